!> How the library reports what went wrong: an allocatable error, allocated
!> means failed. The library never stops and never prints.
module kschur_error
   implicit none
   private
   public :: error_type, new_error, add_context, take_cancelled

   !> Wrong use: an option or a call that does not fit the problem.
   integer, parameter, public :: error_usage = 1
   !> Bad input: a matrix, a shape, a value that cannot be right.
   integer, parameter, public :: error_input = 2
   !> A file that cannot be opened, read or written.
   integer, parameter, public :: error_file = 3
   !> Out of memory.
   integer, parameter, public :: error_memory = 4
   !> The matrix to be factored is singular.
   integer, parameter, public :: error_singular = 5
   !> A library below us (MUMPS, METIS, AMD, LAPACK, ARPACK, HDF5) failed.
   integer, parameter, public :: error_library = 6
   !> An iterative linear solver did not converge.
   integer, parameter, public :: error_convergence = 7
   !> The monitor cancelled the computation. A solve reports it as a reason, not as an error.
   integer, parameter, public :: error_cancelled = 8

   !> What went wrong and what to do about it.
   type :: error_type
      !> One of the `error_*` codes of this module.
      integer :: code = 0
      !> One sentence, without a trailing newline.
      character(len=:), allocatable :: message
   end type error_type

contains

   !> Allocates `error` with a code and a message.
   pure subroutine new_error(error, code, message)
      type(error_type), allocatable, intent(out) :: error
      !> One of `error_*`.
      integer, intent(in) :: code
      !> A sentence that says what is wrong.
      character(len=*), intent(in) :: message

      allocate (error)
      error%code = code
      error%message = message
   end subroutine new_error

   !> Puts `context` and a colon before the message of a raised error; does
   !> nothing where there is no error.
   pure subroutine add_context(error, context)
      type(error_type), allocatable, intent(inout) :: error
      !> Where it happened: a file, a matrix.
      character(len=*), intent(in) :: context

      if (allocated(error)) error%message = context//": "//error%message
   end subroutine add_context

   !> Turns an error that reports a cancelled computation into `cancelled`; keeps other errors.
   pure subroutine take_cancelled(error, cancelled)
      type(error_type), allocatable, intent(inout) :: error
      logical, intent(out) :: cancelled

      cancelled = .false.
      if (allocated(error)) cancelled = error%code == error_cancelled
      if (cancelled) deallocate (error)
   end subroutine take_cancelled
end module kschur_error
