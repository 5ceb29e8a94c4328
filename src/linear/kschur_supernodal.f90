!> Left-looking supernodal LDL^T without pivoting. Threads share independent parts of the elimination tree, and tiles of panels
!> above its leaves; neither the partition nor the digits depend on the number of threads.
module kschur_supernodal
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_left_looking, only: elimination_type, eliminate_in_tiles, eliminate_supernode, panel_type, schedule_updates, &
      supernodal_factors_type, adopt_updates, workspace_type
   use kschur_monitor, only: ask_monitor, is_stopped, monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: eliminate

   ! Panels with fewer entries are factored by one thread.
   integer, parameter :: least_entries = 20000

contains

   !> Factors a symmetric matrix, of which one triangle is read. Stops at a pivot that is zero or NaN; columns that depend on it
   !> are set to zero. With `side`, moves each pivot downwards (-1) or upwards (1) by the bound of the rounding errors.
   subroutine eliminate(matrix, symbolic, subtrees, side, factors, error, monitor, least)
      type(csr_matrix_type), target, intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), target, intent(in) :: subtrees
      integer, intent(in) :: side
      !> Overwritten; its memory is reused if it fits.
      type(supernodal_factors_type), intent(inout) :: factors
      type(error_type), allocatable, intent(out) :: error
      !> Polled between parts of the tree, and between supernodes above its leaves; cancelling is an error.
      class(monitor_type), optional, intent(inout) :: monitor
      !> Least size of a pivot; smaller ones are replaced by it. Absent: 0.
      real(wp), optional, intent(in) :: least
      type(elimination_type) :: shared
      type(panel_type), allocatable :: panels(:)
      type(workspace_type), allocatable :: work(:)
      ! Dependencies: a part follows its children.
      logical :: turn(size(subtrees%root) + 1)
      integer :: t, i, status

      allocate (panels(team_size()), work(team_size()), stat=status)
      if (status == 0) call make_room(symbolic, side, factors, panels, work, status)
      if (present(least)) panels%enclosure%least = least
      if (status == 0) call set_shared(matrix, symbolic, subtrees, side, shared, status)
      if (status /= 0) then
         call new_error(error, error_memory, "no memory for the LDL^T factors")
         return
      end if
      !$omp parallel num_threads(size(work)) if (size(subtrees%root) > 1)
      !$omp master
      do i = 1, size(subtrees%order)
         t = subtrees%order(i)
         !$omp task firstprivate(t) depend(out: turn(t)) depend(in: turn(subtrees%above(t)))
         call eliminate_part(symbolic, t, shared, factors, panels(thread_number()), work, monitor)
         !$omp end task
      end do
      !$omp end master
      !$omp end parallel
      call ask_monitor(monitor, error)
   end subroutine eliminate

   ! Factors the supernodes of part t, whose child parts are done. Factors none if a child part was stopped by a zero pivot.
   subroutine eliminate_part(symbolic, t, shared, factors, panel, work, monitor)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: t
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      !> One for each thread.
      type(workspace_type), intent(inout) :: work(:)
      class(monitor_type), optional, intent(inout) :: monitor
      logical :: stopped, ended
      integer :: c, s

      stopped = .false.
      do c = 1, t - 1
         if (shared%subtrees%above(c) /= t) cycle
         call adopt_updates(symbolic, c, t, shared)
         stopped = stopped .or. shared%stopped(c)
      end do
      associate (first => shared%subtrees%first(t), root => shared%subtrees%root(t), is_leaf => shared%subtrees%is_leaf(t))
         do s = first, root
            call check_monitor(shared, s == first .or. .not. is_leaf, monitor, ended)
            if (stopped .or. ended) exit
            if (is_leaf .or. entries_of_panel(symbolic, s) < least_entries) then
               call eliminate_supernode(symbolic, s, shared, factors, panel, work(thread_number()), stopped)
            else
               call eliminate_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
            end if
            if (.not. stopped) call schedule_updates(symbolic, s, t, shared)
         end do
      end associate
      shared%stopped(t) = stopped
   end subroutine eliminate_part

   ! Returns whether the monitor has cancelled. Only the thread of the caller polls it; others read the result.
   subroutine check_monitor(shared, now, monitor, ended)
      type(elimination_type), intent(inout) :: shared
      logical, intent(in) :: now
      class(monitor_type), optional, intent(inout) :: monitor
      logical, intent(out) :: ended

      if (thread_number() == 1) then
         if (now) then
            ended = is_stopped(monitor)
            !$omp atomic write
            shared%ended = ended
         end if
      end if
      !$omp atomic read
      ended = shared%ended
   end subroutine check_monitor

   ! Number of entries of the dense panel of supernode s.
   pure integer(long) function entries_of_panel(symbolic, s)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s

      associate (columns => symbolic%first(s + 1) - symbolic%first(s))
         entries_of_panel = columns*(columns + symbolic%start(s + 1) - symbolic%start(s))
      end associate
   end function entries_of_panel

   ! Allocates factors and work arrays of each thread.
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
      if (allocated(factors%offset)) deallocate (factors%offset, factors%pivot)
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
      if (allocated(factors%lower)) then
         if (size(factors%lower, kind=long) /= factors%offset(nodes + 1) - 1) deallocate (factors%lower)
      end if
      if (.not. allocated(factors%lower)) allocate (factors%lower(factors%offset(nodes + 1) - 1), stat=status)
      do i = 1, size(work)
         if (status == 0) allocate (panels(i)%entries(most_entries), panels(i)%place(n), work(i)%product(most_entries), &
            work(i)%scaled(widest**2), work(i)%relative(symbolic%most_rows() + widest), stat=status)
         if (side == 0) cycle
         panels(i)%enclosure%side = side
         panels(i)%enclosure%underflow = n*tiny(1.0_wp)
         if (status == 0) allocate (panels(i)%enclosure%sum(widest), panels(i)%enclosure%terms(widest), stat=status)
      end do
   end subroutine make_room

   ! Initialises the data shared by all threads.
   subroutine set_shared(matrix, symbolic, subtrees, side, shared, status)
      type(csr_matrix_type), target, intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), target, intent(in) :: subtrees
      integer, intent(in) :: side
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status

      shared%matrix => matrix
      shared%subtrees => subtrees
      associate (nodes => size(symbolic%first) - 1, parts => size(subtrees%root))
         allocate (shared%next(nodes), shared%wide(nodes), shared%reached(nodes), stat=status)
         if (status == 0) allocate (shared%head(nodes), shared%waiting(parts), source=0, stat=status)
         if (status == 0) allocate (shared%stopped(parts), source=.false., stat=status)
      end associate
      if (status == 0 .and. side /= 0) call count_terms(symbolic, shared, status)
   end subroutine set_shared

   ! Counts the entries of each row of L before its diagonal, the terms of the rounding-error bound.
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
