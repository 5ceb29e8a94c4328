!> dnaupd and dneupd: real operators.
module kschur_arpack_real
   use kschur_arpack_interfaces, only: dnaupd, dneupd
   use kschur_arpack_process, only: arpack_process_type, check_extraction, keep_vectors, largest_magnitude, ido_apply, &
      ido_start
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_operator, only: real_operator_type
   implicit none
   private
   public :: real_process_type

#define SCALAR real(wp)
#define OPERATOR_TYPE real_operator_type
#define PROCESS_TYPE real_process_type
#include "kschur_arpack_process.inc"

   subroutine step(self, error)
      class(real_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call dnaupd(self%ido, "I", self%length, largest_magnitude, self%wanted, self%tolerance, self%residual, &
         self%columns, self%basis, self%length, self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), &
         self%info)
      if (all(self%ido /= [ido_start, ido_apply])) return
      self%applications = self%applications + 1
      call self%apply(self%from(), self%to(), error)
   end subroutine step

   pure subroutine ritz(self, magnitudes, bounds)
      class(real_process_type), intent(in) :: self
      real(wp), intent(out) :: magnitudes(:), bounds(:)

      magnitudes = hypot(self%values_at(6), self%values_at(7))
      bounds = self%values_at(8)
   end subroutine ritz

   ! A conjugate pair occupies two columns, real and imaginary part; half a pair at the end is dropped.
   subroutine extract(self, mu, vectors, error)
      class(real_process_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      ! More than NEV may have converged.
      real(wp) :: re(self%columns + 1), im(self%columns + 1), workev(3*self%columns)
      logical :: select(self%columns)
      integer :: j, found, n

      re = 0
      im = 0
      call dneupd(.true., "A", select, re, im, self%basis, self%length, 0.0_wp, 0.0_wp, workev, "I", self%length, &
         largest_magnitude, self%wanted, self%tolerance, self%residual, self%columns, self%basis, self%length, &
         self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), self%info)
      call check_extraction("dneupd", self%info, self%iparam(5), error)
      if (allocated(error)) return
      n = self%order()
      allocate (mu(self%converged()), vectors(n, self%converged()))
      found = 0
      j = 1
      do while (j <= self%converged())
         if (.not. abs(im(j)) > 0) then
            found = found + 1
            mu(found) = 1/re(j)
            vectors(:, found) = self%basis(:n, j)
            j = j + 1
            cycle
         end if
         if (j < self%converged()) then
            if (.not. abs(im(j) + im(j + 1)) > 0) then
               found = found + 2
               mu(found - 1) = 1/cmplx(re(j), im(j), wp)
               mu(found) = conjg(mu(found - 1))
               vectors(:, found - 1) = cmplx(self%basis(:n, j), self%basis(:n, j + 1), wp)
               vectors(:, found) = conjg(vectors(:, found - 1))
            end if
         end if
         j = j + 2
      end do
      call keep_vectors(mu, vectors, found)
   end subroutine extract
end module kschur_arpack_real
