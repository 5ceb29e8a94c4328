!> The types which tests with a fixture or with parameters extend.
module funit_cases
   implicit none
   private

   public :: TestCase, AbstractTestParameter, ParameterizedTestCase

   !> A test with a fixture of its own.
   type, abstract :: TestCase
   contains
      procedure :: setUp
      procedure :: tearDown
   end type TestCase

   !> What one run of a parameterized test is given.
   type, abstract :: AbstractTestParameter
   contains
      procedure(to_string), deferred :: toString
   end type AbstractTestParameter

   !> A test which runs once for each of its parameters.
   type, abstract, extends(TestCase) :: ParameterizedTestCase
      class(AbstractTestParameter), allocatable :: testParameter
   contains
      procedure :: setTestParameter
   end type ParameterizedTestCase

   abstract interface
      !> How a parameter shows in the name of the test.
      function to_string(this) result(string)
         import :: AbstractTestParameter
         class(AbstractTestParameter), intent(in) :: this
         character(len=:), allocatable :: string
      end function to_string
   end interface

contains

   !> Runs ahead of the test; to be overridden.
   subroutine setUp(this)
      class(TestCase), intent(inout) :: this

      associate (unused => this)
      end associate
   end subroutine setUp

   !> Runs after the test; to be overridden.
   subroutine tearDown(this)
      class(TestCase), intent(inout) :: this

      associate (unused => this)
      end associate
   end subroutine tearDown

   subroutine setTestParameter(this, testParameter)
      class(ParameterizedTestCase), intent(inout) :: this
      class(AbstractTestParameter), intent(in) :: testParameter

      allocate (this%testParameter, source=testParameter)
   end subroutine setTestParameter

end module funit_cases
