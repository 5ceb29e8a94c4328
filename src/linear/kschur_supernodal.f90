!> Multifrontal LDL^T without pivoting. Threads share independent parts of the elimination tree, and tiles of panels
!> above its leaves; neither the partition nor the digits depend on the number of threads.
module kschur_supernodal
   use kschur_common_supernodes, only: common_supernodes_type, common_updates_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: elimination_type, eliminate_supernode, front_type, supernodal_factors_type
   use kschur_kinds, only: wp, long
   use kschur_monitor, only: ask_monitor, is_stopped, monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   use kschur_update_memory, only: matrix_type
   implicit none
   private
   public :: eliminate

   ! Panels with fewer entries are factored by one thread.
   integer, parameter :: least_entries = 20000

contains

   !> Factors a symmetric matrix, of which one triangle is read. Stops at a pivot that is zero or NaN; pivots that depend on it
   !> are zero. With `side`, moves each pivot downwards (-1) or upwards (1) by the bound of the rounding errors.
   subroutine eliminate(matrix, symbolic, subtrees, side, factors, error, monitor, least, pivots_only, common)
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
      !> L is not stored.
      logical, optional, intent(in) :: pivots_only
      !> The supernodes that several processes share, the last part of `subtrees`: collective then. All fail if one has no memory.
      class(common_supernodes_type), optional, intent(inout) :: common
      type(elimination_type) :: shared
      type(front_type), allocatable :: fronts(:)
      logical :: failed
      integer :: own, status

      if (present(pivots_only)) shared%stores = .not. pivots_only
      allocate (fronts(team_size()), stat=status)
      if (status == 0) call make_room(symbolic, side, shared%stores, factors, fronts, status, common)
      if (present(least) .and. status == 0) fronts%enclosure%least = least
      if (status == 0) call set_shared(matrix, symbolic, subtrees, side, shared, status, common)
      if (status == 0) call make_stacks(shared%plan%entries, fronts, status)
      failed = status /= 0
      own = size(subtrees%root)
      if (present(common)) then
         failed = common%any_of(failed)
         own = count(subtrees%root < common%first)
      end if
      if (.not. failed) then
         !$omp parallel num_threads(size(fronts)) if (size(subtrees%root) > 1)
         !$omp master
         call eliminate_parts(own, symbolic, shared, factors, fronts, monitor)
         !$omp end master
         !$omp end parallel
         if (present(common)) call eliminate_common(symbolic, own, shared, factors, fronts, common, monitor)
      end if
      call drop_updates(shared, fronts)
      if (failed .or. shared%no_memory) call no_memory(error)
      if (.not. allocated(error)) call ask_monitor(monitor, error)
   end subroutine eliminate

   ! Factors the first `own` parts, a part after its children. A leaf also waits for one some leaves before it, so that parts above
   ! are done in between and few update matrices are there at a time.
   subroutine eliminate_parts(own, symbolic, shared, factors, fronts, monitor)
      integer, intent(in) :: own
      type(symbolic_type), intent(in) :: symbolic
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      !> One for each thread.
      type(front_type), intent(inout) :: fronts(:)
      class(monitor_type), optional, intent(inout) :: monitor
      ! Dependencies: the last but one stands for what is above the parts, the last one for no leaf before.
      logical :: turn(size(shared%subtrees%root) + 2)
      integer :: leaves(size(shared%subtrees%root)), t, i, k, before

      k = 0
      do i = 1, size(shared%subtrees%order)
         t = shared%subtrees%order(i)
         if (t > own) cycle
         before = size(turn)
         if (shared%subtrees%is_leaf(t)) then
            k = k + 1
            leaves(k) = t
            if (k > 2*size(fronts)) before = leaves(k - 2*size(fronts))
         end if
         !$omp task default(shared) firstprivate(t) depend(out: turn(t)) depend(in: turn(shared%subtrees%above(t)), turn(before)) &
         !$omp    if (size(fronts) > 1)
         call eliminate_part(symbolic, t, shared, factors, fronts(thread_number()), monitor)
         !$omp end task
      end do
      !$omp taskwait
   end subroutine eliminate_parts

   ! Factors the common supernodes after the first `own` parts. None is factored if a part was stopped in any process.
   subroutine eliminate_common(symbolic, own, shared, factors, fronts, common, monitor)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: own
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      !> One for each thread.
      type(front_type), intent(inout) :: fronts(:)
      class(common_supernodes_type), intent(inout) :: common
      class(monitor_type), optional, intent(inout) :: monitor
      type(common_updates_type), allocatable :: update(:)
      real(wp) :: none(0)
      integer :: s, status

      allocate (update(common%first - 1), stat=status)
      shared%no_memory = shared%no_memory .or. status /= 0
      if (common%any_of(any(shared%stopped(:own)) .or. shared%ended .or. shared%no_memory)) return
      do s = 1, size(update)
         if (symbolic%parent(s) < common%first) cycle
         associate (mine => shared%update(s))
            update(s)%entries => mine%matrix%entries
            update(s)%rows = mine%matrix%rows
            update(s)%eliminated = mine%eliminated
            call move_alloc(mine%sum, update(s)%sum)
            mine%matrix = matrix_type()
         end associate
      end do
      call shared%plan%drop_spare()
      call free_stacks(fronts)
      associate (first => symbolic%first(common%first), offset => factors%offset(common%first:))
         if (allocated(shared%terms)) then
            call common%eliminate(shared%matrix, update, fronts(1)%enclosure, shared%terms(first:), offset, factors%lower, &
               factors%pivot(first:), shared%no_memory, monitor)
         else
            call common%eliminate(shared%matrix, update, fronts(1)%enclosure, none, offset, factors%lower, factors%pivot(first:), &
               shared%no_memory, monitor)
         end if
      end associate
   end subroutine eliminate_common

   subroutine no_memory(error)
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_memory, "no memory for the LDL^T factors")
   end subroutine no_memory

   ! Factors the supernodes of part t, whose child parts are done. Factors none if a child part was stopped by a zero pivot.
   subroutine eliminate_part(symbolic, t, shared, factors, front, monitor)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: t
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      type(front_type), intent(inout) :: front
      class(monitor_type), optional, intent(inout) :: monitor
      logical :: stopped, ended
      integer :: c, s

      ! A part that was stopped left matrices on them.
      front%stacks%top = 0
      stopped = .false.
      do c = 1, t - 1
         if (shared%subtrees%above(c) == t) stopped = stopped .or. shared%stopped(c)
      end do
      associate (first => shared%subtrees%first(t), root => shared%subtrees%root(t), is_leaf => shared%subtrees%is_leaf(t))
         do s = first, root
            call check_monitor(shared, s == first .or. .not. is_leaf, monitor, ended)
            if (stopped .or. ended) exit
            call eliminate_supernode(symbolic, s, .not. is_leaf .and. entries_of_panel(symbolic, s) >= least_entries, shared, &
               factors, front, stopped)
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
   subroutine make_room(symbolic, side, stores, factors, fronts, status, common)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      logical, intent(in) :: stores
      type(supernodal_factors_type), intent(inout) :: factors
      type(front_type), intent(inout) :: fronts(:)
      integer, intent(out) :: status
      class(common_supernodes_type), optional, intent(in) :: common
      integer(long) :: most_entries
      integer :: nodes, own, unknowns, n, s, i

      nodes = size(symbolic%first) - 1
      n = size(symbolic%order)
      own = own_supernodes(symbolic, common)
      unknowns = n
      if (present(common)) unknowns = common%unknowns
      if (allocated(factors%offset)) deallocate (factors%offset, factors%pivot)
      allocate (factors%offset(nodes + 1), factors%pivot(n), stat=status)
      if (status /= 0) return
      factors%pivot = 0
      factors%offset(1) = 1
      most_entries = widest**2
      do s = 1, nodes
         associate (columns => symbolic%first(s + 1) - symbolic%first(s))
            factors%offset(s + 1) = factors%offset(s) + entries_of_panel(symbolic, s) - (columns*(columns + 1))/2
            if (s <= own) most_entries = max(most_entries, entries_of_panel(symbolic, s))
         end associate
      end do
      if (stores) call make_lower(factors%offset(nodes + 1) - 1, factors%lower, status)
      do i = 1, size(fronts)
         if (status == 0) allocate (fronts(i)%entries(most_entries), fronts(i)%scaled(most_entries), fronts(i)%place(n), &
            fronts(i)%relative(symbolic%most_rows()), stat=status)
         if (side == 0) cycle
         fronts(i)%enclosure%side = side
         fronts(i)%enclosure%underflow = unknowns*tiny(1.0_wp)
         if (status == 0) allocate (fronts(i)%enclosure%sum(widest), fronts(i)%enclosure%terms(widest), &
            fronts(i)%sum(symbolic%most_rows() + widest), stat=status)
      end do
   end subroutine make_room

   ! Number of supernodes before the common ones.
   pure integer function own_supernodes(symbolic, common) result(own)
      type(symbolic_type), intent(in) :: symbolic
      class(common_supernodes_type), optional, intent(in) :: common

      own = size(symbolic%first) - 1
      if (present(common)) own = common%first - 1
   end function own_supernodes

   ! Keeps the memory that is there if it fits.
   subroutine make_lower(entries, lower, status)
      integer(long), intent(in) :: entries
      real(wp), allocatable, intent(inout) :: lower(:)
      integer, intent(out) :: status

      status = 0
      if (allocated(lower)) then
         if (size(lower, kind=long) /= entries) deallocate (lower)
      end if
      if (.not. allocated(lower)) allocate (lower(entries), stat=status)
   end subroutine make_lower

   ! Of each thread.
   subroutine make_stacks(entries, fronts, status)
      integer(long), intent(in) :: entries(2)
      type(front_type), intent(inout) :: fronts(:)
      integer, intent(out) :: status
      integer :: i, p

      status = 0
      do i = 1, size(fronts)
         do p = 1, size(entries)
            if (status == 0) allocate (fronts(i)%stacks(p)%values(entries(p)), stat=status)
         end do
      end do
   end subroutine make_stacks

   ! Frees the stacks, and matrices that are left where the elimination stopped.
   subroutine drop_updates(shared, fronts)
      type(elimination_type), intent(inout) :: shared
      type(front_type), allocatable, intent(inout) :: fronts(:)
      integer :: s

      if (allocated(shared%update) .and. allocated(shared%plan%stack)) then
         do s = 1, size(shared%update)
            if (shared%plan%stack(s) == 0 .and. associated(shared%update(s)%matrix%entries)) &
               deallocate (shared%update(s)%matrix%entries)
         end do
      end if
      call shared%plan%drop_spare()
      if (allocated(fronts)) call free_stacks(fronts)
   end subroutine drop_updates

   subroutine free_stacks(fronts)
      type(front_type), intent(inout) :: fronts(:)
      integer :: i, p

      do i = 1, size(fronts)
         do p = 1, size(fronts(i)%stacks)
            if (associated(fronts(i)%stacks(p)%values)) deallocate (fronts(i)%stacks(p)%values)
         end do
      end do
   end subroutine free_stacks

   ! Initialises the data shared by all threads.
   subroutine set_shared(matrix, symbolic, subtrees, side, shared, status, common)
      type(csr_matrix_type), target, intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), target, intent(in) :: subtrees
      integer, intent(in) :: side
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      class(common_supernodes_type), optional, intent(in) :: common
      integer :: s, own

      own = own_supernodes(symbolic, common)
      shared%matrix => matrix
      shared%subtrees => subtrees
      associate (nodes => size(symbolic%first) - 1, parts => size(subtrees%root))
         allocate (shared%update(nodes), stat=status)
         if (status == 0) allocate (shared%child(nodes), shared%sibling(nodes), source=0, stat=status)
         if (status == 0) allocate (shared%stopped(parts), source=.false., stat=status)
         if (status /= 0) return
         do s = nodes, 1, -1
            associate (parent => symbolic%parent(s))
               if (parent == 0) cycle
               shared%sibling(s) = shared%child(parent)
               shared%child(parent) = s
            end associate
         end do
      end associate
      call shared%plan%make(symbolic, subtrees, own, status)
      if (status == 0 .and. side /= 0) call count_terms(symbolic, own, shared, status)
   end subroutine set_shared

   ! Counts the entries of each row of L before its diagonal in the first `own` supernodes, the terms of the rounding-error
   ! bound.
   subroutine count_terms(symbolic, own, shared, status)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: own
      type(elimination_type), intent(inout) :: shared
      integer, intent(out) :: status
      integer :: s, k

      allocate (shared%terms(size(symbolic%order)), source=0.0_wp, stat=status)
      if (status /= 0) return
      do s = 1, own
         associate (first => symbolic%first(s), columns => symbolic%first(s + 1) - symbolic%first(s), &
            row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            shared%terms(first:first + columns - 1) = shared%terms(first:first + columns - 1) + [(k, k=0, columns - 1)]
            shared%terms(row) = shared%terms(row) + columns
         end associate
      end do
   end subroutine count_terms
end module kschur_supernodal
