!> Which rows of a vector or a matrix each process has, where they are shared: one range each, as long as the others.
module kschur_row_ranges
   use kschur_kinds, only: long
   implicit none
   private
   public :: row_ranges, row_ranges_type

   !> Processes are counted from 0, rows from 1.
   type :: row_ranges_type
      !> Rows before the first one of each process, (0:processes): those of process p are before(p) + 1 .. before(p + 1).
      integer, allocatable :: before(:)
   contains
      !> The first row of a process, and its last one: one less where it has none.
      procedure :: first
      procedure :: last
      !> How many rows a process has.
      procedure :: rows
      !> Which process has a row.
      procedure :: owner
   end type row_ranges_type

contains

   !> So many rows over so many processes.
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
