!> Counts eigenvalues below a value by Sylvester's law of inertia.
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

   !> Number of negative eigenvalues of K - theta M on the null space of the constraints, of a symmetric problem: for semidefinite M
   !> the number of theta = omega^2 below this one, up to a constant. -1 if unknown.
   !>
   !> A small regularisation of the constraints makes all of their pivots negative, also those of redundant rows, which would be
   !> rounding errors. It lowers each eigenvalue by about `root_epsilon` of itself, and allows motions that violate constraints. As
   !> constraints are scaled to the level of K and theta M, these motions are far above theta; where constraints differ by less than
   !> the square root of `root_epsilon` they are not, and the count is too large.
   subroutine count_below(problem, theta, least, solver, below)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: theta
      !> A lower bound of the count.
      integer, intent(in) :: least
      !> Solver that computes the inertia of indefinite matrices; overwritten by other factors.
      class(real_linear_solver_type), intent(inout) :: solver
      integer, intent(out) :: below
      type(csr_matrix_type) :: matrix
      type(matrix_structure_type) :: structure
      type(error_type), allocatable :: error

      below = -1
      call counting_matrix(problem, theta, least, matrix, structure, error)
      if (.not. allocated(error)) below = negative_directions(matrix, structure, solver)
   end subroutine count_below

   !> Forms the matrix whose negative eigenvalues are counted, [K - theta M, Cq^T; Cq, -D] with scaled Cq; D, small and diagonal, is
   !> the regularisation that `count_below` describes.
   subroutine counting_matrix(problem, theta, least, matrix, structure, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: theta
      !> A lower bound of the count.
      integer, intent(in) :: least
      type(csr_matrix_type), intent(out) :: matrix
      type(matrix_structure_type), intent(out) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: regularisation
      real(wp) :: factors(problem%multipliers())
      integer :: n, m, i

      n = problem%unknowns()
      m = problem%multipliers()
      factors = constraint_factors(problem, scaling_row, sqrt(cmplx(theta, 0, wp)))
      call symmetric_saddle(problem, factors, theta, matrix, structure, error)
      if (allocated(error)) return
      structure%least_negative = least + m
      if (m == 0) return
      call new_csr_from_triplets(regularisation, n + m, n + m, [(n + i, i=1, m)], [(n + i, i=1, m)], &
         -root_epsilon*factors*problem%constraints%row_maxima(), error)
      if (.not. allocated(error)) matrix = linear_combination(1.0_wp, matrix, 1.0_wp, regularisation)
   end subroutine counting_matrix

   !> Number of negative eigenvalues of a matrix of `counting_matrix`, without those of the constraints; -1 if unknown.
   integer function negative_directions(matrix, structure, solver) result(negative)
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      !> As for `count_below`.
      class(real_linear_solver_type), intent(inout) :: solver
      type(error_type), allocatable :: error

      negative = -1
      call solver%factorize(matrix, structure, error)
      if (allocated(error)) return
      ! Null pivot: theta is an eigenvalue.
      if (solver%null_pivots == 0) negative = max(solver%negative_pivots - structure%multipliers, -1)
   end function negative_directions
end module kschur_inertia
