!> Moves, rotates and combines columns of tall complex arrays.
module kschur_columns_complex
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgemm
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: combine_columns, move_columns, rotate_columns

#define SCALAR complex(wp)
#define GEMM zgemm
#include "kschur_columns.inc"

   !> vectors := q y, with as many of the first columns of q as y has rows.
   subroutine combine_columns(q, y, vectors)
      complex(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), intent(in) :: y(:, :)
      complex(wp), intent(inout) :: vectors(:, :)

      call combine_panels(size(q, 1), size(y, 1), size(y, 2), q, y, vectors)
   end subroutine combine_columns

   ! As `combine_columns` for explicit shapes: n rows, k columns combined, b results.
   subroutine combine_panels(n, k, b, q, y, vectors)
      integer, intent(in) :: n, k, b
      complex(wp), intent(in) :: q(n, *), y(k, b)
      complex(wp), intent(inout) :: vectors(:, :)
      complex(wp), allocatable :: part(:, :)
      integer :: i, rows

      if (k == 0) vectors = zero
      if (min(k, b) == 0) return
      !$omp parallel private(part, rows) if (n > panel_rows)
      allocate (part(panel, b))
      !$omp do schedule(static)
      do i = 1, n, panel
         rows = min(panel, n - i + 1)
         call zgemm("N", "N", rows, b, k, one, q(i, 1), n, y, k, zero, part, panel)
         vectors(i:i + rows - 1, :) = part(:rows, :)
      end do
      !$omp end do
      deallocate (part)
      !$omp end parallel
   end subroutine combine_panels
end module kschur_columns_complex
