!> Distribution of the rows of a vector or matrix over processes: one contiguous range each, of nearly equal lengths.
module kschur_row_ranges
   use kschur_kinds, only: long
   implicit none
   private
   public :: row_ranges, row_ranges_type

   !> Processes are counted from 0, rows from 1.
   type :: row_ranges_type
      !> Number of rows before those of each process, (0:processes): process p has rows before(p) + 1 .. before(p + 1).
      integer, allocatable :: before(:)
   contains
      !> First and last row of a process; last = first - 1 if it has none.
      procedure :: first
      procedure :: last
      !> Number of rows of a process.
      procedure :: rows
      !> The process that has a row.
      procedure :: owner
   end type row_ranges_type

contains

   !> Distributes `rows` rows over `processes` processes.
   pure function row_ranges(rows, processes) result(ranges)
      integer, intent(in) :: rows, processes
      type(row_ranges_type) :: ranges
      integer :: p

      allocate (ranges%before(0:processes))
      do p = 0, processes
         ranges%before(p) = int(int(rows, long)*p/processes)
      end do
   end function row_ranges

   pure integer function first(self, process)
      class(row_ranges_type), intent(in) :: self
      integer, intent(in) :: process

      first = self%before(process) + 1
   end function first

   pure integer function last(self, process)
      class(row_ranges_type), intent(in) :: self
      integer, intent(in) :: process

      last = self%before(process + 1)
   end function last

   pure integer function rows(self, process)
      class(row_ranges_type), intent(in) :: self
      integer, intent(in) :: process

      rows = self%before(process + 1) - self%before(process)
   end function rows

   pure integer function owner(self, row)
      class(row_ranges_type), intent(in) :: self
      integer, intent(in) :: row
      integer :: above, middle

      owner = 0
      above = ubound(self%before, 1)
      do while (above - owner > 1)
         middle = (owner + above)/2
         if (row > self%before(middle)) then
            owner = middle
         else
            above = middle
         end if
      end do
   end function owner
end module kschur_row_ranges
