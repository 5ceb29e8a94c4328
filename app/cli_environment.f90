!> Environment variables that libraries read when they are loaded: to set them, the program executes itself again.
module cli_environment
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_long, c_null_char, c_null_ptr, c_ptr
   implicit none
   private
   public :: keep_one_blas_thread, start_again_to_wait_asleep

   ! struct rlimit.
   type, bind(c) :: limit_type
      integer(c_long) :: soft = 0, hard = 0
   end type limit_type

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

      integer(c_int) function c_getrlimit(resource, limit) bind(c, name="getrlimit")
         import :: c_int, limit_type
         integer(c_int), value :: resource
         type(limit_type), intent(out) :: limit
      end function c_getrlimit
   end interface

contains

   !> Restarts the program so that idle OpenMP threads sleep instead of spinning, which is very slow on a busy machine, unless
   !> the user has set the wait policy or the number of threads.
   subroutine start_again_to_wait_asleep()
      character(len=15), parameter :: said(3) = [character(len=15) :: "OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "OMP_NUM_THREADS"]
      integer :: i

      if (any([(is_set(trim(said(i))), i=1, size(said))])) return
      call start_again_with("OMP_WAIT_POLICY", "PASSIVE")
   end subroutine start_again_to_wait_asleep

   !> Restarts the program with one thread of OpenBLAS if the address space is limited (`ulimit -v`), unless the user has set
   !> their number: each thread maps a buffer when it is loaded, waits forever if it gets none, and blocks the exit of the
   !> program.
   subroutine keep_one_blas_thread()
      character(len=*), parameter :: variable = "OPENBLAS_NUM_THREADS"
      ! On Linux; -1: unlimited.
      integer(c_int), parameter :: rlimit_as = 9
      type(limit_type) :: limit

      if (is_set(variable)) return
      if (c_getrlimit(rlimit_as, limit) == 0 .and. limit%soft >= 0) call start_again_with(variable, "1")
   end subroutine keep_one_blas_thread

   ! Whether an environment variable is set, even if it is empty.
   logical function is_set(variable)
      character(len=*), intent(in) :: variable
      integer, parameter :: is_missing = 1
      integer :: status

      call get_environment_variable(variable, status=status)
      is_set = status /= is_missing
   end function is_set

   ! Executes the program again with the same arguments. Returns if that fails.
   subroutine start_again_with(variable, value)
      character(len=*), intent(in) :: variable, value
      character(len=*), parameter :: this_program = "/proc/self/exe"
      character(kind=c_char), allocatable, target :: words(:, :)
      type(c_ptr), allocatable :: arguments(:)
      character(len=:), allocatable :: word
      integer :: i, length, longest
      integer(c_int) :: failed

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
      failed = c_setenv(variable//c_null_char, value//c_null_char, 1_c_int)
      if (failed == 0) failed = c_execv(this_program//c_null_char, arguments)
   end subroutine start_again_with
end module cli_environment
