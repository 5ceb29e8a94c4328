!> kschur response: response to a harmonic force at given frequencies.
module cli_response
   use cli_arguments, only: arguments_type
   use cli_columns, only: print_columns
   use cli_input, only: input_type, is_part_of, read_problem, take_input
   use cli_interrupt, only: catch_interrupts
   use cli_numbers, only: read_integer, read_list, read_range
   use cli_output, only: format_table, take_format
   use cli_picture, only: make_response_page
   use cli_progress, only: new_progress, progress_type
   use cli_properties, only: read_directions
   use cli_scratch, only: make_scratch, remove_scratch
   use cli_system, only: check_new_file, check_output, complain
   use kschur, only: error_input, error_type, error_usage, frequency_response, index_of_name, join_nodes, mesh_type, &
      modal_problem_type, new_error, rigid_motion_names, text, wp, write_hdf5_response
   implicit none
   private
   public :: response_command

   ! Largest number of frequencies.
   integer, parameter :: most_points = 1000000

   !> Request of `kschur response`.
   type :: request_type
      type(input_type) :: input
      real(wp), allocatable :: frequencies(:)
      !> An unknown, a rigid motion of the mesh, or a file.
      character(len=:), allocatable :: force
      !> Unknowns that are printed; not allocated: the one where the force is largest.
      integer, allocatable :: at(:)
      character(len=:), allocatable :: output, html
      integer :: format = format_table
      logical :: quiet = .false.
   end type request_type

contains

   !> Runs the command; `complete` is false if an interrupt left frequencies out.
   subroutine response_command(arguments, complete, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(request_type) :: request
      type(modal_problem_type) :: problem
      type(progress_type) :: progress
      type(mesh_type), allocatable :: mesh
      complex(wp), allocatable :: force(:, :), response(:, :, :), multipliers(:, :, :)
      integer :: asked

      complete = .false.
      call take_request(arguments, request, error)
      if (.not. allocated(error) .and. allocated(request%output)) call check_new_file(request%output, error)
      if (.not. allocated(error) .and. allocated(request%html)) call check_new_file(request%html, error)
      if (.not. allocated(error)) call read_problem(request%input, problem, error)
      if (.not. allocated(error)) call make_force(request%force, problem, force, error)
      if (.not. (allocated(error) .or. allocated(request%at))) request%at = [maxloc(abs(force(:, 1)), 1)]
      if (.not. allocated(error)) call check_unknowns(request%at, problem%unknowns(), error)
      if (allocated(error)) return
      progress = new_progress(request%quiet)
      call catch_interrupts()
      if (allocated(request%output) .or. allocated(request%html)) then
         call frequency_response(problem, request%frequencies, force, response, error, multipliers, monitor=progress)
      else
         call frequency_response(problem, request%frequencies, force, response, error, unknowns=request%at, monitor=progress)
      end if
      call progress%finish()
      if (allocated(error)) return
      asked = size(request%frequencies)
      request%frequencies = request%frequencies(:size(response, 3))
      if (allocated(multipliers)) then
         if (allocated(problem%mesh)) then
            allocate (mesh, source=problem%mesh)
            call join_nodes(mesh, problem%stiffness)
         end if
         if (allocated(request%output)) call write_hdf5_response(request%frequencies, force(:, 1), response(:, 1, :), &
            multipliers(:, 1, :), mesh, request%output, error)
         call print_response(request, response(request%at, 1, :))
      else
         call print_response(request, response(:, 1, :))
      end if
      call check_output(error)
      complete = size(request%frequencies) == asked
      if (.not. complete) call complain("the response was interrupted after "//text(size(request%frequencies))//" of "// &
         text(asked)//" frequencies")
      ! Last: all else is there where it fails.
      if (allocated(request%html) .and. .not. allocated(error)) &
         call make_page(request, mesh, force(:, 1), response(:, 1, :), multipliers(:, 1, :), error)
   end subroutine response_command

   ! Makes the page for a browser from a temporary file; none if the response has no frequency.
   subroutine make_page(request, mesh, force, response, multipliers, error)
      type(request_type), intent(in) :: request
      type(mesh_type), allocatable, intent(in) :: mesh
      complex(wp), intent(in) :: force(:), response(:, :), multipliers(:, :)
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: folder

      if (size(request%frequencies) == 0) return
      call make_scratch(request%html, folder, error)
      if (allocated(error)) return
      call write_hdf5_response(request%frequencies, force, response, multipliers, mesh, folder//"/response.h5", error)
      if (.not. allocated(error)) call make_response_page(folder//"/response.h5", request%at, request%html, error)
      call remove_scratch(folder)
   end subroutine make_page

   subroutine take_request(arguments, request, error)
      type(arguments_type), intent(inout) :: arguments
      type(request_type), intent(out) :: request
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: frequencies, at
      real(wp), allocatable :: numbers(:)
      logical :: ok

      call arguments%take_text("--frequencies", frequencies, error, "FIRST:LAST:POINTS or F1,F2,... in Hz")
      call arguments%take_text("--input", request%force, error, "an unknown, a direction of the mesh or a file")
      call arguments%take_text("--at", at, error, "unknowns, N1,N2,...")
      call arguments%take_text("--output", request%output, error)
      call arguments%take_text("--html", request%html, error, "the name of a page, as response.html")
      call take_format(arguments, request%format, error)
      call arguments%take_flag("--quiet", request%quiet, error)
      call take_input(arguments, request%input, error)
      if (allocated(error)) return
      if (.not. (allocated(frequencies) .and. allocated(request%force))) then
         call new_error(error, error_usage, "kschur response wants --frequencies and --input")
         return
      end if
      call read_range(frequencies, most_points, request%frequencies, ok)
      if (.not. ok) call read_list(frequencies, request%frequencies, ok)
      if (ok) ok = all(request%frequencies >= 0)
      if (.not. ok) call new_error(error, error_usage, "--frequencies wants FIRST:LAST:POINTS with two to "// &
         text(most_points)//" points, or F1,F2,..., none negative, not '"//frequencies//"'")
      if (allocated(at) .and. .not. allocated(error)) then
         call read_list(at, numbers, ok)
         if (ok) ok = all(numbers >= 1 .and. numbers <= huge(1) .and. .not. abs(numbers - aint(numbers)) > 0)
         if (.not. ok) call new_error(error, error_usage, "--at wants numbers of unknowns from 1, not '"//at//"'")
         if (ok) request%at = int(numbers)
      end if
      if (.not. allocated(error) .and. allocated(request%output)) call check_apart(request%input, request%output, error)
      if (.not. allocated(error) .and. allocated(request%html)) call check_apart(request%input, request%html, error)
   end subroutine take_request

   ! Fails if a path names a file of the problem.
   subroutine check_apart(input, path, error)
      type(input_type), intent(in) :: input
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error

      if (is_part_of(input, path)) call new_error(error, error_usage, path//" would replace the problem")
   end subroutine check_apart

   subroutine check_unknowns(numbers, n, error)
      integer, intent(in) :: numbers(:), n
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(numbers)
         if (allocated(error)) return
         if (numbers(i) < 1 .or. numbers(i) > n) &
            call new_error(error, error_usage, "there is no unknown "//text(numbers(i))//": the problem has "//text(n))
      end do
   end subroutine check_unknowns

   ! Creates the force: 1 at an unknown; the inertia force of a ground motion along a direction of the mesh; or a column of a
   ! file.
   subroutine make_force(word, problem, force, error)
      character(len=*), intent(in) :: word
      type(modal_problem_type), intent(in) :: problem
      complex(wp), allocatable, intent(out) :: force(:, :)
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: path
      real(wp), allocatable :: columns(:, :), motions(:, :)
      integer :: unknown, direction
      logical :: ok

      allocate (force(problem%unknowns(), 1), source=(0.0_wp, 0.0_wp))
      call read_integer(word, unknown, ok)
      direction = index_of_name(word, rigid_motion_names) + 1
      if (ok) then
         call check_unknowns([unknown], size(force), error)
         if (.not. allocated(error)) force(unknown, 1) = 1
      else if (direction > 0) then
         if (.not. allocated(problem%mesh)) then
            call new_error(error, error_input, "--input "//word//" is a direction, and the problem has no /coordinates")
            return
         end if
         call problem%mesh%rigid_motions(motions)
         call problem%mass%add_product((-1.0_wp, 0.0_wp), cmplx(motions(:, direction:direction), kind=wp), force)
      else
         path = word
         call read_directions(path, size(force), columns, error)
         if (allocated(error)) return
         if (size(columns, 2) == 1) then
            force(:, 1) = columns(:, 1)
         else
            call new_error(error, error_input, path//": the force has "//text(size(columns, 2))//" columns but must have one")
         end if
      end if
      if (.not. (allocated(error) .or. any(abs(force) > 0))) &
         call new_error(error, error_input, "--input "//word//": the force is zero")
   end subroutine make_force

   ! Prints the response, points x unknowns: amplitudes and phases in the table, real and imaginary parts in JSON and CSV.
   subroutine print_response(request, response)
      type(request_type), intent(in) :: request
      complex(wp), intent(in) :: response(:, :)
      real(wp), parameter :: degrees = 45/atan(1.0_wp)
      character(len=24), allocatable :: names(:), units(:)
      real(wp), allocatable :: values(:, :)
      integer :: i

      allocate (names(1 + 2*size(request%at)), units(1 + 2*size(request%at)))
      allocate (values(size(request%frequencies), size(names)))
      names(1) = "frequency_hz"
      units = ""
      values(:, 1) = request%frequencies
      do i = 1, size(request%at)
         associate (x => response(i, :), unknown => "unknown_"//text(request%at(i)))
            if (request%format == format_table) then
               names(2*i:2*i + 1) = unknown
               units(2*i) = "amplitude"
               units(2*i + 1) = "phase, degrees"
               values(:, 2*i) = abs(x)
               values(:, 2*i + 1) = degrees*atan2(aimag(x), real(x, wp))
            else
               names(2*i) = unknown//"_re"
               names(2*i + 1) = unknown//"_im"
               values(:, 2*i) = real(x, wp)
               values(:, 2*i + 1) = aimag(x)
            end if
         end associate
      end do
      call print_columns("point", names, units, values, request%format)
   end subroutine print_response
end module cli_response
