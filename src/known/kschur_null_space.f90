!> The null space of a matrix of the problem on the motions that the constraints allow, and its factors for what comes after:
!> of K these are rigid motions and mechanisms, the eigenvalue zero; of M they are the infinite one.
module kschur_null_space
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: effort_type
   use kschur_energies, only: separate_energies
   use kschur_error, only: error_type, error_cancelled, error_convergence, error_memory, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_options, only: inner_mumps
   use kschur_orthonormal, only: lengths, orthonormalize, subtract
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: may_be_several
   use kschur_random, only: random_vector, state_of_seed
   use kschur_saddle, only: bordered, saddle_structure
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, identity_csr_matrix, linear_combination, transpose_csr
   use kschur_tied_levels, only: spread_levels
   use kschur_tolerances, only: above_rounding, blurred_value, contraction, least_enlarged, most_enlarged, &
      rounding_of_energy, rounding_of_row, visible_pivot
   implicit none
   private
   public :: find_null_space, null_space_type

   !> {phi : A phi + Cq^T xi = 0, Cq phi = 0} with the factors of [D A D, D Cq^T S; S Cq D, 0] + E. D and S are diagonals such
   !> that the rows of both blocks are of size one: what is zero does not depend on units, or on heavy and light
   !> parts. E is delta I and -delta I or, as left and right null vectors of an unsymmetric A may be orthogonal to each
   !> other, random on the pattern of the problem and -delta I: no pivot is left to be null, as one of a redundant
   !> constraint could not be told from one of a null vector. Where there are no constraints and A is symmetric, rounding and
   !> springs of delta at null pivots are E enough: then the factors are those of A where no null vector feels the forces.
   type :: null_space_type
      !> phi, n x k, and xi, m x k.
      real(wp), allocatable :: motions(:, :), multipliers(:, :)
      !> D, n numbers, and S, m numbers: powers of two.
      real(wp), allocatable :: scaling(:), constraint_scaling(:)
      !> Holds the factors.
      class(real_linear_solver_type), allocatable :: solver
      !> Whether some vector stores more energy than rounding of a symmetric A makes likely: it may be none.
      logical :: doubtful = .false.
      !> Whether a solution with the factors, for forces that no null vector feels, is one of A x = f.
      logical :: exact = .false.
      ! The scaled matrix, and E.
      type(csr_matrix_type), private :: matrix, added
      logical, private :: symmetric = .false.
      real(wp), private :: delta = 0
      ! D^{-1} phi above S^{-1} xi, the former orthonormal.
      real(wp), allocatable, private :: basis(:, :)
      ! How much the first vectors were enlarged, in units of 1/delta.
      real(wp), private :: enlarged = 0
   contains
      !> The null vectors of the transposed matrix.
      procedure :: find_left
      !> The y with A y + Cq^T xi = f, Cq y = 0, for forces that have such, without null vectors.
      procedure :: pseudo_solve
   end type null_space_type

   ! Turns of inverse iteration, and steps of refinement that take E out again.
   integer, parameter :: iterations = 2, refinements = 3
   ! Solvers take so many right-hand sides for the price of one or two.
   integer, parameter :: together = 4

contains

   !> Finds the null space, from factors of A itself where it is positive semidefinite. Where what is singular cannot be told
   !> from E, another E may do; where the solver fails, as a matrix may be nearer to singular than the problem is at any shift,
   !> MUMPS does.
   subroutine find_null_space(space, problem, matrix, inner, purpose, effort, error)
      type(null_space_type), intent(out) :: space
      type(modal_problem_type), intent(in) :: problem
      !> A, n x n, in the pattern of the problem.
      type(csr_matrix_type), intent(in) :: matrix
      type(inner_solvers_type), intent(in) :: inner
      !> What the factorisations are counted for: one of `for_*`.
      integer, intent(in) :: purpose
      !> Has the factorisations, and the solves with all but the last one.
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      class(real_linear_solver_type), allocatable :: solver
      real(wp), allocatable :: basis(:, :)
      integer :: attempt

      call factor_exactly(space, problem, matrix, inner, purpose, effort, basis, error)
      if (allocated(error)) return
      attempt = 0
      do while (.not. space%exact)
         attempt = attempt + 1
         if (allocated(space%solver)) call effort%add_solves(space%solver)
         if (attempt <= attempts) then
            allocate (solver, source=inner%unshifted)
         else
            allocate (solver, source=direct_real_type(inner=inner_mumps))
         end if
         call factorize(space, problem, matrix, solver, mod(attempt - 1, attempts), error)
         if (.not. allocated(error)) then
            call effort%add_factors(space%solver, purpose)
            ! A null pivot hides a null vector.
            if (attempt < attempts .and. space%solver%null_pivots > 0) cycle
            call find_vectors(space, .false., basis, error)
         end if
         if (.not. allocated(error)) then
            if (attempt >= attempts .or. space%enlarged <= most_enlarged) exit
         else
            if (attempt > attempts .or. all(error%code /= [error_convergence, error_singular])) return
            attempt = attempts
         end if
      end do
      call unscale(space, basis, space%motions, space%multipliers)
      call move_alloc(basis, space%basis)
   end subroutine find_null_space

   ! Leaves `exact` false where the matrix does not fit, or may have eigenvalues that are negative.
   subroutine factor_exactly(space, problem, matrix, inner, purpose, effort, basis, error)
      type(null_space_type), intent(inout) :: space
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrix
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: purpose
      class(effort_type), intent(inout) :: effort
      real(wp), allocatable, intent(out) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_structure_type) :: structure

      if (problem%multipliers() > 0) return
      select type (solver => inner%unshifted)
      type is (direct_real_type)
         ! Several processes factor with MUMPS.
         if (may_be_several(solver%processes)) return
         allocate (space%solver, source=solver)
      class default
         return
      end select
      call scale_matrix(space, problem, matrix, structure)
      if (.not. structure%symmetric) return
      structure%singular = .true.
      space%delta = visible_pivot
      call space%solver%factorize(space%matrix, structure, error)
      if (.not. allocated(error)) then
         call effort%add_factors(space%solver, purpose)
         call find_vectors(space, .false., basis, error)
      end if
      if (allocated(error)) then
         if (all(error%code /= [error_cancelled, error_memory])) deallocate (error)
      else
         ! Each negative pivot is one of a null vector then.
         space%exact = space%solver%negative_pivots <= size(basis, 2) .and. .not. space%doubtful
      end if
   end subroutine factor_exactly

   ! The matrix that is factored, but for E; its structure.
   subroutine scale_matrix(space, problem, matrix, structure)
      type(null_space_type), intent(inout) :: space
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(out) :: structure
      type(csr_matrix_type) :: a, constraints

      ! With the places of M: one analysis serves K and K - s M.
      a = linear_combination(1.0_wp, matrix, 0.0_wp, problem%mass)
      structure = saddle_structure(problem)
      if (.not. problem%symmetric) structure%symmetric = a%is_symmetric()
      space%symmetric = structure%symmetric
      constraints = problem%constraints
      call set_scalings(space, a, constraints)
      call a%scale_entries(space%scaling, space%scaling)
      call constraints%scale_entries(spread(1.0_wp, 1, problem%multipliers()), space%scaling)
      space%matrix = bordered(a, constraints, space%constraint_scaling)
   end subroutine scale_matrix

   subroutine factorize(space, problem, matrix, solver, attempt, error)
      type(null_space_type), intent(out) :: space
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrix
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      !> From 0; each has another E.
      integer, intent(in) :: attempt
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: e
      type(matrix_structure_type) :: structure
      integer :: n, m

      n = problem%unknowns()
      m = problem%multipliers()
      call move_alloc(solver, space%solver)
      call scale_matrix(space, problem, matrix, structure)
      space%delta = 3.0_wp**attempt*max(above_rounding*space%solver%accuracy, visible_pivot)
      if (structure%symmetric) then
         e = identity_csr_matrix(n)
      else
         e = random_on_pattern(problem, attempt + 1)
      end if
      e%value = space%delta*e%value
      space%added = bordered(e, empty_csr_matrix(m, n), spread(1.0_wp, 1, m), spread(-space%delta, 1, m))
      call space%solver%factorize(linear_combination(1.0_wp, space%matrix, 1.0_wp, space%added), structure, error)
   end subroutine factorize

   ! D and S. Powers of two: scaling rounds nothing.
   subroutine set_scalings(space, a, constraints)
      type(null_space_type), intent(inout) :: space
      type(csr_matrix_type), intent(in) :: a, constraints
      real(wp) :: level(a%rows), softest
      integer :: i

      level = a%row_maxima()
      if (all(.not. level > 0)) level = 1
      softest = minval(level, level > 0)
      call spread_levels(constraints, level)
      where (.not. level > 0) level = maxval(level)
      ! An entry of a constraint that is rounding makes nothing softer.
      level = max(level, softest)
      allocate (space%scaling(a%rows), source=scale(1.0_wp, -exponent(level)/2))
      allocate (space%constraint_scaling(constraints%rows))
      do i = 1, constraints%rows
         associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
            space%constraint_scaling(i) = scale(1.0_wp, -exponent(maxval( &
               abs(constraints%value(first:last)*space%scaling(constraints%column(first:last))))))
         end associate
      end do
   end subroutine set_scalings

   ! Numbers between a half and one, of either sign, where M, R or K or their transposes have entries.
   function random_on_pattern(problem, seed) result(matrix)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: seed
      type(csr_matrix_type) :: matrix
      integer(long) :: state

      matrix = linear_combination(spread(1.0_wp, 1, 3), [problem%mass, problem%damping, problem%stiffness])
      matrix = linear_combination(1.0_wp, matrix, 1.0_wp, transpose_csr(matrix))
      matrix = linear_combination(1.0_wp, matrix, 1.0_wp, identity_csr_matrix(matrix%rows))
      state = seed
      call random_vector(state, matrix%value)
      matrix%value = sign((1 + abs(matrix%value))/2, matrix%value)
   end function random_on_pattern

   subroutine find_left(self, left, error)
      class(null_space_type), intent(inout) :: self
      !> n x k, where there are as many as from the right.
      real(wp), allocatable, intent(out) :: left(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: basis(:, :), multipliers(:, :)

      if (self%symmetric .or. size(self%motions, 2) == 0) then
         allocate (left, source=self%motions)
         return
      end if
      call find_vectors(self, .true., basis, error)
      if (.not. allocated(error)) call unscale(self, basis, left, multipliers)
   end subroutine find_left

   subroutine unscale(space, basis, motions, multipliers)
      type(null_space_type), intent(in) :: space
      real(wp), intent(in) :: basis(:, :)
      real(wp), allocatable, intent(out) :: motions(:, :), multipliers(:, :)
      integer :: n

      n = size(space%scaling)
      allocate (motions, source=basis(:n, :)*spread(space%scaling, 2, size(basis, 2)))
      allocate (multipliers, source=basis(n + 1:, :)*spread(space%constraint_scaling, 2, size(basis, 2)))
   end subroutine unscale

   ! Finds all null vectors, those of the transposed matrix if so asked, block by block.
   subroutine find_vectors(space, transposed, basis, error)
      class(null_space_type), intent(inout) :: space
      logical, intent(in) :: transposed
      real(wp), allocatable, intent(out) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: state
      integer :: wanted, n, before, more
      logical :: doubtful

      n = size(space%scaling)
      allocate (basis(space%matrix%rows, 0))
      state = state_of_seed(5)
      wanted = 1
      do
         before = size(basis, 2)
         wanted = min(wanted, n - before)
         call find_more(space, wanted, transposed, state, basis, doubtful, error)
         if (allocated(error)) return
         more = size(basis, 2) - before
         ! A block tells better than a single vector what is zero.
         if (size(basis, 2) == n .or. (more < wanted .and. .not. (doubtful .and. (wanted == 1 .or. more > 0)))) exit
         if (wanted == 1 .or. more == wanted) wanted = together*max(1, size(basis, 2)/together)
      end do
      if (space%symmetric .and. size(basis, 2) > 0) call leave_strained(space, state, basis, error)
   end subroutine find_vectors

   ! Leaves out what stores energy, as the lowest modes of a long chain do whose forces are rounding beside the largest of A. Null
   ! vectors that have some of these modes in them are told from them by iteration of a space that holds both, in which the
   ! energies of modes settle and those of null vectors vanish.
   subroutine leave_strained(space, state, basis, error)
      class(null_space_type), intent(inout) :: space
      integer(long), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_turns = 20
      real(wp), allocatable :: x(:, :), energies(:), before(:), parts(:)
      logical, allocatable :: null(:), settled(:)
      integer :: n, k, turn, j

      n = size(space%scaling)
      k = size(basis, 2)
      allocate (x, source=basis)
      call separate_energies(space%matrix, n, x, energies, parts, error)
      if (allocated(error)) return
      space%doubtful = any(parts > rounding_of_energy)
      if (all(parts <= rounding_of_row)) return
      deallocate (x)
      allocate (x(size(basis, 1), min(n, k + max(k, 2*together))), source=0.0_wp)
      x(:, :k) = basis
      allocate (before(0))
      do turn = 1, most_turns
         x(n + 1:, :) = 0
         call orthonormalize(x(:, :0), n, x, state)
         call solve(space, .false., x, error)
         if (allocated(error)) return
         call orthonormalize(x(:, :0), n, x)
         call separate_energies(space%matrix, n, x, energies, parts, error)
         if (allocated(error)) return
         null = parts <= rounding_of_row
         settled = energies >= negligible(space)
         if (size(before) == size(energies)) settled = settled .or. &
            energies >= merge(contraction, 1 - blurred_value, null)*before
         if (all(settled)) exit
         before = energies
      end do
      null = null .or. .not. settled
      space%doubtful = any(null .and. parts > rounding_of_energy)
      basis = x(:, pack([(j, j=1, size(null))], null))
   end subroutine leave_strained

   ! A force on a vector of unit norm below this is rounding.
   real(wp) function negligible(space)
      type(null_space_type), intent(in) :: space

      negligible = rounding_of_row*max(4.0_wp, space%matrix%infinity_norm())
   end function negligible

   ! Adds up to `wanted` null vectors to those there are, fewer if there are no more: inverse iteration on a block of random
   ! vectors, with the adjoint in turn, as an unsymmetric matrix may be far from normal.
   subroutine find_more(space, wanted, transposed, state, basis, doubtful, error)
      type(null_space_type), intent(inout) :: space
      integer, intent(in) :: wanted
      logical, intent(in) :: transposed
      integer(long), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: basis(:, :)
      !> Whether some vector may be one, but was not found well enough.
      logical, intent(out) :: doubtful
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), forces(:, :), force(:), rotation(:, :), zero(:, :)
      integer, allocatable :: clear(:)
      integer :: i, j, n, null

      n = size(space%scaling)
      doubtful = .false.
      allocate (x(size(basis, 1), wanted), source=0.0_wp)
      do i = 1, 2*iterations
         x(n + 1:, :) = 0
         call orthonormalize(basis, n, x, state)
         call solve(space, transposed .neqv. mod(i, 2) == 1, x, error)
         if (allocated(error)) return
         if (mod(i, 2) == 1) cycle
         associate (enlarged => space%delta*lengths(x, n))
            if (i == 2 .and. size(basis, 2) == 0 .and. .not. transposed) space%enlarged = maxval(enlarged)
            ! Being orthogonal to the others short ones say that no null vector is left for them.
            x = x(:, pack([(j, j=1, size(x, 2))], .not. enlarged < least_enlarged))
         end associate
         if (size(x, 2) == 0) return
      end do
      call orthonormalize(basis, n, x, state)
      ! What the turn from left to right left of E. Each step enlarges rounding along one null vector, which must not drown others.
      do i = 1, refinements
         zero = 0*x
         call refine(space, transposed, zero, x, 1, error)
         if (allocated(error)) return
         call orthonormalize(basis, n, x)
      end do
      forces = product_of(space%matrix, transposed, x)
      ! Columns that have any force would drown those of the others.
      clear = pack([(j, j=1, size(x, 2))], norm2(forces, 1) < sqrt(real(n, wp)))
      if (size(clear) == 0) return
      x = x(:, clear)
      ! The combinations that meet the least forces are the last singular vectors.
      call right_singular_vectors(forces(:, clear), force, rotation, error)
      if (allocated(error)) return
      null = count(force < negligible(space))
      doubtful = null < size(x, 2)
      x = matmul(x, rotation(:, size(x, 2) - null + 1:))
      ! A free motion needs no reaction.
      where (abs(x(n + 1:, :)) < negligible(space)) x(n + 1:, :) = 0
      basis = reshape([basis, x], [size(basis, 1), size(basis, 2) + null])
   end subroutine find_more

   subroutine pseudo_solve(self, f, y, error)
      class(null_space_type), intent(inout) :: self
      !> n x p
      real(wp), intent(in) :: f(:, :)
      !> y above xi, (n + m) x p.
      real(wp), intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: rhs(:, :)
      integer :: n

      n = size(self%scaling)
      allocate (rhs(self%matrix%rows, size(f, 2)), source=0.0_wp)
      rhs(:n, :) = f*spread(self%scaling, 2, size(f, 2))
      y = 0
      call refine(self, .false., rhs, y, refinements, error, self%basis)
      y = y*spread([self%scaling, self%constraint_scaling], 2, size(f, 2))
   end subroutine pseudo_solve

   ! Refines solutions of A x = f, without what they have along other vectors: each step takes out more of what E changed.
   subroutine refine(space, transposed, f, x, steps, error, others)
      class(null_space_type), intent(inout) :: space
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(in) :: f(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer, intent(in) :: steps
      type(error_type), allocatable, intent(out) :: error
      real(wp), contiguous, optional, intent(in) :: others(:, :)
      real(wp), allocatable :: residual(:, :)
      integer :: step

      allocate (residual, mold=f)
      do step = 1, steps
         residual = f - product_of(space%matrix, transposed, x)
         call solve(space, transposed, residual, error)
         if (allocated(error)) return
         x = x + residual
         if (.not. present(others)) cycle
         call subtract(others, others, x, size(space%scaling))
         call subtract(others, others, x, size(space%scaling))
      end do
   end subroutine refine

   function product_of(matrix, transposed, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp) :: y(size(x, 1), size(x, 2))

      y = 0
      if (transposed) then
         call matrix%add_transposed_product(1.0_wp, x, y)
      else
         call matrix%add_product(1.0_wp, x, y)
      end if
   end function product_of

   subroutine solve(space, transposed, x, error)
      class(null_space_type), intent(inout) :: space
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (transposed) then
         call space%solver%solve_adjoint(x, error)
      else
         call space%solver%solve(x, error)
      end if
   end subroutine solve
end module kschur_null_space
