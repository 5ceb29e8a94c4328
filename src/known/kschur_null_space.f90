!> The null space of K or M on the motions that the constraints allow, by inverse iteration, and the factors of the matrix for
!> later steps: null vectors of K are rigid motions and mechanisms (lambda = 0), those of M belong to infinite eigenvalues.
module kschur_null_space
   use kschur_border_scaling, only: find_scalings
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: effort_type
   use kschur_equilibration, only: equilibrate
   use kschur_error, only: error_type, error_cancelled, error_convergence, error_memory, error_singular
   use kschur_held_bodies, only: try_factors
   use kschur_iterative_real, only: iterative_real_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_magnitudes, only: magnitudes, terms_of
   use kschur_null_pairs, only: keep_null_pairs, radius_of_zeros, solve
   use kschur_options, only: inner_mumps
   use kschur_orthonormal, only: lengths, orthonormalize, subtract
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_row_problem, only: all_three, row_problem_type
   use kschur_saddle, only: bordered, saddle_structure
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, identity_csr_matrix, linear_combination, transpose_csr
   use kschur_tolerances, only: above_rounding, blurred_value, contraction, least_enlarged, most_enlarged, &
      rounding_of_energy, rounding_of_row, visible_pivot
   implicit none
   private
   public :: find_null_space, null_space_type

   !> The null space {phi : A phi + Cq^T xi = 0, Cq phi = 0}, with the factors of D1 [A, Cq^T; Cq, 0] D2 + E. The diagonals D1 and
   !> D2, equal if A is symmetric or nothing is added, scale rows and columns to size one, so that the numerical rank does not
   !> depend on units, or on heavy and light parts. The perturbation E makes the matrix regular: diag(delta I, -delta I) or, as
   !> left and right null vectors of an unsymmetric A may be orthogonal to each other, a random matrix on the pattern of the problem
   !> in place of delta I. Without E a null pivot of a redundant constraint could not be told from one of a null vector. Without
   !> constraints E is zero if A is unsymmetric and regular, and rounding and delta at null pivots alone if A is positive
   !> semidefinite, as also with constraints between few bodies: the factors are those of A then, for forces orthogonal to the null
   !> vectors (`exact`).
   type :: null_space_type
      !> phi, n x k, and xi, m x k.
      real(wp), allocatable :: motions(:, :), multipliers(:, :)
      !> Those of the transposed matrix, if A is unsymmetric and has null vectors; another number of columns than of `motions` means
      !> that rounding hides the rank.
      real(wp), allocatable :: left_motions(:, :)
      !> D1 and D2, n + m numbers each: powers of two.
      real(wp), allocatable :: row_scaling(:), column_scaling(:)
      !> The factors of the perturbed matrix.
      class(real_linear_solver_type), allocatable :: solver
      !> Whether the energy of a vector exceeds rounding: it may be no null vector.
      logical :: doubtful = .false.
      !> Of an unsymmetric K: what is taken as zero may lie so far from it (1/s); huge: not known.
      real(wp) :: radius = 0
      !> Whether the factors are those of A itself: for forces f orthogonal to the null vectors they solve A x = f.
      logical :: exact = .false.
      ! The scaled matrix.
      type(csr_matrix_type), private :: matrix
      logical, private :: symmetric = .false., perturbed = .false.
      integer, private :: unknowns = 0
      real(wp), private :: delta = 0
      ! D2^{-1} [phi; xi], its columns orthonormal in the first n rows.
      real(wp), allocatable, private :: basis(:, :)
      ! Growth of the first block in inverse iteration, in units of 1/delta.
      real(wp), private :: growth = 0
   contains
      !> Solves A y + Cq^T xi = f, Cq y = 0 for consistent forces; y is orthogonal to the null vectors in the scaled basis.
      procedure :: pseudo_solve
   end type null_space_type

   ! Number of inverse iterations, and of refinement steps that remove the effect of E.
   integer, parameter :: double_iterations = 2, refinements = 3
   ! Solvers take so many right-hand sides at about the cost of one or two.
   integer, parameter :: economic_block = 4

contains

   !> Finds the null space of a matrix on the motions that the constraints allow. Factors A itself if there are no constraints and
   !> it is positive semidefinite, or unsymmetric and regular; otherwise A + E, with another E if the growth of vectors shows that
   !> the sum is singular to rounding, and with MUMPS if the solver fails, as A may be nearer to singular than at any shift.
   subroutine find_null_space(space, problem, matrix, held, inner, purpose, effort, error, matrices)
      type(null_space_type), intent(out) :: space
      type(modal_problem_type), intent(in) :: problem
      !> A, n x n, in the pattern of the problem.
      type(csr_matrix_type), intent(in) :: matrix
      !> Whether A has factors beside the constraints, by `are_held`.
      logical, intent(in) :: held
      type(inner_solvers_type), intent(in) :: inner
      !> Purpose that the factorisations are accounted to: one of `for_*`.
      integer, intent(in) :: purpose
      !> Accounts for the factorisations, and for the solves with all but the last one.
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      !> The matrices of the problem, distributed, of which A is the stiffness: the first process has them whole while it scales A
      !> only. Absent: they are not distributed.
      type(row_problem_type), optional, intent(inout) :: matrices
      integer, parameter :: attempts = 3
      type(matrix_structure_type) :: structure
      real(wp), allocatable :: basis(:, :)
      integer :: attempt
      logical :: found

      call factor_alone()
      if (allocated(error)) return
      attempt = 0
      do while (.not. found)
         attempt = attempt + 1
         if (allocated(space%solver)) call effort%add_solves(space%solver)
         call factor_perturbed(attempt)
         if (.not. allocated(error)) then
            call effort%add_factors(space%solver, purpose)
            ! A null pivot is replaced by the solver: the null vector would be lost.
            if (attempt < attempts .and. space%solver%null_pivots > 0) cycle
            call find_null_vectors(space, .false., basis, error)
         end if
         if (.not. allocated(error)) then
            if (attempt >= attempts .or. space%growth <= most_enlarged) exit
         else
            if (attempt > attempts .or. all(error%code /= [error_convergence, error_singular])) return
            deallocate (error)
            attempt = attempts
         end if
      end do
      if (.not. (space%symmetric .or. size(basis, 2) == 0)) call find_left_vectors()
      if (allocated(error)) return
      associate (n => space%unknowns, vectors => scaled(basis, space%column_scaling))
         allocate (space%motions, source=vectors(:n, :))
         allocate (space%multipliers, source=vectors(n + 1:, :))
      end associate
      call move_alloc(basis, space%basis)
      ! It serves vectors beside null vectors.
      if (size(space%motions, 2) == 0) space%matrix = csr_matrix_type()

   contains

      ! Factors A itself, without E, and finds its null vectors (`found`), of a symmetric A if the inertia shows no negative
      ! eigenvalue but those of null vectors and multipliers; an unsymmetric one must have none, as pivoting leaves unknown what
      ! replaces them.
      subroutine factor_alone()
         found = .false.
         select type (solver => inner%unshifted)
         type is (direct_real_type)
            if (problem%multipliers() > 0 .and. .not. held) return
            allocate (space%solver, source=solver)
         type is (iterative_real_type)
            ! Factors in single precision hold no null pivots: A must be regular.
            if (problem%multipliers() > 0 .or. .not. problem%symmetric) return
            allocate (space%solver, source=solver)
         class default
            return
         end select
         call scale_matrix()
         if (allocated(error)) return
         structure%singular = structure%symmetric
         space%delta = merge(structure%least_pivot(), visible_pivot, structure%singular)
         call space%solver%factorize(space%matrix, structure, error)
         if (.not. allocated(error)) then
            call effort%add_factors(space%solver, purpose)
            call find_null_vectors(space, .false., basis, error)
         end if
         if (allocated(error)) then
            if (all(error%code /= [error_cancelled, error_memory])) deallocate (error)
         else if (structure%symmetric) then
            ! Each negative pivot belongs to a null vector then.
            found = space%solver%negative_pivots <= problem%multipliers() + size(basis, 2) .and. .not. space%doubtful
            space%exact = found
            if (found .and. problem%multipliers() > 0) &
               call try_factors(space%solver, space%matrix, basis, space%unknowns, space%exact, error)
         else
            found = space%solver%null_pivots == 0 .and. size(basis, 2) == 0
            space%exact = found
         end if
      end subroutine factor_alone

      ! Sets the scaled matrix, without E, and its structure.
      subroutine scale_matrix()
         type(csr_matrix_type) :: constraints
         real(wp) :: scaling(problem%unknowns()), constraint_scaling(problem%multipliers())

         space%unknowns = problem%unknowns()
         if (present(matrices)) call matrices%bring_back(all_three, error)
         if (allocated(error)) return
         ! The pattern includes that of M, so that one symbolic analysis serves K and K - s M.
         space%matrix = linear_combination(1.0_wp, matrix, 0.0_wp, problem%mass)
         if (present(matrices)) call matrices%put_away(all_three)
         structure = saddle_structure(problem)
         if (.not. problem%symmetric) structure%symmetric = space%matrix%is_symmetric()
         space%symmetric = structure%symmetric
         constraints = problem%constraints
         call find_scalings(space%matrix, constraints, scaling, constraint_scaling)
         call space%matrix%scale_entries(scaling, scaling)
         call constraints%scale_entries(spread(1.0_wp, 1, problem%multipliers()), scaling)
         space%row_scaling = [scaling, constraint_scaling]
         space%column_scaling = [scaling, constraint_scaling]
         if (constraints%rows > 0) space%matrix = bordered(space%matrix, constraints, constraint_scaling)
      end subroutine scale_matrix

      ! Factors the scaled matrix plus E: each attempt has a larger E, and another random one; the last one has MUMPS.
      subroutine factor_perturbed(attempt)
         integer, intent(in) :: attempt
         type(csr_matrix_type) :: e
         integer(long) :: state

         space = null_space_type(perturbed=.true.)
         if (attempt <= attempts) then
            allocate (space%solver, source=inner%unshifted)
         else
            allocate (space%solver, source=direct_real_type(inner=inner_mumps))
         end if
         call scale_matrix()
         if (allocated(error)) return
         if (.not. structure%symmetric) call equilibrate(space%matrix, space%row_scaling, space%column_scaling)
         space%delta = 3.0_wp**mod(attempt - 1, attempts)*max(above_rounding*space%solver%accuracy, visible_pivot)
         if (structure%symmetric) then
            e = identity_csr_matrix(space%unknowns)
         else
            ! On the symmetrized pattern of M, R and K and the diagonal, entries of either sign between a half and one.
            e = linear_combination(spread(1.0_wp, 1, 3), [problem%mass, problem%damping, problem%stiffness])
            e = linear_combination(1.0_wp, e, 1.0_wp, transpose_csr(e))
            e = linear_combination(1.0_wp, e, 1.0_wp, identity_csr_matrix(space%unknowns))
            state = mod(attempt - 1, attempts) + 1
            call random_vector(state, e%value)
            e%value = sign((1 + abs(e%value))/2, e%value)
         end if
         e%value = space%delta*e%value
         associate (m => problem%multipliers())
            e = bordered(e, empty_csr_matrix(m, space%unknowns), spread(1.0_wp, 1, m), spread(-space%delta, 1, m))
         end associate
         call space%solver%factorize(linear_combination(1.0_wp, space%matrix, 1.0_wp, e), structure, error)
      end subroutine factor_perturbed

      ! Finds the null vectors of the transposed matrix, and drops those that are not null entry by entry.
      subroutine find_left_vectors()
         real(wp), allocatable :: left(:, :), y(:, :), x(:, :), forms(:, :)

         call find_null_vectors(space, .true., left, error)
         if (allocated(error)) return
         space%radius = huge(1.0_wp)
         space%doubtful = size(left, 2) /= size(basis, 2)
         associate (n => space%unknowns, rows => space%row_scaling(:space%unknowns))
            if (.not. space%doubtful) then
               y = left
               x = basis
               call keep_null_pairs(space%matrix, space%solver, y, x, forms, space%doubtful, error)
               if (allocated(error)) return
               space%radius = radius_of_zeros(problem%mass, problem%damping, scaled(y(:n, :), rows), &
                  scaled(x(:n, :), space%column_scaling(:n)), forms)
               if (size(x, 2) < size(basis, 2)) then
                  call orthonormalize(basis(:, :0), n, x)
                  call orthonormalize(basis(:, :0), n, y)
                  basis = x
                  left = y
               end if
            end if
            allocate (space%left_motions, source=scaled(left(:n, :), rows))
         end associate
      end subroutine find_left_vectors
   end subroutine find_null_space

   ! D X, of a diagonal matrix D.
   pure function scaled(x, diagonal)
      real(wp), intent(in) :: x(:, :), diagonal(:)
      real(wp) :: scaled(size(x, 1), size(x, 2))

      scaled = x*spread(diagonal, 2, size(x, 2))
   end function scaled

   ! Finds all null vectors, block by block until a block has fewer than it has room for, and drops those of a symmetric matrix
   ! whose energy is not zero.
   subroutine find_null_vectors(space, transposed, basis, error)
      class(null_space_type), intent(inout) :: space
      !> Whether to find those of the transposed matrix.
      logical, intent(in) :: transposed
      real(wp), allocatable, intent(out) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: state
      integer :: block_size, n, n_before, n_new
      ! Whether some vector grew as a null vector does, but its force is above the tolerance.
      logical :: doubtful, is_first

      n = space%unknowns
      allocate (basis(space%matrix%rows, 0))
      state = state_of_seed(5)
      ! One more than seem to be null: a block that finds fewer than it has room for is the last.
      block_size = min(1 + space%solver%replaced_pivots, 2*economic_block)
      is_first = .true.
      do
         n_before = size(basis, 2)
         block_size = min(block_size, n - n_before)
         call add_null_vectors()
         if (allocated(error)) return
         n_new = size(basis, 2) - n_before
         ! A block separates null vectors from others better than few vectors: if these are doubtful it is repeated with a block.
         if (size(basis, 2) == n .or. (n_new < block_size .and. .not. (doubtful .and. (is_first .or. n_new > 0)))) exit
         if (is_first .or. n_new == block_size) block_size = economic_block*max(1, size(basis, 2)/economic_block)
         is_first = .false.
      end do
      if (space%symmetric .and. size(basis, 2) > 0) call drop_flexible()

   contains

      ! Drops vectors with strain energy: flexible modes whose forces are rounding relative to the largest of A, as the lowest ones
      ! of a long chain. Separates them from null vectors by inverse subspace iteration with Rayleigh-Ritz in a larger space:
      ! energies of modes converge to positive values, those of null vectors to zero. Sets `doubtful`.
      subroutine drop_flexible()
         integer, parameter :: most_turns = 20
         real(wp), allocatable :: x(:, :), energies(:), energies_before(:), relative_energies(:)
         logical, allocatable :: is_null(:), is_settled(:)
         integer :: k, turn, j

         k = size(basis, 2)
         allocate (x, source=basis)
         call diagonalize_energies(x, energies, relative_energies)
         if (allocated(error)) return
         space%doubtful = any(relative_energies > rounding_of_energy)
         if (all(relative_energies <= rounding_of_row)) return
         deallocate (x)
         allocate (x(size(basis, 1), min(n, k + max(k, 2*economic_block))), source=0.0_wp)
         x(:, :k) = basis
         allocate (energies_before(0))
         do turn = 1, most_turns
            x(n + 1:, :) = 0
            call orthonormalize(x(:, :0), n, x, state)
            call solve(space%solver, .false., x, error)
            if (allocated(error)) return
            call orthonormalize(x(:, :0), n, x)
            call diagonalize_energies(x, energies, relative_energies)
            if (allocated(error)) return
            is_null = relative_energies <= rounding_of_row
            is_settled = energies >= force_tolerance(space)
            if (size(energies_before) == size(energies)) is_settled = is_settled .or. &
               energies >= merge(contraction, 1 - blurred_value, is_null)*energies_before
            if (all(is_settled)) exit
            energies_before = energies
         end do
         is_null = is_null .or. .not. is_settled
         space%doubtful = any(is_null .and. relative_energies > rounding_of_energy)
         basis = x(:, pack([(j, j=1, size(is_null))], is_null))
      end subroutine drop_flexible

      ! Diagonalizes X^T A X by rotating the columns of X (Rayleigh-Ritz, by singular vectors). Energies are better known than
      ! forces A x: they err with the square of the error of x.
      subroutine diagonalize_energies(x, energies, relative_energies)
         !> k columns, orthonormal in the first n rows; multipliers below are zero if a vector has none.
         real(wp), intent(inout) :: x(:, :)
         !> k energies without sign, the largest first, and the same relative to |x|^T |A| |x|, the terms that they are sums of.
         real(wp), allocatable, intent(out) :: energies(:), relative_energies(:)
         real(wp), allocatable :: rotation(:, :), sizes(:, :)

         call right_singular_vectors(matmul(transpose(x), space%matrix%product(x)), energies, rotation, error)
         if (allocated(error)) return
         x = matmul(x, rotation)
         sizes = abs(x)
         sizes(:n, :) = magnitudes(x(:n, :))
         relative_energies = energies/max(tiny(1.0_wp), sum(sizes*terms_of(space%matrix, sizes), 1))
      end subroutine diagonalize_energies

      ! Adds up to `block_size` null vectors to a basis, fewer if there are no more: inverse iteration on a block of random vectors,
      ! alternately with the matrix and its transpose, as an unsymmetric matrix may be far from normal, and refinement that removes
      ! the effect of E. Accepts the combinations whose force, a singular value, is below `force_tolerance`.
      subroutine add_null_vectors()
         real(wp), allocatable :: x(:, :), known(:, :), forces(:, :), singular(:), rotation(:, :)
         integer, allocatable :: nearly_null(:)
         integer :: i, j, n_null

         doubtful = .false.
         allocate (x(size(basis, 1), block_size), forces(size(basis, 1), block_size), known(size(basis, 1), 0), source=0.0_wp)
         do i = 1, double_iterations
            do j = 1, 2
               x(n + 1:, :) = 0
               call orthonormalize(basis, n, x, state)
               call solve(space%solver, transposed .neqv. j == 1, x, error)
               if (allocated(error)) return
            end do
            associate (growth => space%delta*lengths(x, n))
               if (i == 1 .and. size(basis, 2) == 0 .and. .not. transposed) space%growth = maxval(growth)
               ! Null vectors grow by 1/delta: as the block is orthogonal to those found, one that grows less has none in it.
               x = x(:, pack([(j, j=1, size(x, 2))], .not. growth < least_enlarged))
            end associate
            if (size(x, 2) == 0) return
            if (space%perturbed .and. i < double_iterations) cycle
            call orthonormalize(basis, n, x, state)
            forces = space%matrix%product(x, transposed)
            ! Where E is delta at null pivots alone: what is left is its force, which further iterations leave.
            if (all(norm2(forces, 1) <= space%delta)) exit
         end do
         ! Removes the effect of E. Orthonormalizes after each step, as the first amplifies rounding along one null vector.
         do i = 1, refinements
            if (.not. space%perturbed .and. all(norm2(forces, 1) <= rounding_of_row)) exit
            known = basis(:, :0)
            if (i > 1) known = reshape([basis, x], [size(x, 1), size(basis, 2) + size(x, 2)])
            call correct(space, transposed, 0*x, x, error, known)
            if (allocated(error)) return
            call orthonormalize(basis, n, x)
            forces = space%matrix%product(x, transposed)
         end do
         ! Drops columns with a large force, whose rounding would hide the forces of others.
         allocate (nearly_null, source=pack([(j, j=1, size(x, 2))], norm2(forces, 1) < sqrt(real(n, wp))))
         if (size(nearly_null) == 0) return
         x = x(:, nearly_null)
         ! The combinations with the smallest forces are the last right singular vectors.
         call right_singular_vectors(forces(:, nearly_null), singular, rotation, error)
         if (allocated(error)) return
         n_null = count(singular < force_tolerance(space))
         doubtful = n_null < size(x, 2)
         x = matmul(x, rotation(:, size(x, 2) - n_null + 1:))
         ! A motion that no constraint opposes has no reaction: its multipliers are rounding errors.
         where (abs(x(n + 1:, :)) < force_tolerance(space)) x(n + 1:, :) = 0
         basis = reshape([basis, x], [size(basis, 1), size(basis, 2) + n_null])
      end subroutine add_null_vectors
   end subroutine find_null_vectors

   ! The norm below which the force A x on a vector x of unit norm is a rounding error.
   real(wp) function force_tolerance(space)
      type(null_space_type), intent(in) :: space

      force_tolerance = rounding_of_row*max(4.0_wp, space%matrix%infinity_norm())
   end function force_tolerance

   !> Solves A y + Cq^T xi = f, Cq y = 0 with the factors of A + E and refinement that removes E.
   subroutine pseudo_solve(self, f, y, error)
      class(null_space_type), intent(inout) :: self
      !> n x p
      real(wp), intent(in) :: f(:, :)
      !> y above xi, (n + m) x p.
      real(wp), intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: rhs(:, :)
      integer :: n, step

      n = self%unknowns
      allocate (rhs(self%matrix%rows, size(f, 2)), source=0.0_wp)
      rhs(:n, :) = scaled(f, self%row_scaling(:n))
      y = 0
      do step = 1, refinements
         call correct(self, .false., rhs, y, error, self%basis)
         if (allocated(error)) return
         call subtract(self%basis, self%basis, y, n)
         call subtract(self%basis, self%basis, y, n)
      end do
      y = scaled(y, self%column_scaling)
   end subroutine pseudo_solve

   ! Corrects solutions of A x = f by the factors of A + E: reduces the effect of E by a factor of delta ||A^+||. Where E is delta
   ! at null pivots alone, null vectors are amplified by far more than 1/delta: the rounding of the residual along them, which an
   ! exact residual has not, would make the correction as inaccurate as a first solution. So it is subtracted.
   subroutine correct(space, transposed, f, x, error, null_vectors)
      class(null_space_type), intent(inout) :: space
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(in) :: f(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      !> As far as they are known.
      real(wp), contiguous, intent(in) :: null_vectors(:, :)
      real(wp), allocatable :: residual(:, :)

      allocate (residual, source=f - space%matrix%product(x, transposed))
      if (space%symmetric .and. .not. (space%perturbed .and. space%matrix%rows > space%unknowns)) &
         call subtract(null_vectors, null_vectors, residual)
      call solve(space%solver, transposed, residual, error)
      if (.not. allocated(error)) x = x + residual
   end subroutine correct
end module kschur_null_space
