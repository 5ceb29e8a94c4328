!> Magnitudes of the terms of matrix-vector products, |A| |x|, row by row: a sum that is small relative to them may be their
!> rounding error (Higham, Accuracy and Stability of Numerical Algorithms (2002), section 3.1), in the units of its row.
module kschur_magnitudes
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: blurred_entry
   implicit none
   private
   public :: add_magnitudes, magnitudes, terms_of

contains

   !> |x|, bounded below by `blurred_entry` times the largest entry of each column, as smaller entries may be rounding errors of
   !> the largest.
   pure function magnitudes(x)
      real(wp), intent(in) :: x(:, :)
      real(wp) :: magnitudes(size(x, 1), size(x, 2))
      integer :: j

      do j = 1, size(x, 2)
         magnitudes(:, j) = max(abs(x(:, j)), blurred_entry*maxval(abs(x(:, j))))
      end do
   end function magnitudes

   !> |A| x.
   pure function terms_of(matrix, x) result(terms)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), allocatable :: terms(:, :)

      allocate (terms(matrix%rows, size(x, 2)), source=0.0_wp)
      call add_magnitudes(matrix, x, terms)
   end function terms_of

   !> y := y + |A| x.
   pure subroutine add_magnitudes(matrix, x, y)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, j, k

      do j = 1, size(x, 2)
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               y(i, j) = y(i, j) + abs(matrix%value(k))*x(matrix%column(k), j)
            end do
         end do
      end do
   end subroutine add_magnitudes
end module kschur_magnitudes
