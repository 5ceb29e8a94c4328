!> The program `kschur`: runs one command and ends with its exit status.
program kschur_program
   use cli_arguments, only: arguments_type, command_arguments
   use cli_compare, only: compare_command
   use cli_convert, only: convert_command
   use cli_environment, only: keep_one_blas_thread
   use cli_help, only: command_names, print_help, print_version
   use cli_interrupt, only: let_signals
   use cli_info, only: info_command
   use cli_mac, only: mac_command
   use cli_processes, only: start_processes
   use cli_response, only: response_command
   use cli_scene, only: scene_command
   use cli_sensitivity, only: sensitivity_command
   use cli_sweep, only: sweep_command
   use cli_solve, only: solve_command
   use cli_system, only: check_output, complain, end_program, ignore_size_signal
   use cli_view, only: view_command
   use kschur, only: did_you_mean, error_input, error_type, error_usage, new_error
   implicit none

   integer, parameter :: status_usage = 1, status_input = 2, status_incomplete = 3, status_failure = 4
   type(arguments_type) :: arguments
   type(error_type), allocatable :: error
   character(len=:), allocatable :: command
   logical :: complete, help, version

   complete = .true.
   call keep_one_blas_thread()
   call ignore_size_signal()
   call start_processes(error)
   call let_signals()
   arguments = command_arguments()
   call arguments%take_word(command)
   if (.not. allocated(command)) allocate (character(len=0) :: command)
   if (.not. allocated(error)) call take_flags()
   if (.not. allocated(error)) call do_command()
   call check_output(error)

   if (allocated(error)) then
      call complain(error%message)
      select case (error%code)
      case (error_usage)
         call end_program(status_usage)
      case (error_input)
         call end_program(status_input)
      case default
         call end_program(status_failure)
      end select
   end if
   call end_program(merge(0, status_incomplete, complete))

contains

   ! Takes --help and --version.
   subroutine take_flags()
      call arguments%take_flag("--help", help, error)
      call arguments%take_flag("--version", version, error)
   end subroutine take_flags

   subroutine do_command()
      character(len=:), allocatable :: hint, topic

      if (version) then
         call print_version()
      else if (help) then
         call help_on(command)
      else
         select case (command)
         case ("solve")
            call solve_command(arguments, complete, error)
         case ("compare")
            call compare_command(arguments, complete, error)
         case ("convert")
            call convert_command(arguments, error)
         case ("mac")
            call mac_command(arguments, error)
         case ("sensitivity")
            call sensitivity_command(arguments, complete, error)
         case ("response")
            call response_command(arguments, complete, error)
         case ("sweep")
            call sweep_command(arguments, complete, error)
         case ("scene")
            call scene_command(arguments, error)
         case ("info")
            call info_command(arguments, error)
         case ("view")
            call view_command(arguments, error)
         case ("help")
            call arguments%take_word(topic)
            if (.not. allocated(topic)) allocate (character(len=0) :: topic)
            call help_on(topic)
         case ("")
            call arguments%check_all_taken(error)
            if (.not. allocated(error)) call new_error(error, error_usage, "no command is given; see kschur help")
         case default
            hint = did_you_mean(command, command_names)
            if (hint == "") hint = "; see kschur help"
            call new_error(error, error_usage, "unknown command '"//command//"'"//hint)
         end select
      end if
   end subroutine do_command

   ! Prints the help on a command, or, for `scene`, on the scene that the next word names.
   subroutine help_on(topic)
      character(len=*), intent(in) :: topic
      character(len=:), allocatable :: scene

      if (topic == "scene") call arguments%take_word(scene)
      if (.not. allocated(scene)) allocate (character(len=0) :: scene)
      call print_help(topic, scene, error)
   end subroutine help_on
end program kschur_program
