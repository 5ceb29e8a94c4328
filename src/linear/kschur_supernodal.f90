!> LDL^T without pivoting, left-looking, one supernode after the other. Threads work on independent subtrees of the
!> elimination tree, and above these on tiles of a panel: neither depends on how many threads there are, nor does a digit.
!> E. G. Ng, B. W. Peyton, SIAM J. Sci. Comput. 14 (1993), doi 10.1137/0914063.
module kschur_supernodal
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_left_looking, only: elimination_type, eliminate_in_tiles, eliminate_supernode, link_to_next, panel_type, &
      pass_on, supernodal_factors_type, workspace_type
   use kschur_monitor, only: ask_monitor, is_stopped, monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: eliminate

   ! A panel with fewer entries is not worth more than one thread.
   integer, parameter :: least_entries = 20000

contains

   !> Factors a symmetric matrix, of which it reads the lower triangle. Goes no further than a pivot that is zero, or not a
   !> number: those that depend on it are zero. With a `side`, each pivot is moved downwards (-1) or upwards (1) by as much
   !> as rounding may do.
   subroutine eliminate(matrix, symbolic, subtrees, side, factors, error, monitor)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: side
      type(supernodal_factors_type), intent(inout) :: factors
      type(error_type), allocatable, intent(out) :: error
      !> Asked between subtrees, and between supernodes above these: its end is an error.
      class(monitor_type), optional, intent(inout) :: monitor
      type(elimination_type) :: shared
      type(panel_type), allocatable :: panels(:)
      type(workspace_type), allocatable :: work(:)
      integer :: t, status
      logical :: stopped, ended, now

      allocate (panels(team_size()), work(team_size()), stat=status)
      if (status == 0) call make_room(symbolic, side, factors, panels, work, status)
      if (status == 0) call share(matrix, symbolic, side, shared, status)
      if (status /= 0) then
         call new_error(error, error_memory, "no memory for the LDL^T factors")
         return
      end if
      stopped = .false.
      ended = .false.
      !$omp parallel do schedule(dynamic) reduction(.or.: stopped) private(now) if (size(subtrees%root) > 1)
      do t = 1, size(subtrees%root)
         ! The thread of the caller asks; the others look at what it was told.
         if (thread_number() == 1) then
            now = is_stopped(monitor)
            !$omp atomic write
            ended = now
         end if
         !$omp atomic read
         now = ended
         if (now) cycle
         call eliminate_subtree(symbolic, [subtrees%first(t), subtrees%root(t)], shared, factors, panels(thread_number()), &
            work(thread_number()), stopped)
      end do
      !$omp end parallel do
      if (.not. (stopped .or. ended)) call eliminate_top(symbolic, subtrees, shared, factors, panels(1), work, monitor)
      call ask_monitor(monitor, error)
   end subroutine eliminate

   ! Supernodes from ... to, the last of which is above the others.
   subroutine eliminate_subtree(symbolic, range, shared, factors, panel, work, stopped)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: range(2)
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      type(workspace_type), intent(inout) :: work
      logical, intent(inout) :: stopped
      logical :: now
      integer :: s

      do s = range(1), range(2)
         call eliminate_supernode(symbolic, s, shared, factors, panel, work, now)
         stopped = stopped .or. now
         if (now) return
         call pass_on(symbolic, s, range(2), shared)
      end do
   end subroutine eliminate_subtree

   ! The supernodes above all subtrees.
   subroutine eliminate_top(symbolic, subtrees, shared, factors, panel, work, monitor)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      type(workspace_type), intent(inout) :: work(:)
      class(monitor_type), optional, intent(inout) :: monitor
      integer :: i, s, t, nodes
      logical :: stopped

      nodes = size(symbolic%first) - 1
      do t = 1, size(subtrees%root)
         do s = subtrees%first(t), subtrees%root(t)
            call link_to_next(symbolic, s, nodes, shared)
         end do
      end do
      do i = 1, size(subtrees%top)
         if (is_stopped(monitor)) return
         s = subtrees%top(i)
         if (entries_of_panel(symbolic, s) < least_entries) then
            call eliminate_supernode(symbolic, s, shared, factors, panel, work(1), stopped)
         else
            call eliminate_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
         end if
         if (stopped) return
         call pass_on(symbolic, s, nodes, shared)
      end do
   end subroutine eliminate_top

   pure integer(long) function entries_of_panel(symbolic, s)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s

      associate (columns => symbolic%first(s + 1) - symbolic%first(s))
         entries_of_panel = columns*(columns + symbolic%start(s + 1) - symbolic%start(s))
      end associate
   end function entries_of_panel

   ! For the factors, and for each thread.
   subroutine make_room(symbolic, side, factors, panels, work, status)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panels(:)
      type(workspace_type), intent(inout) :: work(:)
      integer, intent(out) :: status
      integer(long) :: most_entries
      integer :: nodes, n, s, i

      nodes = size(symbolic%first) - 1
      n = size(symbolic%order)
      allocate (factors%offset(nodes + 1), factors%pivot(n), stat=status)
      if (status /= 0) return
      factors%pivot = 0
      factors%offset(1) = 1
      most_entries = 0
      do s = 1, nodes
         associate (columns => symbolic%first(s + 1) - symbolic%first(s))
            factors%offset(s + 1) = factors%offset(s) + entries_of_panel(symbolic, s) - (columns*(columns + 1))/2
            most_entries = max(most_entries, entries_of_panel(symbolic, s))
         end associate
      end do
      allocate (factors%lower(factors%offset(nodes + 1) - 1), stat=status)
      do i = 1, size(work)
         if (status == 0) allocate (panels(i)%entries(most_entries), panels(i)%place(n), work(i)%product(most_entries), &
            work(i)%scaled(widest**2), work(i)%relative(symbolic%most_rows() + widest), stat=status)
         if (side == 0) cycle
         panels(i)%enclosure%side = side
         panels(i)%enclosure%underflow = n*tiny(1.0_wp)
         if (status == 0) allocate (panels(i)%enclosure%sum(widest), panels(i)%enclosure%terms(widest), stat=status)
      end do
   end subroutine make_room

   subroutine share(matrix, symbolic, side, shared, status)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status

      associate (nodes => size(symbolic%first) - 1)
         allocate (shared%next(nodes), shared%wide(nodes), shared%reached(nodes), stat=status)
         if (status == 0) allocate (shared%head(nodes), source=0, stat=status)
      end associate
      if (status == 0) call take_lower_triangle(matrix, symbolic, shared, status)
      if (status == 0 .and. side /= 0) call count_terms(symbolic, shared, status)
   end subroutine share

   ! Sorted by columns, as rows come in ascending order.
   subroutine take_lower_triangle(matrix, symbolic, shared, status)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      integer :: i, k, p

      allocate (shared%start(matrix%rows + 2), source=0, stat=status)
      if (status /= 0) return
      do k = 1, matrix%rows
         do p = matrix%row_start(k), matrix%row_start(k + 1) - 1
            i = symbolic%position(matrix%column(p))
            if (i <= symbolic%position(k)) shared%start(i + 2) = shared%start(i + 2) + 1
         end do
      end do
      shared%start(1:2) = 1
      do k = 3, size(shared%start)
         shared%start(k) = shared%start(k) + shared%start(k - 1)
      end do
      associate (entries => shared%start(size(shared%start)) - 1)
         allocate (shared%row(entries), shared%value(entries), stat=status)
      end associate
      if (status /= 0) return
      do k = 1, matrix%rows
         do p = matrix%row_start(symbolic%order(k)), matrix%row_start(symbolic%order(k) + 1) - 1
            i = symbolic%position(matrix%column(p))
            if (i > k) cycle
            shared%row(shared%start(i + 1)) = k
            shared%value(shared%start(i + 1)) = matrix%value(p)
            shared%start(i + 1) = shared%start(i + 1) + 1
         end do
      end do
   end subroutine take_lower_triangle

   ! Of each row of L, before its diagonal.
   subroutine count_terms(symbolic, shared, status)
      type(symbolic_type), intent(in) :: symbolic
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      integer :: s, k

      allocate (shared%terms(size(symbolic%order)), shared%weight(size(symbolic%order)), source=0.0_wp, stat=status)
      if (status /= 0) return
      do s = 1, size(symbolic%first) - 1
         associate (first => symbolic%first(s), columns => symbolic%first(s + 1) - symbolic%first(s), &
            row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            shared%terms(first:first + columns - 1) = shared%terms(first:first + columns - 1) + [(k, k=0, columns - 1)]
            shared%terms(row) = shared%terms(row) + columns
         end associate
      end do
   end subroutine count_terms
end module kschur_supernodal
