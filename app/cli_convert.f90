!> kschur convert: files of other codes into HDF5, by the Python script kschur-convert beside this program.
module cli_convert
   use cli_arguments, only: arguments_type
   use cli_python, only: quoted, run_script
   use cli_system, only: end_program
   use kschur, only: error_type
   implicit none
   private
   public :: convert_command

contains

   !> Does the command; where the script fails it has said why, and the program ends with its status.
   subroutine convert_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: words(:), line
      integer :: i, status

      allocate (words, source=arguments%rest())
      line = ""
      do i = 1, size(words)
         line = line//" "//quoted(trim(words(i)))
      end do
      call run_script("kschur-convert", line, status, error)
      if (.not. allocated(error) .and. status /= 0) call end_program(status)
   end subroutine convert_command
end module cli_convert
