!> Runs and counts the tests; called by the main programs which pf_preprocess.py writes.
module funit_runner
   use, intrinsic :: iso_fortran_env, only: output_unit
   use funit_core, only: anyExceptions, clear_failures, print_failures
   implicit none
   private

   public :: begin_test, end_test, run_test, report_and_stop

   integer :: passed = 0, failed = 0

   abstract interface
      subroutine plain_procedure()
      end subroutine plain_procedure
   end interface

contains

   !> Announces a test, so that its name is known even if it crashes.
   subroutine begin_test(name)
      character(*), intent(in) :: name

      call clear_failures()
      write (output_unit, '(a," ... ")', advance='no') name
      flush (output_unit)
   end subroutine begin_test

   !> Tells how the test went.
   subroutine end_test()
      if (anyExceptions()) then
         failed = failed + 1
         print '(a)', 'FAILED'
         call print_failures()
      else
         passed = passed + 1
         print '(a)', 'ok'
      end if
   end subroutine end_test

   !> Runs a test which is a plain subroutine.
   subroutine run_test(name, test, before, after)
      character(*), intent(in) :: name
      procedure(plain_procedure) :: test
      procedure(plain_procedure), optional :: before, after

      call begin_test(name)
      if (present(before)) call before()
      if (.not. anyExceptions()) then
         call test()
         if (present(after)) call after()
      end if
      call end_test()
   end subroutine run_test

   !> Ends the program, with an error unless some tests ran and all passed.
   subroutine report_and_stop()
      print '(i0," passed, ",i0," failed")', passed, failed
      flush (output_unit)
      if (failed > 0 .or. passed == 0) stop 1
   end subroutine report_and_stop

end module funit_runner
