!> The modes of a problem: chooses formulation and shift, runs the
!> Krylov-Schur method or ARPACK, turns Ritz pairs into modes.
module kschur_solver
   use kschur_balance, only: balance
   use kschur_certificate, only: certificate_type, same_distance
   use kschur_certify, only: certify_modes
   use kschur_clock, only: clock, seconds_since
   use kschur_deflation, only: deflation_type
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: count_eigenvalues, eigenvalue_count_type
   use kschur_error, only: error_type, error_singular
   use kschur_formulation, only: choose_formulation, is_structured
   use kschur_inner_solvers, only: choose_inner_solvers, inner_solvers_type
   use kschur_iteration, only: iterate
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_left, only: set_left_modes
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_method, only: check_options, method_name, settings_of
   use kschur_backward_error, only: backward_errors
   use kschur_modes, only: drop_inaccurate, drop_modes, drop_spurious, highest, orthonormalize_zeros, replace_modes, &
      select_modes
   use kschur_monitor, only: monitor_type
   use kschur_notes, only: note_inaccurate, note_modes, note_problem, note_redundant
   use kschur_options, only: modal_options_type
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_refine, only: confirm, refine
   use kschur_result, only: modal_result_type, certified_unknown, certified_yes, reason_cancelled, &
      reason_converged, reason_fewer_modes, reason_inaccurate, inaccurate_above
   use kschur_rigid_modes, only: find_rigid
   use kschur_scaling, only: constraint_factors
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   use kschur_shift, only: factor_beside, place_shift
   use kschur_text, only: text
   use kschur_tolerances, only: same_value
   use kschur_transform, only: transform_type
   use kschur_transposed, only: new_transposed_transform, transpose_problem
   implicit none
   private
   public :: solve_modes, modes_of, undo_presolve

   ! Units that are further apart than this hide errors.
   real(wp), parameter :: uneven = 1.0e6_wp

contains

   !> Computes the modes nearest to a target. What converged is in `result`
   !> even where it is less than was asked for: then `result%reason` says why.
   !> What else a user must know is in `result%notes`. Fails on options that do not fit
   !> the problem, on a problem that is singular for every lambda, and where memory or a library fails.
   subroutine solve_modes(problem, options, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iteration and may end it.
      class(monitor_type), intent(inout), optional :: monitor
      !> Linear solvers of the caller's own; `options%inner` is `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(inner_solvers_type) :: inner
      class(transform_type), allocatable, target :: transform
      type(modal_options_type) :: settings
      type(modal_problem_type), target :: work
      type(presolve_type) :: plan
      type(deflation_type), target :: deflation
      type(scaled_stiffness_type), allocatable :: stiffness
      type(eigenpairs_type) :: rigid
      type(eigenvalue_count_type) :: total
      class(linear_solver_type), pointer :: solver
      integer(long) :: started

      started = clock()
      call check_options(options, error)
      if (.not. allocated(error)) call choose_inner_solvers(options, inner, error, solvers)
      if (allocated(error)) return
      settings = settings_of(options)
      result%options = options
      result%method = method_name(options)
      result%inner = "none: nothing was factored"
      result%modes_asked = options%modes
      result%unknowns = problem%unknowns()
      result%constraints = problem%multipliers()
      result%damping_kind = problem%damping_kind
      result%symmetric = problem%symmetric
      result%target = options%target
      allocate (result%notes(0))
      call choose_formulation(problem, settings%formulation, result%formulation, result%decision, error, inner)
      if (allocated(error)) return
      if (settings%formulation /= options%formulation) result%decision = "it is the one that plain ARPACK iterates"
      ! The pencils of Table 1 keep all unknowns, those of plain ARPACK as they are.
      call presolve(problem, work, plan, error, eliminating=settings%presolve .and. is_structured(result%formulation))
      if (plan%unknowns_after == 0) then
         call note_redundant(plan%redundant, result)
         call no_modes(problem, inner, result, error)
         return
      end if
      if (allocated(error)) return
      if (.not. settings%is_plain()) call balance(work, plan)

      call note_problem(work, plan, result, error)
      if (.not. allocated(error)) call find_rigid(work, result%formulation, .not. settings%is_plain(), &
         result%redundant_constraints, inner, deflation, rigid, result%effort_type, error, stiffness, options%modes)
      if (allocated(error)) return
      call undo_presolve(problem, plan, rigid)
      total = count_eigenvalues(work, deflation, result%redundant_constraints - plan%redundant, size(rigid%lambda))
      if (options%modes > total%number .and. .not. settings%is_plain()) then
         call result%add_note("of "//text(options%modes)//" modes there are "//text(total%number)// &
            " at most: so many eigenvalues the problem has, both of a conjugate pair counted")
         if (present(monitor)) call monitor%announce("the problem has "//text(total%number)// &
            " eigenvalues, both of a conjugate pair counted: no more modes are looked for")
      end if
      if (total%number == size(rigid%lambda) .and. .not. settings%is_plain()) then
         call only_rigid(problem, rigid, inner, result, error)
         call result%set_total(seconds_since(started))
         return
      end if
      call place_shift(work, stiffness, size(rigid%lambda) > 0, deflation, settings, inner, transform, result, error)
      if (allocated(error)) return
      call find_modes(problem, work, plan, deflation, rigid, total, transform, settings, inner, result, error, monitor)
      if (.not. allocated(error) .and. options%certify) &
         call certify_modes(work, inner%complex, deflation%zeros(), result)
      if (.not. allocated(error) .and. options%left) &
         call find_left_modes(problem, work, plan, size(rigid%lambda) > 0, total, transform, settings, inner, result, error, &
         monitor)
      if (.not. allocated(error)) call note_modes(problem, result, error)
      if (allocated(error)) return
      result%factored_order = transform%order()
      solver => transform%linear_solver()
      result%factor_entries = solver%factor_entries
      result%inner = trim(solver%description)
      call result%add_solver(transform%linear_solver())
      call result%set_total(seconds_since(started))
   end subroutine solve_modes

   ! Iterates until there are the modes that were asked for. Ritz values near
   ! zero cannot be told apart while they iterate: where they make fewer modes
   ! than they seemed to, more are asked for, as long as that helps. What the degree of the determinant says to be
   ! missing is looked for at other shifts.
   subroutine find_modes(problem, work, plan, deflation, rigid, total, transform, options, inner, result, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> What the plan left of it.
      type(modal_problem_type), target, intent(in) :: work
      type(presolve_type), intent(in) :: plan
      !> What the transform leaves out of the iteration, and all rigid motions, of the problem.
      type(deflation_type), target, intent(in) :: deflation
      type(eigenpairs_type), intent(inout) :: rigid
      type(eigenvalue_count_type), intent(in) :: total
      class(transform_type), allocatable, target, intent(inout) :: transform
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      integer, parameter :: rounds = 5
      ! Wanted eigenvalues of this part of the shift all look alike from there.
      real(wp), parameter :: much_smaller = 1.0e-2_wp
      integer :: asked, missing, before, round, places, inaccurate, found, lost
      ! Whether the iteration came to infinite eigenvalues; whether it is certain that there are no more modes.
      logical :: beyond, complete
      real(wp) :: reach, largest

      call orthonormalize_zeros(rigid)
      asked = min(options%modes, total%number)
      before = options%modes + 1
      places = 0
      round = 1
      do
         call iterate(transform, options, deflation%eigenvalues(), asked, pairs, reach, statistics, result, error, monitor)
         if (allocated(error)) return
         largest = size_of_most(pairs%lambda, much_smaller*min(abs(options%target), abs(result%shift)))
         if (.not. allocated(options%shift) .and. largest > 0 .and. places < rounds) then
            places = places + 1
            call result%add_solver(transform%linear_solver())
            call factor_beside(work, deflation, options, inner, 2*largest*options%target/abs(options%target), transform, &
               result, error)
            if (allocated(error)) return
            cycle
         end if
         if (plan%spread_of_units() > uneven) call save_hidden(work, options, inner, pairs, result, error)
         if (allocated(error)) return
         call undo_presolve(problem, plan, pairs, rigid)
         call select_modes(problem, options, total%number, pairs, size(rigid%lambda), abs(result%shift), reach, result, &
            inaccurate, beyond, found)
         if (.not. options%is_plain()) call drop_unfounded(problem, work, plan, options, inner, &
            may_be_anything(result, deflation), result, found, error)
         if (allocated(error)) return
         complete = statistics%reason == reason_fewer_modes .or. beyond .or. asked == total%number
         missing = options%modes - size(result%eigenvalues)
         if (missing == 0 .or. missing >= before .or. asked == total%number .or. statistics%reason /= reason_converged &
            .or. options%is_plain() .or. round == rounds) exit
         round = round + 1
         before = missing
         asked = min(asked + max(missing, asked/4), total%number)
      end do
      if (.not. options%is_plain()) call mend(problem, work, plan, deflation, options, inner, result, found, error)
      if (allocated(error)) return
      missing = options%modes - size(result%eigenvalues)
      if (missing > 0 .and. total%exact .and. .not. options%is_plain()) then
         ! What refinement could not mend may be infinite.
         call drop_inaccurate(problem, inaccurate_above, result, lost)
         found = found - lost
         missing = options%modes - size(result%eigenvalues)
      end if
      if (missing > 0 .and. total%exact .and. complete .and. found < total%number .and. .not. options%is_plain()) then
         call search_elsewhere(problem, work, plan, deflation, options, inner, total%number, result, inaccurate, found, error, &
            monitor)
         if (allocated(error)) return
         call mend(problem, work, plan, deflation, options, inner, result, found, error)
         if (allocated(error)) return
         call drop_inaccurate(problem, inaccurate_above, result, lost)
         found = found - lost
         missing = options%modes - size(result%eigenvalues)
      end if
      result%reason = statistics%reason
      if (missing == 0) then
         result%reason = merge(reason_inaccurate, reason_converged, &
            inaccurate > 0 .or. any(result%backward_error > inaccurate_above))
      else if (any(result%reason == [reason_converged, reason_fewer_modes])) then
         if (total%exact) then
            complete = found == total%number
         else
            complete = complete .and. inaccurate == 0
         end if
         result%reason = merge(reason_fewer_modes, reason_inaccurate, complete)
         if (total%exact .and. .not. complete) call result%add_note(text(total%number)//" eigenvalues exist and "// &
            text(found)//" were found")
      end if
      call note_inaccurate(inaccurate, result)
      call certify(transform%certificate, result)
      result%locking_error = statistics%locking_error
      result%history = statistics%history
   end subroutine find_modes

   ! The largest |lambda| below a limit, if most of them are; else 0.
   pure real(wp) function size_of_most(lambda, limit)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: limit

      size_of_most = 0
      if (2*count(abs(lambda) < limit) > size(lambda)) size_of_most = maxval(abs(lambda), abs(lambda) < limit)
   end function size_of_most

   ! Errors that uneven units would hide from the judge: what is refined is no longer wrong, the rest is dropped.
   subroutine save_hidden(work, options, inner, pairs, result, error)
      type(modal_problem_type), intent(in) :: work
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(eigenpairs_type), intent(inout) :: pairs
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      complex(wp), allocatable :: before(:)
      real(wp), allocatable :: errors(:)

      allocate (errors, source=backward_errors(work, pairs))
      where (abs(pairs%lambda) > 10*highest(work)) errors = 0
      if (any(errors > inaccurate_above)) then
         allocate (solver, source=inner%complex)
         allocate (before, source=pairs%lambda)
         call refine(work, constraint_factors(work, options%constraint_scaling, result%shift), inaccurate_above, &
            solver, pairs, errors, result%factorizations, error)
         if (allocated(error)) return
         call result%add_solver(solver)
         ! It may have become one that is there.
         allocate (pairs%again(size(before)), source=abs(pairs%lambda - before) > same_value*abs(pairs%lambda))
      end if
      call drop_spurious(work, pairs)
   end subroutine save_hidden

   ! Polishes the modes, and drops those that remain inaccurate or may be anything, if they are not eigenvalues.
   subroutine mend(problem, work, plan, deflation, options, inner, result, found, error)
      type(modal_problem_type), intent(in) :: problem, work
      type(presolve_type), intent(in) :: plan
      type(deflation_type), intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues were found: less those that turned out to be others of the list, or none.
      integer, intent(inout) :: found
      type(error_type), allocatable, intent(out) :: error
      integer :: lost

      call polish(problem, work, plan, options, inner, result, lost, error)
      if (allocated(error)) return
      found = found - lost
      call drop_unfounded(problem, work, plan, options, inner, &
         may_be_anything(result, deflation) .or. result%backward_error > inaccurate_above, result, found, error)
   end subroutine mend

   ! Which modes have error bounds that let them be anything; those of rigid motions are known.
   function may_be_anything(result, deflation)
      type(modal_result_type), intent(in) :: result
      type(deflation_type), intent(in) :: deflation
      logical :: may_be_anything(size(result%eigenvalues))
      real(wp), parameter :: anything = 1.0e-2_wp
      complex(wp), allocatable :: known(:)
      integer :: i

      allocate (known, source=deflation%eigenvalues())
      may_be_anything = result%error_bound > anything*abs(result%eigenvalues)
      do i = 1, size(known)
         may_be_anything = may_be_anything .and. abs(result%eigenvalues - known(i)) > same_value*abs(known(i))
      end do
   end function may_be_anything

   ! Drops doubtful modes, if they are not eigenvalues after all.
   subroutine drop_unfounded(problem, work, plan, options, inner, doubtful, result, found, error)
      type(modal_problem_type), intent(in) :: problem, work
      type(presolve_type), intent(in) :: plan
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      logical, intent(in) :: doubtful(:)
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues were found: less those.
      integer, intent(inout) :: found
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      type(eigenpairs_type) :: pairs
      logical :: confirmed(size(doubtful))
      integer :: lost

      if (.not. any(doubtful)) return
      pairs = contracted(plan, result)
      allocate (solver, source=inner%complex)
      call confirm(work, options%constraint_scaling, solver, pairs, doubtful, confirmed, result%factorizations, error)
      if (allocated(error)) return
      call result%add_solver(solver)
      call drop_modes(problem, confirmed, result, lost)
      found = found - lost
   end subroutine drop_unfounded

   ! The modes of a result, of what the plan left of the problem.
   function contracted(plan, result) result(pairs)
      type(presolve_type), intent(in) :: plan
      type(modal_result_type), intent(in) :: result
      type(eigenpairs_type) :: pairs

      allocate (pairs%lambda, source=result%eigenvalues)
      allocate (pairs%phi(plan%unknowns_after, size(pairs%lambda)), pairs%xi(plan%constraints_after, size(pairs%lambda)))
      call plan%contract(result%eigenvectors, result%multipliers, pairs%phi, pairs%xi)
   end function contracted

   ! Adds to the modes what is found at shifts above and below all of them, until there are as many eigenvalues as
   ! the problem has: what is far from the first shift is filtered out there as infinite eigenvalues are.
   subroutine search_elsewhere(problem, work, plan, deflation, options, inner, most, result, inaccurate, found, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type), target, intent(in) :: work
      type(presolve_type), intent(in) :: plan
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: most
      type(modal_result_type), intent(inout) :: result
      integer, intent(inout) :: inaccurate, found
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      real(wp), parameter :: steps(8) = [1.0_wp, 1.0e2_wp, 1.0e-2_wp, 1.0e4_wp, 1.0e-4_wp, 1.0e6_wp, 1.0e-6_wp, 1.0e8_wp]
      class(transform_type), allocatable :: transform
      type(eigenpairs_type) :: pairs, all
      type(krylov_statistics_type) :: statistics
      real(wp) :: scale, reach
      complex(wp) :: shift
      integer :: i, k

      shift = result%shift
      scale = abs(shift)
      do i = 1, size(steps)
         if (found >= most) exit
         ! Beyond the spectrum all eigenvalues look alike.
         if (steps(i) > 1 .and. 3*steps(i)*scale > 10*highest(work)) cycle
         call factor_beside(work, deflation, options, inner, cmplx(3*steps(i)*scale, 0, wp), transform, result, error)
         if (allocated(error)) then
            if (error%code /= error_singular) return
            deallocate (error)
            cycle
         end if
         call iterate(transform, options, deflation%eigenvalues(), most, pairs, reach, statistics, result, error, monitor)
         if (allocated(error)) return
         call result%add_solver(transform%linear_solver())
         if (plan%spread_of_units() > uneven) call save_hidden(work, options, inner, pairs, result, error)
         if (allocated(error)) return
         call undo_presolve(problem, plan, pairs)
         all = modes_of(result)
         all%weights = plan%weights()
         k = size(all%lambda)
         allocate (all%paired(k), source=.false.)
         call append_pairs(all, pairs)
         all%paired(k + 1:) = pairs%paired
         if (allocated(all%again)) deallocate (all%again)
         allocate (all%again(size(all%lambda)), source=.true.)
         all%again(:k) = .false.
         call select_modes(problem, options, most, all, 0, scale, huge(1.0_wp), result, inaccurate, found=found)
         call drop_unfounded(problem, work, plan, options, inner, may_be_anything(result, deflation), &
            result, found, error)
         if (allocated(error)) return
      end do
      result%shift = shift
   end subroutine search_elsewhere

   ! Left vectors are conjugated modes of the transposed problem: the modes
   ! themselves where the problem is symmetric.
   subroutine find_left_modes(problem, work, plan, free, total, transform, options, inner, result, error, monitor)
      type(modal_problem_type), target, intent(in) :: problem, work
      type(presolve_type), intent(in) :: plan
      !> Whether there are rigid motions: there are as many from the left.
      logical, intent(in) :: free
      type(eigenvalue_count_type), intent(in) :: total
      class(transform_type), target, intent(in) :: transform
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(modal_problem_type), target :: transposed, transposed_work
      type(deflation_type), target :: deflation
      type(eigenpairs_type) :: rigid
      class(transform_type), allocatable :: adjoint
      type(modal_result_type) :: left
      logical :: own_factors

      if (problem%symmetric) then
         call set_left_modes(problem, problem, modes_of(result), .false., inner, result, error)
         return
      end if
      call transpose_problem(problem, transposed, error)
      if (.not. allocated(error)) call transpose_problem(work, transposed_work, error)
      if (.not. allocated(error)) call find_rigid(transposed_work, result%formulation, free, &
         result%redundant_constraints, inner, deflation, rigid, result%effort_type, error)
      if (.not. allocated(error)) call new_transposed_transform(adjoint, transposed_work, deflation, transform, &
         result%shift, inner, own_factors, error)
      if (allocated(error)) return
      call undo_presolve(transposed, plan, rigid)
      left%shift = result%shift
      left%formulation = result%formulation
      left%redundant_constraints = result%redundant_constraints
      call find_modes(transposed, transposed_work, plan, deflation, rigid, total, adjoint, options, inner, left, error, monitor)
      if (allocated(error)) return
      call set_left_modes(problem, transposed, modes_of(left), left%reason /= reason_cancelled, inner, result, error)
      call result%add_solver(adjoint%linear_solver())
      result%factorizations = result%factorizations + left%factorizations + merge(1, 0, own_factors)
      result%operator_applications = result%operator_applications + left%operator_applications
      result%restarts = result%restarts + left%restarts
      result%seconds%orthogonalize = result%seconds%orthogonalize + left%seconds%orthogonalize
   end subroutine find_left_modes

   !> The modes of a result as eigenpairs.
   function modes_of(result) result(pairs)
      type(modal_result_type), intent(in) :: result
      type(eigenpairs_type) :: pairs

      allocate (pairs%lambda, source=result%eigenvalues)
      allocate (pairs%phi, source=result%eigenvectors)
      allocate (pairs%xi, source=result%multipliers)
   end function modes_of

   ! The modes are the nearest to the target if they are no further than what is proved.
   subroutine certify(certificate, result)
      type(certificate_type), intent(in) :: certificate
      type(modal_result_type), intent(inout) :: result
      real(wp) :: furthest

      result%factorizations = result%factorizations + certificate%factorizations
      result%seconds%analyze = result%seconds%analyze + certificate%analyze_seconds
      result%seconds%factorize = result%seconds%factorize + certificate%factorize_seconds
      result%certified = certified_unknown
      if (result%reason /= reason_converged) return
      result%certified = certificate%verdict
      if (certificate%verdict /= certified_yes) return
      furthest = maxval(min(abs(result%eigenvalues - result%target), abs(conjg(result%eigenvalues) - result%target)))
      if (furthest > (1 + 2*same_distance)*certificate%reach) &
         result%certified = certified_unknown
   end subroutine certify

   ! Where the constraints leave no motion.
   subroutine no_modes(problem, inner, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: none

      allocate (none%lambda(0), none%phi(problem%unknowns(), 0), none%xi(problem%multipliers(), 0))
      call select_modes(problem, result%options, 0, none, 0, 0.0_wp, 0.0_wp, result)
      allocate (result%history%converged(0), result%history%operator_applications(0), result%history%residual(0))
      result%reason = reason_fewer_modes
      if (result%options%left) call set_left_modes(problem, problem, modes_of(result), .false., inner, result, error)
   end subroutine no_modes

   ! Where rigid motions are all there is.
   subroutine only_rigid(problem, rigid, inner, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: rigid
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      integer :: k

      call orthonormalize_zeros(rigid)
      k = size(rigid%lambda)
      call select_modes(problem, result%options, k, rigid, k, 0.0_wp, huge(1.0_wp), result)
      allocate (result%history%converged(0), result%history%operator_applications(0), result%history%residual(0))
      if (result%options%modes > k) result%reason = reason_fewer_modes
      if (result%options%left) call set_left_modes(problem, problem, modes_of(result), .false., inner, result, error)
      if (.not. allocated(error)) call note_modes(problem, result, error)
   end subroutine only_rigid

   ! Modes far from the shift are known less well than those near to it. Judged and refined in the units that
   ! balance has found: in those as given errors may hide behind a few large entries.
   subroutine polish(problem, work, plan, options, inner, result, lost, error)
      type(modal_problem_type), intent(in) :: problem, work
      type(presolve_type), intent(in) :: plan
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues turned out to be others of the list.
      integer, intent(out) :: lost
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: good_enough
      class(complex_linear_solver_type), allocatable :: solver
      type(eigenpairs_type) :: pairs
      real(wp), allocatable :: errors(:)
      integer :: before

      lost = 0
      good_enough = max(1.0e-13_wp, options%tolerance/10)
      if (all(result%backward_error <= good_enough) .and. plan%spread_of_units() <= uneven) return
      pairs = contracted(plan, result)
      allocate (errors, source=backward_errors(work, pairs))
      where (result%backward_error > good_enough) errors = max(errors, result%backward_error)
      if (.not. any(errors > good_enough)) return
      before = result%factorizations
      allocate (solver, source=inner%complex)
      call refine(work, constraint_factors(work, options%constraint_scaling, result%shift), good_enough, &
         solver, pairs, errors, result%factorizations, error)
      if (allocated(error)) return
      call result%add_solver(solver)
      if (result%factorizations == before) return
      call undo_presolve(problem, plan, pairs)
      call replace_modes(problem, pairs, result, lost)
   end subroutine polish

   !> Shapes and multipliers of the problem as given.
   subroutine undo_presolve(problem, plan, pairs, more)
      type(modal_problem_type), intent(in) :: problem
      type(presolve_type), intent(in) :: plan
      type(eigenpairs_type), intent(inout) :: pairs
      !> Pairs of the problem as given, to stand behind.
      type(eigenpairs_type), optional, intent(in) :: more
      complex(wp), allocatable :: phi(:, :), xi(:, :)
      integer :: k, l

      k = size(pairs%lambda)
      l = 0
      if (present(more)) l = size(more%lambda)
      allocate (phi(problem%unknowns(), k + l), xi(problem%multipliers(), k + l))
      call plan%expand_shapes(pairs%phi, phi(:, :k))
      deallocate (pairs%phi)
      call plan%expand_multipliers(problem, pairs%lambda, phi(:, :k), pairs%xi, xi(:, :k))
      call move_alloc(phi, pairs%phi)
      call move_alloc(xi, pairs%xi)
      pairs%weights = plan%weights()
      if (l == 0) return
      if (allocated(pairs%paired)) pairs%paired = [pairs%paired, spread(.false., 1, l)]
      if (allocated(pairs%again)) pairs%again = [pairs%again, spread(.false., 1, l)]
      pairs%lambda = [pairs%lambda, more%lambda]
      pairs%phi(:, k + 1:) = more%phi
      pairs%xi(:, k + 1:) = more%xi
   end subroutine undo_presolve
end module kschur_solver
