!> Rows of constraints under row operations, and what these confine.
module kschur_joint_rows
   use kschur_confinement, only: confinement_type
   use kschur_error, only: error_type
   use kschur_joint_block, only: most_columns
   use kschur_kinds, only: wp, xp
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: rounding_of_row
   implicit none
   private
   public :: add_operation, finish, joint_rows_type, list_type, put_row, start, substitute

   !> A sparse row.
   type :: row_type
      integer, allocatable :: column(:)
      real(xp), allocatable :: value(:)
   end type row_type

   !> A growing list of integers.
   type :: list_type
      integer :: length = 0
      integer, allocatable :: item(:)
   contains
      procedure :: append
   end type list_type

   !> State: current rows; rows that are done, as they confine or are empty; the chain of rows of each column and its length, some
   !> of them without an entry there by now.
   type :: joint_rows_type
      type(row_type), allocatable :: row(:)
      logical, allocatable :: settled(:), confined(:)
      !> Unknowns left to bodies in sets.
      logical, allocatable :: is_motion(:)
      integer, allocatable :: first(:), users(:)
      type(list_type) :: next, of_row
      !> Rows to begin at; sets of unknowns to go on from, each preceded by its size.
      type(list_type) :: seeds, sets
      logical, allocatable :: is_seed(:)
      !> Marks of rows, and of columns with their place in the current block.
      integer :: mark = 0
      integer, allocatable :: row_mark(:), column_mark(:), place(:)
      !> Operations, and the rows that confine with their unknowns.
      type(list_type) :: target, source, pivot_row, pivot
      real(xp), allocatable :: multiple(:)
      !> States of self-stress.
      type(list_type) :: before, first_entry, stressed_row
      real(wp), allocatable :: stress(:), weight(:)
      !> Largest entries of the rows as given.
      real(wp), allocatable :: unit(:)
   end type joint_rows_type

contains

   !> Copies the rows, and lists those of each column.
   subroutine start(work, constraints)
      type(joint_rows_type), intent(inout) :: work
      type(csr_matrix_type), intent(in) :: constraints
      integer :: i, k, m, n

      m = constraints%rows
      n = constraints%columns
      allocate (work%unit, source=constraints%row_maxima())
      allocate (work%row(m), work%multiple(16), work%stress(16), work%weight(16))
      allocate (work%settled(m), work%is_seed(m), work%confined(n), work%is_motion(n), source=.false.)
      allocate (work%first(n), work%users(n), work%row_mark(m), work%column_mark(n), work%place(n), source=0)
      associate (w => work)
         allocate (w%next%item(16), w%of_row%item(16), w%seeds%item(16), w%sets%item(16), w%target%item(16), w%source%item(16), &
            w%pivot_row%item(16), w%pivot%item(16), w%before%item(16), w%first_entry%item(16), w%stressed_row%item(16))
      end associate
      do i = m, 1, -1
         associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
            work%row(i)%column = constraints%column(first:last)
            work%row(i)%value = real(constraints%value(first:last), xp)
         end associate
         do k = 1, size(work%row(i)%column)
            call list_row(work, i, work%row(i)%column(k))
         end do
         call add_seed(work, i)
      end do
   end subroutine start

   ! Adds a row to the chain of a column.
   subroutine list_row(work, r, column)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: r, column

      call work%of_row%append(r)
      call work%next%append(work%first(column))
      work%first(column) = work%of_row%length
      work%users(column) = work%users(column) + 1
   end subroutine list_row

   ! Remembers a row to begin at, if it is short, and no tie.
   subroutine add_seed(work, r)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: r

      associate (length => size(work%row(r)%column))
         if (work%is_seed(r) .or. work%settled(r) .or. length > most_columns/2 .or. length == 2) return
      end associate
      work%is_seed(r) = .true.
      call work%seeds%append(r)
   end subroutine add_seed

   !> Adds an operation: row target less a multiple of row source.
   subroutine add_operation(work, target, source, multiple)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: target, source
      real(xp), intent(in) :: multiple

      call work%target%append(target)
      call work%source%append(source)
      if (work%target%length > size(work%multiple)) work%multiple = [work%multiple, work%multiple]
      work%multiple(work%target%length) = multiple
   end subroutine add_operation

   !> Replaces a row.
   subroutine put_row(work, r, column, value)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: r, column(:)
      real(xp), intent(in) :: value(:)
      integer :: k

      do k = 1, size(column)
         if (.not. any(work%row(r)%column == column(k))) call list_row(work, r, column(k))
      end do
      work%row(r)%column = column
      work%row(r)%value = value
   end subroutine put_row

   !> Eliminates the unknown of pivot row p from all rows that are not settled.
   subroutine substitute(work, p, unknown)
      type(joint_rows_type), intent(inout) :: work
      integer, intent(in) :: p, unknown
      integer, allocatable :: column(:)
      real(xp), allocatable :: value(:)
      real(xp) :: ratio, change
      integer :: at(1), i, k, r, l, entries

      i = work%first(unknown)
      do while (i > 0)
         r = work%of_row%item(i)
         i = work%next%item(i)
         if (work%settled(r)) cycle
         at = findloc(work%row(r)%column, unknown)
         if (at(1) == 0) cycle
         ratio = work%row(r)%value(at(1))
         entries = size(work%row(r)%column)
         call make_room(entries + size(work%row(p)%column))
         column(:entries) = work%row(r)%column
         value(:entries) = work%row(r)%value
         associate (pivot_row => work%row(p))
            ratio = ratio/pivot_row%value(findloc(pivot_row%column, unknown, 1))
            do k = 1, size(pivot_row%column)
               change = -ratio*pivot_row%value(k)
               l = findloc(column(:entries), pivot_row%column(k), 1)
               if (l == 0) then
                  entries = entries + 1
                  column(entries) = pivot_row%column(k)
                  value(entries) = change
               else if (pivot_row%column(k) == unknown .or. &
                  abs(value(l) + change) <= rounding_of_row*max(abs(value(l)), abs(change))) then
                  value(l) = 0
               else
                  value(l) = value(l) + change
               end if
            end do
         end associate
         call add_operation(work, r, p, ratio)
         associate (is_entry => abs(value(:entries)) > 0)
            call put_row(work, r, pack(column(:entries), is_entry), pack(value(:entries), is_entry))
         end associate
         call add_seed(work, r)
      end do

   contains

      ! Makes room for a row with so many entries; its contents are lost.
      subroutine make_room(length)
         integer, intent(in) :: length

         if (allocated(column)) then
            if (size(column) >= length) return
            deallocate (column, value)
         end if
         allocate (column(2*length), value(2*length))
      end subroutine make_room
   end subroutine substitute

   !> Copies the result.
   subroutine finish(work, constraints, confinement, error)
      type(joint_rows_type), intent(in) :: work
      type(csr_matrix_type), intent(in) :: constraints
      type(confinement_type), intent(inout) :: confinement
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      ! The unknown that each row confines, 0: none.
      integer :: confines(constraints%rows)
      integer :: i, k, l, p, r, entries

      associate (k => work%target%length)
         confinement%target = work%target%item(:k)
         confinement%source = work%source%item(:k)
         confinement%multiple = real(work%multiple(:k), wp)
      end associate
      confinement%before = work%before%item(:work%before%length)
      confinement%first_entry = [work%first_entry%item(:work%first_entry%length), work%stressed_row%length + 1]
      associate (k => work%stressed_row%length)
         confinement%stressed_row = work%stressed_row%item(:k)
         confinement%stress = work%stress(:k)
         confinement%weight = work%weight(:k)
      end associate
      associate (pivots => work%pivot%length)
         confinement%unknown = work%pivot%item(:pivots)
         entries = 0
         do i = 1, pivots
            entries = entries + size(work%row(work%pivot_row%item(i))%column) - 1
         end do
         allocate (confinement%start(pivots + 1), confinement%master(entries), confinement%share(entries))
      end associate
      confinement%start(1) = 1
      l = 0
      confines = 0
      do i = 1, size(confinement%unknown)
         r = work%pivot_row%item(i)
         confines(r) = confinement%unknown(i)
         associate (pivot_row => work%row(r))
            p = findloc(pivot_row%column, confinement%unknown(i), 1)
            do k = 1, size(pivot_row%column)
               if (k == p) cycle
               l = l + 1
               confinement%master(l) = pivot_row%column(k)
               confinement%share(l) = real(-pivot_row%value(k)/pivot_row%value(p), wp)
            end do
         end associate
         confinement%start(i + 1) = l + 1
      end do
      entries = 0
      do i = 1, size(work%row)
         entries = entries + size(work%row(i)%column)
      end do
      allocate (row(entries), column(entries), value(entries))
      entries = 0
      do i = 1, size(work%row)
         do k = 1, size(work%row(i)%column)
            if (confines(i) > 0 .and. work%row(i)%column(k) /= confines(i)) cycle
            entries = entries + 1
            row(entries) = i
            column(entries) = work%row(i)%column(k)
            value(entries) = real(work%row(i)%value(k), wp)
         end do
      end do
      call new_csr_from_triplets(confinement%constraints, constraints%rows, constraints%columns, row(:entries), column(:entries), &
         value(:entries), error)
   end subroutine finish

   subroutine append(self, item)
      class(list_type), intent(inout) :: self
      integer, intent(in) :: item
      integer, allocatable :: more(:)

      if (self%length == size(self%item)) then
         allocate (more(2*self%length))
         more(:self%length) = self%item
         call move_alloc(more, self%item)
      end if
      self%length = self%length + 1
      self%item(self%length) = item
   end subroutine append
end module kschur_joint_rows
