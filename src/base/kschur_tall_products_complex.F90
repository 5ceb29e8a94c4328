!> Products with tall and narrow complex blocks, by panels of rows.
module kschur_tall_products_complex
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgemm, zgemv
   use kschur_row_sums, only: row_sums_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: column_length, complete_and_combine, form_combinations, inner_products, project_again, subtract_combinations

#define SCALAR complex(wp)
#define GEMV zgemv
#define GEMM zgemm
#include "kschur_tall_products.inc"

   ! D := V^* Y, b columns of Y.
   subroutine panel_inner_block(rows, columns, b, lead, v, y, lead_d, d)
      !> Leading dimension of v and y: `lead`.
      integer, intent(in) :: rows, columns, b, lead, lead_d
      complex(wp), intent(in) :: v(lead, *), y(lead, *)
      complex(wp), intent(inout) :: d(lead_d, *)

      call zgemm("C", "N", columns, b, rows, one, v, lead, y, lead, zero, d, lead_d)
   end subroutine panel_inner_block

   ! Y := Y - V C, then D := V^* Y with the new Y, b columns of it.
   subroutine panel_project_block(rows, columns, b, lead, v, lead_d, c, y, d)
      integer, intent(in) :: rows, columns, b, lead, lead_d
      complex(wp), intent(in) :: v(lead, *), c(lead_d, *)
      complex(wp), intent(inout) :: y(lead, *), d(lead_d, *)

      call zgemm("N", "N", rows, b, columns, -one, v, lead, c, lead_d, one, y, lead)
      call panel_inner_block(rows, columns, b, lead, v, y, lead_d, d)
   end subroutine panel_project_block

   ! d := V^* y, as `panel_inner` of `kschur_tall_panels`.
   subroutine panel_inner(rows, columns, lead, v, y, d)
      integer, intent(in) :: rows, columns, lead
      complex(wp), intent(in) :: v(lead, *), y(*)
      complex(wp), intent(out) :: d(*)

      call zgemv("C", rows, columns, one, v, lead, y, 1, zero, d, 1)
   end subroutine panel_inner

   ! y := y - V c, then d := V^* y with the new y.
   subroutine panel_project(rows, columns, lead, v, c, y, d)
      integer, intent(in) :: rows, columns, lead
      complex(wp), intent(in) :: v(lead, *), c(*)
      complex(wp), intent(inout) :: y(*)
      complex(wp), intent(inout) :: d(*)
      integer :: i, part

      d(:columns) = zero
      do i = 1, rows, panel
         part = min(panel, rows - i + 1)
         call zgemv("N", part, columns, -one, v(i, 1), lead, c, 1, one, y(i), 1)
         call zgemv("C", part, columns, one, v(i, 1), lead, y(i), 1, one, d, 1)
      end do
   end subroutine panel_project

   ! y := (y - V c)/length, y the column after those of V, then X := [V y] A.
   subroutine panel_complete(rows, columns, lead, v, c, length, a, lead_a, x, lead_x)
      integer, intent(in) :: rows, columns, lead, lead_a, lead_x
      complex(wp), intent(inout) :: v(lead, *), x(lead_x, *)
      complex(wp), intent(in) :: c(*), a(lead_a, *)
      real(wp), intent(in) :: length
      integer :: i, j, part

      do i = 1, rows, panel
         part = min(panel, rows - i + 1)
         if (columns > 0) call zgemv("N", part, columns, -one, v(i, 1), lead, c, 1, one, v(i, columns + 1), 1)
         v(i:i + part - 1, columns + 1) = v(i:i + part - 1, columns + 1)/length
         do j = 1, 2
            call zgemv("N", part, columns + 1, one, v(i, 1), lead, a(1, j), 1, zero, x(i, j), 1)
         end do
      end do
   end subroutine panel_complete
end module kschur_tall_products_complex
