!> znaupd and zneupd: complex operators.
module kschur_arpack_complex
   use kschur_arpack_interfaces, only: znaupd, zneupd
   use kschur_arpack_process, only: arpack_process_type, check_extraction, keep_vectors, largest_magnitude, ido_apply, &
      ido_start
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_operator, only: complex_operator_type
   implicit none
   private
   public :: complex_process_type

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#define PROCESS_TYPE complex_process_type
#include "kschur_arpack_process.inc"

   subroutine step(self, error)
      class(complex_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: rwork(self%columns)

      call znaupd(self%ido, "I", self%length, largest_magnitude, self%wanted, self%tolerance, self%residual, &
         self%columns, self%basis, self%length, self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), &
         rwork, self%info)
      if (all(self%ido /= [ido_start, ido_apply])) return
      self%applications = self%applications + 1
      call self%apply(self%from(), self%to(), error)
   end subroutine step

   pure subroutine ritz(self, magnitudes, bounds)
      class(complex_process_type), intent(in) :: self
      real(wp), intent(out) :: magnitudes(:), bounds(:)

      magnitudes = abs(self%values_at(6))
      bounds = abs(self%values_at(8))
   end subroutine ritz

   subroutine extract(self, mu, vectors, error)
      class(complex_process_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: inverses(self%columns + 1), workev(2*self%columns)
      real(wp) :: rwork(self%columns)
      logical :: select(self%columns)
      integer :: found, n

      inverses = 0
      call zneupd(.true., "A", select, inverses, self%basis, self%length, (0.0_wp, 0.0_wp), workev, "I", self%length, &
         largest_magnitude, self%wanted, self%tolerance, self%residual, self%columns, self%basis, self%length, &
         self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), rwork, self%info)
      call check_extraction("zneupd", self%info, self%iparam(5), error)
      if (allocated(error)) return
      found = self%converged()
      n = self%order()
      allocate (mu(found), source=1/inverses(:found))
      allocate (vectors(n, found), source=self%basis(:n, :found))
      call keep_vectors(mu, vectors, found)
   end subroutine extract
end module kschur_arpack_complex
