!> kschur solve: reads a problem, computes its modes, writes and prints them.
module cli_solve
   use cli_arguments, only: arguments_type
   use cli_interrupt, only: catch_interrupts
   use cli_input, only: input_type, is_large, is_part_of, read_shared_problem, take_input
   use cli_numbers, only: rounded
   use cli_options, only: take_iteration, take_wanted
   use cli_output, only: format_table, print_result, take_format
   use cli_processes, only: gather_processes
   use cli_properties, only: print_properties, read_directions, take_properties
   use cli_progress, only: new_progress, progress_type
   use cli_shortfall, only: shortfall, take_interrupt
   use cli_system, only: check_new_file, check_output, complain, peak_memory_bytes, print_line, wall_seconds
   use cli_environment, only: start_again_to_wait_asleep
   use kschur, only: arpack_names, certified_no, error_type, error_usage, find_modal_properties, formulation_names, &
      method_arpack, method_names, modal_options_type, modal_result_type, new_error, normalisation_names, reason_converged, &
      shared_problem_type, solve_band, solve_modes, text, wp, write_hdf5_result
   implicit none
   private
   public :: solve_command

   !> Request of `kschur solve`.
   type :: request_type
      type(input_type) :: input
      type(modal_options_type) :: options
      !> All modes of a band of frequencies (Hz); not allocated: those nearest to a target.
      real(wp), allocatable :: band(:)
      !> Where to write the result; not allocated: nowhere.
      character(len=:), allocatable :: output
      integer :: format = 0
      logical :: quiet = .false., verbose = .false.
      !> Whether modal properties are wanted, and the file of directions.
      logical :: properties = .false.
      character(len=:), allocatable :: directions
   end type request_type

contains

   !> Runs the command; `complete` is false if fewer modes were found than asked for, or a count finds that modes are missing.
   subroutine solve_command(arguments, complete, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(request_type) :: request
      type(shared_problem_type) :: shared
      type(modal_result_type) :: result
      type(progress_type) :: progress
      real(wp), allocatable :: directions(:, :)
      real(wp) :: started, read_seconds, write_seconds

      complete = .false.
      call take_request(arguments, request, error)
      if (.not. allocated(error) .and. allocated(request%output)) call check_new_file(request%output, error)
      if (.not. allocated(error) .and. allocated(request%options%checkpoint)) &
         call check_new_file(request%options%checkpoint, error)
      if (allocated(error)) return
      if (request%options%threads /= 1) then
         if (is_large(request%input)) call start_again_to_wait_asleep()
      end if
      progress = new_progress(request%quiet)
      call progress%show("reading")
      started = wall_seconds()
      call read_shared_problem(request%input, shared, error)
      read_seconds = wall_seconds() - started
      if (.not. allocated(error)) then
         if (request%properties) call read_directions(request%directions, shared%problem%unknowns(), directions, error)
         if (request%properties .and. .not. shared%problem%symmetric) request%options%left = .true.
      end if
      if (.not. allocated(error)) then
         call gather_processes(request%options)
         call catch_interrupts()
         if (allocated(request%band)) then
            call solve_band(shared%problem, request%band(1), request%band(2), request%options, result, error, progress)
         else
            call solve_modes(shared, request%options, result, error, progress)
         end if
      end if
      call progress%finish()
      if (.not. allocated(error) .and. request%properties) &
         call find_modal_properties(shared%problem, result, error, directions)
      if (allocated(error)) return

      call take_interrupt(result)
      result%peak_memory_bytes = peak_memory_bytes()
      started = wall_seconds()
      if (allocated(request%output)) call write_hdf5_result(result, request%output, error)
      write_seconds = wall_seconds() - started
      call print_result(result, request%format, request%verbose)
      if (request%verbose .and. request%format == format_table) call print_line("files    read "// &
         rounded(read_seconds)//" s, write "//rounded(write_seconds)//" s")
      if (request%properties .and. request%format == format_table) call print_properties(result%properties)
      call check_output(error)
      if (allocated(error)) return
      complete = result%reason == reason_converged .and. size(result%eigenvalues) >= result%modes_asked
      if (.not. complete) call complain(shortfall(result))
      if (result%missing > 0) then
         call complain("eigenvalues are missing among the modes: "//text(result%missing))
      else if (complete .and. result%certified == certified_no) then
         call complain("a count of eigenvalues does not agree: a mode may be missing")
      end if
      complete = complete .and. result%certified /= certified_no
      if (request%options%left) call complain_of_left(result)
   end subroutine solve_command

   subroutine take_request(arguments, request, error)
      type(arguments_type), intent(inout) :: arguments
      type(request_type), intent(out) :: request
      type(error_type), allocatable, intent(out) :: error

      associate (options => request%options)
         call take_wanted(arguments, options, error, request%band)
         call take_iteration(arguments, options, error)
         call take_method(arguments, options, error)
         call arguments%take_choice("--formulation", formulation_names, options%formulation, error)
         call arguments%take_choice("--normalise", normalisation_names, options%normalisation, error)
         call arguments%take_flag("--left", options%left, error)
         call arguments%take_switch("--certify", options%certify, options%uncounted, error)
      end associate

      call take_properties(arguments, request%properties, request%directions, error)
      call arguments%take_text("--output", request%output, error)
      call arguments%take_text("--checkpoint", request%options%checkpoint, error)
      call arguments%take_text("--resume", request%options%resume, error)
      call take_format(arguments, request%format, error)
      call arguments%take_integer("--threads", 1, request%options%threads, error)
      call arguments%take_flag("--quiet", request%quiet, error)
      call arguments%take_flag("--verbose", request%verbose, error)
      call take_input(arguments, request%input, error)
      if (allocated(error)) return
      if (request%quiet .and. request%verbose) &
         call new_error(error, error_usage, "--quiet and --verbose exclude each other")
      call check_place("--output", request%output)
      call check_place("--checkpoint", request%options%checkpoint)

   contains

      ! Fails if the file of an option is one of the problem.
      subroutine check_place(option, path)
         character(len=*), intent(in) :: option
         character(len=:), allocatable, intent(in) :: path

         if (allocated(error) .or. .not. allocated(path)) return
         if (is_part_of(request%input, path)) &
            call new_error(error, error_usage, option//" "//path//" would replace the problem")
      end subroutine check_place
   end subroutine take_request

   subroutine take_method(arguments, options, error)
      type(arguments_type), intent(inout) :: arguments
      type(modal_options_type), intent(inout) :: options
      type(error_type), allocatable, intent(inout) :: error
      integer :: method, setting

      method = 0
      setting = -1
      call arguments%take_choice("--method", [character(len=12) :: "auto", method_names], method, error)
      call arguments%take_choice("--arpack", arpack_names, setting, error)
      if (allocated(error)) return
      if (method > 0) options%method = method - 1
      if (setting >= 0) options%arpack = setting
      if (setting >= 0 .and. options%method /= method_arpack) &
         call new_error(error, error_usage, "--arpack "//trim(arpack_names(setting))//" wants --method arpack")
   end subroutine take_method

   ! Lists on standard error the modes for which no left eigenvector was found.
   subroutine complain_of_left(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: modes
      integer :: i

      modes = ""
      do i = 1, size(result%condition)
         if (.not. result%condition(i) >= 0) modes = modes//", "//text(i)
      end do
      if (modes /= "") call complain("no left eigenvector was found of the modes "//modes(3:))
   end subroutine complain_of_left
end module cli_solve
