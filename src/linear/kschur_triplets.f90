!> A list of matrix entries (row, column, value) that grows as it is filled.
module kschur_triplets
   use kschur_error, only: error_type, new_error, error_input, error_memory
   use kschur_kinds, only: wp
   use kschur_text, only: text
   implicit none
   private
   public :: triplets_type

   !> The first `count` places of each array are in use.
   type :: triplets_type
      integer :: count = 0
      integer, allocatable :: row(:)
      integer, allocatable :: column(:)
      real(wp), allocatable :: value(:)
   contains
      !> Appends one entry; fails if memory is short.
      procedure :: append
      !> Allocates room for this many entries in all.
      procedure :: reserve
   end type triplets_type

contains

   pure subroutine append(self, row, column, value, error)
      class(triplets_type), intent(inout) :: self
      integer, intent(in) :: row, column
      real(wp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(self%value)) call self%reserve(1024, error)
      if (self%count == huge(1)) call new_error(error, error_input, "there are more than "//text(huge(1))//" entries")
      if (allocated(error)) return
      if (self%count == size(self%value)) call self%reserve(self%count + min(self%count, huge(1) - self%count), error)
      if (allocated(error)) return
      self%count = self%count + 1
      self%row(self%count) = row
      self%column(self%count) = column
      self%value(self%count) = value
   end subroutine append

   pure subroutine reserve(self, places, error)
      class(triplets_type), intent(inout) :: self
      integer, intent(in) :: places
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: larger(:)
      integer :: status

      call lengthen(self%row, self%count, places, status)
      if (status == 0) call lengthen(self%column, self%count, places, status)
      if (status == 0) allocate (larger(places), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "there is not enough memory for "//text(places)//" entries")
         return
      end if
      if (self%count > 0) larger(:self%count) = self%value(:self%count)
      call move_alloc(larger, self%value)
   end subroutine reserve

   ! Reallocates a list to `places` entries and keeps the first `count`.
   pure subroutine lengthen(list, count, places, status)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(in) :: count, places
      integer, intent(out) :: status
      integer, allocatable :: larger(:)

      allocate (larger(places), stat=status)
      if (status /= 0) return
      if (count > 0) larger(:count) = list(:count)
      call move_alloc(larger, list)
   end subroutine lengthen
end module kschur_triplets
