!> Results, for C: created, destroyed, read and written.
module kschur_capi_result
   use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use kschur, only: error_type, modal_result_type, read_hdf5_result, write_hdf5_result
   use kschur_capi_status, only: handle_type, fail, get_message, outcome, require, status_memory, status_null, status_ok, &
      status_order
   use kschur_capi_text, only: take_text
   implicit none
   private
   public :: result_handle_type, clear, has_modes, has_solution, keep, result_of

   !> Kinds of contents.
   integer, parameter, public :: nothing = 0, modes_of_problem = 1, eigenvalues_of_operator = 2

   !> Target of a `kschur_result` handle.
   type, extends(handle_type) :: result_handle_type
      type(modal_result_type) :: result
      !> Empty, modes of a problem, or eigenvalues of an operator.
      integer :: holds = nothing
   end type result_handle_type

contains

#define HANDLE_TYPE result_handle_type
#define HANDLE_OF result_of
#define CREATE kschur_result_create
#define DESTROY kschur_result_destroy
#define MESSAGE kschur_result_get_message
#include "kschur_capi_handle.inc"

   !> Clears a result.
   subroutine clear(handle)
      type(result_handle_type), intent(inout) :: handle
      type(modal_result_type) :: empty

      handle%result = empty
      handle%holds = nothing
   end subroutine clear

   !> Sets which kind of contents a result holds, and allocates as empty what it lacks: older files and operators do not have all
   !> data.
   subroutine keep(handle, holds)
      type(result_handle_type), intent(inout) :: handle
      integer, intent(in) :: holds

      handle%holds = holds
      associate (result => handle%result)
         if (.not. allocated(result%decision)) result%decision = ""
         if (.not. allocated(result%inner)) result%inner = ""
         if (.not. allocated(result%notes)) allocate (result%notes(0))
         if (.not. allocated(result%history%residual)) &
            allocate (result%history%converged(0), result%history%operator_applications(0), result%history%residual(0))
      end associate
   end subroutine keep

   !> Whether the handle is valid and not empty; else sets the status.
   logical function has_solution(handle, status)
      type(result_handle_type), pointer, intent(in) :: handle
      integer(c_int), intent(out) :: status

      status = status_null
      if (associated(handle)) then
         status = status_ok
         if (handle%holds == nothing) &
            status = fail(handle, status_order, "the result is empty: solve or read a file first")
      end if
      has_solution = status == status_ok
   end function has_solution

   !> Whether the handle is valid and has modes of a problem; else sets the status.
   logical function has_modes(handle, status)
      type(result_handle_type), pointer, intent(in) :: handle
      integer(c_int), intent(out) :: status

      has_modes = has_solution(handle, status)
      if (.not. has_modes) return
      has_modes = handle%holds == modes_of_problem
      if (.not. has_modes) &
         status = fail(handle, status_order, "the result holds eigenvalues of an operator, which have no such property")
   end function has_modes

   integer(c_int) function kschur_result_write_hdf5(address, path) bind(c) result(status)
      type(c_ptr), value :: address, path
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(path, "path", error)
      if (.not. allocated(error)) then
         call take_text(path, name)
         call write_hdf5_result(handle%result, name, error)
      end if
      status = outcome(handle, error)
   end function kschur_result_write_hdf5

   integer(c_int) function kschur_result_read_hdf5(address, path) bind(c) result(status)
      type(c_ptr), value :: address, path
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
         call read_hdf5_result(read, name, error)
      end if
      status = outcome(handle, error)
      if (status /= status_ok) return
      handle%result = read
      call keep(handle, modes_of_problem)
   end function kschur_result_read_hdf5
end module kschur_capi_result
