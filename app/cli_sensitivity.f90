!> kschur sensitivity: derivatives of modes with respect to a parameter.
module cli_sensitivity
   use cli_arguments, only: arguments_type
   use cli_columns, only: print_columns
   use cli_input, only: input_type, read_problem, take_symmetric
   use cli_interrupt, only: catch_interrupts
   use cli_options, only: take_iteration, take_wanted
   use cli_output, only: take_format
   use cli_processes, only: gather_processes
   use cli_progress, only: new_progress, progress_type
   use cli_shortfall, only: shortfall, take_interrupt
   use cli_system, only: complain
   use kschur, only: eigenvalue_rates, error_type, error_usage, modal_options_type, modal_problem_type, modal_result_type, &
      new_error, problem_rate_type, rate_between, reason_converged, solve_modes, wp
   implicit none
   private
   public :: sensitivity_command

   character(len=*), parameter :: names(6) = [character(len=15) :: "eigenvalue_re", "eigenvalue_im", "rate_re", "rate_im", &
      "frequency_rate", "damping_rate"], units(6) = [character(len=15) :: "1/s", "1/s", "1/s/p", "1/s/p", "Hz/p", "1/p"]

contains

   !> Runs the command; `complete` is false if fewer modes were found than asked for.
   subroutine sensitivity_command(arguments, complete, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(modal_options_type) :: options
      type(modal_problem_type) :: problem, changed
      type(modal_result_type) :: result
      type(problem_rate_type) :: rate
      type(progress_type) :: progress
      type(input_type) :: here, there
      complex(wp), allocatable :: rates(:)
      real(wp), allocatable :: step
      logical :: quiet
      integer :: format

      complete = .false.
      call take_wanted(arguments, options, error)
      call take_iteration(arguments, options, error)
      call arguments%take_positive("--step", step, error)
      call take_format(arguments, format, error)
      call arguments%take_integer("--threads", 1, options%threads, error)
      call arguments%take_flag("--quiet", quiet, error)
      call take_symmetric(arguments, here, error)
      there%symmetric = here%symmetric
      call arguments%take_word(here%path)
      call arguments%take_word(there%path)
      if (.not. allocated(error)) call arguments%check_all_taken(error)
      if (.not. (allocated(error) .or. allocated(there%path))) call new_error(error, error_usage, &
         "kschur sensitivity wants two problems: as it is, and with the parameter larger by --step")
      if (.not. allocated(step)) allocate (step, source=1.0_wp)
      if (.not. allocated(error)) call read_problem(here, problem, error)
      if (.not. allocated(error)) call read_problem(there, changed, error)
      if (.not. allocated(error)) call rate_between(problem, changed, step, rate, error)
      if (allocated(error)) return
      options%left = .not. problem%symmetric
      progress = new_progress(quiet)
      call gather_processes(options)
      call catch_interrupts()
      call solve_modes(problem, options, result, error, progress)
      call progress%finish()
      if (.not. allocated(error)) call eigenvalue_rates(problem, result, rate, rates, error)
      if (allocated(error)) return
      call print_columns("mode", names, units, columns(result%eigenvalues, rates), format)
      call take_interrupt(result)
      complete = result%reason == reason_converged
      if (.not. complete) call complain(shortfall(result))
   end subroutine sensitivity_command

   ! The columns that are printed: eigenvalues, their rates, and the rates of |lambda|/(2 pi) and of -Re lambda/|lambda|.
   function columns(lambda, rates)
      complex(wp), intent(in) :: lambda(:), rates(:)
      real(wp) :: columns(size(lambda), 6)
      real(wp), parameter :: two_pi = 8*atan(1.0_wp)
      real(wp) :: size_rates(size(lambda))

      size_rates = real(conjg(lambda)*rates, wp)/abs(lambda)
      columns(:, 1) = real(lambda, wp)
      columns(:, 2) = aimag(lambda)
      columns(:, 3) = real(rates, wp)
      columns(:, 4) = aimag(rates)
      columns(:, 5) = size_rates/two_pi
      columns(:, 6) = (real(lambda, wp)*size_rates/abs(lambda) - real(rates, wp))/abs(lambda)
   end function columns
end module cli_sensitivity
