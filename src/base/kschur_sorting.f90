!> Orders of short lists, and positions in them.
module kschur_sorting
   use kschur_kinds, only: wp
   implicit none
   private
   public :: ascending_order, positions

contains

   !> The positions of `numbers` (n), the smallest first; equal ones keep their order. By insertion, for lists that are short or
   !> nearly in order.
   pure function ascending_order(numbers) result(order)
      real(wp), intent(in) :: numbers(:)
      integer :: order(size(numbers))
      integer :: i, j

      do i = 1, size(numbers)
         j = i - 1
         do while (j > 0)
            if (numbers(order(j)) <= numbers(i)) exit
            order(j + 1) = order(j)
            j = j - 1
         end do
         order(j + 1) = i
      end do
   end function ascending_order

   !> The positions at which a mask is true, in order.
   pure function positions(mask)
      logical, intent(in) :: mask(:)
      integer :: positions(count(mask))
      integer :: i

      positions = pack([(i, i=1, size(mask))], mask)
   end function positions
end module kschur_sorting
