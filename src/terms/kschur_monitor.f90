!> How a caller watches a long computation and stops it.
module kschur_monitor
   use kschur_error, only: error_cancelled, error_type, new_error
   use kschur_kinds, only: wp
   implicit none
   private
   public :: ask_monitor, is_stopped, monitor_type, stopper_type

   !> Extend it and pass it to `solve_modes`.
   type, abstract :: monitor_type
   contains
      !> Called each time that convergence was looked at.
      procedure(report_interface), deferred :: report
      !> Asked before each step that takes a while, and often within it: .true. ends the computation with what has converged.
      !> It stays .true. then. It is .false. unless overridden.
      procedure :: stops
      !> Called before a computation that is longer, or less, than it seems. It does nothing unless overridden.
      procedure :: announce
      !> Called where a step begins: what it does. It does nothing unless overridden.
      procedure :: begins
      !> Called before the modes of a part are looked for: how many of the problem were found, how many this part has, how many
      !> are asked for, 0 where nobody knows. It does nothing unless overridden.
      procedure :: counts
   end type monitor_type

   !> Stops a computation within another as the monitor of that does, which is told nothing of it.
   type, extends(monitor_type) :: stopper_type
      class(monitor_type), pointer :: of => null()
   contains
      procedure :: report => keep_silent
      procedure :: stops => stops_as_other
   end type stopper_type

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

   !> The same as an error (error_cancelled), for what has no result without all its steps.
   subroutine ask_monitor(monitor, error)
      class(monitor_type), optional, intent(inout) :: monitor
      type(error_type), allocatable, intent(out) :: error

      if (is_stopped(monitor)) call new_error(error, error_cancelled, "the computation was ended by who watches it")
   end subroutine ask_monitor

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

   subroutine begins(self, step)
      class(monitor_type), intent(inout) :: self
      !> "factorisation", "iteration", ...
      character(len=*), intent(in) :: step

      associate (unused => self, neither => step)
      end associate
   end subroutine begins

   subroutine counts(self, found, part, asked)
      class(monitor_type), intent(inout) :: self
      integer, intent(in) :: found, part, asked

      associate (unused => self, neither => [found, part, asked])
      end associate
   end subroutine counts

   subroutine keep_silent(self, restart, converged, wanted, residual, proceed)
      class(stopper_type), intent(inout) :: self
      integer, intent(in) :: restart, converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed

      associate (unused => self, neither => [restart, converged, wanted], nor_this => residual)
         proceed = proceed
      end associate
   end subroutine keep_silent

   logical function stops_as_other(self)
      class(stopper_type), intent(inout) :: self

      stops_as_other = .false.
      if (associated(self%of)) stops_as_other = self%of%stops()
   end function stops_as_other
end module kschur_monitor
