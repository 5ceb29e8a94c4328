!> The stiffness of a constrained structure without its units, regularised and factored.
module kschur_scaled_stiffness
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_saddle, only: bordered, saddle_structure
   use kschur_sparse, only: csr_matrix_type, identity_csr_matrix, linear_combination, transpose_csr
   use kschur_tied_levels, only: spread_levels
   implicit none
   private
   public :: scaled_stiffness_type, new_scaled_stiffness

   !> [D K D + delta E, D Cq^T S; S Cq D, -delta I] with diagonal D and S such that the rows of both blocks are of
   !> size one: what is zero does not depend on units, or on heavy and light parts. E is the unit matrix, or, as left
   !> and right rigid motions of an unsymmetric K may be orthogonal to each other, random on the pattern of the problem.
   !> No pivot is left to be null: one of a redundant constraint could not be told from one of a rigid motion.
   type :: scaled_stiffness_type
      !> D, n numbers, and S, m numbers: powers of two.
      real(wp), allocatable :: scaling(:), constraint_scaling(:)
      !> delta
      real(wp) :: regularization = 0
      !> Whether the regularised matrix is nearer to singular than delta: another attempt may be better.
      logical :: too_singular = .false.
      type(csr_matrix_type) :: matrix
      ! delta E, where it is not delta I.
      type(csr_matrix_type), private :: random
      !> Holds the factors.
      class(real_linear_solver_type), allocatable :: solver
   contains
      !> x := A^{-1} x, or A^{-T} x.
      procedure :: solve
      !> A x, or A^T x, without delta.
      procedure :: forces
      !> f := f - (A + delta) x, or the same of the transpose.
      procedure :: subtract_product
      !> What delta adds to A x.
      procedure :: regularizer
      !> The motions y with K y + Cq^T xi = f, Cq y = 0, for forces that have such, without rigid ones.
      procedure :: pseudo_solve
   end type scaled_stiffness_type

   ! delta, in units of what the solver makes of rounding: above it, and so far above the unit of the last place
   ! that a pivot of delta plus rounding is never taken for a null pivot.
   real(wp), parameter :: above_rounding = 16, too_large = 30, visible = 1024*epsilon(1.0_wp)

contains

   !> Factors the scaled stiffness of a problem with n unknowns and m constraints.
   subroutine new_scaled_stiffness(self, problem, solver, error, matrix, attempt)
      type(scaled_stiffness_type), intent(out) :: self
      type(modal_problem_type), intent(in) :: problem
      !> Moved into it.
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> In place of K.
      type(csr_matrix_type), optional, intent(in) :: matrix
      !> Each attempt has another regularisation.
      integer, optional, intent(in) :: attempt
      type(csr_matrix_type) :: k, cq
      type(matrix_structure_type) :: structure
      real(wp), allocatable :: trial(:, :)
      integer :: n, m, seed
      integer(long) :: state

      n = problem%unknowns()
      m = problem%multipliers()
      call move_alloc(solver, self%solver)
      ! With the places of M: one analysis serves K and K - s M.
      if (present(matrix)) then
         k = linear_combination(1.0_wp, matrix, 0.0_wp, problem%mass)
      else
         k = linear_combination(1.0_wp, problem%stiffness, 0.0_wp, problem%mass)
      end if
      self%regularization = max(above_rounding*self%solver%accuracy, visible)
      seed = 1
      if (present(attempt)) seed = attempt
      self%regularization = 3.0_wp**(seed - 1)*self%regularization
      structure = saddle_structure(problem)
      if (.not. problem%symmetric) structure%symmetric = k%is_symmetric()
      cq = problem%constraints
      call set_scalings(self, k, cq)
      call k%scale_entries(self%scaling, self%scaling)
      call cq%scale_entries(self%constraint_scaling, self%scaling)
      self%matrix = bordered(linear_combination(1.0_wp, k, &
         merge(self%regularization, 0.0_wp, structure%symmetric), identity_csr_matrix(n)), cq, &
         spread(1.0_wp, 1, m), spread(-self%regularization, 1, m))
      if (.not. structure%symmetric) then
         self%random = random_on_pattern(problem, self%regularization, n + m, seed)
         self%matrix = linear_combination(1.0_wp, self%matrix, 1.0_wp, self%random)
      end if
      call self%solver%factorize(self%matrix, structure, error)
      if (allocated(error) .or. structure%symmetric) return
      allocate (trial(n + m, 1), source=0.0_wp)
      state = seed
      call random_vector(state, trial(:n, 1))
      ! The first solution points to what the second one enlarges most.
      call self%solver%solve_adjoint(trial, error)
      if (allocated(error)) return
      trial(n + 1:, :) = 0
      trial = trial/norm2(trial)
      call self%solver%solve(trial, error)
      if (.not. allocated(error)) self%too_singular = .not. norm2(trial(:n, :)) <= too_large/self%regularization
   end subroutine new_scaled_stiffness

   ! D and S. Powers of two: scaling rounds nothing.
   subroutine set_scalings(self, k, constraints)
      type(scaled_stiffness_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: k, constraints
      real(wp) :: level(k%rows), softest
      integer :: i

      level = k%row_maxima()
      if (all(.not. level > 0)) level = 1
      softest = minval(level, level > 0)
      call spread_levels(constraints, level)
      where (.not. level > 0) level = maxval(level)
      ! An entry of a constraint that is rounding makes nothing softer.
      level = max(level, softest)
      allocate (self%scaling(k%rows), source=scale(1.0_wp, -exponent(level)/2))
      allocate (self%constraint_scaling(constraints%rows))
      do i = 1, constraints%rows
         associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
            self%constraint_scaling(i) = scale(1.0_wp, -exponent(maxval( &
               abs(constraints%value(first:last)*self%scaling(constraints%column(first:last))))))
         end associate
      end do
   end subroutine set_scalings

   ! Numbers of a size, of either sign, where M, R or K or their transposes have entries.
   function random_on_pattern(problem, size_of_entries, order, seed) result(matrix)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: size_of_entries
      integer, intent(in) :: order, seed
      type(csr_matrix_type) :: matrix
      type(csr_matrix_type) :: parts(7)
      integer(long) :: state
      integer :: i

      parts(1) = problem%mass
      parts(2) = problem%damping
      parts(3) = problem%stiffness
      do i = 1, 3
         parts(i)%value = 1
         parts(i + 3) = transpose_csr(parts(i))
      end do
      parts(7) = identity_csr_matrix(problem%unknowns())
      matrix = linear_combination(spread(1.0_wp, 1, 7), parts)
      state = seed
      call random_vector(state, matrix%value)
      matrix%value = size_of_entries*sign((1 + abs(matrix%value))/2, matrix%value)
      matrix%rows = order
      matrix%columns = order
      matrix%row_start = [matrix%row_start, spread(matrix%nonzeros() + 1, 1, order - problem%unknowns())]
   end function random_on_pattern

   function forces(self, x, transposed)
      class(scaled_stiffness_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      logical, intent(in) :: transposed
      real(wp) :: forces(size(x, 1), size(x, 2))

      forces = 0
      if (transposed) then
         call self%matrix%add_transposed_product(1.0_wp, x, forces)
      else
         call self%matrix%add_product(1.0_wp, x, forces)
      end if
      forces = forces - self%regularizer(x, transposed)
   end function forces

   subroutine subtract_product(self, x, transposed, f)
      class(scaled_stiffness_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(inout) :: f(:, :)

      if (transposed) then
         call self%matrix%add_transposed_product(-1.0_wp, x, f)
      else
         call self%matrix%add_product(-1.0_wp, x, f)
      end if
   end subroutine subtract_product

   function regularizer(self, x, transposed) result(forces)
      class(scaled_stiffness_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      logical, intent(in) :: transposed
      real(wp) :: forces(size(x, 1), size(x, 2))
      integer :: n

      n = size(self%scaling)
      forces = 0
      forces(n + 1:, :) = -self%regularization*x(n + 1:, :)
      if (.not. allocated(self%random%value)) then
         forces(:n, :) = self%regularization*x(:n, :)
      else if (transposed) then
         call self%random%add_transposed_product(1.0_wp, x, forces)
      else
         call self%random%add_product(1.0_wp, x, forces)
      end if
   end function regularizer

   ! Refinement takes out what the regularised factors changed.
   subroutine pseudo_solve(self, motions, f, y, error, reactions)
      class(scaled_stiffness_type), intent(inout) :: self
      !> All rigid motions, n x k.
      real(wp), intent(in) :: motions(:, :)
      real(wp), intent(in) :: f(:, :)
      real(wp), intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      !> xi
      real(wp), optional, intent(out) :: reactions(:, :)
      integer, parameter :: refinements = 2
      real(wp), allocatable :: rhs(:, :), x(:, :), residual(:, :), rigid(:, :)
      integer :: n, step, j, pass

      n = size(self%scaling)
      allocate (rigid, source=motions)
      do j = 1, size(rigid, 2)
         rigid(:, j) = motions(:, j)/self%scaling
         do pass = 1, 2
            rigid(:, j) = rigid(:, j) - matmul(rigid(:, :j - 1), matmul(rigid(:, j), rigid(:, :j - 1)))
         end do
         rigid(:, j) = rigid(:, j)/norm2(rigid(:, j))
      end do
      allocate (rhs(self%matrix%rows, size(f, 2)), x(self%matrix%rows, size(f, 2)), source=0.0_wp)
      do j = 1, size(f, 2)
         rhs(:n, j) = self%scaling*f(:, j)
      end do
      do step = 0, refinements
         residual = rhs - self%forces(x, .false.)
         call self%solver%solve(residual, error)
         if (allocated(error)) return
         x = x + residual
         do pass = 1, 2
            x(:n, :) = x(:n, :) - matmul(rigid, matmul(transpose(rigid), x(:n, :)))
         end do
      end do
      do j = 1, size(f, 2)
         y(:, j) = self%scaling*x(:n, j)
         if (present(reactions)) reactions(:, j) = self%constraint_scaling*x(n + 1:, j)
      end do
   end subroutine pseudo_solve

   subroutine solve(self, x, transposed, error)
      class(scaled_stiffness_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      logical, intent(in) :: transposed
      type(error_type), allocatable, intent(out) :: error

      if (transposed) then
         call self%solver%solve_adjoint(x, error)
      else
         call self%solver%solve(x, error)
      end if
   end subroutine solve
end module kschur_scaled_stiffness
