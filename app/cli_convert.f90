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

   !> Runs the command. If the script fails, it has printed the reason, and the program exits with its status.
   subroutine convert_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      call run_script("kschur-convert", joined(arguments%rest()), status, error)
      if (.not. allocated(error) .and. status /= 0) call end_program(status)
   end subroutine convert_command

   ! Joins words to a shell command.
   pure function joined(words) result(line)
      character(len=*), intent(in) :: words(:)
      character(len=:), allocatable :: line
      integer :: i

      allocate (character(len=0) :: line)
      do i = 1, size(words)
         line = line//" "//quoted(trim(words(i)))
      end do
   end function joined
end module cli_convert
