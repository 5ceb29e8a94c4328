!> kschur info: describes a problem, or prints the table of a stored result.
module cli_info
   use cli_arguments, only: arguments_type
   use cli_input, only: input_type, read_problem, take_input
   use cli_json, only: boolean, number, string
   use cli_numbers, only: rounded
   use cli_output, only: format_csv, format_json, format_table, print_result, take_format
   use cli_properties, only: print_properties
   use cli_system, only: print_line
   use kschur, only: asymmetry_of, asymmetry_type, choose_formulation, csr_matrix_type, damping_names, &
      damping_proportional, description_of, error_memory, error_type, error_usage, estimate_memory, formulation_auto, &
      formulation_names, inner_auto, inner_iterative, inner_names, &
      is_hdf5_result, kschur_version, long, memory_estimate_type, modal_options_type, modal_problem_type, &
      modal_result_type, new_error, presolve, presolve_type, read_hdf5_result, text, wp
   implicit none
   private
   public :: info_command

   !> What the command tells about a problem, besides its matrices.
   type :: facts_type
      integer :: formulation = formulation_auto
      character(len=:), allocatable :: decision
      type(presolve_type) :: plan
      type(memory_estimate_type) :: memory
      !> With factors in single precision, which a limit of memory may choose; 0: it does not.
      real(wp) :: single = 0
      integer :: modes = 0
   end type facts_type

contains

   !> Runs the command.
   subroutine info_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      type(input_type) :: input
      type(modal_options_type) :: options
      integer :: format, modes
      logical :: verbose

      call take_format(arguments, format, error)
      call arguments%take_flag("--verbose", verbose, error)
      modes = 0
      call arguments%take_integer("--modes", 1, modes, error)
      if (modes > 0) options%modes = modes
      call arguments%take_choice("--formulation", formulation_names, options%formulation, error)
      call arguments%take_choice("--inner", inner_names, options%inner, error)
      call take_input(arguments, input, error)
      if (allocated(error)) return
      if (allocated(input%path)) then
         if (is_hdf5_result(input%path, trial=.true.)) then
            call tell_of_result(input%path, format, verbose, error)
            return
         end if
      end if
      if (format == format_csv) then
         call new_error(error, error_usage, "--format csv is for results; a problem has table and json")
      else
         call tell_of_problem(input, options, format, error)
      end if
   end subroutine info_command

   ! Prints a stored result, and its modal properties in the table.
   subroutine tell_of_result(path, format, verbose, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: format
      logical, intent(in) :: verbose
      type(error_type), allocatable, intent(out) :: error
      type(modal_result_type) :: result

      call read_hdf5_result(result, path, error, trial=.true.)
      if (allocated(error)) return
      call print_result(result, format, verbose)
      if (allocated(result%properties) .and. format == format_table) call print_properties(result%properties)
   end subroutine tell_of_result

   ! Prints facts about a problem: formulation, presolve and memory, without a solve.
   subroutine tell_of_problem(input, options, format, error)
      type(input_type), intent(in) :: input
      type(modal_options_type), intent(in) :: options
      integer, intent(in) :: format
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: no_motion
      type(modal_problem_type) :: problem, reduced
      type(facts_type) :: facts

      call read_problem(input, problem, error)
      if (.not. allocated(error)) &
         call choose_formulation(problem, formulation_auto, facts%formulation, facts%decision, error)
      if (allocated(error)) return
      call presolve(problem, reduced, facts%plan, no_motion)
      if (allocated(no_motion)) then
         if (no_motion%code == error_memory) call move_alloc(no_motion, error)
      end if
      if (.not. allocated(error)) call estimate_memory(problem, options, facts%memory, error)
      if (.not. allocated(error)) call estimate_single(problem, options, facts, error)
      if (allocated(error)) return
      facts%modes = options%modes
      if (format == format_json) then
         call print_object(problem, facts)
      else
         call print_lines(problem, facts)
      end if
   end subroutine tell_of_problem

   ! Estimates the memory with factors in single precision, if a solve with these options may take them.
   subroutine estimate_single(problem, options, facts, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(facts_type), intent(inout) :: facts
      type(error_type), allocatable, intent(out) :: error
      type(modal_options_type) :: changed
      type(memory_estimate_type) :: memory

      if (options%inner /= inner_auto .or. allocated(problem%loss)) return
      changed = options
      changed%inner = inner_iterative
      call estimate_memory(problem, changed, memory, error)
      if (allocated(error) .or. memory%total() >= facts%memory%total()) return
      facts%single = memory%total()
   end subroutine estimate_single

   ! Prints the facts as lines.
   subroutine print_lines(problem, facts)
      type(modal_problem_type), intent(in) :: problem
      type(facts_type), intent(in) :: facts

      call print_line("unknowns     "//text(problem%unknowns()))
      call print_line("constraints  "//text(problem%multipliers()))
      call print_line("symmetric    "//symmetry_text(problem))
      call print_line("damping      "//damping_text(problem))
      if (allocated(problem%loss)) call print_line("losses       "//losses_text(problem))
      associate (plan => facts%plan)
         call print_line("presolve     "//text(plan%eliminated)//" constraints clamp or tie an unknown, "// &
            text(plan%redundant)//" follow from them: "//text(plan%unknowns_after)//" unknowns, "// &
            text(plan%constraints_after)//" constraints are left")
      end associate
      call print_line("formulation  "//trim(formulation_names(facts%formulation))//", because "//facts%decision)
      associate (memory => facts%memory)
         call print_line("memory       about "//megabytes(memory%total())//" MB for "//text(facts%modes)// &
            trim(merge(" mode: ", " modes:", facts%modes == 1))//" matrices "//megabytes(memory%matrices)//", factors "// &
            megabytes(memory%factors)//", vectors "//megabytes(memory%vectors))
         if (facts%single > 0) call print_line("             or "//megabytes(facts%single)// &
            " MB with factors in single precision, which --memory may choose")
      end associate
      call print_line("")
      call print_line("matrix                     nonzeros   infinity norm")
      call print_matrix("mass M", problem%mass)
      call print_matrix("damping R", problem%damping)
      call print_matrix("stiffness K", problem%stiffness)
      call print_matrix("constraints Cq", problem%constraints)
      if (allocated(problem%loss)) call print_matrix("loss H", problem%loss)
   end subroutine print_lines

   ! Prints the facts as one JSON object.
   subroutine print_object(problem, facts)
      type(modal_problem_type), intent(in) :: problem
      type(facts_type), intent(in) :: facts

      call print_line('{"kschur": '//string(kschur_version)//',')
      call print_line(' "problem": {"n": '//text(problem%unknowns())//', "m": '//text(problem%multipliers())// &
         ', "symmetric": '//boolean(problem%symmetric)//asymmetry_object(problem)//', "damping": '// &
         string(damping_names(problem%damping_kind))// &
         trim(merge(', "loss": true', repeat(" ", 14), allocated(problem%loss)))//'},')
      call print_line(' "presolve": {"n": '//text(facts%plan%unknowns_after)//', "m": '// &
         text(facts%plan%constraints_after)//'},')
      call print_line(' "formulation": '//string(formulation_names(facts%formulation))//', "because": '// &
         string(facts%decision)//',')
      associate (memory => facts%memory)
         call print_line(' "modes": '//text(facts%modes)//',')
         call print_line(' "memory_bytes": {"total": '//text(nint(memory%total(), long))//', "matrices": '// &
            text(nint(memory%matrices, long))//', "factors": '//text(nint(memory%factors, long))//', "vectors": '// &
            text(nint(memory%vectors, long))//single_member(facts%single)//'}}')
      end associate
   end subroutine print_object

   ! JSON member with the estimate of factors in single precision; empty if there is none.
   pure function single_member(bytes) result(member)
      real(wp), intent(in) :: bytes
      character(len=:), allocatable :: member

      member = ""
      if (bytes > 0) member = ', "in_single_precision": '//text(nint(bytes, long))
   end function single_member

   ! "yes", or "no" with the two mirrored entries that differ most.
   function symmetry_text(problem)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable :: symmetry_text, name, entry, mirrored
      type(asymmetry_type) :: largest

      symmetry_text = "yes"
      if (problem%symmetric) return
      call asymmetry_of(problem, largest, name)
      entry = rounded(largest%entry)
      mirrored = rounded(largest%mirrored)
      if (entry == mirrored) then
         entry = number(largest%entry)
         mirrored = number(largest%mirrored)
      end if
      symmetry_text = "no: the "//name//" has "//entry//" at ("//text(largest%row)//", "//text(largest%column)//") and "// &
         mirrored//" at ("//text(largest%column)//", "//text(largest%row)//"), which differ by "//rounded(largest%part)// &
         " of the largest entry there"
   end function symmetry_text

   ! JSON member with the two mirrored entries that differ most; empty if the problem is symmetric.
   function asymmetry_object(problem) result(member)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable :: member, name
      type(asymmetry_type) :: largest

      member = ""
      if (problem%symmetric) return
      call asymmetry_of(problem, largest, name)
      member = ', "asymmetry": {"matrix": '//string(name)//', "row": '//text(largest%row)//', "column": '// &
         text(largest%column)//', "entry": '//number(largest%entry)//', "mirrored": '//number(largest%mirrored)// &
         ', "part": '//number(largest%part)//'}'
   end function asymmetry_object

   pure function megabytes(bytes)
      real(wp), intent(in) :: bytes
      character(len=:), allocatable :: megabytes

      megabytes = text(ceiling(bytes/1.0e6_wp, long))
   end function megabytes

   subroutine print_matrix(name, matrix)
      character(len=*), intent(in) :: name
      type(csr_matrix_type), intent(in) :: matrix
      character(len=51) :: line

      write (line, "(a20, i15, a16)") adjustl(name//repeat(" ", 20)), matrix%nonzeros(), &
         rounded(matrix%infinity_norm())
      call print_line(line)
   end subroutine print_matrix

   function losses_text(problem)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable :: losses_text

      losses_text = "general"
      if (abs(problem%loss_factor) > 0) losses_text = "proportional, loss factor "//rounded(problem%loss_factor)
   end function losses_text

   function damping_text(problem)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable :: damping_text

      damping_text = trim(damping_names(problem%damping_kind))
      if (allocated(problem%dampers)) damping_text = damping_text//": "//trim(description_of(problem))
      if (problem%damping_kind == damping_proportional) damping_text = damping_text//", alpha "// &
         rounded(problem%alpha)//" 1/s, beta "//rounded(problem%beta)//" s"
   end function damping_text
end module cli_info
