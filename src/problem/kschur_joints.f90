!> Joints that confine bodies: rows of the constraints that leave few motions to a body.
!>
!> Multibody codes write the rows of a joint in its own frame, so that each concerns all unknowns of two bodies. If the first body
!> moves in a few ways only, as those that hang on the ground do, there are combinations of these rows that concern the second
!> body alone: it moves in a few ways too, and so on from joint to joint. Where a loop closes, combinations vanish: they are
!> redundant. Blocks of rows of a joint are eliminated exactly, with threshold pivoting, in extended precision. Rows that nearly
!> depend on each other are left as they are.
module kschur_joints
   use kschur_confinement, only: confinement_type
   use kschur_error, only: error_type
   use kschur_joint_block, only: joint_block_type, most_columns, most_motions, most_rows
   use kschur_joint_rows, only: add_operation, finish, joint_rows_type, list_type, put_row, start, substitute
   use kschur_kinds, only: wp, xp
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: confine

   ! Rows at an unknown up to which the joints of its body are looked at.
   integer, parameter :: most_joint_rows = 256

contains

   !> Finds what confines bodies. Without any, `unknown` is empty.
   subroutine confine(constraints, confinement, error)
      type(csr_matrix_type), intent(in) :: constraints
      type(confinement_type), intent(out) :: confinement
      type(error_type), allocatable, intent(out) :: error
      type(joint_rows_type) :: work
      integer :: r, set, length

      call start(work, constraints)
      set = 1
      do
         if (work%seeds%length > 0) then
            r = work%seeds%item(work%seeds%length)
            work%seeds%length = work%seeds%length - 1
            work%is_seed(r) = .false.
            if (.not. work%settled(r)) call begin_at(work, r)
         else if (set <= work%sets%length) then
            length = work%sets%item(set)
            call go_on(work, [work%sets%item(set + 1:set + length)])
            set = set + length + 1
         else
            exit
         end if
      end do
      call finish(work, constraints, confinement, error)
   end subroutine confine

   ! Begins at row r: gathers rows that concern at most one unknown more each, as those of a body at the ground.
   subroutine begin_at(work, r)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: r
      type(joint_block_type) :: block

      if (any(work%is_motion(work%row(r)%column))) return
      work%mark = work%mark + 1
      call add_to_block(work, block, r)
      call add_close_rows(work, block, 1, 1)
      if (2*block%rows > block%columns) call eliminate_block(work, block)
   end subroutine begin_at

   ! Goes on from a body with few motions to those that are joined to it.
   subroutine go_on(work, set)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: set(:)
      type(list_type) :: rows
      type(joint_block_type) :: block
      integer, allocatable :: motions(:)
      integer :: seen, i, k, r

      motions = pack(set, .not. work%confined(set))
      if (size(motions) == 0 .or. size(motions) > most_motions) return
      allocate (rows%item(16))
      work%mark = work%mark + 1
      seen = work%mark
      if (any(work%users(motions) > most_joint_rows)) return
      do i = 1, size(motions)
         k = work%first(motions(i))
         do while (k > 0)
            r = work%of_row%item(k)
            k = work%next%item(k)
            if (work%settled(r) .or. work%row_mark(r) == seen) cycle
            if (.not. any(work%row(r)%column == motions(i))) cycle
            work%row_mark(r) = seen
            call rows%append(r)
         end do
      end do
      do i = 1, rows%length
         r = rows%item(i)
         ! It was in a block before.
         if (work%row_mark(r) /= seen) cycle
         if (all(is_member(work%row(r)%column, motions))) cycle
         block%rows = 0
         block%columns = 0
         block%inner = 0
         call gather(work, motions, rows%item(:rows%length), seen, r, block)
         if (block%rows > 1) call eliminate_block(work, block)
      end do
   end subroutine go_on

   ! Which of some columns are in a small set.
   pure function is_member(column, set)
      integer, intent(in) :: column(:), set(:)
      logical :: is_member(size(column))
      integer :: i

      do i = 1, size(column)
         is_member(i) = any(set == column(i))
      end do
   end function is_member

   ! Gathers the rows that are connected to row r by unknowns other than the motions, those of one joint or several of one body.
   ! An empty block: they are too many.
   subroutine gather(work, motions, rows, seen, r, block)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: motions(:), rows(:), seen, r
      type(joint_block_type), intent(inout) :: block
      integer :: i
      logical :: grows

      work%mark = work%mark + 1
      do i = 1, size(motions)
         call add_column(work, block, motions(i))
      end do
      block%inner = size(motions)
      call add_to_block(work, block, r)
      grows = block%rows > 0
      do while (grows)
         grows = .false.
         do i = 1, size(rows)
            if (work%row_mark(rows(i)) /= seen) cycle
            associate (column => work%row(rows(i))%column)
               if (.not. any(work%column_mark(column) == work%mark .and. work%place(column) > block%inner)) cycle
            end associate
            call add_to_block(work, block, rows(i))
            if (block%rows == 0) return
            grows = .true.
         end do
      end do
      call add_close_rows(work, block, block%inner + 1, 0)
   end subroutine gather

   ! Adds the rows with an unknown of a block, from column `first` on, that concern at most `more` others, as far as there is room.
   subroutine add_close_rows(work, block, first, more)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(inout) :: block
      integer, intent(in) :: first, more
      integer :: c, k, s

      c = first
      do while (c <= block%columns)
         k = 0
         if (work%users(block%column(c)) <= most_joint_rows) k = work%first(block%column(c))
         c = c + 1
         do while (k > 0)
            s = work%of_row%item(k)
            k = work%next%item(k)
            if (work%settled(s) .or. work%row_mark(s) == work%mark .or. block%rows == most_rows) cycle
            associate (column => work%row(s)%column)
               if (.not. any(column == block%column(c - 1))) cycle
               if (block%inner == 0 .and. any(work%is_motion(column))) cycle
               if (count(work%column_mark(column) /= work%mark) > merge(more, 0, block%columns < most_columns)) cycle
            end associate
            call add_to_block(work, block, s)
            ! With an unknown more, rows that were too long may fit.
            c = first
            exit
         end do
      end do
   end subroutine add_close_rows

   ! Adds a row to a block with its columns; leaves the block without rows if it becomes too large.
   subroutine add_to_block(work, block, r)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(inout) :: block
      integer, intent(in) :: r
      integer :: k

      associate (row => work%row(r))
         work%row_mark(r) = work%mark
         if (block%rows == most_rows .or. block%columns - block%inner + &
            count(work%column_mark(row%column) /= work%mark) > most_columns) then
            block%rows = 0
            return
         end if
         block%rows = block%rows + 1
         block%row(block%rows) = r
         block%value(block%rows, :) = 0
         do k = 1, size(row%column)
            if (work%column_mark(row%column(k)) /= work%mark) call add_column(work, block, row%column(k))
            block%value(block%rows, work%place(row%column(k))) = row%value(k)
         end do
      end associate
   end subroutine add_to_block

   subroutine add_column(work, block, column)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(inout) :: block
      integer, intent(in) :: column

      block%columns = block%columns + 1
      block%column(block%columns) = column
      work%column_mark(column) = work%mark
      work%place(column) = block%columns
   end subroutine add_column

   ! Eliminates a block, and keeps that if it leaves half of the unknowns of the body or less, or a row is redundant.
   subroutine eliminate_block(work, block)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(inout) :: block
      logical :: is_sure, is_empty(block%rows)
      integer :: confined

      call block%eliminate(is_empty, is_sure)
      if (.not. is_sure) return
      confined = count(block%pivot(:block%rows) > 0)
      if (2*confined + min(block%inner, 1) <= block%columns - block%inner) then
         if (.not. any(is_empty)) return
         block%pivot = 0
      end if
      call keep(work, block, is_empty)
   end subroutine eliminate_block

   ! Keeps what the elimination of a block has found, and substitutes the confined unknowns in all rows. Rows that neither confine
   ! nor vanish stay as they were.
   subroutine keep(work, block, is_empty)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(in) :: block
      logical, intent(in) :: is_empty(:)
      integer, allocatable :: places(:), motions(:)
      real(xp) :: of_rows(block%rows, block%rows)
      logical :: is_settled(block%rows)
      integer :: i, k

      if (any(is_empty)) call add_self_stress(work, block, is_empty)
      of_rows = block%combinations()
      is_settled = is_empty .or. block%pivot(:block%rows) > 0
      if (any(block%pivot(:block%rows) > 0)) then
         do k = 1, block%operations
            associate (i => block%target(k), j => block%source(k))
               if (.not. is_settled(i)) cycle
               if (is_settled(j)) then
                  call add_operation(work, block%row(i), block%row(j), block%multiple(k))
               else
                  call add_rows(i, block%multiple(k)*of_rows(j, :))
               end if
            end associate
         end do
      else
         do i = 1, block%rows
            of_rows(i, i) = 0
            if (is_empty(i)) call add_rows(i, -of_rows(i, :))
         end do
      end if
      do i = 1, block%rows
         if (.not. is_settled(i)) cycle
         places = pack([(k, k=1, block%columns)], abs(block%value(i, :block%columns)) > 0)
         call put_row(work, block%row(i), block%column(places), block%value(i, places))
         work%settled(block%row(i)) = .true.
      end do
      do i = 1, block%rows
         if (block%pivot(i) == 0) cycle
         call work%pivot_row%append(block%row(i))
         call work%pivot%append(block%column(block%pivot(i)))
         work%confined(block%column(block%pivot(i))) = .true.
      end do
      do i = 1, block%rows
         if (block%pivot(i) > 0) call substitute(work, block%row(i), block%column(block%pivot(i)))
      end do
      if (.not. any(block%pivot(:block%rows) > 0)) return
      motions = pack(block%column(block%inner + 1:block%columns), .not. work%confined(block%column(block%inner + 1:block%columns)))
      if (size(motions) == 0) return
      call work%sets%append(size(motions))
      work%is_motion(motions) = .true.
      do i = 1, size(motions)
         call work%sets%append(motions(i))
      end do

   contains

      ! Adds the operations that subtract multiples of rows as they were from row i.
      subroutine add_rows(i, multiple)
         integer, intent(in) :: i
         real(xp), intent(in) :: multiple(:)
         integer :: j

         do j = 1, block%rows
            if (abs(multiple(j)) > 0) call add_operation(work, block%row(i), block%row(j), multiple(j))
         end do
      end subroutine add_rows
   end subroutine keep

   ! Adds the states of self-stress of a block, the combinations of its rows that vanish, orthonormal in units of the rows.
   subroutine add_self_stress(work, block, is_empty)
      type(joint_rows_type), intent(inout) :: work
      type(joint_block_type), intent(in) :: block
      logical, intent(in) :: is_empty(:)
      integer, allocatable :: rows(:)
      real(xp) :: state(block%rows, block%rows), unit(block%rows)
      integer :: i, j, k, entries, pass

      state = block%combinations()
      unit = work%unit(block%row(:block%rows))
      rows = pack([(i, i=1, block%rows)], is_empty)
      do i = 1, size(rows)
         associate (v => state(rows(i), :))
            v = v*unit
            do pass = 1, 2
               do j = 1, i - 1
                  v = v - dot_product(v, state(rows(j), :))*state(rows(j), :)
               end do
            end do
            v = v/norm2(v)
            call work%before%append(work%target%length)
            call work%first_entry%append(work%stressed_row%length + 1)
            do k = 1, block%rows
               if (.not. abs(v(k)) > 0) cycle
               call work%stressed_row%append(block%row(k))
               entries = work%stressed_row%length
               if (entries > size(work%stress)) then
                  work%stress = [work%stress, work%stress]
                  work%weight = [work%weight, work%weight]
               end if
               work%stress(entries) = real(v(k)/unit(k), wp)
               work%weight(entries) = real(v(k)*unit(k), wp)
            end do
         end associate
      end do
   end subroutine add_self_stress
end module kschur_joints
