!> Shift and scaling at which a formulation is factored.
module kschur_placement
   use kschur_kinds, only: wp
   use kschur_options, only: formulation_quadratic
   use kschur_row_problem, only: row_problem_type
   implicit none
   private
   public :: placement_type

   !> A formulation with its shift, unit and factors.
   type :: placement_type
      !> One of `formulation_*`.
      integer :: formulation = formulation_quadratic
      !> The shift (1/s).
      complex(wp) :: lambda = (0.0_wp, 0.0_wp)
      !> Unit of lambda (1/s) in vectors with velocities.
      real(wp) :: unit = 1
      !> Factor of each constraint.
      real(wp), allocatable :: factors(:)
      !> Upper bound of the dimension of the null space of the constraints.
      integer :: motions = huge(1)
      !> Lower bound of the eigenvalues of M, scaled to unit diagonal; zero: none was proved.
      real(wp) :: mass_bound = 0
      !> Whether the solver has factored the matrix already, so that symmetric forms do not make it.
      logical :: factored = .false.
      !> Whether vectors of a pencil include multipliers, and are not purified.
      logical :: raw = .false.
      !> Distributed matrices of the problem; not associated: not distributed.
      type(row_problem_type), pointer :: matrices => null()
   end type placement_type
end module kschur_placement
