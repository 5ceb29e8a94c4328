!> Counts of eigenvalues by Sylvester's law of inertia.
module kschur_inertia
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_options, only: scaling_row
   use kschur_problem, only: modal_problem_type
   use kschur_saddle, only: symmetric_saddle
   use kschur_scaling, only: constraint_factors
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets
   use kschur_tolerances, only: root_epsilon
   implicit none
   private
   public :: count_below, counting_matrix, negative_directions

contains

   !> Negative eigenvalues of K - theta M on the motions that the constraints allow, of
   !> a symmetric problem: where M is semidefinite, the number of theta = omega^2 below
   !> this one, but for a number that does not depend on it. -1 where they cannot be told.
   !>
   !> A little compliance of the constraints makes every one of their pivots negative,
   !> those of redundant rows too, which would be rounding. It lowers each eigenvalue by
   !> some `root_epsilon` of itself. The motions it lets in are far above theta, as the
   !> constraints are scaled to the level of K and theta M; but between constraints that
   !> differ by less than the root of that they are not, and then too many are counted.
   subroutine count_below(problem, theta, known, solver, below)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: theta
      !> So many are known to be below.
      integer, intent(in) :: known
      !> One that tells the inertia of indefinite matrices; holds other factors on return.
      class(real_linear_solver_type), intent(inout) :: solver
      integer, intent(out) :: below
      type(csr_matrix_type) :: matrix
      type(matrix_structure_type) :: structure
      type(error_type), allocatable :: error

      below = -1
      call counting_matrix(problem, theta, known, matrix, structure, error)
      if (.not. allocated(error)) below = negative_directions(matrix, structure, solver)
   end subroutine count_below

   !> The matrix whose negative eigenvalues are counted.
   subroutine counting_matrix(problem, theta, known, matrix, structure, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: theta
      !> So many are known to be below.
      integer, intent(in) :: known
      type(csr_matrix_type), intent(out) :: matrix
      type(matrix_structure_type), intent(out) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: parts(2)
      real(wp) :: factors(problem%multipliers())
      integer :: n, m, i

      n = problem%unknowns()
      m = problem%multipliers()
      factors = constraint_factors(problem, scaling_row, sqrt(cmplx(theta, 0, wp)))
      call symmetric_saddle(problem, factors, theta, parts(1), structure, error)
      if (.not. allocated(error)) call new_csr_from_triplets(parts(2), n + m, n + m, [(n + i, i=1, m)], &
         [(n + i, i=1, m)], -root_epsilon*factors*problem%constraints%row_maxima(), error)
      if (allocated(error)) return
      matrix = linear_combination([1.0_wp, 1.0_wp], parts)
      structure%least_negative = known + m
   end subroutine counting_matrix

   !> Negative eigenvalues of such a matrix, but for those of the constraints; -1 where they cannot be told.
   integer function negative_directions(matrix, structure, solver) result(negative)
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      !> As for `count_below`.
      class(real_linear_solver_type), intent(inout) :: solver
      type(error_type), allocatable :: error

      negative = -1
      call solver%factorize(matrix, structure, error)
      if (allocated(error)) return
      ! A null pivot: theta is an eigenvalue.
      if (solver%null_pivots == 0) negative = max(solver%negative_pivots - structure%multipliers, -1)
   end function negative_directions
end module kschur_inertia
