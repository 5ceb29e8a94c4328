!> The modes of a problem: chooses formulation and shift, runs the
!> Krylov-Schur method, turns Ritz pairs into modes.
module kschur_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_formulation, only: choose_formulation, is_structured
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_left, only: set_left_modes
   use kschur_linear_solver, only: linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_modes, only: eigenpairs_type, select_modes
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_names, scaling_names
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type, reason_cancelled, reason_converged, reason_fewer_modes
   use kschur_shift, only: account, place_shift
   use kschur_transform, only: transform_type
   use kschur_transposed, only: new_transposed_transform, transpose_problem
   implicit none
   private
   public :: solve_modes

contains

   !> Computes the modes nearest to a target. What converged is in `result`
   !> even where it is less than was asked for: then `result%reason` says why.
   !> Fails on options that do not fit the problem, on a shift that is an
   !> eigenvalue, and where memory or a library fails.
   subroutine solve_modes(problem, options, result, error, monitor)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iteration and may end it.
      class(monitor_type), intent(inout), optional :: monitor
      class(transform_type), allocatable, target :: transform
      type(modal_problem_type), target :: work
      type(presolve_type) :: plan
      logical :: presolved
      class(linear_solver_type), pointer :: solver
      integer(long) :: started

      started = clock()
      call check_options(options, error)
      if (allocated(error)) return
      result%options = options
      result%method = "krylov-schur"
      result%modes_asked = options%modes
      result%unknowns = problem%unknowns()
      result%constraints = problem%multipliers()
      result%damping_kind = problem%damping_kind
      result%symmetric = problem%symmetric
      result%target = options%target
      call choose_formulation(problem, options%formulation, result%formulation, error)
      if (allocated(error)) return
      presolved = options%presolve .and. is_structured(result%formulation)
      if (presolved) then
         call presolve(problem, work, plan, error)
         if (plan%unknowns_after == 0) then
            call no_modes(problem, result, error)
            return
         end if
         if (allocated(error)) return
      else
         work = problem
      end if

      call place_shift(work, options, transform, result, error)
      if (.not. allocated(error)) call find_modes(problem, presolved, plan, transform, options, result, error, monitor)
      if (.not. allocated(error) .and. options%left) &
         call find_left_modes(problem, work, presolved, plan, transform, options, result, error, monitor)
      if (allocated(error)) return
      result%factored_order = transform%order()
      solver => transform%linear_solver()
      result%factor_entries = solver%factor_entries
      call account(transform%linear_solver(), result)
      result%seconds%total = seconds_since(started)
   end subroutine solve_modes

   ! Iterates until there are the modes that were asked for. Ritz values near
   ! zero cannot be told apart while they iterate: where they make fewer modes
   ! than they seemed to, more are asked for.
   subroutine find_modes(problem, presolved, plan, transform, options, result, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> Whether the transform is that of the problem that a plan reduced.
      logical, intent(in) :: presolved
      type(presolve_type), intent(in) :: plan
      class(transform_type), target, intent(inout) :: transform
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      integer :: asked, missing, most
      real(wp) :: reach

      most = 2*problem%unknowns()
      asked = min(options%modes, most)
      do
         call iterate(transform, options, asked, pairs, reach, statistics, result, error, monitor)
         if (allocated(error)) return
         if (presolved) call undo_presolve(problem, plan, pairs)
         call select_modes(problem, options, pairs, abs(result%shift), reach, result)
         missing = options%modes - size(result%eigenvalues)
         if (missing == 0 .or. asked == most .or. statistics%reason /= reason_converged) exit
         asked = min(asked + max(missing, asked/4), most)
      end do
      result%reason = statistics%reason
      if (missing == 0) then
         result%reason = reason_converged
      else if (result%reason == reason_converged) then
         result%reason = reason_fewer_modes
      end if
      result%locking_error = statistics%locking_error
      result%history = statistics%history
   end subroutine find_modes

   ! Left vectors are conjugated modes of the transposed problem: the modes
   ! themselves where the problem is symmetric.
   subroutine find_left_modes(problem, work, presolved, plan, transform, options, result, error, monitor)
      type(modal_problem_type), target, intent(in) :: problem, work
      logical, intent(in) :: presolved
      type(presolve_type), intent(in) :: plan
      class(transform_type), target, intent(in) :: transform
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(modal_problem_type), target :: transposed, transposed_work
      class(transform_type), allocatable :: adjoint
      type(modal_result_type) :: left
      logical :: own_factors

      if (problem%symmetric) then
         call set_left_modes(problem, problem, modes_of(result), .false., result, error)
         return
      end if
      call transpose_problem(problem, transposed, error)
      if (.not. allocated(error)) call transpose_problem(work, transposed_work, error)
      if (.not. allocated(error)) &
         call new_transposed_transform(adjoint, transposed_work, transform, result%shift, own_factors, error)
      if (allocated(error)) return
      left%shift = result%shift
      call find_modes(transposed, presolved, plan, adjoint, options, left, error, monitor)
      if (allocated(error)) return
      call set_left_modes(problem, transposed, modes_of(left), left%reason /= reason_cancelled, result, error)
      call account(adjoint%linear_solver(), result)
      if (own_factors) result%factorizations = result%factorizations + 1
      result%operator_applications = result%operator_applications + left%operator_applications
      result%restarts = result%restarts + left%restarts
      result%seconds%orthogonalize = result%seconds%orthogonalize + left%seconds%orthogonalize
   end subroutine find_left_modes

   function modes_of(result) result(pairs)
      type(modal_result_type), intent(in) :: result
      type(eigenpairs_type) :: pairs

      allocate (pairs%lambda, source=result%eigenvalues)
      allocate (pairs%phi, source=result%eigenvectors)
      allocate (pairs%xi, source=result%multipliers)
   end function modes_of

   subroutine check_options(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: largest = 1.0e100_wp

      if (options%modes < 1) then
         call new_error(error, error_usage, "the number of modes must be at least 1")
      else if (.not. (options%tolerance > 0 .and. options%tolerance < 1)) then
         call new_error(error, error_usage, "the tolerance must lie between 0 and 1")
      else if (.not. abs(options%target) <= largest) then
         call new_error(error, error_usage, "the target must be a number below 1e100")
      else if (options%subspace < 0) then
         call new_error(error, error_usage, "the subspace dimension must not be negative")
      else if (options%max_restarts < 1) then
         call new_error(error, error_usage, "the number of restarts must be at least 1")
      else if (options%formulation < 0 .or. options%formulation > ubound(formulation_names, 1)) then
         call new_error(error, error_usage, "there is no such formulation")
      else if (options%constraint_scaling < 0 .or. options%constraint_scaling > ubound(scaling_names, 1)) then
         call new_error(error, error_usage, "there is no such constraint scaling")
      else if (allocated(options%shift)) then
         if (.not. abs(options%shift) <= largest) &
            call new_error(error, error_usage, "the shift must be a number below 1e100")
      end if
   end subroutine check_options

   ! Where the constraints leave no motion.
   subroutine no_modes(problem, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: none

      allocate (none%lambda(0), none%phi(problem%unknowns(), 0), none%xi(problem%multipliers(), 0))
      call select_modes(problem, result%options, none, 0.0_wp, 0.0_wp, result)
      allocate (result%history%converged(0), result%history%operator_applications(0), result%history%residual(0))
      result%reason = reason_fewer_modes
      if (result%options%left) call set_left_modes(problem, problem, none, .false., result, error)
   end subroutine no_modes

   ! Shapes and multipliers of the problem as given.
   subroutine undo_presolve(problem, plan, pairs)
      type(modal_problem_type), intent(in) :: problem
      type(presolve_type), intent(in) :: plan
      type(eigenpairs_type), intent(inout) :: pairs
      complex(wp), allocatable :: phi(:, :), xi(:, :)

      allocate (phi, source=plan%expand_shapes(pairs%phi))
      allocate (xi(problem%multipliers(), size(pairs%lambda)))
      call plan%expand_multipliers(problem, pairs%lambda, phi, pairs%xi, xi)
      call move_alloc(phi, pairs%phi)
      call move_alloc(xi, pairs%xi)
   end subroutine undo_presolve

   ! Runs the iteration and purifies what it found by one more application,
   ! which removes what is left of infinite eigenvalues.
   subroutine iterate(transform, options, asked, pairs, reach, statistics, result, error, monitor)
      class(transform_type), target, intent(inout) :: transform
      type(modal_options_type), intent(in) :: options
      integer, intent(in) :: asked
      type(eigenpairs_type), intent(out) :: pairs
      !> All eigenvalues nearer to the target than this are among the pairs.
      real(wp), intent(out) :: reach
      type(krylov_statistics_type), intent(out) :: statistics
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(modal_selection_type) :: selection
      type(krylov_options_type) :: krylov
      complex(wp), allocatable :: mu(:), vectors(:, :), phi(:, :), xi(:, :)
      complex(wp) :: roots(2)
      integer, allocatable :: of(:)
      integer :: values, j

      selection = modal_selection_type(asked, transform%map, transform%shift, options%target)
      values = merge(1, 2, transform%map%oscillator)*asked
      krylov%subspace = options%subspace
      if (krylov%subspace == 0) krylov%subspace = max(2*values, values + 20)
      krylov%subspace = max(krylov%subspace, values + 2)
      krylov%tolerance = options%tolerance
      krylov%max_restarts = options%max_restarts
      krylov%seed = options%seed
      call transform%iterate(selection, krylov, mu, vectors, statistics, error, monitor)
      if (.not. allocated(error)) call transform%recover(mu, vectors, phi, xi, error)
      if (allocated(error)) return

      allocate (pairs%lambda(0), of(0))
      reach = huge(1.0_wp)
      if (statistics%reason == reason_converged) reach = 0
      do j = 1, size(mu)
         reach = max(reach, selection%key(mu(j)))
         roots = transform%map%lambdas(transform%theta(mu(j)))
         pairs%lambda = [pairs%lambda, roots(1)]
         of = [of, j]
         if (.not. transform%map%oscillator) cycle
         pairs%lambda = [pairs%lambda, roots(2)]
         of = [of, j]
      end do
      allocate (pairs%phi(size(phi, 1), size(of)), source=phi(:, of))
      allocate (pairs%xi(size(xi, 1), size(of)), source=xi(:, of))
      do j = 1, size(of)
         pairs%xi(:, j) = transform%map%reaction(pairs%lambda(j))*pairs%xi(:, j)
      end do
      result%restarts = result%restarts + statistics%restarts
      result%operator_applications = result%operator_applications + statistics%operator_applications + size(mu)
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
   end subroutine iterate

end module kschur_solver
