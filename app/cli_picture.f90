!> Pictures and pages of modes, made by the Python script kschur-picture beside this program.
module cli_picture
   use cli_system, only: real_path
   use kschur, only: error_library, error_type, new_error, text
   implicit none
   private
   public :: draw_picture, make_page

contains

   !> Draws some modes of a result file into a file of a format that Matplotlib knows, by its ending: .png, .pdf, .svg.
   subroutine draw_picture(result, modes, picture, error)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: picture
      type(error_type), allocatable, intent(out) :: error

      call run_script("", result, modes, picture, "NumPy, SciPy and Matplotlib", error)
   end subroutine draw_picture

   !> Makes a page for a browser of some modes of a result file.
   subroutine make_page(result, modes, page, error)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: page
      type(error_type), allocatable, intent(out) :: error

      call run_script(" --html", result, modes, page, "NumPy and SciPy, and three.js", error)
   end subroutine make_page

   subroutine run_script(option, result, modes, picture, wants, error)
      character(len=*), intent(in) :: option, result, picture, wants
      integer, intent(in) :: modes(:)
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: script, command
      logical :: exists
      integer :: failed, status, k

      script = real_path("/proc/self/exe")
      script = script(:index(script, "/", back=.true.))//"kschur-picture"
      inquire (file=script, exist=exists)
      if (.not. exists) then
         call new_error(error, error_library, picture//": there is no "//script//" to draw it")
         return
      end if
      command = quoted(script)//option//" "//quoted(result)//" "//quoted(picture)
      do k = 1, size(modes)
         command = command//" "//text(modes(k))
      end do
      status = 0
      call execute_command_line(command, exitstat=status, cmdstat=failed)
      if (failed /= 0 .or. status /= 0) call new_error(error, error_library, picture// &
         ": could not be drawn; it takes Python with "//wants)
   end subroutine run_script

   ! One word for the shell.
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
end module cli_picture
