!> Where a formulation is factored, and in what units.
module kschur_placement
   use kschur_kinds, only: wp
   use kschur_options, only: formulation_quadratic
   use kschur_row_problem, only: row_problem_type
   implicit none
   private
   public :: placement_type

   !> A formulation, a shift, units and factors.
   type :: placement_type
      !> One of `formulation_*`.
      integer :: formulation = formulation_quadratic
      !> The shift (1/s).
      complex(wp) :: lambda = (0.0_wp, 0.0_wp)
      !> Unit of lambda (1/s) where vectors carry velocities.
      real(wp) :: unit = 1
      !> Factor of each constraint.
      real(wp), allocatable :: factors(:)
      !> There are no more independent motions that the constraints allow than this.
      integer :: motions = huge(1)
      !> Whether the vectors of a pencil carry multipliers, and are taken as they come from the iteration.
      logical :: raw = .false.
      !> The matrices of the problem, by rows with all processes; not associated: they are multiplied with where they are.
      type(row_problem_type), pointer :: matrices => null()
   end type placement_type
end module kschur_placement
