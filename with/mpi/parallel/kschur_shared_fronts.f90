!> The rows of a front of LDL^T that one of several processes has: rows of the common columns are dealt out in blocks, so that each
!> process has as many of every front, at all columns. A front takes its rows of A and of the update matrices of its children.
module kschur_shared_fronts
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: dgemm
   use kschur_enclosure, only: enclosure_type
   use kschur_panel, only: factor_rows
   use kschur_sparse, only: csr_matrix_type
   use kschur_threads, only: team_size
   implicit none
   private
   public :: common_tree_type, process_of_row, shared_front_type, shared_update_type

   !> The common supernodes; their columns are counted from 1.
   type :: common_tree_type
      !> As in `symbolic_type`, with all rows.
      integer, allocatable :: first(:), row(:)
      integer(long), allocatable :: start(:)
      !> 0 at a root; the children of supernode s are child(s), sibling(child(s)) ...
      integer, allocatable :: parent(:), child(:), sibling(:)
   contains
      !> Finds parents and children.
      procedure :: find_children
      !> Number of rows of a supernode, with its diagonal block, and the most of all; of columns.
      procedure :: rows
      procedure :: most_rows
      procedure :: columns
   end type common_tree_type

   !> The rows of this process of the update matrix of a supernode, after those and columns that are eliminated already.
   type :: shared_update_type
      real(wp), allocatable :: entries(:, :)
      integer :: rows_done = 0, columns_done = 0
      !> Of each of its rows, the `sum` of `enclosure_type`.
      real(wp), allocatable :: sum(:)
   end type shared_update_type

   !> The front of the current supernode.
   type :: shared_front_type
      integer :: processes = 1, rank = 0
      integer :: columns = 0
      !> The common columns that its rows stand for, and which of them are here.
      integer, allocatable :: row(:), mine(:)
      !> Number of rows here that are in the diagonal block.
      integer :: diagonal = 0
      !> Of each common column, its place among all rows, and among those here.
      integer, allocatable :: place(:), here(:)
      !> Its entries.
      type(shared_update_type) :: matrix
   contains
      procedure :: begin
      procedure :: add_matrix
      procedure :: add_update
      procedure :: pack_diagonal
      procedure :: factor_mine
      procedure :: subtract_columns
   end type shared_front_type

   ! Rows that go to one process: few, so that all have as many; a cache line of them at least.
   integer, parameter :: dealt_rows = 16

   ! Rows of a panel, and columns of an update matrix, in a tile of a thread. Tiles along the diagonal waste half their width.
   integer, parameter :: tile_rows = 192, tile_columns = 96

contains

   !> The process, from 0, that has a row of the common columns.
   pure elemental integer function process_of_row(row, processes) result(process)
      integer, intent(in) :: row, processes

      process = mod((row - 1)/dealt_rows, processes)
   end function process_of_row

   subroutine find_children(self)
      class(common_tree_type), intent(inout) :: self
      integer :: supernode(self%first(size(self%first)) - 1), nodes, s

      nodes = size(self%first) - 1
      do s = 1, nodes
         supernode(self%first(s):self%first(s + 1) - 1) = s
      end do
      allocate (self%parent(nodes), self%child(nodes), self%sibling(nodes), source=0)
      do s = nodes, 1, -1
         if (self%start(s) == self%start(s + 1)) cycle
         self%parent(s) = supernode(self%row(self%start(s)))
         self%sibling(s) = self%child(self%parent(s))
         self%child(self%parent(s)) = s
      end do
   end subroutine find_children

   pure integer function rows(self, s)
      class(common_tree_type), intent(in) :: self
      integer, intent(in) :: s

      rows = self%first(s + 1) - self%first(s) + int(self%start(s + 1) - self%start(s))
   end function rows

   pure integer function most_rows(self)
      class(common_tree_type), intent(in) :: self
      integer :: s

      most_rows = maxval([0, (self%rows(s), s=1, size(self%first) - 1)])
   end function most_rows

   pure integer function columns(self)
      class(common_tree_type), intent(in) :: self

      columns = self%first(size(self%first)) - 1
   end function columns

   !> Makes the front of supernode s, and adds the update matrices of its children. The matrix of one that has all its rows, as
   !> those of the pieces of a wide supernode have, becomes that of the front.
   subroutine begin(self, tree, s, update, status)
      class(shared_front_type), intent(inout) :: self
      type(common_tree_type), intent(in) :: tree
      integer, intent(in) :: s
      !> Of the common supernodes; those of the children are freed.
      type(shared_update_type), intent(inout) :: update(:)
      integer, intent(out) :: status
      integer :: c, k, j, taken
      logical :: is_mine(tree%rows(s))

      self%columns = tree%first(s + 1) - tree%first(s)
      self%row = [(k, k=tree%first(s), tree%first(s + 1) - 1), tree%row(tree%start(s):tree%start(s + 1) - 1)]
      self%place(self%row) = [(k, k=1, size(self%row))]
      is_mine = process_of_row(self%row, self%processes) == self%rank
      self%mine = pack([(k, k=1, size(self%row))], is_mine)
      self%diagonal = count(is_mine(:self%columns))
      self%here(self%row(self%mine)) = [(k, k=1, size(self%mine))]
      taken = 0
      c = tree%child(s)
      do while (c /= 0)
         if (tree%start(c + 1) - tree%start(c) == size(self%row)) taken = c
         c = tree%sibling(c)
      end do
      self%matrix%rows_done = 0
      self%matrix%columns_done = 0
      status = 0
      if (allocated(self%matrix%entries)) deallocate (self%matrix%entries)
      if (allocated(self%matrix%sum)) deallocate (self%matrix%sum)
      if (taken > 0) then
         self%matrix%rows_done = update(taken)%rows_done
         self%matrix%columns_done = update(taken)%columns_done
         call move_alloc(update(taken)%entries, self%matrix%entries)
         call move_alloc(update(taken)%sum, self%matrix%sum)
      else
         allocate (self%matrix%entries(size(self%mine), size(self%row)), self%matrix%sum(size(self%mine)), stat=status)
         if (status /= 0) return
         self%matrix%sum = 0
         k = 1
         do j = 1, size(self%row)
            if (k <= size(self%mine)) then
               if (self%mine(k) < j) k = k + 1
            end if
            self%matrix%entries(k:, j) = 0
         end do
      end if
      c = tree%child(s)
      do while (c /= 0)
         if (c /= taken) call add_child(self, tree%row(tree%start(c):tree%start(c + 1) - 1), update(c))
         c = tree%sibling(c)
      end do
   end subroutine begin

   ! Adds the rows here of the update matrix of a child, and frees it.
   subroutine add_child(self, row, update)
      class(shared_front_type), intent(inout) :: self
      integer, intent(in) :: row(:)
      type(shared_update_type), intent(inout) :: update
      integer :: mine(count(process_of_row(row, self%processes) == self%rank)), to(size(mine)), i, j, k, n, column

      mine = pack([(k, k=1, size(row))], process_of_row(row, self%processes) == self%rank)
      to = self%here(row(mine))
      self%matrix%sum(to) = self%matrix%sum(to) + update%sum
      n = 1
      do j = 1, size(row)
         if (n <= size(mine)) then
            if (mine(n) < j) n = n + 1
         end if
         column = self%matrix%columns_done + self%place(row(j))
         associate (front => self%matrix%entries, done => self%matrix%rows_done)
            do i = n, size(mine)
               front(done + to(i), column) = front(done + to(i), column) + update%entries(update%rows_done + i, &
                  update%columns_done + j)
            end do
         end associate
      end do
      deallocate (update%entries, update%sum)
   end subroutine add_child

   !> Adds the rows here of the columns of A.
   subroutine add_matrix(self, matrix, before)
      class(shared_front_type), intent(inout) :: self
      !> The lower triangle, by columns, with the rows here; `before` columns are not common.
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: before
      integer :: i, j, p

      do j = 1, self%columns
         associate (column => before + self%row(j))
            do p = matrix%row_start(column), matrix%row_start(column + 1) - 1
               i = self%matrix%rows_done + self%here(matrix%column(p) - before)
               self%matrix%entries(i, self%matrix%columns_done + j) = self%matrix%entries(i, self%matrix%columns_done + j) + &
                  matrix%value(p)
            end do
         end associate
      end do
   end subroutine add_matrix

   !> Adds columns first ... last of the update matrix of a subtree: `values` has its rows here, on and below the diagonal.
   subroutine add_update(self, row, first, last, values)
      class(shared_front_type), intent(inout) :: self
      !> The common columns of its rows.
      integer, intent(in) :: row(:), first, last
      real(wp), intent(in) :: values(:)
      integer :: mine(size(row)), to(size(row)), n, i, j, k, column, next

      n = 0
      do k = first, size(row)
         if (process_of_row(row(k), self%processes) /= self%rank) cycle
         n = n + 1
         mine(n) = k
         to(n) = self%here(row(k))
      end do
      next = 0
      k = 1
      do j = first, last
         if (k <= n) then
            if (mine(k) < j) k = k + 1
         end if
         column = self%matrix%columns_done + self%place(row(j))
         associate (front => self%matrix%entries, done => self%matrix%rows_done)
            do i = k, n
               front(done + to(i), column) = front(done + to(i), column) + values(next + i - k + 1)
            end do
         end associate
         next = next + n - k + 1
      end do
   end subroutine add_update

   !> The rows here of the diagonal block, column by column, and their sums.
   subroutine pack_diagonal(self, values)
      class(shared_front_type), intent(in) :: self
      real(wp), intent(out) :: values(self%diagonal, self%columns + 1)

      associate (row => self%matrix%rows_done, column => self%matrix%columns_done)
         values(:, :self%columns) = self%matrix%entries(row + 1:row + self%diagonal, column + 1:column + self%columns)
         values(:, self%columns + 1) = self%matrix%sum(:self%diagonal)
      end associate
   end subroutine pack_diagonal

   !> Computes the rows here of L below the diagonal block, and their sums.
   subroutine factor_mine(self, block, pivot, enclosure, panel, below)
      class(shared_front_type), intent(inout) :: self
      !> The factored diagonal block.
      real(wp), intent(in) :: block(self%columns, self%columns), pivot(self%columns)
      !> With the dimensions of the front.
      type(enclosure_type), intent(in) :: enclosure
      !> Workspace.
      real(wp), intent(inout) :: panel(self%columns + size(self%mine) - self%diagonal, self%columns)
      real(wp), intent(out) :: below(size(self%mine) - self%diagonal, self%columns)
      integer :: row, last, j

      associate (matrix => self%matrix, columns => self%columns, rows => size(panel, 1))
         !$omp parallel do schedule(dynamic) private(last, j) num_threads(team_size()) if (rows > columns + tile_rows)
         do row = columns + 1, rows, tile_rows
            last = min(row + tile_rows - 1, rows)
            associate (from => matrix%rows_done + self%diagonal + row - columns, many => last - row)
               if (row == columns + 1) panel(:columns, :) = block
               panel(row:last, :) = matrix%entries(from:from + many, matrix%columns_done + 1:matrix%columns_done + columns)
            end associate
         end do
         !$omp end parallel do
         !$omp parallel do schedule(dynamic) private(last, j) num_threads(team_size()) if (rows > columns + tile_rows)
         do row = columns + 1, rows, tile_rows
            last = min(row + tile_rows - 1, rows)
            call factor_rows(row, last, columns, panel, rows, pivot)
            below(row - columns:last - columns, :) = panel(row:last, :)
            if (enclosure%side /= 0) then
               associate (sum => matrix%sum(self%diagonal + row - columns:self%diagonal + last - columns))
                  do j = 1, columns
                     sum = sum + enclosure%weight(j, pivot(j))*panel(row:last, j)**2
                  end do
               end associate
            end if
         end do
         !$omp end parallel do
      end associate
   end subroutine factor_mine

   !> Subtracts L D L^T of the columns from the rows here of the update matrix, which goes to `update`.
   subroutine subtract_columns(self, below, scaled, update)
      class(shared_front_type), intent(inout) :: self
      !> The rows of L here; all rows below the diagonal block, times pivots.
      real(wp), intent(in) :: below(size(self%mine) - self%diagonal, self%columns), &
         scaled(size(self%row) - self%columns, self%columns)
      type(shared_update_type), intent(inout) :: update
      integer :: j, from, wide, rows, lead

      associate (matrix => self%matrix)
         lead = size(matrix%entries, 1)
         matrix%rows_done = matrix%rows_done + self%diagonal
         matrix%columns_done = matrix%columns_done + self%columns
         !$omp parallel do schedule(dynamic) private(from, wide, rows) num_threads(team_size()) if (size(scaled, 1) > tile_columns)
         do j = 1, size(scaled, 1), tile_columns
            wide = min(tile_columns, size(scaled, 1) - j + 1)
            from = count(self%mine(self%diagonal + 1:) - self%columns < j) + 1
            rows = size(below, 1) - from + 1
            if (rows > 0) call dgemm("N", "T", rows, wide, self%columns, -1.0_wp, below(from, 1), size(below, 1), scaled(j, 1), &
               size(scaled, 1), 1.0_wp, matrix%entries(matrix%rows_done + from, matrix%columns_done + j), lead)
         end do
         !$omp end parallel do
         update%rows_done = matrix%rows_done
         update%columns_done = matrix%columns_done
         call move_alloc(matrix%entries, update%entries)
         allocate (update%sum(size(below, 1)))
         update%sum = matrix%sum(self%diagonal + 1:)
         deallocate (matrix%sum)
      end associate
   end subroutine subtract_columns
end module kschur_shared_fronts
