!> Left-looking LDL^T of one supernode: assembles its columns in a dense panel, subtracts the updates of its descendants,
!> factors the panel and stores L; by one thread, or by all in tiles of rows.
module kschur_left_looking
   use kschur_kinds, only: wp, long
   use kschur_panel, only: enclosure_type, factor_panel, factor_rows, subtract_rectangle, subtract_trapezoid
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: thread_number
   implicit none
   private
   public :: supernodal_factors_type, elimination_type, panel_type, workspace_type
   public :: eliminate_supernode, assemble_in_tiles, eliminate_in_tiles, factor_in_tiles, schedule_updates, adopt_updates

   !> L and D, in the order and with the supernodes of a symbolic factorisation.
   type :: supernodal_factors_type
      !> The columns of supernode s start at offset(s): first the packed strict lower triangle of the diagonal block, column by
      !> column, then the dense block of the rows below.
      integer(long), allocatable :: offset(:)
      real(wp), allocatable :: lower(:)
      real(wp), allocatable :: pivot(:)
   end type supernodal_factors_type

   !> Data shared by all threads.
   type :: elimination_type
      !> Symmetric to rounding; one triangle is read.
      type(csr_matrix_type), pointer :: matrix => null()
      type(subtrees_type), pointer :: subtrees => null()
      !> Lists of supernodes that will update supernode s next: head(s), next(head(s)) ...; first row of each inside s, and
      !> number of such rows. waiting(t): list of supernodes of part t or below that will update a supernode above it.
      integer, allocatable :: head(:), next(:), wide(:), waiting(:)
      integer(long), allocatable :: reached(:)
      !> Of each part, whether it or a part below has a pivot that is zero or NaN.
      logical, allocatable :: stopped(:)
      !> The monitor has cancelled the computation.
      logical :: ended = .false.
      !> Of each column, `terms` as in `enclosure_type`, and the weight (e + sqrt(e)) |d|, e its number of subdiagonal entries.
      real(wp), allocatable :: terms(:), weight(:)
   end type elimination_type

   !> The dense panel of the current supernode.
   type :: panel_type
      integer :: supernode = 0, rows = 0, columns = 0
      real(wp), allocatable :: entries(:)
      !> Map from rows of the matrix to rows of the panel.
      integer, allocatable :: place(:)
      type(enclosure_type) :: enclosure
   end type panel_type

   !> Work arrays of a thread: the update by a descendant before it is scattered into the panel; rows of L, of the descendant or the
   !> panel, times pivots; panel rows of the update.
   type :: workspace_type
      real(wp), allocatable :: product(:), scaled(:)
      integer, allocatable :: relative(:)
   end type workspace_type

   ! No tile has more.
   integer, parameter :: most_tile_rows = 384

contains

   !> Computes the columns of supernode s; its descendants must be done.
   subroutine eliminate_supernode(symbolic, s, shared, factors, panel, work, stopped)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      type(workspace_type), intent(inout) :: work
      !> Whether a pivot is zero or NaN.
      logical, intent(out) :: stopped

      associate (first => symbolic%first(s), last => symbolic%first(s + 1) - 1)
         call fill_panel(symbolic, s, shared, panel)
         call subtract_descendants(symbolic, factors, shared, 1, panel%rows, panel, work)
         call factor_panel(panel%rows, panel%columns, panel%entries, panel%rows, factors%pivot(first:last), work%scaled, &
            panel%enclosure)
         stopped = .not. all(abs(factors%pivot(first:last)) > 0)
         if (stopped) return
         call store_weights(panel, factors%pivot(first:last), first, shared)
         call store_triangle(panel%rows, panel%columns, panel%entries, factors%lower(factors%offset(s):))
         call store_rows(panel, panel%columns + 1, panel%rows, factors%lower(factors%offset(s):))
      end associate
   end subroutine eliminate_supernode

   !> As `eliminate_supernode`, by all threads: digits differ from it, but not between numbers of threads.
   subroutine eliminate_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      !> One for each thread.
      type(workspace_type), intent(inout) :: work(:)
      logical, intent(out) :: stopped

      call assemble_in_tiles(symbolic, s, shared, factors, panel, work)
      call factor_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
   end subroutine eliminate_in_tiles

   !> Assembles the columns of supernode s in the panel and subtracts the updates of its descendants, by all threads.
   subroutine assemble_in_tiles(symbolic, s, shared, factors, panel, work)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(in) :: factors
      type(panel_type), intent(inout) :: panel
      !> One for each thread.
      type(workspace_type), intent(inout) :: work(:)
      integer :: tile, last_row, high

      call fill_panel(symbolic, s, shared, panel)
      high = tile_rows(panel%rows, panel%columns)
      !$omp taskloop grainsize(1) default(shared) private(last_row)
      do tile = 1, panel%rows, high
         last_row = min(tile + high - 1, panel%rows)
         call subtract_descendants(symbolic, factors, shared, tile, last_row, panel, work(thread_number()))
      end do
      !$omp end taskloop
   end subroutine assemble_in_tiles

   !> Factors the assembled panel of supernode s and stores L, by all threads.
   subroutine factor_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      !> One for each thread.
      type(workspace_type), intent(inout) :: work(:)
      !> Whether a pivot is zero or NaN.
      logical, intent(out) :: stopped
      integer :: tile, last_row, high

      associate (first => symbolic%first(s), last => symbolic%first(s + 1) - 1)
         call factor_panel(panel%columns, panel%columns, panel%entries, panel%rows, factors%pivot(first:last), &
            work(thread_number())%scaled, panel%enclosure)
         stopped = .not. all(abs(factors%pivot(first:last)) > 0)
         if (stopped) return
         call store_weights(panel, factors%pivot(first:last), first, shared)
         call store_triangle(panel%rows, panel%columns, panel%entries, factors%lower(factors%offset(s):))
         high = tile_rows(panel%rows - panel%columns, panel%columns)
         !$omp taskloop grainsize(1) default(shared) private(last_row)
         do tile = panel%columns + 1, panel%rows, high
            last_row = min(tile + high - 1, panel%rows)
            call factor_rows(tile, last_row, panel%columns, panel%entries, panel%rows, factors%pivot(first:last), &
               work(thread_number())%scaled)
            call store_rows(panel, tile, last_row, factors%lower(factors%offset(s):))
         end do
         !$omp end taskloop
      end associate
   end subroutine factor_in_tiles

   ! Of each tile, as equal as may be, so that threads end together, and an even number of them. The first one has all rows of
   ! the diagonal block.
   pure integer function tile_rows(rows, columns)
      integer, intent(in) :: rows, columns
      integer :: tiles

      tiles = min(2*((rows + 2*most_tile_rows - 1)/(2*most_tile_rows)), rows/columns)
      tile_rows = max(rows, 1)
      if (tiles > 1) tile_rows = (rows + tiles - 1)/tiles
   end function tile_rows

   !> Adds each supernode that updated supernode s to the list of the supernode that it updates next, and s itself if its columns
   !> are here.
   subroutine schedule_updates(symbolic, s, t, shared, is_here)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s, t
      type(elimination_type), intent(inout) :: shared
      logical, intent(in) :: is_here
      integer :: k, following

      k = shared%head(s)
      do while (k /= 0)
         following = shared%next(k)
         shared%reached(k) = shared%reached(k) + shared%wide(k)
         call link_to_next(symbolic, k, t, shared)
         k = following
      end do
      if (.not. is_here) return
      shared%reached(s) = symbolic%start(s)
      call link_to_next(symbolic, s, t, shared)
   end subroutine schedule_updates

   !> Moves the supernodes waiting in the finished child part c to the lists of part t, or to its waiting list.
   subroutine adopt_updates(symbolic, c, t, shared)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: c, t
      type(elimination_type), intent(inout) :: shared
      integer :: k, following

      k = shared%waiting(c)
      do while (k /= 0)
         following = shared%next(k)
         call link_to_next(symbolic, k, t, shared)
         k = following
      end do
   end subroutine adopt_updates

   ! Adds supernode s to the list of the supernode that contains row reached(s), or to the waiting list if that is above part t.
   subroutine link_to_next(symbolic, s, t, shared)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s, t
      type(elimination_type), intent(inout) :: shared

      if (shared%reached(s) >= symbolic%start(s + 1)) return
      associate (target => symbolic%supernode(symbolic%row(shared%reached(s))))
         if (target <= shared%subtrees%root(t)) then
            shared%next(s) = shared%head(target)
            shared%head(target) = s
         else
            shared%next(s) = shared%waiting(t)
            shared%waiting(t) = s
         end if
      end associate
   end subroutine link_to_next

   ! Assembles the columns of A of supernode s, and counts the rows of each descendant that lie inside s.
   subroutine fill_panel(symbolic, s, shared, panel)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(elimination_type), intent(inout) :: shared
      type(panel_type), intent(inout) :: panel
      integer :: i, j, k, p

      associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
         panel%supernode = s
         panel%columns = symbolic%first(s + 1) - first
         panel%rows = panel%columns + size(row)
         do k = 1, panel%columns
            panel%place(first + k - 1) = k
         end do
         do k = 1, size(row)
            panel%place(row(k)) = panel%columns + k
         end do
         panel%entries(:panel%rows*panel%columns) = 0
         do j = 1, panel%columns
            i = symbolic%order(first + j - 1)
            do p = shared%matrix%row_start(i), shared%matrix%row_start(i + 1) - 1
               k = symbolic%position(shared%matrix%column(p))
               if (k >= first + j - 1) panel%entries((j - 1)*panel%rows + panel%place(k)) = shared%matrix%value(p)
            end do
         end do
         if (panel%enclosure%side /= 0) then
            panel%enclosure%rows = panel%rows
            panel%enclosure%columns = panel%columns
            panel%enclosure%sum(:panel%columns) = 0
            panel%enclosure%terms(:panel%columns) = shared%terms(first:first + panel%columns - 1)
         end if
      end associate
      k = shared%head(s)
      do while (k /= 0)
         associate (from => shared%reached(k), wide => shared%wide(k))
            wide = 1
            do while (from + wide < symbolic%start(k + 1))
               if (symbolic%row(from + wide) >= symbolic%first(s + 1)) exit
               wide = wide + 1
            end do
         end associate
         k = shared%next(k)
      end do
   end subroutine fill_panel

   ! Subtracts the updates of the descendants from rows first_row..last_row.
   subroutine subtract_descendants(symbolic, factors, shared, first_row, last_row, panel, work)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      type(elimination_type), intent(in) :: shared
      integer, intent(in) :: first_row, last_row
      type(panel_type), intent(inout) :: panel
      type(workspace_type), intent(inout) :: work
      integer(long) :: from, to
      integer :: k

      k = shared%head(panel%supernode)
      do while (k /= 0)
         associate (start => symbolic%start(k), reached => shared%reached(k), columns => symbolic%first(k + 1) - symbolic%first(k))
            from = reached
            to = symbolic%start(k + 1) - 1
            if (first_row > 1) from = first_at(symbolic%row, panel%place, reached, to, first_row)
            if (last_row < panel%rows) to = first_at(symbolic%row, panel%place, reached, to, last_row + 1) - 1
            if (from <= to) call subtract_one(k, columns, int(symbolic%start(k + 1) - start), shared%wide(k), from, to, &
               factors%lower(factors%offset(k) + (columns*(columns - 1))/2))
         end associate
         k = shared%next(k)
      end do

   contains

      ! Subtracts L_rows D L_columns^T of descendant k; the first `wide` rows in the panel are its columns.
      subroutine subtract_one(k, terms, lda, wide, from, to, lower)
         integer, intent(in) :: k, terms, lda, wide
         integer(long), intent(in) :: from, to
         real(wp), intent(in) :: lower(lda, *)
         integer :: columns(wide), i, j, p, high, at, top, offset
         logical :: dense

         top = int(shared%reached(k) - symbolic%start(k))
         offset = int(from - symbolic%start(k))
         high = int(to - from) + 1
         columns = panel%place(symbolic%row(shared%reached(k):shared%reached(k) + wide - 1))
         work%relative(:high) = panel%place(symbolic%row(from:to))
         associate (first => symbolic%first(k))
            do p = 1, terms
               work%scaled((p - 1)*wide + 1:p*wide) = factors%pivot(first + p - 1)*lower(top + 1:top + wide, p)
            end do
            if (first_row == 1 .and. panel%enclosure%side /= 0) then
               do p = 1, terms
                  panel%enclosure%sum(columns) = panel%enclosure%sum(columns) + &
                     shared%weight(first + p - 1)*lower(top + 1:top + wide, p)**2
               end do
            end if
            dense = work%relative(high) - work%relative(1) == high - 1 .and. columns(wide) - columns(1) == wide - 1
            if (dense) then
               call subtract_product(high, wide, terms, lower(offset + 1, 1), lda, &
                  panel%entries((columns(1) - 1)*panel%rows + work%relative(1)), panel%rows)
            else
               work%product(:high*wide) = 0
               call subtract_product(high, wide, terms, lower(offset + 1, 1), lda, work%product, high)
               do j = 1, wide
                  at = (columns(j) - 1)*panel%rows
                  do i = merge(j, 1, first_row == 1), high
                     panel%entries(at + work%relative(i)) = panel%entries(at + work%relative(i)) + work%product((j - 1)*high + i)
                  end do
               end do
            end if
         end associate
      end subroutine subtract_one

      ! C := C - A B^T, B the scaled columns; in the first tile of rows its lower trapezoid only.
      subroutine subtract_product(rows, wide, terms, a, lda, c, ldc)
         integer, intent(in) :: rows, wide, terms, lda, ldc
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: c(ldc, *)

         if (first_row == 1) then
            call subtract_trapezoid(rows, wide, terms, a, lda, work%scaled, c, ldc)
         else
            call subtract_rectangle(rows, wide, terms, a, lda, work%scaled, c, ldc)
         end if
      end subroutine subtract_product
   end subroutine subtract_descendants

   ! Binary search: first position whose row has a panel row of at least `least`.
   pure integer(long) function first_at(row, place, from, to, least)
      integer, intent(in) :: row(:), place(:), least
      integer(long), intent(in) :: from, to
      integer(long) :: beyond, middle

      first_at = from
      beyond = to + 1
      do while (first_at < beyond)
         middle = (first_at + beyond)/2
         if (place(row(middle)) < least) then
            first_at = middle + 1
         else
            beyond = middle
         end if
      end do
   end function first_at

   ! Stores the rounding-error weights of the columns of a supernode, for the supernodes that it will update.
   pure subroutine store_weights(panel, pivot, first, shared)
      type(panel_type), intent(in) :: panel
      real(wp), intent(in) :: pivot(:)
      integer, intent(in) :: first
      type(elimination_type), intent(inout) :: shared
      integer :: j

      if (panel%enclosure%side == 0) return
      do j = 1, size(pivot)
         shared%weight(first + j - 1) = panel%enclosure%weight(j, pivot(j))
      end do
   end subroutine store_weights

   ! Packs the strict lower triangle of the diagonal block by columns.
   pure subroutine store_triangle(rows, columns, panel, lower)
      integer, intent(in) :: rows, columns
      real(wp), intent(in) :: panel(rows, columns)
      real(wp), intent(inout) :: lower(*)
      integer :: j, k

      k = 0
      do j = 1, columns - 1
         lower(k + 1:k + columns - j) = panel(j + 1:columns, j)
         k = k + columns - j
      end do
   end subroutine store_triangle

   ! Copies rows first_row..last_row of the panel, below the diagonal block, to the factor.
   pure subroutine store_rows(panel, first_row, last_row, lower)
      type(panel_type), intent(in) :: panel
      integer, intent(in) :: first_row, last_row
      real(wp), intent(inout) :: lower(*)
      integer :: below, j, k

      associate (rows => panel%rows, columns => panel%columns)
         below = rows - columns
         k = (columns*(columns - 1))/2 - columns
         do j = 1, columns
            lower(k + first_row:k + last_row) = panel%entries((j - 1)*rows + first_row:(j - 1)*rows + last_row)
            k = k + below
         end do
      end associate
   end subroutine store_rows
end module kschur_left_looking
