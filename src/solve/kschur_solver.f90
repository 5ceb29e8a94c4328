!> Computes the modes nearest to a target: the steps of a solve from the options to the result.
module kschur_solver
   use kschur_band_groups, only: band_groups_type
   use kschur_certify, only: certify_modes
   use kschur_checkpoint, only: checkpoint_type
   use kschur_clock, only: clock, seconds_since
   use kschur_checkpointing, only: begin_checkpoint
   use kschur_context, only: begin, solve_context_type, whole_given
   use kschur_dense_choice, only: dense_may_end_stall, dense_may_tell
   use kschur_effort, only: for_refinement, phase_examine, phase_judge, phase_left, phase_place
   use kschur_error, only: error_type, error_singular, take_cancelled
   use kschur_examination, only: examination_type, assume_no_rigid_motions
   use kschur_finishing, only: is_small
   use kschur_worker_loop, only: worker_loop
   use kschur_kinds, only: wp, long
   use kschur_left_run, only: bound_modes, find_left_modes, lacks_bounds
   use kschur_long_list, only: find_long_list, is_long_list
   use kschur_low_rank_choice, only: leave_low_rank, settle_low_rank, weigh_low_rank
   use kschur_modes, only: modes_type, no_modes
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, formulation_low_rank, &
      formulation_names, method_arpack
   use kschur_outcome, only: certified_no, certified_yes, reason_cancelled, reason_converged, reason_fewer_modes, &
      reason_max_restarts
   use kschur_preparation, only: examine, reduce
   use kschur_problem, only: damping_proportional, modal_problem_type
   use kschur_processes, only: join_processes, processes_type
   use kschur_report, only: report
   use kschur_result, only: kind_overdamped, modal_result_type, note_length
   use kschur_search, only: find_modes, take_rigid
   use kschur_shared_problem, only: shared_problem_type
   use kschur_shift, only: place_shift
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_threads, only: enter_solve, leave_solve
   implicit none
   private
   public :: prepare, report_none, solve_again_dense, solve_modes, solve_prepared

   !> Computes the modes nearest to a target. `result` has the converged modes even if they are fewer than requested;
   !> `result%reason` says why, and `result%notes` what else a user should know. Fails on options that do not fit the problem, on a
   !> problem that is singular for every lambda, and if memory is short or a library fails.
   interface solve_modes
      module procedure solve_given, solve_shared
   end interface solve_modes

contains

   ! Solves a problem that is given as whole matrices.
   subroutine solve_given(problem, options, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Follows the iteration and may cancel it.
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Linear solvers of the caller; `options%inner` must be `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(modal_problem_type), pointer :: given

      given => problem
      call solve_together(given, options, result, error, monitor, solvers)
   end subroutine solve_given

   ! Solves a problem of which each process has read its own rows.
   subroutine solve_shared(shared, options, result, error, monitor, solvers)
      type(shared_problem_type), target, intent(inout) :: shared
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      type(modal_problem_type), pointer :: given

      given => shared%problem
      call solve_together(given, options, result, error, monitor, solvers, shared)
   end subroutine solve_shared

   ! Joins the processes of the communicator, and solves in the first; the others serve its requests. Sets threads, and returns
   ! errors in all processes.
   subroutine solve_together(problem, options, result, error, monitor, solvers, shared)
      type(modal_problem_type), pointer, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      type(shared_problem_type), target, intent(inout), optional :: shared
      type(processes_type), target :: processes
      integer :: threads_before

      call join_processes(options%communicator, options%distribute, processes, error)
      if (allocated(error)) return
      call enter_solve(processes%threads(options%threads), problem%unknowns(), threads_before, error)
      if (present(shared)) call shared%check(processes, error)
      call processes%agree(error)
      if (.not. allocated(error)) then
         if (processes%rank > 0) then
            call worker_loop(processes, shared)
         else
            call solve(problem, options, processes, result, error, monitor, solvers, shared)
         end if
      end if
      call processes%leave(error)
      call leave_solve(threads_before)
   end subroutine solve_together

   ! Solves in the first process: prepares, computes modes, and replaces modes that are not trusted by those of a dense solve.
   subroutine solve(problem, options, processes, result, error, monitor, solvers, shared)
      type(modal_problem_type), pointer, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(processes_type), target, intent(inout) :: processes
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      type(shared_problem_type), target, intent(inout), optional :: shared
      type(solve_context_type), allocatable, target :: s
      type(band_groups_type) :: groups
      type(checkpoint_type), target :: checkpoint
      real(wp) :: no_edges(0)
      integer(long) :: started
      logical :: cancelled, dense_tells, dense_ends

      started = clock()
      allocate (s)
      call begin(s, problem, options, error, monitor, solvers, processes)
      if (.not. allocated(error)) call begin_checkpoint(s, no_edges, checkpoint, error)
      if (.not. allocated(error)) then
         ! The caller's solvers exist in this process only, so that other groups could not factor with them.
         if (is_long_list(s) .and. .not. present(solvers)) call groups%begin(problem, s%options, processes, error)
         if (groups%number_of_groups() > 1) then
            s%may_be_dense = .false.
         else if (present(shared)) then
            s%shared => shared
         end if
         if (.not. allocated(error)) call prepare(s, error)
         dense_tells = .false.
         dense_ends = .false.
         if (.not. allocated(error)) dense_tells = dense_may_tell(s)
         if (.not. allocated(error)) dense_ends = dense_may_end_stall(s)
         if (.not. allocated(error)) call solve_prepared(s, options, result, error, groups)
         call groups%finish()
         if (.not. allocated(error)) dense_tells = dense_tells .or. (dense_ends .and. &
            (result%reason == reason_max_restarts .or. reaches_crowd(s%problem, result)))
         if (.not. allocated(error) .and. dense_tells) call solve_again_dense(s, options, result)
      end if
      call take_cancelled(error, cancelled)
      if (cancelled) call report_none(s, options, result, error)
      deallocate (s)
      call groups%disband(processes)
      call result%set_total(seconds_since(started))
   end subroutine solve

   !> Reduces and examines a problem before modes are computed; serves other targets as well.
   subroutine prepare(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error

      call settle_low_rank(s)
      call reduce(s, error)
      if (.not. allocated(error)) call examine(s, error)
      if (.not. allocated(error)) call weigh_low_rank(s, error)
      call s%end_step(phase_examine)
   end subroutine prepare

   !> Computes the modes of a prepared problem, with certificate and left vectors if requested. The context stays prepared; its
   !> factors are freed.
   subroutine solve_prepared(s, options, result, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      !> Options of the caller.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Groups of processes that compute a long list in parts; absent: none.
      type(band_groups_type), intent(inout), optional :: groups
      type(modes_type) :: modes

      if (associated(s%monitor)) call s%monitor%counts(0, options%modes, options%modes)
      if (s%only_rigid()) then
         call s%hold(whole_given, error)
         if (.not. allocated(error)) call take_rigid(s, modes)
      else
         call search(s, modes, error, groups)
         if (allocated(error)) return
         if (options%certify .or. should_count(s, modes)) call certify_modes(s, modes)
         call s%end_step(phase_judge)
      end if
      if (allocated(error)) return
      if (options%left) then
         call find_left_modes(s, modes, error)
         call s%end_step(phase_left)
      else if (lacks_bounds(s, modes)) then
         call bound_modes(s, modes)
         call s%end_step(phase_left)
      end if
      ! Certificate or left vectors may be missing.
      if (s%is_stopped()) modes%reason = reason_cancelled
      if (.not. allocated(error)) call report(s, options, modes, result, error)
   end subroutine solve_prepared

   ! Whether modes are counted without being asked: those of small problems of which some were refined, as copies may be lost then,
   ! and those of the low-rank form, which knows undamped modes only: local forces may move one of another distance to the target.
   logical function should_count(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      should_count = s%effort%factorizations_for(for_refinement) > 0 .or. s%formulation == formulation_low_rank
      should_count = should_count .and. is_small(s) .and. &
         .not. (modes%certified == certified_yes .or. s%options%uncounted .or. s%options%method == method_arpack)
   end function should_count

   ! Chooses the shift and computes the modes. Falls back to iteration if an automatically chosen dense solve is not certified, and
   ! to the quadratic form if an automatically chosen low-rank one does not converge.
   subroutine search(s, modes, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout), optional :: groups
      character(len=note_length), allocatable :: notes(:)
      logical :: done

      if (present(groups)) then
         call find_long_list(s, groups, modes, done, error)
         if (allocated(error) .or. done) return
      end if
      do
         allocate (notes, source=s%notes)
         call place_shift(s, error)
         call s%end_step(phase_place)
         if (.not. allocated(error)) call find_modes(s, modes, error)
         if (.not. should_fall_back(s, modes, error)) exit
         if (allocated(error)) deallocate (error)
         call s%drop_transform()
         call move_alloc(notes, s%notes)
         if (s%dense) then
            s%dense = .false.
            s%may_be_dense = .false.
            s%decision = "dense does not tell all eigenvalues apart"
         else
            call leave_low_rank(s, "the space of the low-rank form grew beyond what the quadratic one costs")
         end if
      end do
   end subroutine search

   !> Solves again with all eigenvalues of the dense matrix, if an automatically chosen iteration ended with modes that are not
   !> trusted, and replaces the result if the dense set is certified or has more modes. For use only if `dense_may_tell` was true
   !> before the iteration, or it stalled and `dense_may_end_stall` was.
   subroutine solve_again_dense(s, options, result)
      type(solve_context_type), intent(inout) :: s
      !> Options of the caller.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(solve_context_type), allocatable, target :: own
      type(modal_options_type) :: settings
      type(modal_result_type) :: dense
      type(error_type), allocatable :: error

      if (result%reason == reason_cancelled) return
      if (result%reason == reason_fewer_modes .or. (result%reason == reason_converged .and. &
         result%certified /= certified_no .and. .not. reaches_crowd(s%problem, result))) return
      settings = options
      settings%formulation = formulation_dense
      allocate (own)
      call begin(own, s%problem, settings, error, s%monitor)
      if (.not. allocated(error)) call prepare(own, error)
      if (.not. allocated(error)) call solve_prepared(own, options, dense, error)
      if (allocated(error)) return
      if (.not. (dense%reason == reason_fewer_modes .or. size(dense%eigenvalues) > size(result%eigenvalues) .or. &
         (dense%reason == reason_converged .and. dense%certified == certified_yes))) return
      dense%decision = "dense: the "//trim(formulation_names(result%formulation))//" form did not tell all eigenvalues apart"
      call dense%add_effort(result)
      result = dense
   end subroutine solve_again_dense

   ! Whether a list that is not certified has overdamped modes near -1/beta, where eigenvalues of stiff motions accumulate: the
   ! nearest to that point are the stiffest, and so far from the shift the iteration misses copies.
   pure logical function reaches_crowd(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      real(wp), parameter :: about = 0.5_wp

      reaches_crowd = problem%damping_kind == damping_proportional .and. result%certified /= certified_yes
      if (reaches_crowd) reaches_crowd = any(result%kind == kind_overdamped .and. abs(result%eigenvalues)*problem%beta > about)
   end function reaches_crowd

   !> Fills the result of a solve that was cancelled before modes could be computed: no modes. Invalidates the context.
   subroutine report_none(s, options, result, error)
      type(solve_context_type), intent(inout) :: s
      !> Options of the caller.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(examination_type) :: nothing_known
      type(modes_type) :: no_modes_found

      call s%hold(whole_given, error)
      if (allocated(error)) return
      s%known = nothing_known
      call assume_no_rigid_motions(s%problem, s%known)
      if (.not. allocated(s%decision)) s%decision = ""
      no_modes_found = no_modes(s%problem%unknowns(), s%problem%multipliers())
      no_modes_found%reason = reason_cancelled
      if (options%left) allocate (no_modes_found%left_phi(s%problem%unknowns(), 0), &
         no_modes_found%left_xi(s%problem%multipliers(), 0), no_modes_found%condition(0))
      call report(s, options, no_modes_found, result, error)
   end subroutine report_none

   ! Whether an automatically chosen formulation has failed: a singular matrix, a dense set that is not known to be complete, or a
   ! low-rank one that did not converge.
   logical function should_fall_back(s, modes, error)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      type(error_type), allocatable, intent(in) :: error

      should_fall_back = s%options%formulation == formulation_auto .and. (s%dense .or. s%formulation == formulation_low_rank)
      if (.not. should_fall_back) return
      if (allocated(error)) then
         should_fall_back = error%code == error_singular
      else if (modes%reason == reason_cancelled) then
         should_fall_back = .false.
      else if (s%dense) then
         ! With losses no dense set is certified.
         should_fall_back = modes%certified /= certified_yes .and. modes%reason /= reason_fewer_modes .and. &
            .not. (s%is_lossy() .and. modes%reason == reason_converged)
      else
         should_fall_back = modes%reason /= reason_converged
      end if
   end function should_fall_back
end module kschur_solver
