!> Priority queue of integers, smallest first: a binary heap (Williams, Comm. ACM 7 (1964), algorithm 232).
module kschur_number_heap
   implicit none
   private
   public :: number_heap_type

   !> The heap: `put` inserts a number, `least` removes the smallest while `length` is not zero.
   type :: number_heap_type
      integer :: length = 0
      ! Heap order: number(i) <= number(2 i), number(2 i + 1).
      integer, allocatable, private :: number(:)
   contains
      procedure :: put
      !> Removes and returns the smallest number; the heap must not be empty.
      procedure :: least
   end type number_heap_type

contains

   subroutine put(self, number)
      class(number_heap_type), intent(inout) :: self
      integer, intent(in) :: number
      integer :: i

      if (.not. allocated(self%number)) allocate (self%number(32))
      if (self%length == size(self%number)) self%number = [self%number, self%number]
      self%length = self%length + 1
      i = self%length
      do while (i > 1)
         if (self%number(i/2) <= number) exit
         self%number(i) = self%number(i/2)
         i = i/2
      end do
      self%number(i) = number
   end subroutine put

   integer function least(self)
      class(number_heap_type), intent(inout) :: self
      integer :: i, child, last

      least = self%number(1)
      last = self%number(self%length)
      self%length = self%length - 1
      i = 1
      do
         child = 2*i
         if (child > self%length) exit
         if (child < self%length) then
            if (self%number(child + 1) < self%number(child)) child = child + 1
         end if
         if (self%number(child) >= last) exit
         self%number(i) = self%number(child)
         i = child
      end do
      self%number(i) = last
   end function least
end module kschur_number_heap
