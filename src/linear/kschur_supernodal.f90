!> Left-looking supernodal LDL^T without pivoting. Threads share independent parts of the elimination tree, and tiles of panels
!> above its leaves; neither the partition nor the digits depend on the number of threads.
module kschur_supernodal
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_left_looking, only: adopt_updates, assemble_in_tiles, elimination_type, eliminate_in_tiles, &
      eliminate_supernode, factor_in_tiles, panel_type, schedule_updates, supernodal_factors_type, workspace_type
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
   subroutine eliminate(matrix, symbolic, subtrees, side, factors, error, monitor, least, common)
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
      !> The supernodes that several processes share, the last part of `subtrees`: collective then. All fail if one has no memory.
      class(common_supernodes_type), optional, intent(inout) :: common
      type(elimination_type) :: shared
      type(panel_type), allocatable :: panels(:)
      type(workspace_type), allocatable :: work(:)
      ! Dependencies: a part follows its children.
      logical :: turn(size(subtrees%root) + 1)
      logical :: failed
      integer :: own, t, i, status

      allocate (panels(team_size()), work(team_size()), stat=status)
      if (status == 0) call make_room(symbolic, side, factors, panels, work, status, common)
      if (present(least)) panels%enclosure%least = least
      if (status == 0) call set_shared(matrix, symbolic, subtrees, side, shared, status, common)
      failed = status /= 0
      own = size(subtrees%root)
      if (present(common)) then
         failed = common%any_of(failed)
         own = count(subtrees%root < common%first)
      end if
      if (failed) then
         call new_error(error, error_memory, "no memory for the LDL^T factors")
         return
      end if
      !$omp parallel num_threads(size(work)) if (size(subtrees%root) > 1)
      !$omp master
      do i = 1, size(subtrees%order)
         t = subtrees%order(i)
         if (t > own) cycle
         !$omp task firstprivate(t) depend(out: turn(t)) depend(in: turn(subtrees%above(t)))
         call eliminate_part(symbolic, t, shared, factors, panels(thread_number()), work, monitor)
         !$omp end task
      end do
      !$omp end master
      !$omp end parallel
      if (present(common)) call eliminate_common(symbolic, own, shared, factors, panels(1), work, common)
      call ask_monitor(monitor, error)
   end subroutine eliminate

   ! Factors the common supernodes after the first `own` parts: the process that leads has their columns and adds the updates of
   ! the others. None is factored if a part was stopped in any process.
   subroutine eliminate_common(symbolic, own, shared, factors, panel, work, common)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: own
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panel
      type(workspace_type), intent(inout) :: work(:)
      class(common_supernodes_type), intent(inout) :: common
      logical :: stopped
      integer :: s, c

      stopped = common%any_of(any(shared%stopped(:own)) .or. shared%ended)
      if (stopped) return
      !$omp parallel num_threads(size(work))
      !$omp master
      do c = 1, own
         if (shared%subtrees%above(c) == own + 1) call adopt_updates(symbolic, c, own + 1, shared)
      end do
      do s = common%first, size(symbolic%first) - 1
         associate (is_empty => .not. common%leads .and. shared%head(s) == 0)
            if (.not. is_empty) call assemble_in_tiles(symbolic, s, shared, factors, panel, work)
            call add_updates(symbolic, s, is_empty, panel, common)
         end associate
         if (common%leads .and. .not. stopped) call factor_in_tiles(symbolic, s, shared, factors, panel, work, stopped)
         call schedule_updates(symbolic, s, own + 1, shared, common%leads .and. .not. stopped)
      end do
      !$omp end master
      !$omp end parallel
   end subroutine eliminate_common

   ! Adds the panels of supernode s of all processes, and their sums and terms of the enclosure, in the one that leads.
   subroutine add_updates(symbolic, s, is_empty, panel, common)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      logical, intent(in) :: is_empty
      type(panel_type), intent(inout) :: panel
      class(common_supernodes_type), intent(inout) :: common

      associate (columns => symbolic%first(s + 1) - symbolic%first(s))
         call common%add_up(is_empty, panel%entries(:entries_of_panel(symbolic, s)))
         if (panel%enclosure%side == 0) return
         call common%add_up(is_empty, panel%enclosure%sum(:columns))
         call common%add_up(is_empty, panel%enclosure%terms(:columns))
      end associate
   end subroutine add_updates

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
            if (.not. stopped) call schedule_updates(symbolic, s, t, shared, .true.)
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

   ! Allocates factors and work arrays of each thread; of common supernodes only in the process that leads.
   subroutine make_room(symbolic, side, factors, panels, work, status, common)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      type(supernodal_factors_type), intent(inout) :: factors
      type(panel_type), intent(inout) :: panels(:)
      type(workspace_type), intent(inout) :: work(:)
      integer, intent(out) :: status
      class(common_supernodes_type), optional, intent(inout) :: common
      integer(long) :: most_entries
      integer :: nodes, stored, unknowns, n, s, i

      nodes = size(symbolic%first) - 1
      n = size(symbolic%order)
      stored = stored_supernodes(symbolic, common)
      unknowns = n
      if (present(common)) unknowns = common%unknowns
      if (allocated(factors%offset)) deallocate (factors%offset, factors%pivot)
      allocate (factors%offset(nodes + 1), factors%pivot(n), stat=status)
      if (status /= 0) return
      factors%pivot = 0
      factors%offset(1) = 1
      most_entries = 0
      do s = 1, nodes
         associate (columns => symbolic%first(s + 1) - symbolic%first(s))
            factors%offset(s + 1) = factors%offset(s)
            if (s <= stored) factors%offset(s + 1) = factors%offset(s) + entries_of_panel(symbolic, s) - (columns*(columns + 1))/2
            most_entries = max(most_entries, entries_of_panel(symbolic, s))
         end associate
      end do
      if (allocated(factors%lower)) then
         if (size(factors%lower, kind=long) /= factors%offset(nodes + 1) - 1) deallocate (factors%lower)
      end if
      if (.not. allocated(factors%lower)) allocate (factors%lower(factors%offset(nodes + 1) - 1), stat=status)
      if (present(common) .and. status == 0) call common%make_room(most_entries, status)
      do i = 1, size(work)
         if (status == 0) allocate (panels(i)%entries(most_entries), panels(i)%place(n), work(i)%product(most_entries), &
            work(i)%scaled(widest**2), work(i)%relative(symbolic%most_rows() + widest), stat=status)
         if (side == 0) cycle
         panels(i)%enclosure%side = side
         panels(i)%enclosure%underflow = unknowns*tiny(1.0_wp)
         if (status == 0) allocate (panels(i)%enclosure%sum(widest), panels(i)%enclosure%terms(widest), stat=status)
      end do
   end subroutine make_room

   ! Number of supernodes whose columns this process stores.
   pure integer function stored_supernodes(symbolic, common) result(stored)
      type(symbolic_type), intent(in) :: symbolic
      class(common_supernodes_type), optional, intent(in) :: common

      stored = size(symbolic%first) - 1
      if (.not. present(common)) return
      if (.not. common%leads) stored = common%first - 1
   end function stored_supernodes

   ! Initialises the data shared by all threads.
   subroutine set_shared(matrix, symbolic, subtrees, side, shared, status, common)
      type(csr_matrix_type), target, intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), target, intent(in) :: subtrees
      integer, intent(in) :: side
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      class(common_supernodes_type), optional, intent(in) :: common

      shared%matrix => matrix
      shared%subtrees => subtrees
      associate (nodes => size(symbolic%first) - 1, parts => size(subtrees%root))
         allocate (shared%next(nodes), shared%wide(nodes), shared%reached(nodes), stat=status)
         if (status == 0) allocate (shared%head(nodes), shared%waiting(parts), source=0, stat=status)
         if (status == 0) allocate (shared%stopped(parts), source=.false., stat=status)
      end associate
      if (status == 0 .and. side /= 0) call count_terms(symbolic, stored_supernodes(symbolic, common), shared, status)
   end subroutine set_shared

   ! Counts the entries of each row of L before its diagonal in the first `stored` supernodes, the terms of the rounding-error
   ! bound.
   subroutine count_terms(symbolic, stored, shared, status)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: stored
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      integer :: s, k

      allocate (shared%terms(size(symbolic%order)), shared%weight(size(symbolic%order)), source=0.0_wp, stat=status)
      if (status /= 0) return
      do s = 1, stored
         associate (first => symbolic%first(s), columns => symbolic%first(s + 1) - symbolic%first(s), &
            row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            shared%terms(first:first + columns - 1) = shared%terms(first:first + columns - 1) + [(k, k=0, columns - 1)]
            shared%terms(row) = shared%terms(row) + columns
         end associate
      end do
   end subroutine count_terms
end module kschur_supernodal
