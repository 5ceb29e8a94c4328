!> The assertions on one condition or one value, and those on strings.
module funit_conditions
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use, intrinsic :: iso_fortran_env, only: real64
   use funit_core, only: SourceLocation, same_shape, text, throw
   implicit none
   private

   public :: assertFail, assertTrue, assertFalse
   public :: assertAny, assertAll, assertNone, assertNotAll
   public :: assertIsNaN, assertIsFinite
   public :: assertEqual

   interface assertTrue
      module procedure true_0, true_1
   end interface assertTrue

   interface assertFalse
      module procedure false_0, false_1
   end interface assertFalse

   !> Strings are equal if they differ in leading and trailing blanks only, as in pFUnit.
   interface assertEqual
      module procedure equal_string_00, equal_string_01, equal_string_11
   end interface assertEqual

contains

   !> Fails, with a message.
   subroutine assertFail(message, location)
      character(*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location

      call throw(message, location=location)
   end subroutine assertFail

   subroutine demand(condition, what, message, location)
      logical, intent(in) :: condition
      character(*), intent(in) :: what
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (.not. condition) call throw(what, message, location)
   end subroutine demand

   subroutine true_0(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(condition, 'expected true but found false', message, location)
   end subroutine true_0

   subroutine true_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(all(condition), 'expected all true', message, location)
   end subroutine true_1

   subroutine false_0(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(.not. condition, 'expected false but found true', message, location)
   end subroutine false_0

   subroutine false_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(.not. any(condition), 'expected all false', message, location)
   end subroutine false_1

   !> Some condition holds.
   subroutine assertAny(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(any(conditions), 'expected any true', message, location)
   end subroutine assertAny

   !> Every condition holds.
   subroutine assertAll(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(all(conditions), 'expected all true', message, location)
   end subroutine assertAll

   !> No condition holds.
   subroutine assertNone(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(.not. any(conditions), 'expected none true', message, location)
   end subroutine assertNone

   !> Some condition does not hold.
   subroutine assertNotAll(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(.not. all(conditions), 'expected not all true', message, location)
   end subroutine assertNotAll

   !> The value is not a number.
   subroutine assertIsNaN(x, message, location)
      real(real64), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(ieee_is_nan(x), 'expected NaN but found <' // text(x) // '>', message, location)
   end subroutine assertIsNaN

   !> The value is neither infinite nor NaN.
   subroutine assertIsFinite(x, message, location)
      real(real64), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(ieee_is_finite(x), 'expected a finite value but found <' // text(x) // '>', &
         message, location)
   end subroutine assertIsFinite

   subroutine equal_string_00(expected, actual, message, location)
      character(*), intent(in) :: expected, actual
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call demand(adjustl(expected) == adjustl(actual), &
         'expected <' // trim(expected) // '> but found <' // trim(actual) // '>', &
         message, location)
   end subroutine equal_string_00

   subroutine equal_string_01(expected, actual, message, location)
      character(*), intent(in) :: expected, actual(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      integer :: i

      do i = 1, size(actual)
         call assertEqual(expected, actual(i), message, location)
      end do
   end subroutine equal_string_01

   subroutine equal_string_11(expected, actual, message, location)
      character(*), intent(in) :: expected(:), actual(:)
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      integer :: i

      if (.not. same_shape(shape(expected), shape(actual), message, location)) return
      do i = 1, size(actual)
         call assertEqual(expected(i), actual(i), message, location)
      end do
   end subroutine equal_string_11

end module funit_conditions
