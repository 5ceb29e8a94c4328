!> Products with tall and narrow real blocks, by panels of rows.
module kschur_tall_products_real
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dgemv
   use kschur_row_sums, only: row_sums_type
   use kschur_tall_panels, only: panel_complete, panel_inner, panel_inner_sides, panel_project, panel_project_sides
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: column_length, complete_and_combine, form_combinations, inner_products, project_again, subtract_combinations

#define SCALAR real(wp)
#define GEMV dgemv
#define GEMM dgemm
#include "kschur_tall_products.inc"

   ! D := V^T Y, b columns of Y, four at a time.
   subroutine panel_inner_block(rows, columns, b, lead, v, y, lead_d, d)
      !> Leading dimension of v and y: `lead`.
      integer, intent(in) :: rows, columns, b, lead, lead_d
      real(wp), intent(in) :: v(lead, *), y(lead, *)
      real(wp), intent(inout) :: d(lead_d, *)
      integer :: j, s

      do j = 1, b - 3, 4
         call panel_inner_sides(rows, columns, lead, v, lead, y(1, j), lead_d, d(1, j))
      end do
      do s = j, b
         call panel_inner(rows, columns, lead, v, y(1, s), d(1, s))
      end do
   end subroutine panel_inner_block

   ! Y := Y - V C, then D := V^T Y with the new Y, b columns of it, four at a time.
   subroutine panel_project_block(rows, columns, b, lead, v, lead_d, c, y, d)
      integer, intent(in) :: rows, columns, b, lead, lead_d
      real(wp), intent(in) :: v(lead, *), c(lead_d, *)
      real(wp), intent(inout) :: y(lead, *), d(lead_d, *)
      integer :: j, s

      do j = 1, b - 3, 4
         call panel_project_sides(rows, columns, lead, v, lead_d, c(1, j), lead, y(1, j), d(1, j))
      end do
      do s = j, b
         call panel_project(rows, columns, lead, v, c(1, s), y(1, s), d(1, s))
      end do
   end subroutine panel_project_block
end module kschur_tall_products_real
