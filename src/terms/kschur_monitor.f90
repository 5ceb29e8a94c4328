!> How a caller watches a long computation and stops it.
module kschur_monitor
   use kschur_kinds, only: wp
   implicit none
   private
   public :: is_stopped, monitor_type

   !> Extend it and pass it to `solve_modes`.
   type, abstract :: monitor_type
   contains
      !> Called each time that convergence was looked at.
      procedure(report_interface), deferred :: report
      !> Asked before each step that takes a while: .true. ends the computation with what has converged. It is .false. unless
      !> overridden.
      procedure :: stops
      !> Called before a computation that is longer, or less, than it seems. It does nothing unless overridden.
      procedure :: announce
   end type monitor_type

   abstract interface
      subroutine report_interface(self, restart, converged, wanted, residual, proceed)
         import :: monitor_type, wp
         class(monitor_type), intent(inout) :: self
         !> Number of restarts so far.
         integer, intent(in) :: restart
         !> How many of the wanted Ritz values have converged.
         integer, intent(in) :: converged, wanted
         !> Largest relative residual among the wanted ones.
         real(wp), intent(in) :: residual
         !> Set to .false. to end the computation with what has converged.
         logical, intent(inout) :: proceed
      end subroutine report_interface
   end interface

contains

   !> Whether a monitor that is there ends the computation.
   logical function is_stopped(monitor)
      class(monitor_type), optional, intent(inout) :: monitor

      is_stopped = .false.
      if (present(monitor)) is_stopped = monitor%stops()
   end function is_stopped

   logical function stops(self)
      class(monitor_type), intent(inout) :: self

      associate (unused => self)
      end associate
      stops = .false.
   end function stops

   subroutine announce(self, sentence)
      class(monitor_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      associate (unused => self, neither => sentence)
      end associate
   end subroutine announce
end module kschur_monitor
