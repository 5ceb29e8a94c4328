!> A monitor that ends a computation when it was asked so many times.
module timer_monitor
   use kschur, only: monitor_type, wp
   implicit none
   private
   public :: timer_type

   !> Says yes from the `last` time on; counts how often it is asked.
   type, extends(monitor_type) :: timer_type
      integer :: last = huge(1)
      integer :: asked = 0
   contains
      procedure :: report
      procedure :: stops
   end type timer_type

contains

   subroutine report(self, restart, converged, wanted, residual, proceed)
      class(timer_type), intent(inout) :: self
      integer, intent(in) :: restart, converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed

      associate (unused => [self%last, restart, converged, wanted], unused_too => residual, nor_this => proceed)
      end associate
   end subroutine report

   logical function stops(self)
      class(timer_type), intent(inout) :: self

      self%asked = self%asked + 1
      stops = self%asked >= self%last
   end function stops
end module timer_monitor
