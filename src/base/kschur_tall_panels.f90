!> Products of some rows of a long real basis with single vectors, one reading of the rows for all of them.
module kschur_tall_panels
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   implicit none
   private
   public :: panel_inner, panel_project, panel_complete

   interface
      !> d := V^T y.
      subroutine panel_inner(rows, columns, lead, v, y, d) bind(c, name="kschur_panel_inner")
         import :: c_double, c_int
         !> Columns are `lead` entries apart.
         integer(c_int), value :: rows, columns, lead
         real(c_double), intent(in) :: v(lead, *), y(*)
         real(c_double), intent(out) :: d(*)
      end subroutine panel_inner

      !> y := y - V c, and d := V^T y of what is left.
      subroutine panel_project(rows, columns, lead, v, c, y, d) bind(c, name="kschur_panel_project")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead
         real(c_double), intent(in) :: v(lead, *), c(*)
         real(c_double), intent(inout) :: y(*)
         real(c_double), intent(out) :: d(*)
      end subroutine panel_project

      !> The column y behind these becomes (y - V c)/length, and X := [V y] A, two columns.
      subroutine panel_complete(rows, columns, lead, v, c, length, a, lead_a, x, lead_x) bind(c, name="kschur_panel_complete")
         import :: c_double, c_int
         integer(c_int), value :: rows, columns, lead, lead_a, lead_x
         real(c_double), value :: length
         real(c_double), intent(in) :: c(*), a(lead_a, *)
         real(c_double), intent(inout) :: v(lead, *), x(lead_x, *)
      end subroutine panel_complete
   end interface
end module kschur_tall_panels
