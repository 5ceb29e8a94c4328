!> Columns of tall real arrays: rotated, moved, combined.
module kschur_columns_real
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   use kschur_tall_products_real, only: form_combinations
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: combine_columns, move_columns, rotate_columns

#define SCALAR real(wp)
#define GEMM dgemm
#include "kschur_columns.inc"

   !> The combinations q y of the first columns.
   subroutine combine_columns(q, y, vectors)
      real(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), contiguous, intent(in) :: y(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      real(wp), allocatable :: parts(:, :), parts_of_y(:, :)
      integer :: k

      ! Real and imaginary parts side by side, for one reading.
      k = size(y, 2)
      allocate (vectors(size(q, 1), k), parts(size(q, 1), 2*k), parts_of_y(size(y, 1), 2*k))
      parts_of_y(:, :k) = real(y, wp)
      parts_of_y(:, k + 1:) = aimag(y)
      call form_combinations(q, parts_of_y, parts)
      vectors = cmplx(parts(:, :k), parts(:, k + 1:), wp)
   end subroutine combine_columns
end module kschur_columns_real
