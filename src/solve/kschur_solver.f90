!> The modes of a problem.
module kschur_solver
   use kschur_certify, only: certify_modes
   use kschur_clock, only: clock, seconds_since
   use kschur_context, only: begin, solve_context_type
   use kschur_error, only: error_type, error_singular
   use kschur_kinds, only: long
   use kschur_left_run, only: find_left_modes
   use kschur_modes, only: modes_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_auto
   use kschur_outcome, only: certified_yes, reason_cancelled, reason_fewer_modes
   use kschur_preparation, only: examine, reduce
   use kschur_problem, only: modal_problem_type
   use kschur_report, only: report
   use kschur_result, only: modal_result_type, note_length
   use kschur_search, only: find_modes, take_rigid
   use kschur_shift, only: place_shift
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_threads, only: enter_solve, leave_solve
   implicit none
   private
   public :: solve_modes

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
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Linear solvers of the caller's own; `options%inner` is `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      integer :: threads_before

      call enter_solve(options%threads, threads_before)
      call solve(problem, options, result, error, monitor, solvers)
      call leave_solve(threads_before)
   end subroutine solve_modes

   subroutine solve(problem, options, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      type(solve_context_type), target :: s
      type(modes_type) :: modes
      integer(long) :: started

      started = clock()
      call begin(s, problem, options, error, monitor, solvers)
      if (.not. allocated(error)) call reduce(s, error)
      if (.not. allocated(error)) call examine(s, error)
      if (allocated(error)) return
      if (s%only_rigid()) then
         call take_rigid(s, modes)
      else
         call search(s, modes, error)
         if (.not. allocated(error) .and. options%certify) call certify_modes(s, modes)
      end if
      if (.not. allocated(error) .and. options%left) call find_left_modes(s, modes, error)
      if (.not. allocated(error)) call report(s, options, modes, result, error)
      call result%set_total(seconds_since(started))
   end subroutine solve

   ! A set that was found dense and that nobody asked for so is kept where it is known to be complete, and else iterated.
   subroutine search(s, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      character(len=note_length), allocatable :: notes(:)

      allocate (notes, source=s%notes)
      call place_shift(s, error)
      if (.not. allocated(error)) call find_modes(s, modes, error)
      if (.not. s%dense .or. s%options%formulation /= formulation_auto) return
      if (allocated(error)) then
         if (error%code /= error_singular) return
         deallocate (error)
      else if (modes%certified == certified_yes .or. any(modes%reason == [reason_cancelled, reason_fewer_modes])) then
         return
      end if
      call s%drop_transform()
      call move_alloc(notes, s%notes)
      s%dense = .false.
      s%decision = "dense does not tell all eigenvalues apart"
      call place_shift(s, error)
      if (.not. allocated(error)) call find_modes(s, modes, error)
   end subroutine search
end module kschur_solver
