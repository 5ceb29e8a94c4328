!> kschur sweep --html: the diagrams of a sweep, with shapes, as a page for a browser.
module cli_sweep_page
   use cli_arguments, only: arguments_type
   use cli_numbers, only: read_list
   use cli_picture, only: make_sweep_page
   use cli_scratch, only: make_scratch, remove_scratch
   use kschur, only: error_type, error_usage, modal_result_type, new_error, sweep_type, text, wp, write_hdf5_result, &
      write_hdf5_sweep
   implicit none
   private
   public :: keep_shapes, make_page, page_type, prepare, take_page

   !> Request of a page, with multiples of the speed to draw, and the temporary folder of its files. No path: no page is made.
   type :: page_type
      character(len=:), allocatable :: path, folder
      real(wp), allocatable :: orders(:)
   end type page_type

contains

   !> Takes --html and --orders.
   subroutine take_page(arguments, page, error)
      type(arguments_type), intent(inout) :: arguments
      type(page_type), intent(out) :: page
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: orders
      logical :: ok

      call arguments%take_text("--html", page%path, error, "the name of a page, as sweep.html")
      call arguments%take_text("--orders", orders, error, "multiples of the speed, N1,N2,...")
      allocate (page%orders(0))
      if (allocated(error) .or. .not. allocated(orders)) return
      call read_list(orders, page%orders, ok)
      if (.not. ok) call new_error(error, error_usage, "--orders wants numbers, N1,N2,..., not '"//orders//"'")
      if (ok .and. .not. allocated(page%path)) &
         call new_error(error, error_usage, "--orders is for a page, and --html names none")
   end subroutine take_page

   !> Checks the unit for --orders and makes the temporary folder: before the solves, so that a mistake does not waste them.
   subroutine prepare(page, unit, error)
      type(page_type), intent(inout) :: page
      !> That of the parameter.
      character(len=*), intent(in) :: unit
      type(error_type), allocatable, intent(out) :: error
      character(len=*), parameter :: of_speeds(5) = [character(len=5) :: "rpm", "1/min", "Hz", "1/s", "rad/s"]

      if (.not. allocated(page%path)) return
      if (size(page%orders) > 0 .and. .not. any(of_speeds == unit)) call new_error(error, error_usage, &
         "--orders wants the --unit of a speed: rpm, 1/min, Hz, 1/s or rad/s, not '"//unit//"'")
      if (.not. allocated(error)) call make_scratch(page%path, page%folder, error)
   end subroutine prepare

   !> Writes the modes of a point to the folder, for the shapes on the page. If the sweep has more displacements than a page can
   !> hold, leaves out points, evenly.
   subroutine keep_shapes(page, point, points, result, error)
      type(page_type), intent(in) :: page
      !> Its number, from 1, and how many there are.
      integer, intent(in) :: point, points
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: most_displacements = 2.0e6_wp
      integer :: every

      if (.not. (allocated(page%folder) .and. allocated(result%mesh))) return
      every = ceiling(real(points, wp)*size(result%eigenvalues)*result%mesh%nodes()/most_displacements)
      if (mod(point - 1, max(every, 1)) == 0) &
         call write_hdf5_result(result, page%folder//"/point_"//text(point)//".h5", error)
   end subroutine keep_shapes

   !> Makes the page, unless there is no point or an error is raised, and removes the folder.
   subroutine make_page(page, sweep, parameter, unit, error)
      type(page_type), intent(in) :: page
      type(sweep_type), intent(in) :: sweep
      !> The name of the parameter and its unit.
      character(len=*), intent(in) :: parameter, unit
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(page%folder)) return
      if (.not. allocated(error) .and. size(sweep%values) > 0) then
         call write_hdf5_sweep(sweep, parameter, page%folder//"/sweep.h5", error, unit)
         if (.not. allocated(error)) call make_sweep_page(page%folder, page%orders, page%path, error)
      end if
      call remove_scratch(page%folder)
   end subroutine make_page
end module cli_sweep_page
