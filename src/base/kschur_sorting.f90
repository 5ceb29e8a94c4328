!> Sorting of short lists.
module kschur_sorting
   use kschur_kinds, only: wp
   implicit none
   private
   public :: ascending_order

contains

   !> Returns the permutation that sorts `numbers` (n) in ascending order; stable. Insertion sort, for lists that are short or
   !> nearly sorted.
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
end module kschur_sorting
