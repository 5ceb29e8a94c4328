!> Moves, rotates and combines columns of tall real arrays.
module kschur_columns_real
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dnrm2
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: combine_columns, move_columns, rotate_columns, subtract_columns

#define SCALAR real(wp)
#define GEMM dgemm
#include "kschur_columns.inc"

   !> vectors := q y, with as many of the first columns of q as y has rows.
   subroutine combine_columns(q, y, vectors)
      real(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), intent(in) :: y(:, :)
      complex(wp), intent(inout) :: vectors(:, :)

      call combine_panels(size(q, 1), size(y, 1), size(y, 2), q, y, vectors)
   end subroutine combine_columns

   ! As `combine_columns` for explicit shapes: n rows, k columns combined, b results. Multiplies the real and imaginary parts of
   ! y by panels of rows, since whole columns would need a work array of the size of the result.
   subroutine combine_panels(n, k, b, q, y, vectors)
      integer, intent(in) :: n, k, b
      real(wp), intent(in) :: q(n, *)
      complex(wp), intent(in) :: y(k, b)
      complex(wp), intent(inout) :: vectors(:, :)
      ! Real and imaginary parts side by side, so that q is read once.
      real(wp) :: parts_of_y(k, 2*b)
      real(wp), allocatable :: parts(:, :)
      integer :: i, rows

      if (k == 0) vectors = 0
      if (min(k, b) == 0) return
      parts_of_y(:, :b) = real(y, wp)
      parts_of_y(:, b + 1:) = aimag(y)
      !$omp parallel private(parts, rows) if (n > panel_rows)
      allocate (parts(panel, 2*b))
      !$omp do schedule(static)
      do i = 1, n, panel
         rows = min(panel, n - i + 1)
         call dgemm("N", "N", rows, 2*b, k, one, q(i, 1), n, parts_of_y, k, zero, parts, panel)
         vectors(i:i + rows - 1, :) = cmplx(parts(:rows, :b), parts(:rows, b + 1:), wp)
      end do
      !$omp end do
      deallocate (parts)
      !$omp end parallel
   end subroutine combine_panels

   !> y := y - z diag(theta), and the lengths of its columns.
   subroutine subtract_columns(theta, z, y, lengths)
      real(wp), intent(in) :: theta(:)
      real(wp), contiguous, intent(in) :: z(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      real(wp), intent(out) :: lengths(:)
      integer :: j

      !$omp parallel do schedule(static) if (size(y, 1) > panel_rows)
      do j = 1, size(y, 2)
         y(:, j) = y(:, j) - theta(j)*z(:, j)
         lengths(j) = dnrm2(size(y, 1), y(:, j), 1)
      end do
      !$omp end parallel do
   end subroutine subtract_columns
end module kschur_columns_real
