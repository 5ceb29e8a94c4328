!> Interface by which a caller follows a long computation and cancels it.
module kschur_monitor
   use kschur_error, only: error_cancelled, error_type, new_error
   use kschur_kinds, only: wp
   implicit none
   private
   public :: ask_monitor, is_stopped, monitor_type, stopper_type

   !> Abstract monitor; extend it and pass it to `solve_modes`.
   type, abstract :: monitor_type
   contains
      !> Called after each test of convergence.
      procedure(report_interface), deferred :: report
      !> Polled before and within long steps: .true. cancels the computation, which returns what has converged. Must stay .true.
      !> then. Default: .false.
      procedure :: stops
      !> Called before a computation that is longer or smaller than expected. Default: does nothing.
      procedure :: announce
      !> Called at the start of a step, with its name. Default: does nothing.
      procedure :: begins
      !> Called before the modes of a part are computed: number found so far, in this part, and asked for; 0 if unknown.
      !> Default: does nothing.
      procedure :: counts
   end type monitor_type

   !> Monitor of a nested computation: cancels it when the outer monitor cancels, and reports nothing.
   type, extends(monitor_type) :: stopper_type
      !> Monitor of the outer computation; not associated: never cancels.
      class(monitor_type), pointer :: of => null()
   contains
      procedure :: report => report_nothing
      procedure :: stops => stops_with_outer
   end type stopper_type

   abstract interface
      subroutine report_interface(self, restart, converged, wanted, residual, proceed)
         import :: monitor_type, wp
         class(monitor_type), intent(inout) :: self
         !> Number of restarts so far.
         integer, intent(in) :: restart
         !> Number of wanted Ritz values that have converged, and number wanted.
         integer, intent(in) :: converged, wanted
         !> Largest relative residual among the wanted ones.
         real(wp), intent(in) :: residual
         !> Set to .false. to end the computation with what has converged.
         logical, intent(inout) :: proceed
      end subroutine report_interface
   end interface

contains

   !> Whether the monitor, if present, cancels the computation.
   logical function is_stopped(monitor)
      class(monitor_type), optional, intent(inout) :: monitor

      is_stopped = .false.
      if (present(monitor)) is_stopped = monitor%stops()
   end function is_stopped

   !> Fails with `error_cancelled` if the monitor cancels, for computations without partial results.
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

   ! Ignores the reports of the nested computation.
   subroutine report_nothing(self, restart, converged, wanted, residual, proceed)
      class(stopper_type), intent(inout) :: self
      integer, intent(in) :: restart, converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed

      associate (unused => self, neither => [restart, converged, wanted], nor_this => residual)
         proceed = proceed
      end associate
   end subroutine report_nothing

   logical function stops_with_outer(self)
      class(stopper_type), intent(inout) :: self

      stops_with_outer = .false.
      if (associated(self%of)) stops_with_outer = self%of%stops()
   end function stops_with_outer
end module kschur_monitor
