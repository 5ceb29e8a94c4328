!> kschur view: the modes of a result as files for ParaView, as a picture, and as a page for a browser.
module cli_view
   use cli_arguments, only: arguments_type
   use cli_numbers, only: read_integer
   use cli_picture, only: draw_picture, make_page
   use cli_scratch, only: make_scratch, remove_scratch
   use cli_system, only: check_new_file, check_new_folder, print_line
   use kschur, only: add_context, error_input, error_type, error_usage, modal_problem_type, modal_result_type, new_error, &
      read_hdf5_problem, read_hdf5_result, read_hdf5_sweep_point, text, write_hdf5_result, write_view, wp
   implicit none
   private
   public :: view_command

   !> Request of `kschur view`.
   type :: request_type
      character(len=:), allocatable :: result, output, picture, html, modes, problem
      !> Of a sweep; 0: a result.
      integer :: point = 0
      integer :: frames = 12
      !> Largest displacement in the frames, relative to the size of the structure.
      real(wp) :: amplitude = 0.1_wp
   end type request_type

contains

   !> Runs the command.
   subroutine view_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      type(request_type) :: request
      type(modal_result_type) :: result
      integer, allocatable :: modes(:)

      call take_request(arguments, request, error)
      if (.not. allocated(error) .and. allocated(request%output)) call check_new_folder(request%output, error)
      if (.not. allocated(error) .and. allocated(request%picture)) call check_new_file(request%picture, error)
      if (.not. allocated(error) .and. allocated(request%html)) call check_new_file(request%html, error)
      if (allocated(error)) return
      if (request%point > 0) then
         call read_hdf5_sweep_point(result, request%result, request%point, error, trial=.true.)
      else
         call read_hdf5_result(result, request%result, error, trial=.true.)
      end if
      if (.not. allocated(error)) call choose_modes(request, size(result%eigenvalues), modes, error)
      if (allocated(error)) return
      if (.not. allocated(result%mesh)) then
         call new_error(error, error_input, "its problem did not say where the unknowns stand: kschur help view")
         call add_context(error, request%result)
         return
      end if
      if (allocated(request%problem)) call check_problem(request, result, error)
      if (allocated(error)) return
      if (allocated(request%output)) then
         call write_view(result, modes, request%frames, request%amplitude, request%output, error)
         if (.not. allocated(error)) call print_line(request%output//": "//text(size(modes))//" modes on "// &
            text(result%mesh%nodes())//" nodes, open modes.pvd or mode_"//text(modes(1))//".pvd")
      end if
      if (allocated(request%picture) .and. .not. allocated(error)) then
         call draw(request, result, modes, .false., request%picture, error)
         if (.not. allocated(error)) call print_line(request%picture//": "//text(size(modes))//" modes")
      end if
      if (allocated(request%html) .and. .not. allocated(error)) then
         call draw(request, result, modes, .true., request%html, error)
         if (.not. allocated(error)) call print_line(request%html//": "//text(size(modes))//" modes, open it in a browser")
      end if
   end subroutine view_command

   ! Fails unless --problem names a problem with the unknowns of the result.
   subroutine check_problem(request, result, error)
      type(request_type), intent(in) :: request
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: problem

      call read_hdf5_problem(problem, request%problem, error, trial=.true.)
      if (allocated(error)) return
      if (problem%unknowns() /= result%unknowns) call new_error(error, error_input, request%problem//": the problem has "// &
         text(problem%unknowns())//" unknowns, "//request%result//" has "//text(result%unknowns))
   end subroutine check_problem

   ! Draws modes by a script, which reads a result file: for a point of a sweep, writes a temporary one.
   subroutine draw(request, result, modes, as_page, drawing, error)
      type(request_type), intent(in) :: request
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: modes(:)
      !> A page for a browser, else a picture.
      logical, intent(in) :: as_page
      character(len=*), intent(in) :: drawing
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: folder

      if (request%point == 0) then
         call draw_file(request%result)
         return
      end if
      call make_scratch(drawing, folder, error)
      if (allocated(error)) return
      call write_hdf5_result(result, folder//"/point_"//text(request%point)//".h5", error)
      if (.not. allocated(error)) call draw_file(folder//"/point_"//text(request%point)//".h5")
      call remove_scratch(folder)

   contains

      subroutine draw_file(path)
         character(len=*), intent(in) :: path

         if (as_page) then
            call make_page(path, modes, drawing, error, request%problem)
         else
            call draw_picture(path, modes, drawing, error)
         end if
      end subroutine draw_file
   end subroutine draw

   subroutine take_request(arguments, request, error)
      type(arguments_type), intent(inout) :: arguments
      type(request_type), intent(out) :: request
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: amplitude

      call arguments%take_text("--output", request%output, error, "the name of a folder")
      call arguments%take_text("--picture", request%picture, error)
      call arguments%take_text("--html", request%html, error)
      call arguments%take_text("--problem", request%problem, error, "the file of the problem")
      call arguments%take_text("--modes", request%modes, error, "numbers of modes, as 1,3,7")
      call arguments%take_integer("--point", 1, request%point, error)
      call arguments%take_integer("--frames", 0, request%frames, error)
      call arguments%take_positive("--amplitude", amplitude, error)
      if (allocated(amplitude)) request%amplitude = amplitude
      call arguments%take_word(request%result)
      call arguments%check_all_taken(error)
      if (allocated(error)) return
      if (.not. allocated(request%result)) then
         call new_error(error, error_usage, "no result is given; see kschur help view")
      else if (.not. (allocated(request%output) .or. allocated(request%picture) .or. allocated(request%html))) then
         call new_error(error, error_usage, "kschur view wants --output FOLDER, --picture FILE.png or --html FILE.html")
      else if (allocated(request%problem) .and. .not. allocated(request%html)) then
         call new_error(error, error_usage, "--problem is for the page of --html, which shows its constraints and strain energies")
      else if (allocated(request%picture)) then
         if (.not. is_picture(request%picture)) call new_error(error, error_usage, "--picture wants a file that ends in .png, "// &
            ".pdf or .svg, not '"//request%picture//"'; modes move on the page of --html, which saves films of them")
      end if
   end subroutine take_request

   ! Whether Matplotlib knows the ending of a name.
   pure logical function is_picture(name)
      character(len=*), intent(in) :: name
      character(len=*), parameter :: endings(11) = [character(len=5) :: ".png", ".pdf", ".svg", ".svgz", ".eps", ".ps", ".jpg", &
         ".jpeg", ".tif", ".tiff", ".webp"]
      character(len=:), allocatable :: ending
      integer :: i

      ending = name(max(1, index(name, ".", back=.true.)):)
      do i = 1, len(ending)
         if (lge(ending(i:i), "A") .and. lle(ending(i:i), "Z")) ending(i:i) = achar(iachar(ending(i:i)) + 32)
      end do
      is_picture = any(endings == ending)
   end function is_picture

   ! Chooses the modes that --modes lists, or all without it.
   subroutine choose_modes(request, found, modes, error)
      type(request_type), intent(in) :: request
      integer, intent(in) :: found
      integer, allocatable, intent(out) :: modes(:)
      type(error_type), allocatable, intent(inout) :: error
      integer :: first, last, mode, k
      logical :: valid

      if (found == 0) then
         call new_error(error, error_usage, request%result//": there are no modes in it")
      else if (.not. allocated(request%modes)) then
         allocate (modes(found), source=[(k, k=1, found)])
      else
         allocate (modes(0))
         first = 1
         do while (first <= len(request%modes) + 1 .and. .not. allocated(error))
            last = first + index(request%modes(first:)//",", ",") - 2
            call read_integer(request%modes(first:last), mode, valid)
            if (valid) valid = mode >= 1 .and. mode <= found
            if (.not. valid) call new_error(error, error_usage, "--modes wants numbers from 1 to "//text(found)// &
               ", as 1,3,7, not '"//request%modes//"'")
            modes = [modes, mode]
            first = last + 2
         end do
      end if
   end subroutine choose_modes
end module cli_view
