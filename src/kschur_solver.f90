!> The modes of a problem: chooses formulation and shift, runs the
!> Krylov-Schur method, turns Ritz pairs into modes.
module kschur_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_input, error_singular, error_usage
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type, real_linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_modes, only: eigenpairs_type, select_modes
   use kschur_monitor, only: monitor_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_options, only: modal_options_type, formulation_auto, formulation_damped, &
      formulation_damped_constrained, formulation_names, formulation_proportional, formulation_quadratic, &
      formulation_symmetric, formulation_undamped, &
      formulation_undamped_constrained, &
      scaling_names
   use kschur_pencil, only: check_fit
   use kschur_pencil_transform, only: pencil_transform_type, new_pencil_transform
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type, damping_none, damping_general
   use kschur_quadratic_transform_complex, only: complex_quadratic_type => quadratic_transform_type, &
      new_complex_quadratic => new_quadratic_transform
   use kschur_quadratic_transform_real, only: real_quadratic_type => quadratic_transform_type, &
      new_real_quadratic => new_quadratic_transform
   use kschur_result, only: modal_result_type, reason_converged, reason_fewer_modes
   use kschur_scaling, only: constraint_factors
   use kschur_symmetric_transform, only: symmetric_transform_type, new_symmetric_transform, mass_is_semidefinite
   use kschur_transform, only: transform_type
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
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iteration and may end it.
      class(monitor_type), intent(inout), optional :: monitor
      class(transform_type), allocatable :: transform
      type(modal_problem_type), target :: work
      type(presolve_type) :: plan
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      logical :: presolved
      class(linear_solver_type), pointer :: solver
      integer :: asked, missing, most
      real(wp) :: reach
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
      call choose_formulation(problem, options, result, error)
      if (allocated(error)) return
      presolved = options%presolve .and. is_structured(result%formulation)
      if (presolved) then
         call presolve(problem, work, plan, error)
         if (allocated(error) .and. plan%unknowns_after == 0) then
            deallocate (error)
            call no_modes(problem, result)
            return
         end if
         if (allocated(error)) return
      else
         work = problem
      end if

      call place_shift(work, options, transform, result, error)
      if (allocated(error)) return
      ! Ritz values near zero cannot be told apart while they iterate: where
      ! they make fewer modes than they seemed to, more are asked for.
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
      result%factored_order = transform%order()
      solver => transform%linear_solver()
      result%factor_entries = solver%factor_entries
      call account(transform%linear_solver(), result)
      result%seconds%total = seconds_since(started)
   end subroutine solve_modes

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

   !> The smallest formulation that is exact for a problem with a mass matrix
   !> that has no negative eigenvalue: one of `formulation_*`.
   pure integer function smallest_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      if (problem%symmetric .and. problem%damping_kind == damping_none) then
         formulation = formulation_symmetric
      else if (problem%symmetric .and. problem%damping_kind /= damping_general) then
         formulation = formulation_proportional
      else
         formulation = general_formulation(problem)
      end if
   end function smallest_formulation

   pure integer function general_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      formulation = formulation_quadratic
      if (problem%damping_kind == damping_none) &
         formulation = merge(formulation_undamped_constrained, formulation_undamped, problem%multipliers() > 0)
   end function general_formulation

   pure logical function is_structured(formulation)
      integer, intent(in) :: formulation

      is_structured = any(formulation == [formulation_quadratic, formulation_symmetric, formulation_proportional])
   end function is_structured

   ! The formulation that was asked for, if it fits, or the smallest one.
   subroutine choose_formulation(problem, options, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(mumps_real_type) :: solver
      character(len=:), allocatable :: name
      logical :: semidefinite

      result%formulation = options%formulation
      if (options%formulation == formulation_auto) result%formulation = smallest_formulation(problem)
      if (.not. is_structured(result%formulation)) then
         call check_fit(problem, result%formulation, error)
         return
      end if
      if (result%formulation == formulation_quadratic) return
      name = "the formulation "//trim(formulation_names(result%formulation))//" does not fit the problem: "
      if (.not. problem%symmetric) then
         call new_error(error, error_usage, name//"its matrices are not symmetric")
      else if (result%formulation == formulation_symmetric .and. problem%damping_kind /= damping_none) then
         call new_error(error, error_usage, name//"it has damping")
      else if (problem%damping_kind == damping_general) then
         call new_error(error, error_usage, name//"its damping is not proportional")
      end if
      if (allocated(error)) return
      call mass_is_semidefinite(problem, solver, semidefinite, error)
      if (allocated(error)) return
      if (semidefinite) return
      if (options%formulation == formulation_auto) then
         result%formulation = general_formulation(problem)
      else
         call new_error(error, error_usage, name//"its mass matrix has negative eigenvalues")
      end if
   end subroutine choose_formulation

   ! Where the constraints leave no motion.
   subroutine no_modes(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      type(eigenpairs_type) :: none

      allocate (none%lambda(0), none%phi(problem%unknowns(), 0), none%xi(problem%multipliers(), 0))
      call select_modes(problem, result%options, none, 0.0_wp, 0.0_wp, result)
      allocate (result%history%converged(0), result%history%operator_applications(0), result%history%residual(0))
      result%reason = reason_fewer_modes
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

   ! Factors at the shift that was given, next to a target, or, where that is
   ! small, at the scale of the lowest modes.
   subroutine place_shift(problem, options, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: scale

      if (allocated(options%shift)) then
         call factor_at(problem, options, options%shift, transform, result, error)
      else if (abs(options%target) > first_scale(problem)) then
         call factor_near_target(problem, options, transform, result, error)
      else
         call factor_at_scale(problem, options, transform, scale, result, error)
         if (allocated(error)) return
         if (abs(options%target) <= scale) return
         call account(transform%linear_solver(), result)
         call factor_near_target(problem, options, transform, result, error)
      end if
   end subroutine place_shift

   ! To the right of the target, where a stable system has no eigenvalue.
   subroutine factor_near_target(problem, options, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: off_axis(3) = [0.01_wp, 0.03_wp, 0.1_wp]
      integer :: attempt

      do attempt = 1, size(off_axis)
         call factor_at(problem, options, options%target + off_axis(attempt)*abs(options%target), transform, &
            result, error)
         if (.not. allocated(error)) return
         if (error%code /= error_singular) return
      end do
   end subroutine factor_near_target

   ! At the scale of the lowest modes, found by trial.
   subroutine factor_at_scale(problem, options, transform, scale, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      class(transform_type), allocatable, intent(out) :: transform
      !> The shift (1/s).
      real(wp), intent(out) :: scale
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: previous, proposed
      integer :: attempt

      scale = first_scale(problem)
      previous = scale
      do attempt = 1, shift_attempts
         call factor_at(problem, options, cmplx(scale, 0, wp), transform, result, error)
         if (allocated(error) .and. attempt > 1) then
            scale = previous
            call factor_at(problem, options, cmplx(scale, 0, wp), transform, result, error)
            return
         end if
         if (allocated(error) .or. attempt == shift_attempts) return
         call propose_scale(transform, options, result, proposed, error)
         if (allocated(error) .or. .not. proposed > 0) return
         if (proposed >= scale/close_enough .and. proposed <= scale*close_enough) return
         call account(transform%linear_solver(), result)
         previous = scale
         scale = proposed
      end do
   end subroutine factor_at_scale

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

   subroutine factor_at(problem, options, shift, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      complex(wp), intent(in) :: shift
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      class(real_linear_solver_type), allocatable :: real_solver
      type(pencil_transform_type), allocatable :: pencil
      type(complex_quadratic_type), allocatable :: quadratic
      type(real_quadratic_type), allocatable :: real_quadratic
      type(symmetric_transform_type), allocatable :: symmetric
      real(wp) :: factors(problem%multipliers()), unit

      result%shift = shift
      factors = constraint_factors(problem, options%constraint_scaling, shift)
      unit = scale(1.0_wp, exponent(max(abs(shift), first_scale(problem))))
      allocate (mumps_complex_type :: solver)
      allocate (mumps_real_type :: real_solver)
      if (any(result%formulation == [formulation_symmetric, formulation_proportional])) then
         allocate (symmetric)
         call new_symmetric_transform(symmetric, problem, factors, shift, real_solver, error)
         call move_alloc(symmetric, transform)
      else if (result%formulation /= formulation_quadratic) then
         allocate (pencil)
         call new_pencil_transform(pencil, problem, result%formulation, factors, unit, shift, solver, error)
         call move_alloc(pencil, transform)
      else if (abs(aimag(shift)) > 0) then
         allocate (quadratic)
         call new_complex_quadratic(quadratic, problem, factors, unit, shift, solver, error)
         call move_alloc(quadratic, transform)
      else
         allocate (real_quadratic)
         call new_real_quadratic(real_quadratic, problem, factors, unit, real(shift, wp), real_solver, error)
         call move_alloc(real_quadratic, transform)
      end if
      if (allocated(error)) return
      result%factorizations = result%factorizations + 1
   end subroutine factor_at

   ! Where the shift had better be, from a few steps at the shift that is; zero
   ! where they do not tell.
   subroutine propose_scale(transform, options, result, proposed, error)
      class(transform_type), target, intent(inout) :: transform
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      real(wp), intent(out) :: proposed
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 30
      real(wp), parameter :: roughly = 0.1_wp
      ! Beyond these, relative to the shift, a zero or an infinite eigenvalue may be blurred by rounding.
      real(wp), parameter :: too_near = 1.0e-4_wp, too_far = 1.0e3_wp
      type(modal_selection_type) :: selection
      type(krylov_statistics_type) :: statistics
      complex(wp), allocatable :: mu(:), vectors(:, :)
      real(wp) :: magnitude
      integer :: i

      proposed = 0
      selection = modal_selection_type(options%modes, transform%map, transform%shift, options%target)
      call transform%iterate(selection, krylov_options_type(subspace=steps, tolerance=roughly, &
         max_restarts=1, seed=options%seed, verify=.false.), mu, vectors, statistics, error)
      if (allocated(error)) return
      result%operator_applications = result%operator_applications + statistics%operator_applications
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
      do i = 1, size(mu)
         magnitude = maxval(abs(transform%map%lambdas(transform%theta(mu(i)))))
         if (magnitude < too_near*abs(result%shift) .or. magnitude > too_far*abs(result%shift)) cycle
         proposed = max(proposed, shift_level*magnitude)
      end do
   end subroutine propose_scale

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

   subroutine account(solver, result)
      class(linear_solver_type), intent(in) :: solver
      type(modal_result_type), intent(inout) :: result

      result%seconds%analyze = result%seconds%analyze + solver%analyze_seconds
      result%seconds%factorize = result%seconds%factorize + solver%factorize_seconds
      result%seconds%solve = result%seconds%solve + solver%solve_seconds
   end subroutine account
end module kschur_solver
