!> Multifrontal LDL^T of one supernode. A dense front takes its columns of A, and the update matrices of its children; its columns
!> are factored and stored in L; what they subtract from the rows below is its update matrix, for its parent. (J. W. H. Liu, SIAM
!> Rev. 34 (1992), doi 10.1137/1034004.)
module kschur_fronts
   use kschur_kinds, only: wp, long
   use kschur_panel, only: enclosure_type, factor_panel, factor_rows, subtract_trapezoid
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_update_memory, only: matrix_type, stack_type, update_plan_type
   implicit none
   private
   public :: supernodal_factors_type, elimination_type, front_type
   public :: eliminate_supernode

   !> L and D, in the order and with the supernodes of a symbolic factorisation.
   type :: supernodal_factors_type
      !> The columns of supernode s start at offset(s): first the packed strict lower triangle of the diagonal block, column by
      !> column, then the dense block of the rows below.
      integer(long), allocatable :: offset(:)
      real(wp), allocatable :: lower(:)
      real(wp), allocatable :: pivot(:)
   end type supernodal_factors_type

   !> What a supernode and its descendants add to the rows of the supernode below its diagonal block.
   type :: update_type
      !> The lower triangle, after rows and columns that are eliminated already; the upper one is undefined.
      type(matrix_type) :: matrix
      integer :: eliminated = 0
      !> Of each row, the `sum` of `enclosure_type`.
      real(wp), allocatable :: sum(:)
   end type update_type

   !> Data shared by all threads.
   type :: elimination_type
      !> Symmetric to rounding; one triangle is read.
      type(csr_matrix_type), pointer :: matrix => null()
      type(subtrees_type), pointer :: subtrees => null()
      !> The children of supernode s: child(s), sibling(child(s)) ...
      integer, allocatable :: child(:), sibling(:)
      !> Of each supernode, from its elimination to that of its parent.
      type(update_type), allocatable :: update(:)
      type(update_plan_type) :: plan
      !> Of each part, whether it or a part below has a pivot that is zero or NaN.
      logical, allocatable :: stopped(:)
      !> The monitor has cancelled the computation; there was no memory for an update matrix.
      logical :: ended = .false., no_memory = .false.
      !> L is stored; else only D.
      logical :: stores = .true.
      !> Of each column, `terms` as in `enclosure_type`.
      real(wp), allocatable :: terms(:)
   end type elimination_type

   !> The front of the current supernode, and work arrays of a thread.
   type :: front_type
      integer :: supernode = 0, rows = 0, columns = 0
      !> Its columns, where they do not lie in the update matrix of a child.
      real(wp), allocatable :: entries(:)
      !> Map from rows of the matrix to rows of the front; rows in the front of those of an update matrix.
      integer, allocatable :: place(:), relative(:)
      !> Rows of L times pivots.
      real(wp), allocatable :: scaled(:)
      !> Of each row, the `sum` of `enclosure_type` by descendants.
      real(wp), allocatable :: sum(:)
      type(enclosure_type) :: enclosure
      !> For update matrices.
      type(stack_type) :: stacks(2)
   end type front_type

   ! Rows of a panel, and columns of an update matrix, in a tile.
   integer, parameter :: tile_rows = 384, tile_columns = 192

contains

   !> Computes the columns of supernode s; its descendants must be done. Tiles, which all threads share, change the digits; the
   !> number of threads does not.
   subroutine eliminate_supernode(symbolic, s, in_tiles, shared, factors, front, stopped)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      logical, intent(in) :: in_tiles
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(front_type), intent(inout) :: front
      !> Whether a pivot is zero or NaN, or there is no memory.
      logical, intent(out) :: stopped
      logical :: in_place

      front%supernode = s
      call find_rows(symbolic, front)
      call make_update(shared, front, in_place, stopped)
      if (stopped) return
      associate (update => shared%update(s))
         if (in_place) then
            update%eliminated = update%eliminated + front%columns
            call eliminate_in_place(update%matrix%entries, update%matrix%rows)
         else
            front%entries(:front%rows*front%columns) = 0
            call eliminate_columns(front%entries, front%rows)
         end if
         if (front%rows == front%columns .and. in_place) call shared%plan%take_back(s, front%stacks, update%matrix)
      end associate

   contains

      subroutine eliminate_in_place(matrix, lda)
         integer, intent(in) :: lda
         real(wp), intent(inout) :: matrix(lda, *)

         associate (first => shared%update(s)%eliminated - front%columns + 1)
            call eliminate_columns(matrix(first, first), lda)
         end associate
      end subroutine eliminate_in_place

      ! The panel has the rows and columns of the front.
      subroutine eliminate_columns(panel, lda)
         integer, intent(in) :: lda
         real(wp), intent(inout) :: panel(lda, *)
         integer :: row, last_row, high

         call add_matrix(symbolic, shared%matrix, front, panel, lda)
         call add_children(symbolic, in_tiles, shared, front, panel, lda)
         associate (rows => front%rows, columns => front%columns, pivot => factors%pivot(symbolic%first(s): &
            symbolic%first(s + 1) - 1), update => shared%update(s))
            if (front%enclosure%side /= 0) call begin_enclosure(symbolic, shared, front)
            high = merge(tile_rows, max(rows - columns, 1), in_tiles)
            call factor_panel(merge(columns, rows, in_tiles), columns, panel, lda, pivot, front%scaled, front%enclosure)
            stopped = .not. all(abs(pivot) > 0)
            if (stopped) return
            if (shared%stores) call store_triangle(columns, panel, lda, factors%lower(factors%offset(s):))
            !$omp taskloop grainsize(1) default(shared) private(last_row) if (in_tiles)
            do row = columns + 1, rows, high
               last_row = min(row + high - 1, rows)
               if (in_tiles) call factor_rows(row, last_row, columns, panel, lda, pivot)
               if (shared%stores) call store_rows(front, row, last_row, panel, lda, factors%lower(factors%offset(s):))
               call scale_rows(front, row, last_row, panel, lda, pivot)
               if (front%enclosure%side /= 0) call pass_sums(front, row, last_row, panel, lda, pivot, update%sum)
            end do
            !$omp end taskloop
            if (rows > columns) call subtract_columns(in_tiles, front, panel, lda, update%eliminated, update%matrix%entries, &
               update%matrix%rows)
         end associate
      end subroutine eliminate_columns
   end subroutine eliminate_supernode

   ! The rows of the front.
   subroutine find_rows(symbolic, front)
      type(symbolic_type), intent(in) :: symbolic
      type(front_type), intent(inout) :: front
      integer :: k

      associate (s => front%supernode)
         associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            front%columns = symbolic%first(s + 1) - first
            front%rows = front%columns + size(row)
            do k = 1, front%columns
               front%place(first + k - 1) = k
            end do
            do k = 1, size(row)
               front%place(row(k)) = front%columns + k
            end do
         end associate
      end associate
   end subroutine find_rows

   ! Takes the update matrix of a child for that of the supernode, in place, if it has all rows of the front, as those of the
   ! pieces of a wide supernode have; else makes one.
   subroutine make_update(shared, front, in_place, no_memory)
      type(elimination_type), intent(inout) :: shared
      type(front_type), intent(inout) :: front
      logical, intent(out) :: in_place, no_memory
      integer :: c, j, below, status

      status = 0
      if (front%enclosure%side /= 0) front%sum(:front%rows) = 0
      below = front%rows - front%columns
      associate (update => shared%update(front%supernode))
         c = shared%plan%taken(front%supernode)
         in_place = c > 0
         if (in_place) then
            update%matrix = shared%update(c)%matrix
            update%eliminated = shared%update(c)%eliminated
            shared%update(c)%matrix = matrix_type()
         else if (below > 0) then
            call shared%plan%give(front%supernode, below, front%stacks, update%matrix, status)
         end if
         if (status == 0 .and. front%enclosure%side /= 0 .and. below > 0) allocate (update%sum(below), stat=status)
         no_memory = status /= 0
         if (no_memory) then
            !$omp atomic write
            shared%no_memory = .true.
         end if
         if (in_place .or. no_memory) return
         do j = 1, below
            update%matrix%entries(update%matrix%place(j, j):update%matrix%place(below, j)) = 0
         end do
      end associate
   end subroutine make_update

   ! Adds the columns of A.
   subroutine add_matrix(symbolic, matrix, front, panel, lda)
      type(symbolic_type), intent(in) :: symbolic
      type(csr_matrix_type), intent(in) :: matrix
      type(front_type), intent(in) :: front
      integer, intent(in) :: lda
      real(wp), intent(inout) :: panel(lda, *)
      integer :: i, j, k, p

      associate (first => symbolic%first(front%supernode))
         do j = 1, front%columns
            i = symbolic%order(first + j - 1)
            do p = matrix%row_start(i), matrix%row_start(i + 1) - 1
               k = symbolic%position(matrix%column(p))
               if (k < first + j - 1) cycle
               k = front%place(k)
               panel(k, j) = panel(k, j) + matrix%value(p)
            end do
         end do
      end associate
   end subroutine add_matrix

   ! Adds the update matrices of the children, and drops them.
   subroutine add_children(symbolic, in_tiles, shared, front, panel, lda)
      type(symbolic_type), intent(in) :: symbolic
      logical, intent(in) :: in_tiles
      type(elimination_type), intent(inout) :: shared
      type(front_type), intent(inout) :: front
      integer, intent(in) :: lda
      real(wp), intent(inout) :: panel(lda, *)
      integer :: c, rows, column, wide, k

      c = shared%child(front%supernode)
      do while (c /= 0)
         rows = int(symbolic%start(c + 1) - symbolic%start(c))
         associate (child => shared%update(c), update => shared%update(front%supernode))
            front%relative(:rows) = front%place(symbolic%row(symbolic%start(c):symbolic%start(c + 1) - 1))
            if (allocated(child%sum)) then
               do k = 1, rows
                  front%sum(front%relative(k)) = front%sum(front%relative(k)) + child%sum(k)
               end do
               deallocate (child%sum)
            end if
            ! It is not there if it was taken.
            if (associated(child%matrix%entries)) then
               wide = merge(tile_columns, rows, in_tiles)
               !$omp taskloop grainsize(1) default(shared) if (in_tiles)
               do column = 1, rows, wide
                  call add_child(column, min(column + wide - 1, rows), rows, front, child, panel, lda, update)
               end do
               !$omp end taskloop
               call shared%plan%take_back(c, front%stacks, child%matrix)
            end if
         end associate
         c = shared%sibling(c)
      end do
   end subroutine add_children

   ! Adds columns of the update matrix of a child.
   subroutine add_child(first, last, rows, front, child, panel, lda, update)
      integer, intent(in) :: first, last, rows, lda
      type(front_type), intent(in) :: front
      type(update_type), intent(in) :: child
      real(wp), intent(inout) :: panel(lda, *)
      type(update_type), intent(inout) :: update
      integer :: i, j, at

      at = update%eliminated - front%columns
      do j = first, last
         associate (column => front%relative(j), from => child%matrix%entries(child%matrix%place(child%eliminated + 1, &
            child%eliminated + j):))
            if (column <= front%columns) then
               do i = j, rows
                  panel(front%relative(i), column) = panel(front%relative(i), column) + from(i)
               end do
            else
               associate (to => update%matrix%entries(update%matrix%place(1, at + column):))
                  do i = j, rows
                     to(at + front%relative(i)) = to(at + front%relative(i)) + from(i)
                  end do
               end associate
            end if
         end associate
      end do
   end subroutine add_child

   ! The bounds of rounding errors of the rows of the diagonal block.
   subroutine begin_enclosure(symbolic, shared, front)
      type(symbolic_type), intent(in) :: symbolic
      type(elimination_type), intent(in) :: shared
      type(front_type), intent(inout) :: front

      associate (first => symbolic%first(front%supernode), columns => front%columns)
         front%enclosure%rows = front%rows
         front%enclosure%columns = columns
         front%enclosure%sum(:columns) = front%sum(:columns)
         front%enclosure%terms(:columns) = shared%terms(first:first + columns - 1)
      end associate
   end subroutine begin_enclosure

   ! Rows of L times pivots, of the rows below the diagonal block.
   subroutine scale_rows(front, first_row, last_row, panel, lda, pivot)
      type(front_type), intent(inout) :: front
      integer, intent(in) :: first_row, last_row, lda
      real(wp), intent(in) :: panel(lda, *), pivot(:)
      integer :: j, at

      do j = 1, front%columns
         at = (j - 1)*(front%rows - front%columns) - front%columns
         front%scaled(at + first_row:at + last_row) = pivot(j)*panel(first_row:last_row, j)
      end do
   end subroutine scale_rows

   ! The sums of rows below the diagonal block, with the terms of its columns.
   subroutine pass_sums(front, first_row, last_row, panel, lda, pivot, sum)
      type(front_type), intent(in) :: front
      integer, intent(in) :: first_row, last_row, lda
      real(wp), intent(in) :: panel(lda, *), pivot(:)
      real(wp), intent(inout) :: sum(front%columns + 1:)
      integer :: j

      sum(first_row:last_row) = front%sum(first_row:last_row)
      do j = 1, front%columns
         sum(first_row:last_row) = sum(first_row:last_row) + &
            front%enclosure%weight(j, pivot(j))*panel(first_row:last_row, j)**2
      end do
   end subroutine pass_sums

   ! Subtracts L D L^T of the columns from the update matrix.
   subroutine subtract_columns(in_tiles, front, panel, lda, eliminated, matrix, lead)
      logical, intent(in) :: in_tiles
      type(front_type), intent(in) :: front
      integer, intent(in) :: lda, eliminated, lead
      real(wp), intent(in) :: panel(lda, *)
      real(wp), intent(inout) :: matrix(lead, *)
      integer :: j, wide, below

      below = front%rows - front%columns
      wide = merge(tile_columns, below, in_tiles)
      !$omp taskloop grainsize(1) default(shared) if (in_tiles)
      do j = 1, below, wide
         call subtract_trapezoid(below - j + 1, min(wide, below - j + 1), front%columns, panel(front%columns + j, 1), lda, &
            front%scaled(j), below, matrix(eliminated + j, eliminated + j), lead)
      end do
      !$omp end taskloop
   end subroutine subtract_columns

   ! Packs the strict lower triangle of the diagonal block by columns.
   pure subroutine store_triangle(columns, panel, lda, lower)
      integer, intent(in) :: columns, lda
      real(wp), intent(in) :: panel(lda, columns)
      real(wp), intent(inout) :: lower(*)
      integer :: j, k

      k = 0
      do j = 1, columns - 1
         lower(k + 1:k + columns - j) = panel(j + 1:columns, j)
         k = k + columns - j
      end do
   end subroutine store_triangle

   ! Copies rows below the diagonal block to the factor.
   pure subroutine store_rows(front, first_row, last_row, panel, lda, lower)
      type(front_type), intent(in) :: front
      integer, intent(in) :: first_row, last_row, lda
      real(wp), intent(in) :: panel(lda, *)
      real(wp), intent(inout) :: lower(*)
      integer :: below, j, k

      associate (rows => front%rows, columns => front%columns)
         below = rows - columns
         k = (columns*(columns - 1))/2 - columns
         do j = 1, columns
            lower(k + first_row:k + last_row) = panel(first_row:last_row, j)
            k = k + below
         end do
      end associate
   end subroutine store_rows
end module kschur_fronts
