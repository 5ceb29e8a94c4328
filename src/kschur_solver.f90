!> The modes of a problem: chooses formulation and shift, runs the
!> Krylov-Schur method, turns Ritz pairs into modes.
module kschur_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp, long
   use kschur_krylov_complex, only: krylov_schur
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_modes, only: eigenpairs_type, select_modes
   use kschur_monitor, only: monitor_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_options, only: modal_options_type, formulation_auto, formulation_damped, &
      formulation_damped_constrained, formulation_names, formulation_undamped, formulation_undamped_constrained, &
      scaling_names
   use kschur_pencil, only: pencil_type, new_pencil, shift_invert_type, new_shift_invert
   use kschur_problem, only: modal_problem_type, damping_none
   use kschur_result, only: modal_result_type, reason_converged
   use kschur_scaling, only: constraint_factors
   implicit none
   private
   public :: solve_modes, smallest_formulation

   ! Where no shift is given it lies at this part of the largest wanted |lambda|.
   real(wp), parameter :: shift_level = 0.25_wp
   ! A shift within this factor of that place is left where it is.
   real(wp), parameter :: close_enough = 4
   integer, parameter :: shift_attempts = 5

contains

   !> Computes the modes nearest to a target. What converged is in `result`
   !> even where it is less than was asked for: then `result%reason` says why.
   !> Fails on options that do not fit the problem, on a shift that is an
   !> eigenvalue, and where memory or a library fails.
   subroutine solve_modes(problem, options, result, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iteration and may end it.
      class(monitor_type), intent(inout), optional :: monitor
      type(shift_invert_type) :: operator
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      integer :: asked, missing
      integer(long) :: started

      started = clock()
      call check_options(options, error)
      if (allocated(error)) return
      result%method = "krylov-schur"
      result%formulation = options%formulation
      if (result%formulation == formulation_auto) result%formulation = smallest_formulation(problem)
      result%modes_asked = options%modes
      result%unknowns = problem%unknowns()
      result%constraints = problem%multipliers()
      result%damping_kind = problem%damping_kind
      result%symmetric = problem%symmetric
      result%target = options%target

      call place_shift(problem, options, operator, result, error)
      if (allocated(error)) return
      ! Ritz values near zero cannot be told apart while they iterate: where
      ! they make fewer modes than they seemed to, more are asked for.
      asked = options%modes
      do
         call iterate(operator, options, asked, pairs, statistics, result, error, monitor)
         if (allocated(error)) return
         call select_modes(problem, options, pairs, abs(result%shift), result)
         missing = options%modes - size(result%eigenvalues)
         if (missing == 0 .or. statistics%reason /= reason_converged) exit
         asked = asked + max(missing, options%modes/4)
      end do
      result%reason = statistics%reason
      result%locking_error = statistics%locking_error
      result%history = statistics%history
      result%factored_order = operator%order()
      result%factor_entries = operator%solver%factor_entries
      call account(operator%solver, result)
      result%seconds%total = seconds_since(started)
   end subroutine solve_modes

   subroutine check_options(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (options%modes < 1) then
         call new_error(error, error_usage, "the number of modes must be at least 1")
      else if (.not. (options%tolerance > 0 .and. options%tolerance < 1)) then
         call new_error(error, error_usage, "the tolerance must lie between 0 and 1")
      else if (options%subspace < 0) then
         call new_error(error, error_usage, "the subspace dimension must not be negative")
      else if (options%max_restarts < 1) then
         call new_error(error, error_usage, "the number of restarts must be at least 1")
      else if (options%formulation < 0 .or. options%formulation > ubound(formulation_names, 1)) then
         call new_error(error, error_usage, "there is no such formulation")
      else if (options%constraint_scaling < 0 .or. options%constraint_scaling > ubound(scaling_names, 1)) then
         call new_error(error, error_usage, "there is no such constraint scaling")
      end if
   end subroutine check_options

   !> The smallest pencil that is exact for a problem: one of `formulation_*`.
   pure integer function smallest_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      if (problem%damping_kind == damping_none) then
         formulation = merge(formulation_undamped_constrained, formulation_undamped, problem%multipliers() > 0)
      else
         formulation = merge(formulation_damped_constrained, formulation_damped, problem%multipliers() > 0)
      end if
   end function smallest_formulation

   ! Factors at the shift that was given, next to a target that is not zero,
   ! or at the scale of the lowest modes, found by trial.
   subroutine place_shift(problem, options, operator, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(shift_invert_type), intent(out) :: operator
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: off_axis = 0.01_wp
      real(wp) :: scale, proposed
      integer :: attempt

      if (allocated(options%shift)) then
         call factor_at(problem, options, options%shift, operator, result, error)
      else if (abs(options%target) > 0) then
         ! To the right of the target, where a stable system has no eigenvalue.
         call factor_at(problem, options, options%target + off_axis*abs(options%target), operator, result, error)
      else
         scale = first_scale(problem)
         do attempt = 1, shift_attempts
            call factor_at(problem, options, cmplx(scale, 0, wp), operator, result, error)
            if (allocated(error)) return
            if (attempt == shift_attempts) exit
            call propose_scale(operator, options, result, proposed, error)
            if (allocated(error)) return
            if (proposed >= scale/close_enough .and. proposed <= scale*close_enough) exit
            if (.not. proposed > 0) exit
            call account(operator%solver, result)
            scale = proposed
         end do
      end if
   end subroutine place_shift

   ! A frequency that the matrices suggest (1/s): far above the lowest modes of
   ! a fine mesh, but of their units.
   real(wp) function first_scale(problem)
      type(modal_problem_type), intent(in) :: problem
      real(wp), parameter :: below_the_highest = 1.0e-3_wp
      real(wp) :: mass, damping, stiffness

      mass = problem%mass%infinity_norm()
      damping = problem%damping%infinity_norm()
      stiffness = problem%stiffness%infinity_norm()
      first_scale = below_the_highest*max(sqrt(stiffness/mass), damping/mass)
      if (stiffness > 0) first_scale = below_the_highest*sqrt(stiffness/mass)
      if (.not. first_scale > 0) first_scale = 1
   end function first_scale

   subroutine factor_at(problem, options, shift, operator, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      complex(wp), intent(in) :: shift
      type(shift_invert_type), intent(out) :: operator
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(pencil_type) :: pencil
      class(complex_linear_solver_type), allocatable :: solver

      call new_pencil(pencil, problem, result%formulation, &
         constraint_factors(problem, options%constraint_scaling, shift), &
         scale(1.0_wp, exponent(max(abs(shift), first_scale(problem)))), error)
      if (allocated(error)) return
      allocate (mumps_complex_type :: solver)
      result%shift = shift
      call new_shift_invert(operator, pencil, pencil%theta(shift), solver, error)
      if (allocated(error)) return
      result%factorizations = result%factorizations + 1
   end subroutine factor_at

   ! Where the shift had better be, from a few steps at the shift that is; zero
   ! where they do not tell.
   subroutine propose_scale(operator, options, result, proposed, error)
      type(shift_invert_type), target, intent(inout) :: operator
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      real(wp), intent(out) :: proposed
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 30
      real(wp), parameter :: roughly = 0.1_wp
      ! Beyond these, relative to the shift, a zero or an infinite eigenvalue may be blurred by rounding.
      real(wp), parameter :: too_near = 1.0e-6_wp, too_far = 1.0e3_wp
      type(modal_selection_type) :: selection
      type(krylov_statistics_type) :: statistics
      complex(wp), allocatable :: mu(:), vectors(:, :)
      real(wp) :: magnitude
      integer :: i

      proposed = 0
      selection = modal_selection_type(options%modes, operator%pencil, operator%shift, options%target)
      call krylov_schur(operator, selection, krylov_options_type(subspace=steps, tolerance=roughly, &
         max_restarts=1, seed=options%seed), mu, vectors, statistics, error)
      if (allocated(error)) return
      result%operator_applications = result%operator_applications + statistics%operator_applications
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
      do i = 1, size(mu)
         magnitude = abs(operator%pencil%lambda(operator%theta(mu(i))))
         if (magnitude < too_near*abs(result%shift) .or. magnitude > too_far*abs(result%shift)) cycle
         proposed = max(proposed, shift_level*magnitude)
      end do
   end subroutine propose_scale

   ! Runs the iteration and purifies what it found by one more application,
   ! which removes what is left of infinite eigenvalues.
   subroutine iterate(operator, options, asked, pairs, statistics, result, error, monitor)
      type(shift_invert_type), target, intent(inout) :: operator
      type(modal_options_type), intent(in) :: options
      integer, intent(in) :: asked
      type(eigenpairs_type), intent(out) :: pairs
      type(krylov_statistics_type), intent(out) :: statistics
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(modal_selection_type) :: selection
      type(krylov_options_type) :: krylov
      complex(wp), allocatable :: mu(:), vectors(:, :), purified(:, :)
      integer :: values, j

      selection = modal_selection_type(asked, operator%pencil, operator%shift, options%target)
      values = merge(2, 1, operator%pencil%is_damped())*asked
      krylov%subspace = options%subspace
      if (krylov%subspace == 0) krylov%subspace = max(2*values, values + 20)
      krylov%subspace = max(krylov%subspace, values + 2)
      krylov%tolerance = options%tolerance
      krylov%max_restarts = options%max_restarts
      krylov%seed = options%seed
      call krylov_schur(operator, selection, krylov, mu, vectors, statistics, error, monitor)
      if (allocated(error)) return

      allocate (purified(size(vectors, 1), size(vectors, 2)))
      call operator%apply(vectors, purified, error)
      if (allocated(error)) return
      allocate (pairs%lambda(size(mu)))
      do j = 1, size(mu)
         purified(:, j) = purified(:, j)/norm2(abs(purified(:, j)))
         pairs%lambda(j) = operator%pencil%lambda(operator%theta(mu(j)))
      end do
      call operator%pencil%split(purified, pairs%lambda, pairs%phi, pairs%xi)
      if (.not. operator%pencil%is_damped()) call add_negatives(pairs)
      result%restarts = result%restarts + statistics%restarts
      result%operator_applications = result%operator_applications + statistics%operator_applications + size(mu)
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
   end subroutine iterate

   ! Where lambda^2 was computed, -lambda is an eigenvalue with the same shape.
   subroutine add_negatives(pairs)
      type(eigenpairs_type), intent(inout) :: pairs
      integer :: k, j
      integer, allocatable :: twice(:)

      k = size(pairs%lambda)
      allocate (twice(2*k), source=[(j, j=1, k), (j, j=1, k)])
      pairs%lambda = [pairs%lambda, -pairs%lambda]
      pairs%phi = pairs%phi(:, twice)
      pairs%xi = pairs%xi(:, twice)
   end subroutine add_negatives

   subroutine account(solver, result)
      class(complex_linear_solver_type), intent(in) :: solver
      type(modal_result_type), intent(inout) :: result

      result%seconds%analyze = result%seconds%analyze + solver%analyze_seconds
      result%seconds%factorize = result%seconds%factorize + solver%factorize_seconds
      result%seconds%solve = result%seconds%solve + solver%solve_seconds
   end subroutine account
end module kschur_solver
