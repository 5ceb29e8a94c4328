!> Products of a panel of rows of a tall real basis with single vectors, or with four; each product reads the panel once.
module kschur_tall_panels
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   implicit none
   private
   public :: panel_inner, panel_inner_sides, panel_project, panel_project_sides, panel_complete

   interface
      !> d := V^T y.
      subroutine panel_inner(rows, columns, lead, v, y, d) bind(c, name="kschur_panel_inner")
         import :: c_double, c_int
         !> Leading dimension of v: `lead`.
         integer(c_int), value :: rows, columns, lead
         real(c_double), intent(in) :: v(lead, *), y(*)
         real(c_double), intent(out) :: d(*)
      end subroutine panel_inner

      !> y := y - V c, then d := V^T y with the new y.
      subroutine panel_project(rows, columns, lead, v, c, y, d) bind(c, name="kschur_panel_project")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead
         real(c_double), intent(in) :: v(lead, *), c(*)
         real(c_double), intent(inout) :: y(*)
         real(c_double), intent(out) :: d(*)
      end subroutine panel_project

      !> D := V^T Y, four vectors.
      subroutine panel_inner_sides(rows, columns, lead, v, lead_y, y, lead_d, d) bind(c, name="kschur_panel_inner_sides")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead, lead_y, lead_d
         real(c_double), intent(in) :: v(lead, *), y(lead_y, *)
         real(c_double), intent(out) :: d(lead_d, *)
      end subroutine panel_inner_sides

      !> Y := Y - V C, then D := V^T Y with the new Y, four vectors.
      subroutine panel_project_sides(rows, columns, lead, v, lead_d, c, lead_y, y, d) bind(c, name="kschur_panel_project_sides")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead, lead_d, lead_y
         real(c_double), intent(in) :: v(lead, *), c(lead_d, *)
         real(c_double), intent(inout) :: y(lead_y, *)
         real(c_double), intent(out) :: d(lead_d, *)
      end subroutine panel_project_sides

      !> y, the column after those of V, becomes (y - V c)/length; then X := [V y] A, two columns.
      subroutine panel_complete(rows, columns, lead, v, c, length, a, lead_a, x, lead_x) bind(c, name="kschur_panel_complete")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead, lead_a, lead_x
         real(c_double), value :: length
         real(c_double), intent(in) :: c(*), a(lead_a, *)
         real(c_double), intent(inout) :: v(lead, *), x(lead_x, *)
      end subroutine panel_complete
   end interface
end module kschur_tall_panels
