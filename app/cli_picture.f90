!> Pictures and pages of modes, sweeps and responses, made by the Python script kschur-picture beside this program.
module cli_picture
   use cli_numbers, only: plain
   use cli_python, only: quoted, run_script
   use kschur, only: add_context, error_library, error_type, new_error, text, wp
   implicit none
   private
   public :: draw_picture, make_page, make_response_page, make_sweep_page

   character(len=*), parameter :: for_pages = "NumPy and SciPy, and three.js"

contains

   !> Draws modes of a result to a file; Matplotlib chooses the format by its ending: .png, .pdf, .svg.
   subroutine draw_picture(result, modes, picture, error)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: picture
      type(error_type), allocatable, intent(out) :: error

      call draw(quoted(result)//" "//quoted(picture)//numbers(modes), picture, "NumPy, SciPy and Matplotlib", error)
   end subroutine draw_picture

   !> Makes a page for a browser of some modes of a result file, with strain energies and constraints if the problem is given.
   subroutine make_page(result, modes, page, error, problem)
      character(len=*), intent(in) :: result
      !> Numbers of modes, counted from 1.
      integer, intent(in) :: modes(:)
      character(len=*), intent(in) :: page
      type(error_type), allocatable, intent(out) :: error
      !> HDF5 file of the problem of the result; not allocated: none.
      character(len=:), allocatable, intent(in) :: problem

      if (allocated(problem)) then
         call draw("--html "//quoted(result)//" "//quoted(page)//numbers(modes)//" --problem "//quoted(problem), page, &
            "h5py, "//for_pages, error)
      else
         call draw("--html "//quoted(result)//" "//quoted(page)//numbers(modes), page, for_pages, error)
      end if
   end subroutine make_page

   !> Makes a page for a browser of a sweep, with lines of frequencies at multiples of the speed.
   subroutine make_sweep_page(folder, orders, page, error)
      !> With the sweep, sweep.h5, and the results of some points, point_1.h5 and so on.
      character(len=*), intent(in) :: folder
      real(wp), intent(in) :: orders(:)
      character(len=*), intent(in) :: page
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: words
      integer :: k

      words = "--sweep "//quoted(folder)//" "//quoted(page)
      do k = 1, size(orders)
         words = words//" "//plain(orders(k), "0")
      end do
      call draw(words, page, for_pages, error)
   end subroutine make_sweep_page

   !> Makes a page for a browser of a response.
   subroutine make_response_page(response, at, page, error)
      !> Its file.
      character(len=*), intent(in) :: response
      !> Unknowns, counted from 1.
      integer, intent(in) :: at(:)
      character(len=*), intent(in) :: page
      type(error_type), allocatable, intent(out) :: error

      call draw("--response "//quoted(response)//" "//quoted(page)//numbers(at), page, "h5py, "//for_pages, error)
   end subroutine make_response_page

   ! Numbers as words of a command line, each after a blank.
   pure function numbers(list) result(words)
      integer, intent(in) :: list(:)
      character(len=:), allocatable :: words
      integer :: k

      allocate (character(len=0) :: words)
      do k = 1, size(list)
         words = words//" "//text(list(k))
      end do
   end function numbers

   ! Runs kschur-picture with these words. An error names the picture, and `wants`, the Python packages that it takes.
   subroutine draw(words, picture, wants, error)
      character(len=*), intent(in) :: words, picture, wants
      type(error_type), allocatable, intent(out) :: error
      integer :: status

      call run_script("kschur-picture", words, status, error)
      if (allocated(error)) then
         call add_context(error, picture)
      else if (status /= 0) then
         call new_error(error, error_library, picture//": could not be drawn; it takes Python with "//wants)
      end if
   end subroutine draw
end module cli_picture
