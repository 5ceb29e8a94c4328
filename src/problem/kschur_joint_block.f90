!> Dense elimination of the rows of one joint.
module kschur_joint_block
   use kschur_kinds, only: xp
   use kschur_tolerances, only: nearly_dependent, rounding_of_row, usable_pivot
   implicit none
   private
   public :: joint_block_type, most_columns, most_motions, most_rows

   !> Sizes of a block: rows; unknowns of the body that may be confined; of the one before it. A joint has six rows, a body six
   !> unknowns.
   integer, parameter :: most_rows = 16, most_columns = 12, most_motions = 6

   !> Rows as a dense matrix; the first `inner` columns are those of the body before.
   type :: joint_block_type
      integer :: rows = 0, columns = 0, inner = 0
      !> Their numbers.
      integer :: row(most_rows), column(most_motions + most_columns)
      real(xp) :: value(most_rows, most_motions + most_columns)
      !> Sums of magnitudes of the terms of each entry.
      real(xp) :: terms(most_rows, most_motions + most_columns)
      !> Scales of rows and columns.
      real(xp) :: row_scale(most_rows), column_scale(most_motions + most_columns)
      !> The column each row is the pivot row of, 0: none.
      integer :: pivot(most_rows)
      !> Operations within the block.
      integer :: operations = 0
      integer :: target(most_rows**2), source(most_rows**2)
      real(xp) :: multiple(most_rows**2)
   contains
      procedure :: eliminate
      !> Which combination of the rows as they were each row is after the elimination.
      procedure :: combinations
   end type joint_block_type

contains

   !> Eliminates the motions of the body before, then the unknowns of the body from the rows that are left.
   subroutine eliminate(block, is_empty, is_sure)
      class(joint_block_type), intent(inout) :: block
      !> Rows that vanish, to rounding.
      logical, intent(out) :: is_empty(:)
      !> False: rows depend on others nearly, but not to rounding; the block is undefined.
      logical, intent(out) :: is_sure
      logical :: is_done(block%rows)
      integer :: k

      block%operations = 0
      block%column_scale = 1
      block%terms(:block%rows, :block%columns) = abs(block%value(:block%rows, :block%columns))
      do k = 1, block%columns
         associate (largest => maxval(block%terms(:block%rows, k)))
            if (largest > 0) block%column_scale(k) = 1/largest
         end associate
      end do
      do k = 1, block%rows
         block%row_scale(k) = 1/maxval(block%terms(k, :block%columns)*block%column_scale(:block%columns))
      end do
      is_done = .false.
      call eliminate_columns(block, 1, block%inner, is_done, .false., is_sure)
      if (.not. is_sure) return
      block%pivot = 0
      call eliminate_columns(block, block%inner + 1, block%columns, is_done, .true., is_sure)
      is_empty = .not. is_done
   end subroutine eliminate

   pure function combinations(block) result(of_rows)
      class(joint_block_type), intent(in) :: block
      real(xp) :: of_rows(block%rows, block%rows)
      integer :: k

      of_rows = 0
      do k = 1, block%rows
         of_rows(k, k) = 1
      end do
      do k = 1, block%operations
         of_rows(block%target(k), :) = of_rows(block%target(k), :) - block%multiple(k)*of_rows(block%source(k), :)
      end do
   end function combinations

   ! Eliminates columns first..last of a block from the rows that are not done; pivot rows are done. `fully`: also from the pivot
   ! rows before.
   subroutine eliminate_columns(block, first, last, is_done, fully, is_sure)
      class(joint_block_type), intent(inout) :: block
      integer, intent(in) :: first, last
      logical, intent(inout) :: is_done(:)
      logical, intent(in) :: fully
      !> False: entries are neither zero to rounding nor clearly not.
      logical, intent(out) :: is_sure
      logical :: was_done(size(is_done))
      integer :: c, r, row, column, entries, fewest
      real(xp) :: size_of, largest

      is_sure = .true.
      was_done = is_done
      row = 0
      column = 0
      do
         largest = 0
         do c = first, last
            do r = 1, block%rows
               if (.not. is_done(r)) largest = max(largest, magnitude(r, c))
            end do
         end do
         if (.not. largest > 0) exit
         is_sure = largest > nearly_dependent
         if (.not. is_sure) return
         ! Of the shortest rows with usable pivots the largest: what stays is as sparse as it was.
         fewest = huge(fewest)
         size_of = 0
         do r = 1, block%rows
            if (is_done(r)) cycle
            entries = count(abs(block%value(r, :block%columns)) > 0)
            do c = first, last
               if (magnitude(r, c) < usable_pivot*largest .or. entries > fewest) cycle
               if (entries == fewest .and. magnitude(r, c) <= size_of) cycle
               fewest = entries
               size_of = magnitude(r, c)
               row = r
               column = c
            end do
         end do
         is_done(row) = .true.
         block%pivot(row) = column
         do r = 1, block%rows
            if (r == row .or. .not. abs(block%value(r, column)) > 0) cycle
            if (is_done(r) .and. (.not. fully .or. was_done(r))) cycle
            call subtract(block, r, row, column, is_sure)
            if (.not. is_sure) return
         end do
      end do

   contains

      pure real(xp) function magnitude(r, c)
         integer, intent(in) :: r, c

         magnitude = abs(block%value(r, c))*block%row_scale(r)*block%column_scale(c)
      end function magnitude
   end subroutine eliminate_columns

   ! Subtracts the multiple of the pivot row that makes the entry in the column of its pivot vanish.
   subroutine subtract(block, r, row, column, is_sure)
      class(joint_block_type), intent(inout) :: block
      integer, intent(in) :: r, row, column
      logical, intent(out) :: is_sure
      real(xp) :: ratio
      integer :: c

      ratio = block%value(r, column)/block%value(row, column)
      is_sure = block%operations < size(block%target)
      if (.not. is_sure) return
      do c = 1, block%columns
         associate (value => block%value(r, c), terms => block%terms(r, c))
            if (.not. abs(block%value(row, c)) > 0) cycle
            terms = terms + abs(ratio)*block%terms(row, c)
            value = value - ratio*block%value(row, c)
            if (c == column .or. abs(value) <= rounding_of_row*terms) then
               value = 0
            else if (abs(value) < nearly_dependent*terms) then
               is_sure = .false.
            end if
         end associate
      end do
      block%operations = block%operations + 1
      block%target(block%operations) = r
      block%source(block%operations) = row
      block%multiple(block%operations) = ratio
   end subroutine subtract
end module kschur_joint_block
