!> Failures of the running test: where they are recorded and how they read.
module funit_core
   use, intrinsic :: iso_fortran_env, only: int32, int64, real64
   implicit none
   private

   public :: SourceLocation, anyExceptions
   public :: throw, clear_failures, print_failures
   public :: text, within, same_shape

   !> A line of a .pf file.
   type :: SourceLocation
      character(len=255) :: fileName = '<unknown file>'
      integer :: lineNumber = -1
   end type SourceLocation

   type :: failure
      type(SourceLocation) :: location
      character(len=:), allocatable :: what
   end type failure

   type(failure), allocatable :: failures(:)

   !> A value as it is shown in a failure.
   interface text
      module procedure text_int32, text_int64, text_real, text_complex, text_shape
   end interface text

   !> Whether two values differ by no more than `tolerance`; never so for a NaN.
   interface within
      module procedure within_real, within_complex
   end interface within

contains

   !> Whether an assertion of the running test has failed.
   logical function anyExceptions()
      anyExceptions = allocated(failures)
   end function anyExceptions

   !> Records a failure, the author's `message` ahead of `what` went wrong.
   subroutine throw(what, message, location)
      character(*), intent(in) :: what
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      type(failure) :: new

      if (present(location)) new%location = location
      new%what = what
      if (present(message)) new%what = message // ': ' // what
      if (allocated(failures)) then
         failures = [failures, new]
      else
         failures = [new]
      end if
   end subroutine throw

   !> Forgets the failures, ahead of the next test.
   subroutine clear_failures()
      if (allocated(failures)) deallocate (failures)
   end subroutine clear_failures

   !> Prints the failures, one a line as `file:line: what`.
   subroutine print_failures()
      integer :: i

      do i = 1, size(failures)
         print '(3x,a,":",i0,": ",a)', trim(failures(i)%location%fileName), &
            failures(i)%location%lineNumber, failures(i)%what
      end do
   end subroutine print_failures

   !> Whether the shapes agree, a scalar `expected` agreeing with all; if not, a failure.
   logical function same_shape(expected, actual, message, location)
      integer, intent(in) :: expected(:), actual(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      same_shape = size(expected) == 0
      if (size(expected) == size(actual)) same_shape = all(expected == actual)
      if (.not. same_shape) call throw('expected shape ' // text(expected) // &
         ' but found ' // text(actual), message, location)
   end function same_shape

   elemental logical function within_real(a, b, tolerance) result(ok)
      real(real64), intent(in) :: a, b, tolerance

      ! The first part is for equal infinities, the difference of which is NaN.
      ok = (a <= b .and. a >= b) .or. abs(a - b) <= tolerance
   end function within_real

   elemental logical function within_complex(a, b, tolerance) result(ok)
      complex(real64), intent(in) :: a, b
      real(real64), intent(in) :: tolerance

      ok = abs(a - b) <= tolerance
   end function within_complex

   function text_int32(value) result(string)
      integer(int32), intent(in) :: value
      character(len=:), allocatable :: string

      string = text(int(value, int64))
   end function text_int32

   function text_int64(value) result(string)
      integer(int64), intent(in) :: value
      character(len=:), allocatable :: string
      character(len=20) :: buffer

      write (buffer, '(i0)') value
      string = trim(buffer)
   end function text_int64

   function text_real(value) result(string)
      real(real64), intent(in) :: value
      character(len=:), allocatable :: string
      character(len=40) :: buffer

      write (buffer, '(g0)') value
      string = trim(adjustl(buffer))
   end function text_real

   function text_complex(value) result(string)
      complex(real64), intent(in) :: value
      character(len=:), allocatable :: string

      string = '(' // text(real(value)) // ',' // text(aimag(value)) // ')'
   end function text_complex

   function text_shape(value) result(string)
      integer, intent(in) :: value(:)
      character(len=:), allocatable :: string
      integer :: i

      string = '['
      do i = 1, size(value)
         if (i > 1) string = string // ','
         string = string // text(value(i))
      end do
      string = string // ']'
   end function text_shape

end module funit_core
