!> Pictures and pages of modes, made by the Python script kschur-picture beside this program.
module cli_picture
   use cli_python, only: quoted, run_script
   use kschur, only: add_context, error_library, error_type, new_error, text
   implicit none
   private
   public :: draw_picture, make_page

contains

   !> Draws modes of a result to a file; Matplotlib chooses the format by its ending: .png, .pdf, .svg.
   subroutine draw_picture(result, modes, picture, error)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: picture
      type(error_type), allocatable, intent(out) :: error

      call draw("", result, modes, picture, "NumPy, SciPy and Matplotlib", error)
   end subroutine draw_picture

   !> Makes a page for a browser of some modes of a result file.
   subroutine make_page(result, modes, page, error)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: page
      type(error_type), allocatable, intent(out) :: error

      call draw("--html ", result, modes, page, "NumPy and SciPy, and three.js", error)
   end subroutine make_page

   subroutine draw(option, result, modes, picture, wants, error)
      character(len=*), intent(in) :: option, result, picture, wants
      integer, intent(in) :: modes(:)
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: words
      integer :: status, k

      words = option//quoted(result)//" "//quoted(picture)
      do k = 1, size(modes)
         words = words//" "//text(modes(k))
      end do
      call run_script("kschur-picture", words, status, error)
      if (allocated(error)) then
         call add_context(error, picture)
      else if (status /= 0) then
         call new_error(error, error_library, picture//": could not be drawn; it takes Python with "//wants)
      end if
   end subroutine draw
end module cli_picture
