!> Determinant of the problem bordered by its constraints, det [P(lambda) Cq^T; Cq 0], as a function of lambda. Its zeros are
!> the finite eigenvalues with their multiplicities: it is det(Z^T P(lambda) Z) times a constant, Z a basis of null(Cq). With
!> redundant constraints it would vanish identically; therefore a second border [0 Cq^T 0; Cq 0 N; 0 N^T 0] has a column of N
!> for each of them. This changes nothing else if no combination of columns of N is in the range of Cq: Cq phi + N eta = 0 then
!> implies Cq phi = 0, and N^T xi = 0 selects one of the equivalent multipliers. Random columns satisfy this.
module kschur_bordered_determinant
   use kschur_effort, only: effort_type, for_count
   use kschur_error, only: error_type, error_singular
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_monitor, only: monitor_type
   use kschur_ordering, only: elimination_order
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_saddle, only: enlarged, saddle_blocks, saddle_structure
   use kschur_sparse, only: complex_combination, csr_matrix_type, linear_combination, &
      new_csr_from_triplets
   use kschur_winding, only: analytic_function_type
   implicit none
   private
   public :: bordered_determinant_type, new_bordered_determinant

   ! Trial solutions at each point, and safety factor of the phase error estimated from them.
   integer, parameter :: trials = 2
   real(wp), parameter :: caution = 4

   !> The bordered determinant as a function of lambda; each evaluation factors a complex matrix.
   type, extends(analytic_function_type) :: bordered_determinant_type
      type(effort_type) :: effort
      ! Coefficients of lambda^2, lambda and 1.
      type(csr_matrix_type), allocatable, private :: blocks(:)
      type(matrix_structure_type), private :: structure
      class(complex_linear_solver_type), allocatable, private :: solver
      integer(long), private :: state = 1
      !> Monitor that may cancel; not associated: none.
      class(monitor_type), pointer :: monitor => null()
   contains
      procedure :: evaluate
      !> Whether the problem has a loss matrix H, so that the function is not real on the real axis.
      procedure :: is_lossy
      procedure, private :: coefficients
   end type bordered_determinant_type

contains

   !> Forms the matrix coefficients of 1, lambda and lambda^2, bordered by the constraints, and one elimination order for all
   !> lambda. Fails if the matrices cannot be formed or ordered.
   subroutine new_bordered_determinant(determinant, problem, factors, redundant, solver, error)
      type(bordered_determinant_type), intent(out) :: determinant
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> Number of redundant constraints.
      integer, intent(in) :: redundant
      !> Prototype of the solver.
      class(complex_linear_solver_type), intent(in) :: solver
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: pattern, blocks(3)
      integer, allocatable :: position(:)
      integer :: i

      call saddle_blocks(problem, factors, blocks, error)
      if (allocated(error)) return
      allocate (determinant%blocks(merge(4, 3, allocated(problem%loss))))
      determinant%blocks(:3) = blocks
      if (allocated(problem%loss)) determinant%blocks(4) = enlarged(problem%loss, blocks(1)%rows)
      allocate (determinant%solver, source=solver)
      associate (s => determinant%structure)
         s = saddle_structure(problem)
         ! One order for all points.
         if (.not. allocated(s%position)) then
            pattern = linear_combination(spread(1.0_wp, 1, size(determinant%blocks)), determinant%blocks)
            call elimination_order(pattern%row_start, pattern%column, s, position, error)
            if (allocated(error)) return
            call move_alloc(position, s%position)
         end if
         if (redundant == 0) return
         s%multipliers = s%multipliers + redundant
         s%position = [s%position, [(determinant%blocks(1)%rows + i, i=1, redundant)]]
         call border(determinant%blocks, problem%unknowns(), factors*problem%constraints%row_maxima(), redundant, error)
      end associate
   end subroutine new_bordered_determinant

   ! Adds the second border, N and its transpose, with random entries of the size of Cq.
   subroutine border(blocks, unknowns, level, redundant, error)
      type(csr_matrix_type), intent(inout) :: blocks(:)
      integer, intent(in) :: unknowns
      !> Norm of each row of Cq.
      real(wp), intent(in) :: level(:)
      integer, intent(in) :: redundant
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: parts(2)
      real(wp) :: value(size(level), redundant)
      integer :: row(size(level)*redundant), column(size(level)*redundant), order, i, j
      integer(long) :: state

      state = 1
      do j = 1, redundant
         call random_vector(state, value(:, j))
         value(:, j) = level*value(:, j)
      end do
      order = blocks(1)%rows + redundant
      row = [((unknowns + i, i=1, size(level)), j=1, redundant)]
      column = [((order - redundant + j, i=1, size(level)), j=1, redundant)]
      do i = 1, size(blocks)
         blocks(i)%row_start = [blocks(i)%row_start, spread(blocks(i)%nonzeros() + 1, 1, redundant)]
         blocks(i)%rows = order
         blocks(i)%columns = order
      end do
      parts(1) = blocks(3)
      call new_csr_from_triplets(parts(2), order, order, [row, column], [column, row], &
         [reshape(value, shape(row)), reshape(value, shape(row))], error)
      if (.not. allocated(error)) blocks(3) = linear_combination([1.0_wp, 1.0_wp], parts)
   end subroutine border

   !> Evaluates log det and estimates its error. The factors are those of A + E, and log det(A + E) - log det A is trace(A^{-1}
   !> E) to first order. For x with random entries of modulus one and y = (A + E)^{-1} A x, x - y is A^{-1} E x: its Euclidean
   !> norm is on average the Frobenius norm of A^{-1} E, and x^* (x - y) its trace (Hutchinson, Commun. Stat. 19 (1990)). A x is
   !> summed from M x, R x, K x and Cq x, to include the rounding of A.
   subroutine evaluate(self, lambda, logarithm, doubt, reason)
      class(bordered_determinant_type), intent(inout) :: self
      complex(wp), intent(in) :: lambda
      complex(wp), intent(out) :: logarithm
      real(wp), intent(out) :: doubt
      character(len=*), intent(out) :: reason
      type(error_type), allocatable :: error
      complex(wp), allocatable :: x(:, :), y(:, :), coefficients(:)
      real(wp) :: before
      integer :: j

      logarithm = 0
      doubt = huge(doubt)
      if (associated(self%monitor)) then
         reason = "the computation was stopped"
         if (self%monitor%stops()) return
      end if
      before = self%solver%solve_seconds
      call self%solver%factorize(complex_combination(self%coefficients(lambda), self%blocks), self%structure, error)
      call self%effort%add_factors(self%solver, for_count)
      if (.not. allocated(error)) then
         reason = "the solver does not tell determinants"
         if (self%solver%null_pivots > 0) reason = "the matrix is singular on the curve"
         if (.not. self%solver%determinant%known) return
         call random_phases(self, x)
         allocate (y(size(x, 1), trials), source=(0.0_wp, 0.0_wp))
         coefficients = self%coefficients(lambda)
         do j = 1, size(coefficients)
            call self%blocks(j)%add_product(coefficients(j), x, y)
         end do
         call self%solver%solve(y, error)
         self%effort%seconds%solve = self%effort%seconds%solve + (self%solver%solve_seconds - before)
      end if
      if (allocated(error)) then
         reason = error%message
         if (error%code == error_singular) reason = "the matrix is singular on the curve"
         return
      end if
      reason = ""
      doubt = caution*maxval([(dznrm2(size(x, 1), x(:, j) - y(:, j), 1), j=1, trials)])
      logarithm = self%solver%determinant%logarithm()
   end subroutine evaluate

   pure logical function is_lossy(self)
      class(bordered_determinant_type), intent(in) :: self

      is_lossy = size(self%blocks) > 3
   end function is_lossy

   ! Coefficients of the blocks M, R, K and H at lambda.
   pure function coefficients(self, lambda)
      class(bordered_determinant_type), intent(in) :: self
      complex(wp), intent(in) :: lambda
      complex(wp) :: coefficients(size(self%blocks))
      complex(wp) :: all(4)

      all = [lambda**2, lambda, (1.0_wp, 0.0_wp), (0.0_wp, 1.0_wp)]
      coefficients = all(:size(coefficients))
   end function coefficients

   ! Random trial vectors with entries of modulus one.
   subroutine random_phases(self, x)
      class(bordered_determinant_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: x(:, :)
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: angle(self%blocks(1)%rows)
      integer :: j

      allocate (x(size(angle), trials))
      do j = 1, trials
         call random_vector(self%state, angle)
         x(:, j) = cmplx(cos(pi*angle), sin(pi*angle), wp)
      end do
   end subroutine random_phases
end module kschur_bordered_determinant
