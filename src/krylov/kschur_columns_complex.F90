!> Columns of tall complex arrays: rotated, moved, combined.
module kschur_columns_complex
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgemm
   use kschur_tall_products_complex, only: form_combinations
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: combine_columns, move_columns, rotate_columns

#define SCALAR complex(wp)
#define GEMM zgemm
#include "kschur_columns.inc"

   !> The combinations q y of the first columns.
   subroutine combine_columns(q, y, vectors)
      complex(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), contiguous, intent(in) :: y(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)

      allocate (vectors(size(q, 1), size(y, 2)))
      call form_combinations(q, y, vectors)
   end subroutine combine_columns
end module kschur_columns_complex
