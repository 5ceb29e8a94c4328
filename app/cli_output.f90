!> Prints a result in the requested format.
module cli_output
   use cli_arguments, only: arguments_type
   use cli_json, only: print_csv, print_json
   use cli_table, only: print_table
   use kschur, only: error_type, modal_result_type
   implicit none
   private
   public :: print_result, take_format

   !> Human-readable format, the default.
   integer, parameter, public :: format_table = 0
   !> Machine-readable formats.
   integer, parameter, public :: format_json = 1, format_csv = 2
   character(len=*), parameter :: formats(0:2) = [character(len=5) :: "table", "json", "csv"]

contains

   !> Takes the option --format; the default is the table.
   subroutine take_format(arguments, format, error)
      type(arguments_type), intent(inout) :: arguments
      integer, intent(out) :: format
      type(error_type), allocatable, intent(inout) :: error

      format = format_table
      call arguments%take_choice("--format", formats, format, error)
   end subroutine take_format

   !> Prints the result in a format that `take_format` gave.
   subroutine print_result(result, format, verbose)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: format
      logical, intent(in) :: verbose

      select case (trim(formats(format)))
      case ("json")
         call print_json(result)
      case ("csv")
         call print_csv(result)
      case default
         call print_table(result, verbose)
      end select
   end subroutine print_result
end module cli_output
