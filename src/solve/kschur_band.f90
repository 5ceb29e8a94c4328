!> Computes all modes in a band of natural frequencies.
module kschur_band
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_band_counted, only: can_be_counted, solve_counted
   use kschur_band_disc, only: solve_disc
   use kschur_band_groups, only: band_groups_type
   use kschur_checkpoint, only: checkpoint_type
   use kschur_checkpointing, only: begin_checkpoint
   use kschur_clock, only: clock, seconds_since
   use kschur_context, only: begin, solve_context_type
   use kschur_effort, only: phase_examine, phase_judge, phase_left
   use kschur_error, only: error_type, new_error, error_usage, take_cancelled
   use kschur_worker_loop, only: worker_loop
   use kschur_kinds, only: wp, long
   use kschur_left_run, only: bound_modes, find_left_modes, lacks_bounds
   use kschur_low_rank_choice, only: leave_low_rank
   use kschur_modes, only: modes_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, formulation_low_rank, &
      method_krylov_schur
   use kschur_preparation, only: examine, reduce
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: join_processes, processes_type
   use kschur_report, only: report
   use kschur_result, only: modal_result_type
   use kschur_solver, only: report_none
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_threads, only: enter_solve, leave_solve
   use kschur_tolerances, only: same_frequency
   implicit none
   private
   public :: band_options, prepare_band, solve_band, solve_band_prepared

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> Computes all modes with first <= frequency_hz <= last, in ascending order. `frequency_hz` is that of `modal_result_type`: of
   !> both roots of an overdamped oscillator the undamped frequency. The edges include frequencies within a relative 1e-6 of them.
   !> The target of the result is i 2 pi first. A band without modes is a success.
   !>
   !> Undamped and proportionally damped symmetric problems without unstable modes: the eigenvalues are counted by inertia, the
   !> band is cut into parts at gaps of the spectrum, and the parts are solved one by one; `certified` says whether as many modes
   !> were found as were counted. Other problems, and those with losses: all modes with |lambda| <= 2 pi last are computed,
   !> nearest to zero first, and those in the band kept. So modes below the band cost as much as modes in it, the faster root of
   !> an overdamped oscillator may be missing, and `certified` is unknown except for H = g K. Shift, solver and factors in the
   !> result are those of the last part or attempt.
   !>
   !> Fails as `solve_modes` does, and if the band holds more than 10,000 modes, or more than 2,000 lie below its end and cannot
   !> be counted.
   subroutine solve_band(problem, first, last, options, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      !> The edges (Hz), 0 <= first < last.
      real(wp), intent(in) :: first, last
      !> Number of modes, target and shift are ignored.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Follows the iterations and may cancel them.
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Linear solvers of the caller; `options%inner` must be `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(processes_type), target :: processes
      type(band_groups_type) :: groups
      type(solve_context_type), allocatable, target :: s
      type(checkpoint_type), target :: checkpoint
      type(modal_options_type) :: settings
      integer(long) :: started
      integer :: threads_before
      logical :: cancelled

      started = clock()
      call join_processes(options%communicator, options%distribute, processes, error)
      if (allocated(error)) return
      call enter_solve(processes%threads(options%threads), problem%unknowns(), threads_before, error)
      call processes%agree(error)
      if (processes%rank > 0 .and. .not. allocated(error)) then
         call worker_loop(processes)
      else if (.not. allocated(error)) then
         allocate (s)
         call band_options(first, last, options, settings, error)
         if (.not. allocated(error)) call begin(s, problem, settings, error, monitor, solvers, processes)
         if (.not. allocated(error)) call begin_checkpoint(s, [first, last], checkpoint, error)
         if (.not. allocated(error)) then
            ! The caller's solvers exist in this process only, so that other groups could not factor with them.
            if (can_be_counted(s) .and. .not. present(solvers)) call groups%begin(problem, s%options, processes, error)
            if (.not. allocated(error)) call prepare_band(s, error)
            if (.not. allocated(error)) call solve_band_prepared(s, first, last, settings, result, error, groups)
            call groups%finish()
         end if
         call take_cancelled(error, cancelled)
         if (cancelled) call report_none(s, settings, result, error)
         deallocate (s)
         call groups%disband(processes)
         call result%set_total(seconds_since(started))
      end if
      call processes%leave(error)
      call leave_solve(threads_before)
   end subroutine solve_band

   !> Makes the options that a band is solved with from those of the caller. Fails on edges or options that do not fit a band.
   subroutine band_options(first, last, options, settings, error)
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(modal_options_type), intent(out) :: settings
      type(error_type), allocatable, intent(out) :: error

      settings = options
      settings%modes = 1
      settings%target = cmplx(0, 2*pi*first, wp)
      if (allocated(settings%shift)) deallocate (settings%shift)
      call check_band(first, last, settings, error)
   end subroutine band_options

   !> Reduces and examines a problem before its modes are computed; serves other bands as well. Excludes the dense formulation, and
   !> the low-rank one if it was chosen automatically.
   subroutine prepare_band(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error

      s%may_be_dense = .false.
      if (s%options%formulation == formulation_auto .and. s%formulation == formulation_low_rank) &
         call leave_low_rank(s, "the damping is not a combination of mass and stiffness")
      call reduce(s, error)
      if (.not. allocated(error)) call examine(s, error)
      call s%end_step(phase_examine)
   end subroutine prepare_band

   !> Computes the modes of a band of a prepared problem. The context stays prepared; its factors are freed.
   subroutine solve_band_prepared(s, first, last, options, result, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: first, last
      !> Made by `band_options`.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Groups of processes that solve the parts.
      type(band_groups_type), intent(inout) :: groups
      type(modal_options_type) :: reported
      type(modes_type) :: modes
      real(wp) :: band(2)
      logical :: counted

      reported = options
      band = 2*pi*[(1 - same_frequency)*first, (1 + same_frequency)*last]
      counted = can_be_counted(s)
      if (counted) call solve_counted(s, band, modes, counted, error, groups)
      if (.not. allocated(error) .and. .not. counted) call solve_disc(s, band, modes, error)
      call s%end_step(phase_judge)
      if (allocated(error)) return
      if (reported%left) then
         call find_left_modes(s, modes, error)
         call s%end_step(phase_left)
      else if (lacks_bounds(s, modes)) then
         call bound_modes(s, modes)
         call s%end_step(phase_left)
      end if
      if (allocated(error)) return
      reported%modes = size(modes%lambda)
      if (counted) reported%modes = modes%found
      call report(s, reported, modes, result, error, by_frequency=.true.)
      allocate (result%band(2), source=[first, last])
   end subroutine solve_band_prepared

   ! Fails on edges or options that do not fit a band.
   subroutine check_band(first, last, options, error)
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (.not. (first >= 0 .and. last > first .and. ieee_is_finite(last))) then
         call new_error(error, error_usage, "a band wants two frequencies, the first at least 0, the second above the first")
      else if (options%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the modes of a band are found by krylov-schur: leave out the method")
      else if (options%formulation == formulation_dense) then
         call new_error(error, error_usage, "the modes of a band are found by an iteration: leave out the formulation dense")
      else if (options%certify) then
         call new_error(error, error_usage, &
            "certify counts about a target, and a band has none: leave it out, or ask for modes near a target")
      else if (options%uncounted) then
         call new_error(error, error_usage, "the modes of a band are counted: leave out that they are not to be")
      end if
   end subroutine check_band
end module kschur_band
