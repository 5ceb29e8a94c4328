!> Status codes of the C interface, and their messages.
module kschur_capi_status
   use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, new_error, text
   use kschur_capi_text, only: put_text
   implicit none
   private
   public :: handle_type, check_returned, fail, get_message, give_name, give_text, outcome, require

   !> KSCHUR_OK and those of KSCHUR_ERROR_* that the interface itself returns. The library's codes are below 21.
   integer, parameter, public :: status_ok = 0, status_usage = 1, status_input = 2, status_memory = 4, status_null = 21, &
      status_order = 22, status_length = 23, status_callback = 24

   !> Common part of all handles.
   type :: handle_type
      !> Message of the last failure.
      character(len=:), allocatable :: message
   end type handle_type

   character(len=*), parameter :: meanings_of_library(0:7) = [character(len=60) :: &
      "success", &
      "an option or argument is wrong or does not fit the problem", &
      "a matrix, a shape, a value or a file cannot be right", &
      "a file cannot be opened, read or written", &
      "there is not enough memory", &
      "the matrix to be factored is singular", &
      "a library below kschur failed", &
      "a linear solver that iterates came to no solution"]
   character(len=*), parameter :: meanings_of_interface(0:3) = [character(len=60) :: &
      "a handle or pointer is null", &
      "a call came before the one that it needs", &
      "an array or text of the caller is too short", &
      "a callback returned a failure"]

contains

   !> Returns the status of an error, and stores its message in the handle.
   integer(c_int) function outcome(handle, error)
      class(handle_type), intent(inout) :: handle
      type(error_type), allocatable, intent(in) :: error

      outcome = status_ok
      if (.not. allocated(error)) return
      handle%message = error%message
      outcome = int(error%code, c_int)
   end function outcome

   !> Stores a message in the handle, and returns the status.
   integer(c_int) function fail(handle, status, message)
      class(handle_type), intent(inout) :: handle
      integer, intent(in) :: status
      character(len=*), intent(in) :: message

      handle%message = message
      fail = int(status, c_int)
   end function fail

   !> Raises an error if a pointer is null, unless one is already raised.
   subroutine require(address, name, error)
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error) .or. c_associated(address)) return
      call new_error(error, status_null, "the argument '"//name//"' is null")
   end subroutine require

   !> Raises an error if a callback returned a failure.
   subroutine check_returned(returned, name, error)
      integer(c_int), intent(in) :: returned
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(out) :: error

      if (returned /= 0) call new_error(error, status_callback, "the callback '"//name//"' returned "//text(int(returned)))
   end subroutine check_returned

   !> Copies a text to the caller; fails if the buffer is null or too short.
   integer(c_int) function give_text(handle, given, buffer, length) result(status)
      class(handle_type), intent(inout) :: handle
      character(len=*), intent(in) :: given
      type(c_ptr), intent(in) :: buffer
      integer(c_int64_t), intent(in) :: length

      status = text_status(given, buffer, length)
      if (status == status_null) handle%message = "the argument 'text' is null"
      if (status == status_length) handle%message = "the text needs a length of "//text(len(given) + 1)
   end function give_text

   !> Copies the message of a handle to the caller; keeps it.
   integer(c_int) function get_message(handle, buffer, length) result(status)
      class(handle_type), intent(in) :: handle
      type(c_ptr), intent(in) :: buffer
      integer(c_int64_t), intent(in) :: length

      if (allocated(handle%message)) then
         status = text_status(handle%message, buffer, length)
      else
         status = text_status("", buffer, length)
      end if
   end function get_message

   !> Copies a name from a list, numbered from 0, to the caller.
   integer(c_int) function give_name(names, number, buffer, length) result(status)
      character(len=*), intent(in) :: names(0:)
      integer(c_int), intent(in) :: number
      type(c_ptr), intent(in) :: buffer
      integer(c_int64_t), intent(in) :: length

      status = status_usage
      if (number < 0 .or. number > ubound(names, 1)) return
      status = text_status(trim(names(number)), buffer, length)
   end function give_name

   ! Copies a text to the caller; returns the status if the buffer is null or too short.
   integer(c_int) function text_status(given, buffer, length) result(status)
      character(len=*), intent(in) :: given
      type(c_ptr), intent(in) :: buffer
      integer(c_int64_t), intent(in) :: length
      logical :: fits

      status = status_null
      if (.not. c_associated(buffer)) return
      call put_text(given, buffer, length, fits)
      status = merge(status_ok, status_length, fits)
   end function text_status

   integer(c_int) function kschur_status_text(status, buffer, length) bind(c)
      integer(c_int), value :: status
      type(c_ptr), value :: buffer
      integer(c_int64_t), value :: length

      if (status < status_null) then
         kschur_status_text = give_name(meanings_of_library, status, buffer, length)
      else
         kschur_status_text = give_name(meanings_of_interface, status - int(status_null, c_int), buffer, length)
      end if
   end function kschur_status_text
end module kschur_capi_status
