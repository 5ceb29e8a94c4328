!> Runs the Python scripts installed beside this program.
module cli_python
   use cli_system, only: real_path
   use kschur, only: error_library, error_type, new_error
   implicit none
   private
   public :: quoted, run_script

contains

   !> Runs a script with `quoted` words; `status` is its exit status. Fails if it is missing or cannot be run.
   subroutine run_script(name, words, status, error)
      character(len=*), intent(in) :: name, words
      integer, intent(out) :: status
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: script
      logical :: exists
      integer :: failed

      status = 0
      script = real_path("/proc/self/exe")
      script = script(:index(script, "/", back=.true.))//name
      inquire (file=script, exist=exists)
      if (.not. exists) then
         call new_error(error, error_library, "there is no "//script//", which takes Python and the shared library")
         return
      end if
      call execute_command_line(quoted(script)//" "//words, exitstat=status, cmdstat=failed)
      if (failed /= 0) call new_error(error, error_library, script//" cannot be run; it takes Python with NumPy, SciPy and h5py")
   end subroutine run_script

   !> Quotes a word for the shell.
   pure function quoted(word)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: quoted
      integer :: i

      quoted = "'"
      do i = 1, len(word)
         if (word(i:i) == "'") then
            quoted = quoted//"'\''"
         else
            quoted = quoted//word(i:i)
         end if
      end do
      quoted = quoted//"'"
   end function quoted
end module cli_python
