!> kschur compare: solves a problem by each method and compares them.
module cli_compare
   use cli_arguments, only: arguments_type
   use cli_comparison, only: comparison_type, compare_methods, entry_type, labels, method_count
   use cli_interrupt, only: catch_interrupts, is_interrupted
   use cli_input, only: input_type, is_large, read_problem, take_input
   use cli_json, only: certified, counts, number, pair, problem_facts, seconds, string
   use cli_numbers, only: exponential, rounded
   use cli_options, only: take_iteration, take_wanted
   use cli_progress, only: new_progress, progress_type
   use cli_system, only: check_output, complain, print_line
   use cli_environment, only: start_again_to_wait_asleep
   use kschur, only: add_context, damping_names, error_type, formulation_names, kschur_version, modal_options_type, &
      modal_problem_type, reason_converged, reason_names, text, wp
   implicit none
   private
   public :: compare_command

   integer, parameter :: format_json = 1
   character(len=*), parameter :: formats(0:1) = [character(len=5) :: "table", "json"]

contains

   !> Runs the command; `complete` is false if even `auto` does not find the requested modes. Fails if `auto` does, after
   !> printing the table of the others.
   subroutine compare_command(arguments, complete, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(input_type) :: input
      type(modal_options_type) :: options
      type(modal_problem_type) :: problem
      type(comparison_type) :: comparison
      type(progress_type) :: progress
      integer :: format
      logical :: quiet

      complete = .false.
      format = 0
      call take_wanted(arguments, options, error)
      call take_iteration(arguments, options, error)
      call arguments%take_choice("--format", formats, format, error)
      call arguments%take_integer("--threads", 1, options%threads, error)
      call arguments%take_flag("--quiet", quiet, error)
      call take_input(arguments, input, error)
      if (allocated(error)) return
      if (options%threads /= 1) then
         if (is_large(input)) call start_again_to_wait_asleep()
      end if
      progress = new_progress(quiet)
      call progress%show("reading")
      call read_problem(input, problem, error)
      call catch_interrupts()
      if (.not. allocated(error)) call compare_methods(problem, options, comparison, progress)
      call progress%finish()
      if (allocated(error)) return
      if (comparison%reference == 0) then
         error = comparison%entries(1)%error
         return
      end if
      if (format == format_json) then
         call print_json(comparison)
      else
         call print_table(comparison)
      end if
      call check_output(error)
      if (allocated(error)) return
      associate (ours => comparison%entries(1))
         if (allocated(ours%error)) then
            error = ours%error
            call add_context(error, "auto fails")
         else
            complete = ours%result%reason == reason_converged
            if (is_interrupted()) then
               call complain("the comparison was interrupted")
            else if (.not. complete) then
               call complain("auto ended with "//trim(reason_names(ours%result%reason))//": "// &
                  text(size(ours%result%eigenvalues))//" of "//text(options%modes)//" modes")
            end if
            complete = complete .and. .not. is_interrupted()
         end if
      end associate
   end subroutine compare_command

   subroutine print_table(comparison)
      type(comparison_type), intent(in) :: comparison
      integer :: i

      associate (result => comparison%entries(comparison%reference)%result)
         call print_line("problem  "//text(result%unknowns)//" unknowns, "//text(result%constraints)//" constraints, "// &
            trim(merge("symmetric  ", "unsymmetric", result%symmetric))//", damping "// &
            trim(damping_names(result%damping_kind)))
         call print_line("modes    "//text(result%modes_asked)//" nearest to "//rounded(result%target)//" 1/s")
      end associate
      call print_line("compared with those of "//trim(labels(comparison%reference))//", which "//grounds(comparison%certified))
      call print_line("")
      call print_line("                                               operator      factored matrix          "// &
         "                              backward error")
      call print_line("method        formulation         seconds  applications    order  entries/1000  seconds  "// &
         "modes  missed  spurious    worst  median")
      do i = 1, method_count
         call print_row(trim(labels(i)), comparison%entries(i))
      end do
   end subroutine print_table

   ! Why these modes are the reference, as the end of a sentence.
   pure function grounds(certified)
      logical, intent(in) :: certified
      character(len=:), allocatable :: grounds

      grounds = "are not certified, but the most, with the smallest backward error"
      if (certified) grounds = "are certified: none is missing"
   end function grounds

   subroutine print_row(label, entry)
      character(len=*), intent(in) :: label
      type(entry_type), intent(in) :: entry
      character(len=160) :: line

      if (allocated(entry%error)) then
         write (line, "(a12, 2x)") label//repeat(" ", 12)
         call print_line(line(:14)//"fails: "//entry%error%message)
         return
      end if
      associate (result => entry%result)
         write (line, "(a12, 2x, a18, f9.3, i14, i9, f14.1, f9.3, i7, i8, i10, 1x, 2a8, 2x, a)") &
            label//repeat(" ", 12), formulation_names(result%formulation), result%seconds%total, &
            result%operator_applications, result%factored_order, real(result%factor_entries, wp)/1000, &
            result%seconds%factorize, size(result%eigenvalues), entry%missed, entry%spurious, &
            exponential(entry%worst, 8, 1), exponential(entry%median, 8, 1), &
            trim(merge(repeat(" ", len(reason_names)), reason_names(result%reason), result%reason == reason_converged))
      end associate
      call print_line(trim(line))
   end subroutine print_row

   subroutine print_json(comparison)
      type(comparison_type), intent(in) :: comparison
      integer :: i

      associate (reference => comparison%entries(comparison%reference)%result)
         call print_line('{"kschur": '//string(kschur_version)//',')
         call print_line(' "problem": '//problem_facts(reference)//',')
         call print_line(' "target": '//pair(reference%target)//', "modes_asked": '//text(reference%modes_asked)//',')
         call print_line(' "reference": {"name": '//string(labels(comparison%reference))//', "certified": '// &
            trim(merge("true ", "false", comparison%certified))//'},')
      end associate
      call print_line(' "methods": [')
      do i = 1, method_count
         call print_line('  {"name": '//string(labels(i))//', '//outcome(comparison%entries(i))//'}'// &
            trim(merge(",", " ", i < method_count)))
      end do
      call print_line(' ]}')
   end subroutine print_json

   ! Members of the JSON object of a method: its error, or its modes, counts and times.
   function outcome(entry) result(members)
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable :: members

      if (allocated(entry%error)) then
         members = '"error": '//string(entry%error%message)
         return
      end if
      associate (result => entry%result)
         members = '"method": '//string(result%method)//', "formulation": '// &
            string(formulation_names(result%formulation))//', "shift": '//pair(result%shift)//', "reason": '// &
            string(reason_names(result%reason))//', "certified": '//certified(result%certified)// &
            ', "modes": {"found": '//text(size(result%eigenvalues))//', "missed": '//text(entry%missed)// &
            ', "spurious": '//text(entry%spurious)//'}, "backward_error": {"worst": '//number(entry%worst)// &
            ', "median": '//number(entry%median)//'}, "counts": '//counts(result)//', "factored": {"order": '// &
            text(result%factored_order)//', "entries": '//number(real(result%factor_entries, wp))// &
            '}, "seconds": '//seconds(result%seconds)
      end associate
   end function outcome
end module cli_compare
