!> kschur info: what a problem is, or the table of a result that was written.
module cli_info
   use cli_arguments, only: arguments_type
   use cli_input, only: input_type, read_problem, take_input
   use cli_numbers, only: rounded
   use cli_output, only: format_table, print_result, take_format
   use cli_properties, only: print_properties
   use cli_system, only: print_line
   use kschur, only: choose_formulation, csr_matrix_type, damping_names, damping_proportional, description_of, &
      error_memory, error_type, error_usage, formulation_auto, formulation_names, is_hdf5_result, modal_problem_type, &
      modal_result_type, new_error, presolve, presolve_type, read_hdf5_result, text
   implicit none
   private
   public :: info_command

contains

   !> Does the command.
   subroutine info_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      type(input_type) :: input
      type(modal_problem_type) :: problem
      type(modal_result_type) :: result
      integer :: format
      logical :: verbose

      call take_format(arguments, format, error)
      call arguments%take_flag("--verbose", verbose, error)
      call take_input(arguments, input, error)
      if (allocated(error)) return
      if (allocated(input%path)) then
         if (is_hdf5_result(input%path, trial=.true.)) then
            call read_hdf5_result(result, input%path, error, trial=.true.)
            if (allocated(error)) return
            call print_result(result, format, verbose)
            if (allocated(result%properties) .and. format == format_table) call print_properties(result%properties)
            return
         end if
      end if
      if (format /= format_table) then
         call new_error(error, error_usage, "--format is for results; on a problem there is only the table")
      else
         call read_problem(input, problem, error)
      end if
      if (.not. allocated(error)) call print_problem(problem, error)
   end subroutine info_command

   subroutine print_problem(problem, error)
      type(modal_problem_type), intent(in) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: no_motion
      type(modal_problem_type) :: reduced
      type(presolve_type) :: plan
      character(len=:), allocatable :: decision
      integer :: formulation

      call choose_formulation(problem, formulation_auto, formulation, decision, error)
      if (allocated(error)) return
      call presolve(problem, reduced, plan, no_motion)
      if (allocated(no_motion)) then
         if (no_motion%code == error_memory) call move_alloc(no_motion, error)
      end if
      if (allocated(error)) return
      call print_line("unknowns     "//text(problem%unknowns()))
      call print_line("constraints  "//text(problem%multipliers()))
      call print_line("symmetric    "//trim(merge("yes", "no ", problem%symmetric)))
      call print_line("damping      "//damping_text(problem))
      call print_line("presolve     "//text(plan%eliminated)//" constraints clamp or tie an unknown, "// &
         text(plan%redundant)//" follow from them: "//text(plan%unknowns_after)//" unknowns, "// &
         text(plan%constraints_after)//" constraints are left")
      call print_line("formulation  "//trim(formulation_names(formulation))//", because "//decision)
      call print_line("")
      call print_line("matrix                     nonzeros   infinity norm")
      call print_matrix("mass M", problem%mass)
      call print_matrix("damping R", problem%damping)
      call print_matrix("stiffness K", problem%stiffness)
      call print_matrix("constraints Cq", problem%constraints)
   end subroutine print_problem

   subroutine print_matrix(name, matrix)
      character(len=*), intent(in) :: name
      type(csr_matrix_type), intent(in) :: matrix
      character(len=51) :: line

      write (line, "(a20, i15, a16)") adjustl(name//repeat(" ", 20)), matrix%nonzeros(), &
         rounded(matrix%infinity_norm())
      call print_line(line)
   end subroutine print_matrix

   function damping_text(problem)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable :: damping_text

      damping_text = trim(damping_names(problem%damping_kind))
      if (allocated(problem%dampers)) damping_text = damping_text//": "//trim(description_of(problem))
      if (problem%damping_kind == damping_proportional) damping_text = damping_text//", alpha "// &
         rounded(problem%alpha)//" 1/s, beta "//rounded(problem%beta)//" s"
   end function damping_text
end module cli_info
