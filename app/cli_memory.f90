!> Message when an implicit allocation of the compiler fails.
module cli_memory
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t
   implicit none
   private

   interface
      integer(c_size_t) function c_write(descriptor, bytes, count) bind(c, name="write")
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
      end function c_write

      subroutine c_exit_now(status) bind(c, name="_exit")
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit_now
   end interface

contains

   ! Replaces the function that gfortran calls if an implicit allocation, as of an array temporary, fails: that of its run-time
   ! library prints a backtrace and exits with status 1.
   subroutine end_without_memory() bind(c, name="_gfortran_os_error_at")
      integer(c_int), parameter :: standard_error = 2, status_failure = 4
      character(len=*), parameter :: line = "kschur: no memory"//new_line("a")
      integer(c_size_t) :: written

      written = c_write(standard_error, line, len(line, c_size_t))
      call c_exit_now(status_failure)
   end subroutine end_without_memory
end module cli_memory
