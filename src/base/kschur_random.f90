!> Reproducible random vectors without global state.
module kschur_random
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: random_vector, skip_numbers, state_of_seed

   ! The minimal standard generator of Park and Miller.
   integer(long), parameter :: multiplier = 16807_long, modulus = 2147483647_long

contains

   !> Draws n numbers uniform in (-1, 1) and advances `state`, 1 ... 2147483646.
   subroutine random_vector(state, x)
      integer(long), intent(inout) :: state
      real(wp), intent(out) :: x(:)
      integer :: i

      do i = 1, size(x)
         state = mod(multiplier*state, modulus)
         x(i) = 2*real(state, wp)/real(modulus, wp) - 1
      end do
   end subroutine random_vector

   !> Advances the state past `numbers` numbers without drawing them.
   subroutine skip_numbers(state, numbers)
      integer(long), intent(inout) :: state
      integer, intent(in) :: numbers
      integer :: i

      do i = 1, numbers
         state = mod(multiplier*state, modulus)
      end do
   end subroutine skip_numbers

   !> Returns the generator state of a seed.
   pure integer(long) function state_of_seed(seed) result(state)
      integer, intent(in) :: seed

      state = 1 + mod(abs(int(seed, long))*69621_long, 2147483645_long)
   end function state_of_seed
end module kschur_random
