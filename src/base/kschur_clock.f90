!> Wall-clock time.
module kschur_clock
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: clock, seconds_since

contains

   !> The time now, for `seconds_since`.
   integer(long) function clock()
      call system_clock(clock)
   end function clock

   !> Seconds since `start`, a value of `clock`.
   real(wp) function seconds_since(start)
      integer(long), intent(in) :: start
      integer(long) :: now, rate

      call system_clock(now, rate)
      seconds_since = real(now - start, wp)/real(rate, wp)
   end function seconds_since
end module kschur_clock
