!> Sweeps over a parameter, for C.
module kschur_capi_sweep
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_f_procpointer, c_funptr, c_int, c_int64_t, c_loc, &
      c_null_funptr, c_null_ptr, c_ptr
   use kschur, only: error_type, is_hdf5_sweep, kept_result_type, modal_problem_type, modal_result_type, new_error, new_sweep, &
      problem_family_type, read_hdf5_sweep, read_hdf5_sweep_point, reason_cancelled, sweep_type, text, wp, write_hdf5_sweep
   use kschur_capi_arrays, only: give_array, put
   use kschur_capi_callbacks, only: progress_type
   use kschur_capi_options, only: options_handle_type, options_of
   use kschur_capi_problem, only: problem_handle_type, check_problem, problem_of
   use kschur_capi_result, only: result_handle_type, keep, modes_of_problem, result_of
   use kschur_capi_status, only: handle_type, check_returned, get_message, fail, give_text, outcome, require, status_memory, &
      status_null, status_ok, status_order, status_usage
   use kschur_capi_text, only: take_text
   implicit none
   private

   !> Family of problems that a kschur_problem_callback makes, one for each value of the parameter.
   type, extends(problem_family_type) :: called_family_type
      type(c_funptr) :: callback = c_null_funptr
      type(c_ptr) :: context = c_null_ptr
   contains
      procedure :: at => problem_at
   end type called_family_type

   abstract interface
      integer(c_int) function problem_interface(context, value, problem) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: context, problem
         real(c_double), value :: value
      end function problem_interface
   end interface

   !> Target of a `kschur_sweep` handle.
   type, extends(handle_type) :: sweep_handle_type
      !> Not allocated before the first point.
      type(sweep_type), allocatable :: sweep
      !> Of the last point; none where the sweep was read.
      type(modal_result_type) :: result
      type(called_family_type) :: family
      !> Name and unit of the parameter, if the sweep was read from a file: then no points can be added.
      character(len=:), allocatable :: parameter, unit
      !> Of which points that file keeps the results.
      logical, allocatable :: kept(:)
   end type sweep_handle_type

contains

#define HANDLE_TYPE sweep_handle_type
#define HANDLE_OF sweep_of
#define CREATE kschur_sweep_create
#define DESTROY kschur_sweep_destroy
#define MESSAGE kschur_sweep_get_message
#include "kschur_capi_handle.inc"

   integer(c_int) function kschur_sweep_set_problem(address, callback, context) bind(c) result(status)
      type(c_ptr), value :: address, context
      type(c_funptr), value :: callback
      type(sweep_handle_type), pointer :: handle

      status = status_null
      handle => sweep_of(address)
      if (.not. associated(handle)) return
      handle%family%callback = callback
      handle%family%context = context
      status = status_ok
   end function kschur_sweep_set_problem

   ! Has the callback make the problem at a value, and checks it.
   subroutine problem_at(self, value, problem, error)
      class(called_family_type), intent(inout) :: self
      real(wp), intent(in) :: value
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error
      procedure(problem_interface), pointer :: callback
      type(problem_handle_type), target :: made

      call c_f_procpointer(self%callback, callback)
      call check_returned(callback(self%context, value, c_loc(made)), "problem", error)
      if (.not. allocated(error)) call check_problem(made, error)
      if (.not. allocated(error)) problem = made%problem
   end subroutine problem_at

   integer(c_int) function kschur_sweep_add(address, value, problem, options) bind(c) result(status)
      type(c_ptr), value :: address, problem, options
      real(c_double), value :: value
      type(sweep_handle_type), pointer :: handle
      type(problem_handle_type), pointer :: given
      type(options_handle_type), pointer :: wanted
      type(progress_type) :: progress
      type(modal_result_type) :: result
      type(error_type), allocatable :: error

      status = status_null
      handle => sweep_of(address)
      if (.not. associated(handle)) return
      call require(problem, "problem", error)
      call require(options, "options", error)
      given => problem_of(problem)
      wanted => options_of(options)
      if (.not. allocated(error)) call check_problem(given, error)
      if (.not. allocated(error)) then
         if (allocated(wanted%solvers%real) .or. allocated(wanted%solvers%complex)) &
            call new_error(error, status_usage, "a sweep takes the linear solvers of the library")
      end if
      if (.not. allocated(error) .and. allocated(handle%parameter)) &
         call new_error(error, status_usage, "no points can be added to a sweep that was read")
      if (.not. allocated(error)) then
         if (.not. allocated(handle%sweep)) then
            allocate (handle%sweep)
            call new_sweep(handle%sweep, wanted%options)
         end if
         progress = wanted%progress
         if (c_associated(handle%family%callback)) then
            call handle%sweep%add(value, given%problem, error, result, progress, handle%family)
         else
            call handle%sweep%add(value, given%problem, error, result, progress)
         end if
      end if
      if (.not. allocated(error)) call handle%sweep%finish()
      if (.not. allocated(error) .and. result%reason /= reason_cancelled) handle%result = result
      status = outcome(handle, error)
   end function kschur_sweep_add

   integer(c_int) function kschur_sweep_get_result(address, result) bind(c) result(status)
      type(c_ptr), value :: address, result
      type(sweep_handle_type), pointer :: handle
      type(result_handle_type), pointer :: last
      type(error_type), allocatable :: error

      if (.not. has_points(address, handle, status)) return
      call require(result, "result", error)
      last => result_of(result)
      if (.not. (allocated(error) .or. allocated(handle%result%eigenvalues))) &
         call new_error(error, status_order, "a sweep that was read has no results of its points")
      if (.not. allocated(error)) then
         last%result = handle%result
         call keep(last, modes_of_problem)
      end if
      status = outcome(handle, error)
   end function kschur_sweep_get_result

   integer(c_int) function kschur_sweep_get_size(address, branches, points, events) bind(c) result(status)
      type(c_ptr), value :: address, branches, points, events
      type(sweep_handle_type), pointer :: handle

      if (.not. has_points(address, handle, status)) return
      call put(branches, size(handle%sweep%eigenvalues, 1, kind=c_int64_t))
      call put(points, size(handle%sweep%values, kind=c_int64_t))
      call put(events, size(handle%sweep%events, kind=c_int64_t))
   end function kschur_sweep_get_size

   integer(c_int) function kschur_sweep_write_hdf5(address, parameter, unit, path) bind(c) result(status)
      type(c_ptr), value :: address, parameter, unit, path
      type(sweep_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      if (.not. has_points(address, handle, status)) return
      call write_sweep(handle, parameter, unit, path, error)
      status = outcome(handle, error)
   end function kschur_sweep_write_hdf5

   integer(c_int) function kschur_sweep_write_hdf5_results(address, parameter, unit, path, results) bind(c) result(status)
      type(c_ptr), value :: address, parameter, unit, path, results
      type(sweep_handle_type), pointer :: handle
      type(result_handle_type), pointer :: one
      type(error_type), allocatable :: error
      type(kept_result_type), allocatable :: kept(:)
      type(c_ptr), pointer :: places(:)
      integer :: i

      if (.not. has_points(address, handle, status)) return
      call require(results, "results", error)
      if (.not. allocated(error)) then
         allocate (kept(size(handle%sweep%values)))
         call c_f_pointer(results, places, [size(kept)])
         do i = 1, size(kept)
            if (.not. c_associated(places(i))) cycle
            one => result_of(places(i))
            if (one%holds == modes_of_problem) then
               kept(i)%result => one%result
            else if (.not. allocated(error)) then
               call new_error(error, status_order, "results["//text(i - 1)//"] does not hold modes of a problem")
            end if
         end do
      end if
      if (.not. allocated(error)) call write_sweep(handle, parameter, unit, path, error, kept)
      status = outcome(handle, error)
   end function kschur_sweep_write_hdf5_results

   ! Writes the sweep to a file, with the results that are to be kept, if any.
   subroutine write_sweep(handle, parameter, unit, path, error, kept)
      type(sweep_handle_type), intent(in) :: handle
      type(c_ptr), intent(in) :: parameter, unit, path
      type(error_type), allocatable, intent(out) :: error
      type(kept_result_type), intent(in), optional :: kept(:)
      character(len=:), allocatable :: name, of_unit, place

      call require(parameter, "parameter", error)
      call require(path, "path", error)
      if (allocated(error)) return
      call take_text(parameter, name)
      call take_text(path, place)
      of_unit = ""
      if (c_associated(unit)) call take_text(unit, of_unit)
      call write_hdf5_sweep(handle%sweep, name, place, error, of_unit, kept)
   end subroutine write_sweep

   integer(c_int) function kschur_sweep_read_hdf5(address, path) bind(c) result(status)
      type(c_ptr), value :: address, path
      type(sweep_handle_type), pointer :: handle
      type(sweep_type), allocatable :: read
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name, parameter, unit
      logical, allocatable :: kept(:)

      status = status_null
      handle => sweep_of(address)
      if (.not. associated(handle)) return
      call require(path, "path", error)
      allocate (read)
      if (.not. allocated(error)) then
         call take_text(path, name)
         call read_hdf5_sweep(read, parameter, unit, name, error, kept)
      end if
      status = outcome(handle, error)
      if (status /= status_ok) return
      call move_alloc(read, handle%sweep)
      call move_alloc(parameter, handle%parameter)
      call move_alloc(unit, handle%unit)
      call move_alloc(kept, handle%kept)
   end function kschur_sweep_read_hdf5

   integer(c_int) function kschur_result_read_hdf5_point(address, path, point) bind(c) result(status)
      type(c_ptr), value :: address, path
      integer(c_int64_t), value :: point
      type(result_handle_type), pointer :: handle
      type(modal_result_type) :: read
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name

      status = status_null
      handle => result_of(address)
      if (.not. associated(handle)) return
      call require(path, "path", error)
      if (.not. allocated(error)) then
         call take_text(path, name)
         ! Beyond the range of Fortran's integers there is none.
         call read_hdf5_sweep_point(read, name, int(max(-1_c_int64_t, min(point, huge(1) - 1_c_int64_t))) + 1, error)
      end if
      status = outcome(handle, error)
      if (status /= status_ok) return
      handle%result = read
      call keep(handle, modes_of_problem)
   end function kschur_result_read_hdf5_point

   integer(c_int) function kschur_is_sweep(path) bind(c) result(holds)
      type(c_ptr), value :: path
      character(len=:), allocatable :: name

      holds = 0
      if (.not. c_associated(path)) return
      call take_text(path, name)
      if (is_hdf5_sweep(name)) holds = 1
   end function kschur_is_sweep

   integer(c_int) function kschur_sweep_get_parameter(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(sweep_handle_type), pointer :: handle

      if (.not. has_points(address, handle, status)) return
      if (.not. allocated(handle%parameter)) then
         status = give_text(handle, "", buffer, length)
      else
         status = give_text(handle, handle%parameter, buffer, length)
      end if
   end function kschur_sweep_get_parameter

   integer(c_int) function kschur_sweep_get_unit(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(sweep_handle_type), pointer :: handle

      if (.not. has_points(address, handle, status)) return
      if (.not. allocated(handle%unit)) then
         status = give_text(handle, "", buffer, length)
      else
         status = give_text(handle, handle%unit, buffer, length)
      end if
   end function kschur_sweep_get_unit

   integer(c_int) function kschur_sweep_get_onsets(address, onsets) bind(c) result(status)
      type(c_ptr), value :: address, onsets
      type(sweep_handle_type), pointer :: handle

      if (has_points(address, handle, status)) call put(onsets, size(handle%sweep%onsets, kind=c_int64_t))
   end function kschur_sweep_get_onsets

   integer(c_int) function kschur_sweep_get_numbers(address, name, values, length) bind(c) result(status)
      type(c_ptr), value :: address, name, values
      integer(c_int64_t), value :: length
      type(sweep_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      character(len=:), allocatable :: word
      real(wp), allocatable :: numbers(:)

      if (.not. has_points(address, handle, status)) return
      call require(name, "name", error)
      status = outcome(handle, error)
      if (allocated(error)) return
      call take_text(name, word)
      associate (s => handle%sweep)
         select case (word)
         case ("values")
            status = give_array(handle, s%values, values, length)
         case ("eigenvalues")
            status = give_array(handle, s%eigenvalues, values, length)
         case ("frequency_hz")
            status = give_array(handle, s%frequency_hz, values, length)
         case ("damping_ratio")
            status = give_array(handle, s%damping_ratio, values, length)
         case ("share")
            status = give_array(handle, s%share, values, length)
         case ("kept")
            allocate (numbers(size(s%values)), source=0.0_wp)
            if (allocated(handle%kept)) numbers = merge(1.0_wp, 0.0_wp, handle%kept)
            status = give_array(handle, numbers, values, length)
         case ("event_kind")
            allocate (numbers(size(s%events)), source=real(s%events%kind, wp))
            status = give_array(handle, numbers, values, length)
         case ("event_first")
            allocate (numbers(size(s%events)), source=real(s%events%first - 1, wp))
            status = give_array(handle, numbers, values, length)
         case ("event_second")
            allocate (numbers(size(s%events)), source=real(s%events%second - 1, wp))
            status = give_array(handle, numbers, values, length)
         case ("event_value")
            allocate (numbers(size(s%events)), source=s%events%value)
            status = give_array(handle, numbers, values, length)
         case ("onset_branch")
            allocate (numbers(size(s%onsets)), source=real(s%onsets%branch - 1, wp))
            status = give_array(handle, numbers, values, length)
         case ("onset_unstable")
            allocate (numbers(size(s%onsets)), source=merge(1.0_wp, 0.0_wp, s%onsets%unstable))
            status = give_array(handle, numbers, values, length)
         case ("onset_value")
            allocate (numbers(size(s%onsets)), source=s%onsets%value)
            status = give_array(handle, numbers, values, length)
         case ("onset_within")
            allocate (numbers(size(s%onsets)), source=s%onsets%within)
            status = give_array(handle, numbers, values, length)
         case default
            status = fail(handle, status_usage, "a sweep has no numbers '"//word//"'")
         end select
      end associate
   end function kschur_sweep_get_numbers

   ! Whether the sweep of a handle has points; else sets the status.
   logical function has_points(address, handle, status)
      type(c_ptr), intent(in) :: address
      type(sweep_handle_type), pointer, intent(out) :: handle
      integer(c_int), intent(out) :: status

      status = status_null
      handle => sweep_of(address)
      has_points = associated(handle)
      if (.not. has_points) return
      status = status_ok
      has_points = allocated(handle%sweep)
      if (has_points) has_points = allocated(handle%sweep%eigenvalues)
      if (.not. has_points) status = fail(handle, status_order, "the sweep has no points: call kschur_sweep_add first")
   end function has_points
end module kschur_capi_sweep
