!> Sorting of short lists, and positions in them.
module kschur_sorting
   use kschur_kinds, only: wp
   implicit none
   private
   public :: ascending_order, positions

contains

   !> Returns the permutation that sorts `numbers` (n) in ascending order; stable. Merge sort: pairs of sorted runs are merged to
   !> runs of twice the length.
   pure function ascending_order(numbers) result(order)
      real(wp), intent(in) :: numbers(:)
      integer :: order(size(numbers))
      integer :: i, first, length

      order = [(i, i=1, size(numbers))]
      length = 1
      do while (length < size(numbers))
         do first = 1, size(numbers) - length, 2*length
            call merge_runs(numbers, length, order(first:min(first + 2*length - 1, size(numbers))))
         end do
         length = 2*length
      end do
   end function ascending_order

   ! Merges two sorted runs of `order`, the first of which has this length.
   pure subroutine merge_runs(numbers, length, order)
      real(wp), intent(in) :: numbers(:)
      integer, intent(in) :: length
      integer, intent(inout) :: order(:)
      integer :: run(length)
      integer :: i, j, k

      if (numbers(order(length)) <= numbers(order(length + 1))) return
      run = order(:length)
      i = 1
      j = length + 1
      do k = 1, size(order)
         if (j > size(order)) then
            order(k:) = run(i:)
            return
         else if (i > length) then
            return
         else if (numbers(run(i)) <= numbers(order(j))) then
            order(k) = run(i)
            i = i + 1
         else
            order(k) = order(j)
            j = j + 1
         end if
      end do
   end subroutine merge_runs

   !> The positions at which a mask is true, in order.
   pure function positions(mask)
      logical, intent(in) :: mask(:)
      integer :: positions(count(mask))
      integer :: i

      positions = pack([(i, i=1, size(mask))], mask)
   end function positions
end module kschur_sorting
