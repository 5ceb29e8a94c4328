!> Reads a file first in a child process: a library that trusts binary files may crash or loop on one damaged byte. The child
!> then dies, which is an error here. Only for processes without other running threads: OpenBLAS does not survive a fork while
!> it computes.
module kschur_trial
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_f_pointer, c_funloc, c_funptr, c_int, c_loc, c_null_char, &
      c_ptr
   use kschur_error, only: error_type, new_error, error_input
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: try_in_child

   abstract interface
      !> Reads a file and discards it; fails as the reader does.
      subroutine attempt_type(path, part, error)
         import :: error_type
         character(len=*), intent(in) :: path
         !> Number of the part, from 0, and number of parts.
         integer, intent(in) :: part(2)
         type(error_type), allocatable, intent(inout) :: error
      end subroutine attempt_type
   end interface

   ! Arguments of the child.
   type :: context_type
      procedure(attempt_type), pointer, nopass :: attempt => null()
      character(len=:), allocatable :: path
      integer :: part(2) = [0, 1]
   end type context_type

   ! As in kschur_trial.c.
   integer, parameter :: longest = 8192
   integer(c_int), parameter :: ended = 0, broken = 1

   interface
      integer(c_int) function c_try(attempt, context, seconds, bytes, code, message) bind(c, name="kschur_try")
         import :: c_char, c_double, c_funptr, c_int, c_ptr
         type(c_funptr), value :: attempt
         type(c_ptr), value :: context
         real(c_double), value :: seconds, bytes
         integer(c_int), intent(out) :: code
         character(kind=c_char), intent(out) :: message(*)
      end function c_try
   end interface

contains

   !> Fails if `attempt` on the file fails, crashes or exceeds limits of processor time and memory, which grow with the file
   !> size at best compression. Does nothing unless `trial` is given and true, or if no process can be created.
   subroutine try_in_child(attempt, path, what, error, trial, part)
      procedure(attempt_type) :: attempt
      character(len=*), intent(in) :: path
      !> Expected content, for messages.
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      logical, intent(in), optional :: trial
      !> Part of the file that `attempt` reads (all).
      integer, intent(in), optional :: part(2)
      real(c_double), parameter :: least_seconds = 0.6_c_double, seconds_per_byte = 1e-6_c_double
      real(c_double), parameter :: least_memory = 1e8_c_double, memory_per_byte = 3000
      type(context_type), target :: context
      character(kind=c_char), target :: message(longest)
      integer(c_int) :: code
      integer(long) :: bytes

      if (allocated(error) .or. .not. present(trial)) return
      if (.not. trial) return
      inquire (file=path, size=bytes)
      context%attempt => attempt
      context%path = path
      if (present(part)) context%part = part
      select case (c_try(c_funloc(run_attempt), c_loc(context), least_seconds + seconds_per_byte*real(bytes, wp), &
         least_memory + memory_per_byte*real(bytes, wp), code, message))
      case (ended)
         if (code /= 0) call raise(error, int(code), message)
      case (broken)
         call new_error(error, error_input, "a damaged "//what//": its reader breaks down over it")
      end select
   end subroutine try_in_child

   ! Called by kschur_try in the child: runs the attempt, and returns code and message of its error.
   subroutine run_attempt(context, code, message) bind(c, name="kschur_run_attempt")
      type(c_ptr), value :: context
      integer(c_int), intent(out) :: code
      character(kind=c_char), intent(out) :: message(*)
      type(context_type), pointer :: given
      type(error_type), allocatable :: error
      integer :: i, length

      call c_f_pointer(context, given)
      call given%attempt(given%path, given%part, error)
      code = 0
      length = 0
      if (allocated(error)) then
         code = int(error%code, c_int)
         length = min(len(error%message), longest - 1)
         do i = 1, length
            message(i) = error%message(i:i)
         end do
      end if
      message(length + 1) = c_null_char
   end subroutine run_attempt

   ! Raises an error with a null-terminated message.
   pure subroutine raise(error, code, bytes)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: code
      character(kind=c_char), intent(in) :: bytes(:)
      character(len=size(bytes)) :: message
      integer :: i

      do i = 1, size(bytes)
         message(i:i) = bytes(i)
      end do
      call new_error(error, code, message(:index(message, c_null_char) - 1))
   end subroutine raise
end module kschur_trial
