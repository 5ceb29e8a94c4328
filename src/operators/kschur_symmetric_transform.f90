!> Transform for symmetric undamped and proportionally damped problems: real Lanczos, or ARPACK, on (K - s M)^{-1} M restricted
!> to the null space of Cq, in the inner product of M, which may be singular.
module kschur_symmetric_transform
   ! The parent first: in another order gfortran 12 may end with an internal error (write_symtree).
   use kschur_transform, only: transform_type
   use kschur_arpack, only: arpack_symmetric
   use kschur_arpack_options, only: arpack_options_type
   use kschur_certificate, only: inertia_census_type, new_inertia_census
   use kschur_deflation, only: deflation_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, real_ritz_pairs_type, ritz_pairs_type
   use kschur_lanczos, only: lanczos, lanczos_state_type
   use kschur_lapack, only: dnrm2
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type, matrix_structure_type, &
      real_linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_outcome, only: certified_unknown, certified_yes
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_reactions, only: balance_forces
   use kschur_row_matrix, only: row_matrix_type
   use kschur_saddle, only: symmetric_saddle
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   use kschur_symmetric_rows, only: end_sharing, share_operator
   use kschur_tall_products_real, only: form_combinations, inner_products, subtract_combinations
   use kschur_tolerances, only: above_all_rounding, deflated_growth, known_well, nearly_zero, root_epsilon, rounding_of_row, &
      rounding_of_sums, same_value, singular_shift
   use kschur_transposed_solver, only: transposed_real_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: symmetric_transform_type, new_symmetric_transform, purify

   !> The operator, the state continued between iterations, and the census that certifies them.
   type, extends(transform_type) :: symmetric_transform_type
      type(symmetric_shift_invert_type) :: operator
      type(row_matrix_type) :: stiffness
      !> Upper bound of the dimension of the null space of the constraints.
      integer :: motions = huge(1)
      ! State of the last iteration, to be continued.
      type(lanczos_state_type), allocatable, private :: state
      type(inertia_census_type), allocatable, private :: census
      ! Multipliers of the Ritz vectors of the last iteration, if `recover` does not apply the operator.
      real(wp), allocatable, private :: multipliers(:, :)
   contains
      !> Takes over the count of an interval, by which the modes nearest to a target are certified.
      procedure :: take_count
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: hand_over
      procedure :: order
      procedure :: transposed
   end type symmetric_transform_type

contains

   !> Factors [K - s M, Cq^T; Cq, 0] where s = theta(lambda) is the square of a
   !> frequency (1/s^2); of a complex lambda it takes the real part.
   subroutine new_symmetric_transform(transform, problem, deflation, placement, solver, error, counting_solver)
      type(symmetric_transform_type), intent(out) :: transform
      type(modal_problem_type), target, intent(in) :: problem
      !> Motions to be deflated.
      type(deflation_type), target, intent(in) :: deflation
      type(placement_type), intent(in) :: placement
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> A solver that computes the inertia of indefinite matrices: if allocated, iterations are certified.
      class(real_linear_solver_type), allocatable, optional, intent(inout) :: counting_solver
      ! Multipliers of more constraints cost more by normal equations than by one more application.
      integer, parameter :: few = 100
      type(csr_matrix_type) :: matrix
      type(matrix_structure_type) :: structure

      transform%map%oscillator = .true.
      transform%map%alpha = problem%alpha
      transform%map%beta = problem%beta
      transform%map%loss = problem%loss_factor
      transform%map%upper = allocated(problem%loss)
      transform%shift = real(transform%map%theta(placement%lambda), wp)
      transform%operator%problem => problem
      transform%operator%deflation => deflation
      transform%motions = min(problem%unknowns(), placement%motions)
      transform%recover_applies = size(placement%factors) > 0
      allocate (transform%operator%factors, source=placement%factors)
      if (size(placement%factors) > 0) transform%operator%weight_of_violations = sqrt(problem%mass%infinity_norm())/ &
         max(problem%constraints%infinity_norm(), tiny(1.0_wp))
      ! The stiffness of bodies that only joints hold is nearer to singular than it is at other shifts.
      if (placement%factored .and. size(placement%factors) > 0) then
         allocate (transform%operator%lightness, source=problem%mass%diagonal())
         associate (m => transform%operator%lightness)
            m = 1/max(m, epsilon(1.0_wp)*maxval(m), tiny(1.0_wp))
         end associate
         transform%recover_applies = size(placement%factors) > few
      end if
      call transform%operator%constraints%take(problem%constraints)
      if (associated(placement%matrices)) then
         transform%operator%mass = placement%matrices%mass
         transform%stiffness = placement%matrices%stiffness
      else
         call transform%operator%mass%take(problem%mass)
         call transform%stiffness%take(problem%stiffness)
      end if
      call move_alloc(solver, transform%operator%solver)
      if (.not. placement%factored) &
         call symmetric_saddle(problem, placement%factors, real(transform%shift, wp), matrix, structure, error)
      if (.not. allocated(error)) call transform%operator%solver%factorize(matrix, structure, error)
      if (.not. allocated(error) .and. placement%factored .and. transform%operator%solver%null_pivots > 0) &
         call symmetric_saddle(problem, placement%factors, real(transform%shift, wp), matrix, structure, error)
      if (allocated(error)) return
      call check_regular(transform, matrix, error)
      if (allocated(error) .or. .not. present(counting_solver)) return
      if (.not. allocated(counting_solver)) return
      allocate (transform%census)
      call new_inertia_census(transform%census, problem, transform%map, real(transform%shift, wp), &
         transform%operator%solver, counting_solver, size(deflation%decay), placement%mass_bound, placement%matrices)
   end subroutine new_symmetric_transform

   subroutine take_count(self, target, from, to, below, above)
      class(symmetric_transform_type), intent(inout) :: self
      complex(wp), intent(in) :: target
      !> As for the census.
      real(wp), intent(in) :: from, to
      integer, intent(in) :: below, above

      if (.not. allocated(self%census)) return
      self%census%target = target
      call self%census%take_count(from, to, below, above)
   end subroutine take_count

   ! Fails if the shift is an eigenvalue: if a system with consistent right-hand side has no solution (null pivots alone may come
   ! from redundant constraints), or an eigenvalue of C is so large that rounding errors along its vector would swamp all others.
   subroutine check_regular(self, matrix, error)
      type(symmetric_transform_type), intent(inout) :: self
      !> The factored matrix; significant if it has null pivots.
      type(csr_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), y(:, :), rhs(:, :), f(:, :)
      logical :: singular
      integer(long) :: state
      integer :: n

      n = self%operator%order()
      allocate (x(n, 1), y(n, 1))
      allocate (rhs(n + self%operator%problem%multipliers(), 1), source=0.0_wp)
      state = 1
      call random_vector(state, x(:, 1))
      y = x
      call self%operator%deflation%project(y)
      ! All motions are deflated.
      if (norm2(y) <= root_epsilon*norm2(x)) return
      call self%operator%apply_metric(x, y, error)
      if (allocated(error)) return
      rhs(:n, :) = y
      allocate (f, source=rhs)
      call self%operator%solver%solve(rhs, error)
      if (allocated(error)) return
      singular = self%operator%solver%null_pivots > 0
      if (singular) then
         call matrix%add_product(-1.0_wp, rhs, f)
         singular = .not. maxval(abs(f(:n, :))) <= known_well*maxval(abs(y))
      end if
      x = rhs(:n, :)
      call self%operator%deflation%project(x)
      ! A zero pivot may give NaN.
      singular = singular .or. .not. norm2(x) <= huge(1.0_wp)
      if (.not. singular .and. norm2(x) > 0) then
         call self%operator%apply_metric(x/norm2(x), y, error)
         if (allocated(error)) return
         call self%operator%deflation%project_forces(y)
         rhs = 0
         rhs(:n, :) = y
         call self%operator%solver%solve(rhs, error)
         if (allocated(error)) return
         x = rhs(:n, :)
         call self%operator%deflation%project(x)
         ! Rounding errors may reintroduce deflated motions.
         singular = .not. (singular_shift*abs(self%shift)*norm2(x) <= 1 .and. norm2(rhs(:n, :) - x) <= deflated_growth*norm2(x))
      end if
      if (singular) call new_error(error, error_singular, &
         "the shifted problem is singular: the shift is an eigenvalue; move it a little")
   end subroutine check_regular

   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(symmetric_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      call share_operator(self%operator, options%processes, error)
      if (.not. allocated(error)) call iterate_shared(self, selection, options, ritz, error, monitor)
      call end_sharing(self%operator)
      ! A complete iteration needs no continuation, and shapes need the memory of the basis.
      if (self%certificate%verdict == certified_yes .and. allocated(self%state)) deallocate (self%state)
   end subroutine iterate

   ! Iterates by Lanczos or ARPACK with the operator, distributed or not, and takes the census.
   subroutine iterate_shared(self, selection, options, ritz, error, monitor)
      class(symmetric_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      ! Infinite eigenvalues have Jordan blocks of size 2 at most.
      integer, parameter :: filter = 2
      class(krylov_options_type), allocatable :: filtered
      type(deflation_type), pointer :: deflation
      logical :: complete
      integer :: wanted
      type(real_ritz_pairs_type) :: found

      if (.not. allocated(self%state)) then
         allocate (self%state)
         deflation => self%operator%deflation
         if (associated(self%operator%part)) deflation => self%operator%part%deflation
         associate (d => self%state%decomposition)
            d%most = self%motions - size(deflation%decay)
            if (size(deflation%decay) > 0) allocate (d%excluded, source=deflation%shapes)
         end associate
      end if
      if (allocated(self%census)) then
         self%census%target = selection%target
         self%census%certificate%verdict = certified_unknown
         self%state%census => self%census
      end if
      allocate (filtered, source=options)
      filtered%filter = filter
      select type (filtered)
      type is (arpack_options_type)
         call arpack_symmetric(self%operator, selection, filtered, found%values, found%vectors, found%statistics, &
            error, monitor)
         if (allocated(error)) return
         wanted = min(selection%needed(cmplx(found%values, 0, wp)), size(found%values))
         if (allocated(self%census)) call self%census%examine(found%values, 0*found%values, wanted, complete)
         found%values = found%values(:wanted)
         found%vectors = found%vectors(:, :wanted)
      class default
         call lanczos(self%operator, selection, filtered, self%state, found, error, monitor)
      end select
      if (allocated(error)) return
      if (allocated(self%census)) self%certificate = self%census%certificate
      if (.not. (options%observes .or. self%recover_applies)) &
         call purify(self, found%values, found%vectors, found%statistics, error)
      if (allocated(error)) return
      ritz%statistics = found%statistics
      allocate (ritz%mu(size(found%values)), source=cmplx(found%values, 0, wp))
      call move_alloc(found%vectors, ritz%real_vectors)
   end subroutine iterate_shared

   ! The problem is symmetric: its transpose uses the same factors.
   subroutine transposed(self, problem, deflation, solver, adjoint, error)
      class(symmetric_transform_type), target, intent(in) :: self
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(complex_linear_solver_type), intent(in) :: solver
      class(transform_type), allocatable, intent(out) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(symmetric_transform_type), allocatable :: own
      type(transposed_real_type), allocatable :: borrowed
      class(real_linear_solver_type), allocatable :: factors
      type(placement_type) :: placement

      associate (unused => solver)
      end associate
      allocate (own, borrowed)
      borrowed%original => self%operator%solver
      call move_alloc(borrowed, factors)
      placement%lambda = sqrt(self%shift)
      placement%motions = self%motions
      allocate (placement%factors, source=self%operator%factors)
      call new_symmetric_transform(own, problem, deflation, placement, factors, error)
      own%borrows = .true.
      call move_alloc(own, adjoint)
   end subroutine transposed

   !> Purifies vectors of components of infinite eigenvalues: replaces x by C x / mu if its residual is above rounding, or if it may
   !> be a rigid-body shape, whose strain energy is a rounding error. With constraints their multipliers are found, too, and x is
   !> replaced if it violates a constraint by more than rounding. Those still not accurate enough are corrected.
   subroutine purify(self, values, shapes, statistics, error)
      class(symmetric_transform_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      !> Orthonormal in the inner product of M.
      real(wp), contiguous, intent(inout) :: shapes(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      ! Columns multiplied at a time.
      integer, parameter :: block = 4
      real(wp), allocatable :: y(:, :), force(:, :), xi(:, :), violations(:, :)
      real(wp) :: shift, level_of_mass, level_of_stiffness, theta(size(values)), lengths(size(self%operator%factors)), rest(block)
      logical :: impure(size(values))
      integer :: first, last, n, j, k
      integer, allocatable :: chosen(:)

      shift = real(self%shift, wp)
      n = size(shapes, 1)
      theta = huge(1.0_wp)
      where (abs(values) > tiny(1.0_wp)) theta = shift + 1/values
      if (allocated(self%multipliers)) deallocate (self%multipliers)
      allocate (violations(size(self%operator%factors), block), source=0.0_wp)
      if (size(violations, 1) > 0) allocate (force(n, block))
      allocate (self%multipliers(size(self%operator%factors), size(values)), source=0.0_wp)
      impure = .false.
      associate (mass => self%operator%mass, stiffness => self%stiffness, constraints => self%operator%problem%constraints)
         level_of_mass = mass%infinity_norm()
         level_of_stiffness = stiffness%infinity_norm()
         do first = 1, size(values), block
            last = min(first + block - 1, size(values))
            k = last - first + 1
            associate (finite => merge(theta(first:last), 0.0_wp, theta(first:last) < huge(1.0_wp)))
               if (size(violations, 1) == 0) then
                  call stiffness%residual(mass, finite, shapes(:, first:last), rest(:k), error)
               else
                  call stiffness%residual(mass, finite, shapes(:, first:last), rest(:k), error, force(:, :k))
               end if
            end associate
            if (allocated(error)) return
            if (size(violations, 1) > 0) then
               call balance_forces(constraints, force(:, :k), self%multipliers(:, first:last), lengths)
               rest(:k) = [(dnrm2(n, force(:, j), 1), j=1, k)]
               violations = 0
               call constraints%add_product(1.0_wp, shapes(:, first:last), violations(:, :k))
            end if
            !$omp parallel do schedule(static) if (n > panel_rows)
            do j = first, last
               if (.not. theta(j) < huge(1.0_wp)) cycle
               associate (limit => rounding_of_sums*dnrm2(n, shapes(:, j), 1))
                  impure(j) = .not. (rest(j - first + 1) <= limit*(level_of_stiffness + abs(theta(j))*level_of_mass) .and. &
                     all(abs(violations(:, j - first + 1)) <= limit*lengths))
               end associate
               impure(j) = impure(j) .or. abs(theta(j)) <= nearly_zero*abs(shift)
            end do
            !$omp end parallel do
         end do
      end associate
      if (allocated(force)) deallocate (force)
      allocate (chosen, source=pack([(j, j=1, size(values))], impure))
      if (size(chosen) == 0) return
      allocate (y(size(shapes, 1), size(chosen)), xi(size(violations, 1), size(chosen)))
      call self%operator%apply_with_multipliers(shapes(:, chosen), y, xi, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + size(chosen)
      do k = 1, size(chosen)
         shapes(:, chosen(k)) = y(:, k)/values(chosen(k))
         self%multipliers(:, chosen(k)) = xi(:, k)/values(chosen(k))
      end do
      deallocate (y, xi)
      do first = 1, size(chosen), block
         last = min(first + block - 1, size(chosen))
         call correct(self, theta, chosen(first:last), level_of_stiffness, level_of_mass, shapes, statistics, error)
         if (allocated(error)) return
      end do
   end subroutine purify

   ! Corrects purified vectors that would else need refinement, a factorisation for each: rounding errors of the solution C x are
   ! relative to x, those of a correction to itself. With their residuals r = (K - theta M) x subtracts the error along each other
   ! vector x_i, x_i^T r/(theta_i - theta), of which C has amplified those nearer to the shift; and of the part of r that is
   ! orthogonal to all vectors, (K - s M)^{-1} r. Others stay as they are: the rounding error of the residual would spoil low modes
   ! of ill-conditioned stiffness. What is judged later are these residuals, in norms that may be a little smaller, therefore half
   ! of what is good enough then.
   subroutine correct(self, theta, chosen, level_of_stiffness, level_of_mass, shapes, statistics, error)
      class(symmetric_transform_type), intent(inout) :: self
      real(wp), intent(in) :: theta(:), level_of_stiffness, level_of_mass
      integer, intent(in) :: chosen(:)
      real(wp), contiguous, intent(inout) :: shapes(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: y(:, :), force(:, :), xi(:, :), along(:, :), motions(:, :)
      real(wp) :: rest(size(chosen)), limit
      integer, allocatable :: poor(:)
      integer :: n, j, k

      n = size(shapes, 1)
      allocate (force(n, size(chosen)))
      call self%stiffness%residual(self%operator%mass, theta(chosen), shapes(:, chosen), rest, error, force)
      if (allocated(error)) return
      associate (constraints => self%operator%problem%constraints)
         if (constraints%rows > 0) call constraints%add_transposed_product(1.0_wp, self%multipliers(:, chosen), force)
         allocate (poor, source=pack([(j, j=1, size(chosen))], [(dnrm2(n, force(:, j), 1) > above_all_rounding/2* &
            (level_of_stiffness + abs(theta(chosen(j)))*level_of_mass)*dnrm2(n, shapes(:, chosen(j)), 1), j=1, size(chosen))]))
         k = size(poor)
         if (k == 0) return
         allocate (y(n, k), source=force(:, poor))
         poor = chosen(poor)
         allocate (xi(size(self%multipliers, 1), k), source=0.0_wp)
         if (constraints%rows > 0) call constraints%add_product(1.0_wp, shapes(:, poor), xi)
      end associate
      allocate (along(size(theta), k), motions(n, k))
      call inner_products(shapes, y, along)
      call form_combinations(shapes, along, motions)
      call self%operator%apply_metric(motions, force(:, :k), error)
      if (allocated(error)) return
      y = y - force(:, :k)
      call self%operator%respond(y, xi, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + k
      y = shapes(:, poor) - y
      do j = 1, k
         ! Products of the size of the rounding of r tell no error.
         limit = rounding_of_row*(level_of_stiffness + abs(theta(poor(j)))*level_of_mass)*dnrm2(n, shapes(:, poor(j)), 1)**2
         where (abs(theta - theta(poor(j))) > same_value*abs(theta(poor(j))) .and. abs(along(:, j)) > limit)
            along(:, j) = along(:, j)/(theta - theta(poor(j)))
         elsewhere
            along(:, j) = 0
         end where
      end do
      call subtract_combinations(shapes, along, y)
      shapes(:, poor) = y
      self%multipliers(:, poor) = self%multipliers(:, poor) - xi - matmul(self%multipliers, along)
   end subroutine correct

   subroutine recover(self, ritz, pairs, error)
      class(symmetric_transform_type), intent(inout) :: self
      type(ritz_pairs_type), intent(inout) :: ritz
      type(eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: y(:, :), multipliers(:, :)
      real(wp) :: length
      integer :: k, j

      k = size(ritz%mu)
      call move_alloc(ritz%real_vectors, pairs%real_phi)
      if (self%recover_applies) then
         allocate (y(pairs%rows(), k), multipliers(size(self%operator%factors), k))
         call self%operator%apply_with_multipliers(pairs%real_phi, y, multipliers, error)
         if (allocated(error)) return
         ritz%statistics%operator_applications = ritz%statistics%operator_applications + k
         call move_alloc(y, pairs%real_phi)
      else
         ! The iteration has purified them.
         call move_alloc(self%multipliers, multipliers)
      end if
      allocate (pairs%xi(size(multipliers, 1), k))
      !$omp parallel do schedule(static) private(length) if (pairs%rows() > panel_rows)
      do j = 1, k
         associate (phi => pairs%real_phi(:, j))
            length = max(dnrm2(size(phi), phi, 1), tiny(1.0_wp))
            phi = phi/length
         end associate
         pairs%xi(:, j) = multipliers(:, j)/length
      end do
      !$omp end parallel do
   end subroutine recover

   subroutine hand_over(self, spare)
      class(symmetric_transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      call move_alloc(self%operator%solver, spare%real)
   end subroutine hand_over

   function linear_solver(self) result(solver)
      class(symmetric_transform_type), target, intent(in) :: self
      class(linear_solver_type), pointer :: solver

      solver => self%operator%solver
   end function linear_solver

   integer function order(self)
      class(symmetric_transform_type), intent(in) :: self

      order = self%operator%order() + size(self%operator%factors)
   end function order
end module kschur_symmetric_transform
