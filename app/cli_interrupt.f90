!> SIGINT and SIGTERM while modes are computed: the first one ends the computation with what has converged, a second one
!> the program.
module cli_interrupt
   use, intrinsic :: iso_c_binding, only: c_funloc, c_funptr, c_int, c_intptr_t
   implicit none
   private
   public :: catch_interrupts, is_interrupted

   ! The one thing a handler may do is to set a variable.
   logical, volatile :: caught = .false.

   interface
      type(c_funptr) function c_signal(number, action) bind(c, name="signal")
         import :: c_funptr, c_int
         integer(c_int), value :: number
         type(c_funptr), value :: action
      end function c_signal
   end interface

contains

   !> From now on signals wait for `is_interrupted` to be asked. One that was ignored before stays so.
   subroutine catch_interrupts()
      integer(c_int), parameter :: sigint = 2, sigterm = 15

      call catch_one(sigint)
      call catch_one(sigterm)
   end subroutine catch_interrupts

   subroutine catch_one(number)
      integer(c_int), intent(in) :: number
      ! SIG_IGN.
      integer(c_intptr_t), parameter :: ignore = 1
      type(c_funptr) :: before

      before = c_signal(number, c_funloc(note))
      if (transfer(before, ignore) == ignore) before = c_signal(number, before)
   end subroutine catch_one

   !> Whether one came.
   logical function is_interrupted()
      is_interrupted = caught
   end function is_interrupted

   subroutine note(number) bind(c)
      integer(c_int), value :: number
      ! SIG_DFL.
      integer(c_intptr_t), parameter :: default = 0
      type(c_funptr) :: before

      caught = .true.
      before = c_signal(number, transfer(default, before))
   end subroutine note
end module cli_interrupt
