!> Distribution of vectors of unknowns followed by multipliers: each process has a range of both.
module kschur_joint_ranges
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   implicit none
   private
   public :: joint_ranges, joint_ranges_type

   !> Processes are counted from 0, rows from 1.
   type :: joint_ranges_type
      type(row_ranges_type) :: unknowns, multipliers
   contains
      !> Number of rows of a process.
      procedure :: rows
      !> Their indices: unknowns first, then multipliers.
      procedure :: row_numbers
      !> Owner of a row, and its local index there.
      procedure :: owner
      procedure :: place
      !> Total number of unknowns.
      procedure :: all_unknowns
   end type joint_ranges_type

contains

   !> Distributes unknowns and multipliers over `processes` processes.
   pure function joint_ranges(unknowns, multipliers, processes) result(ranges)
      integer, intent(in) :: unknowns, multipliers, processes
      type(joint_ranges_type) :: ranges

      ranges%unknowns = row_ranges(unknowns, processes)
      ranges%multipliers = row_ranges(multipliers, processes)
   end function joint_ranges

   pure integer function rows(self, process)
      class(joint_ranges_type), intent(in) :: self
      integer, intent(in) :: process

      rows = self%unknowns%rows(process) + self%multipliers%rows(process)
   end function rows

   pure function row_numbers(self, process)
      class(joint_ranges_type), intent(in) :: self
      integer, intent(in) :: process
      integer :: row_numbers(self%unknowns%rows(process) + self%multipliers%rows(process))
      integer :: i

      row_numbers = [[(i, i=self%unknowns%first(process), self%unknowns%last(process))], &
         self%all_unknowns() + [(i, i=self%multipliers%first(process), self%multipliers%last(process))]]
   end function row_numbers

   pure integer function owner(self, row)
      class(joint_ranges_type), intent(in) :: self
      integer, intent(in) :: row

      if (row <= self%all_unknowns()) then
         owner = self%unknowns%owner(row)
      else
         owner = self%multipliers%owner(row - self%all_unknowns())
      end if
   end function owner

   pure integer function place(self, row)
      class(joint_ranges_type), intent(in) :: self
      integer, intent(in) :: row
      integer :: process

      process = self%owner(row)
      if (row <= self%all_unknowns()) then
         place = row - self%unknowns%before(process)
      else
         place = self%unknowns%rows(process) + row - self%all_unknowns() - self%multipliers%before(process)
      end if
   end function place

   pure integer function all_unknowns(self)
      class(joint_ranges_type), intent(in) :: self

      all_unknowns = self%unknowns%before(ubound(self%unknowns%before, 1))
   end function all_unknowns
end module kschur_joint_ranges
