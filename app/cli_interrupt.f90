!> Handles SIGINT and SIGTERM: the first one ends the computation with the modes that have converged, a second one (either) ends
!> the program.
module cli_interrupt
   use, intrinsic :: iso_c_binding, only: c_funloc, c_funptr, c_int, c_intptr_t, c_long, c_null_ptr, c_ptr
   implicit none
   private
   public :: catch_interrupts, is_interrupted, let_signals

   integer(c_int), parameter :: signals(2) = [2_c_int, 15_c_int]
   ! A signal handler may only set a variable.
   logical, volatile :: caught = .false.
   ! Which of the signals were not ignored before.
   logical, volatile :: heard(2) = .false.

   interface
      type(c_funptr) function c_signal(number, action) bind(c, name="signal")
         import :: c_funptr, c_int
         integer(c_int), value :: number
         type(c_funptr), value :: action
      end function c_signal

      integer(c_int) function c_raise(number) bind(c, name="raise")
         import :: c_int
         integer(c_int), value :: number
      end function c_raise

      integer(c_int) function c_sigmask(how, set, before) bind(c, name="pthread_sigmask")
         import :: c_int, c_long, c_ptr
         integer(c_int), value :: how
         integer(c_long), intent(in) :: set(*)
         type(c_ptr), value :: before
      end function c_sigmask
   end interface

contains

   !> Unblocks signals in this thread; they are blocked in all others (hold_signals.c).
   subroutine let_signals()
      ! On Linux: SIG_UNBLOCK, and a set of signals, whose bits count from the first.
      integer(c_int), parameter :: unblock = 1
      integer(c_long) :: both(16)
      integer(c_int) :: failed
      integer :: i

      both = 0
      do i = 1, size(signals)
         both(1) = ibset(both(1), signals(i) - 1)
      end do
      failed = c_sigmask(unblock, both, c_null_ptr)
   end subroutine let_signals

   !> Installs the handlers; `is_interrupted` polls for signals. Ignored signals stay ignored.
   subroutine catch_interrupts()
      ! SIG_IGN.
      integer(c_intptr_t), parameter :: ignore = 1
      type(c_funptr) :: before
      integer :: i

      do i = 1, size(signals)
         before = c_signal(signals(i), c_funloc(note))
         heard(i) = transfer(before, ignore) /= ignore
         if (.not. heard(i)) before = c_signal(signals(i), before)
      end do
   end subroutine catch_interrupts

   !> Whether a signal was received.
   logical function is_interrupted()
      is_interrupted = caught
   end function is_interrupted

   ! Signal handler: records the first signal, and lets the next one end the program.
   subroutine note(number) bind(c)
      integer(c_int), value :: number
      ! SIG_DFL.
      integer(c_intptr_t), parameter :: default = 0
      type(c_funptr) :: before
      logical :: second
      integer(c_int) :: failed
      integer :: i

      second = caught
      caught = .true.
      do i = 1, size(signals)
         if (heard(i)) before = c_signal(signals(i), transfer(default, before))
      end do
      ! It arrived before the first one was recorded.
      if (second) failed = c_raise(number)
   end subroutine note
end module cli_interrupt
