!> Direct solver for saddle-point matrices A = [P, C^T; C, 0], P symmetric positive definite, by LDL^T without pivoting. It
!> exists if each multiplier follows unknowns that make its constraint independent of earlier ones. Otherwise, or if a trial
!> solution shows growth, factors A regularised by -delta in its second diagonal block: that is quasi-definite and has LDL^T
!> factors in any order. Iterative refinement with A, residuals in extended precision, removes the effect of delta, and rounding
!> errors too if solves are cheap.
module kschur_quasi_definite
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_singular, error_usage
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: last_analysis_type
   use kschur_ldl, only: ldl_real_type
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_refinement, only: solve_and_refine
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets
   use kschur_tolerances, only: above_all_rounding, root_epsilon
   use kschur_trial_solution, only: try_solver
   implicit none
   private
   public :: low_fill, quasi_definite_type

   !> Mean entries in a column of L above which solutions are refined only if needed: two solves then cost as much as one of
   !> MUMPS.
   integer, parameter :: low_fill = 80

   !> Rejects what LDL rejects, and a P that is not positive definite (error_library).
   type, extends(real_linear_solver_type) :: quasi_definite_type
      !> Largest mean number of entries in a column of L for a regularised matrix; others are rejected (error_library).
      integer :: most_entries = huge(1)
      !> As in LDL.
      type(last_analysis_type), pointer :: last => null()
      type(ldl_real_type), private :: ldl
      ! The matrix A.
      type(csr_matrix_type), private :: matrix
      logical, private :: refined = .true.
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
      procedure :: estimate
      procedure :: forget_factors
   end type quasi_definite_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(quasi_definite_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: backward_error
      logical :: regularized

      self%matrix = matrix
      self%ldl%quasi_definite = .true.
      self%ldl%most_entries = huge(1)
      self%ldl%last => self%last
      self%ldl%monitor => self%monitor
      call self%ldl%factorize(matrix, structure, error)
      self%analyze_seconds = self%ldl%analyze_seconds
      self%factorize_seconds = self%ldl%factorize_seconds
      if (allocated(error)) then
         regularized = error%code == error_singular
         if (.not. regularized) return
      else
         call try_solver(self%ldl, matrix, structure%multipliers, backward_error, error)
         if (allocated(error)) return
         regularized = backward_error > above_all_rounding
      end if
      self%refined = regularized .or. self%ldl%factor_entries <= int(low_fill, long)*matrix%rows
      if (regularized) call factorize_regularized(self, structure, error)
      if (allocated(error)) return
      self%factor_entries = self%ldl%factor_entries
      self%factor_bytes = self%ldl%factor_bytes
      self%null_pivots = self%ldl%null_pivots
      self%negative_pivots = self%ldl%negative_pivots
      self%description = self%ldl%description
   end subroutine factorize

   subroutine estimate(self, pattern, structure, bytes, error)
      class(quasi_definite_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error

      call self%ldl%estimate(pattern, structure, bytes, error)
      ! Includes a copy of A.
      bytes = bytes + pattern%bytes()
   end subroutine estimate

   subroutine forget_factors(self, kept)
      class(quasi_definite_type), intent(inout) :: self
      logical, intent(out) :: kept

      call self%ldl%forget_factors(kept)
   end subroutine forget_factors

   ! Factors A - [0 0; 0 delta].
   subroutine factorize_regularized(self, structure, error)
      class(quasi_definite_type), intent(inout) :: self
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: parts(2)

      self%ldl%most_entries = self%most_entries
      parts(1) = self%matrix
      call new_regularization(self%matrix, structure%multipliers, parts(2), error)
      if (allocated(error)) return
      call self%ldl%factorize(linear_combination([1.0_wp, -1.0_wp], parts), structure, error)
      self%analyze_seconds = self%analyze_seconds + self%ldl%analyze_seconds
      self%factorize_seconds = self%factorize_seconds + self%ldl%factorize_seconds
   end subroutine factorize_regularized

   ! The regularisation [0 0; 0 delta], small relative to C P^{-1} C^T: delta of a constraint is a small multiple of its largest
   ! coefficient squared over its largest stiffness.
   subroutine new_regularization(matrix, multipliers, regularization, error)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: multipliers
      type(csr_matrix_type), intent(out) :: regularization
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: delta(multipliers), stiffness(min(matrix%rows, matrix%columns))
      integer :: n, i

      n = matrix%rows - multipliers
      stiffness = matrix%diagonal()
      do i = 1, multipliers
         associate (first => matrix%row_start(n + i), last => matrix%row_start(n + i + 1) - 1)
            delta(i) = root_epsilon*maxval([0.0_wp, abs(matrix%value(first:last))])**2/ &
               max(maxval([0.0_wp, stiffness(matrix%column(first:last))]), tiny(1.0_wp))
         end associate
      end do
      call new_csr_from_triplets(regularization, matrix%rows, matrix%columns, [(n + i, i=1, multipliers)], &
         [(n + i, i=1, multipliers)], delta, error)
   end subroutine new_regularization

   subroutine solve(self, x, error)
      class(quasi_definite_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: started

      if (size(x, 1) /= self%matrix%rows) then
         call new_error(error, error_usage, "the right-hand sides do not fit the factored matrix")
         return
      end if
      started = clock()
      if (self%refined) then
         call solve_and_refine(self%ldl, self%matrix, x, error)
      else
         call self%ldl%solve(x, error)
      end if
      self%solve_seconds = self%solve_seconds + seconds_since(started)
   end subroutine solve
end module kschur_quasi_definite
