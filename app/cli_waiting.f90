!> How the threads of the program wait for each other. The run-time library of OpenMP lets them spin, which costs a busy
!> machine many times what they bring; it reads what else to do when it is loaded, so that the program has to start again.
module cli_waiting
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
   implicit none
   private
   public :: start_again_to_wait_asleep

   interface
      integer(c_int) function c_setenv(name, value, overwrite) bind(c, name="setenv")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
      end function c_setenv

      integer(c_int) function c_execv(path, arguments) bind(c, name="execv")
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(in) :: arguments(*)
      end function c_execv
   end interface

contains

   !> Starts the program again with the same words, unless the user has said how threads wait, or how many there are.
   !> Returns where that is so, and where it cannot be done.
   subroutine start_again_to_wait_asleep()
      character(len=*), parameter :: this_program = "/proc/self/exe"
      character(len=15), parameter :: said(3) = [character(len=15) :: "OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "OMP_NUM_THREADS"]
      integer, parameter :: is_missing = 1
      character(kind=c_char), allocatable, target :: words(:, :)
      type(c_ptr), allocatable :: arguments(:)
      character(len=:), allocatable :: word
      integer :: i, length, longest, status
      integer(c_int) :: failed

      do i = 1, size(said)
         call get_environment_variable(said(i), status=status)
         if (status /= is_missing) return
      end do
      longest = 0
      do i = 0, command_argument_count()
         call get_command_argument(i, length=length)
         longest = max(longest, length)
      end do
      allocate (words(longest + 1, 0:command_argument_count()), arguments(command_argument_count() + 2))
      words = c_null_char
      allocate (character(len=longest) :: word)
      do i = 0, command_argument_count()
         call get_command_argument(i, word, length)
         words(:length, i) = transfer(word, words(:length, i))
         arguments(i + 1) = c_loc(words(1, i))
      end do
      arguments(size(arguments)) = c_null_ptr
      failed = c_setenv("OMP_WAIT_POLICY"//c_null_char, "PASSIVE"//c_null_char, 1_c_int)
      failed = c_execv(this_program//c_null_char, arguments)
   end subroutine start_again_to_wait_asleep
end module cli_waiting
