!> Products of a panel of rows of a tall real basis with single vectors; each product reads the panel once.
module kschur_tall_panels
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   implicit none
   private
   public :: panel_inner, panel_project, panel_complete

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
