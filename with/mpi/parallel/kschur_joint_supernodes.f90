!> The common supernodes of an LDL^T over several processes, by MPI. Each process has some rows of every front
!> (`kschur_shared_fronts`). Of a supernode the first process gathers and factors the diagonal block, each then computes its rows
!> of L, gets those of the others, and updates its rows of the front.
module kschur_joint_supernodes
   use kschur_common_supernodes, only: common_supernodes_type, common_updates_type
   use kschur_kinds, only: wp, long
   use kschur_memory, only: real_bytes, return_memory
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_enclosure, only: enclosure_type
   use kschur_panel, only: factor_panel
   use kschur_processes, only: processes_type
   use kschur_shared_fronts, only: common_tree_type, process_of_row, shared_front_type, shared_update_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_supernodes, only: widest
   use mpi_f08, only: MPI_Allgather, MPI_Allgatherv, MPI_Allreduce, MPI_Bcast, MPI_Comm, MPI_DOUBLE_PRECISION, MPI_Gatherv, &
      MPI_IN_PLACE, MPI_INTEGER, MPI_LOGICAL, MPI_LOR, MPI_Recv, MPI_Send, MPI_STATUS_IGNORE, MPI_SUM
   implicit none
   private
   public :: joint_supernodes_type

   ! The root of a subtree below a common supernode.
   type :: root_type
      ! Its process, and its number there; the common supernode.
      integer :: process = 0, number = 0, parent = 0
      ! The common columns of its rows.
      integer, allocatable :: row(:)
   end type root_type

   !> Of a group of processes.
   type, extends(common_supernodes_type) :: joint_supernodes_type
      private
      type(MPI_Comm) :: communicator
      integer :: processes = 1, rank = 0
      type(common_tree_type) :: tree
      ! Of all processes, in their order.
      type(root_type), allocatable :: roots(:)
   contains
      procedure :: begin
      !> Bytes of the largest front here, and of work arrays.
      procedure :: bytes
      procedure :: any_of
      procedure :: eliminate
      procedure :: sum_rows
   end type joint_supernodes_type

   ! Work arrays: a panel with its diagonal block; rows of L here and of all, and all times pivots; what is gathered of
   ! a diagonal block, and values of an update matrix; `terms` of `enclosure_type` of all common columns.
   type :: workspace_type
      real(wp), allocatable :: panel(:), below(:), all(:), scaled(:), block(:), sent(:), gathered(:), values(:), terms(:)
      ! Of the process, whether there was no memory.
      logical :: no_memory = .false.
   end type workspace_type

   ! What the first process tells after a diagonal block.
   integer, parameter :: goes_on = 0, stops = 1, ends = 2, lacks_memory = 3

   ! Values of an update matrix in a message: they stay in the cache.
   integer, parameter :: message_values = 200000

contains

   subroutine begin(self, first, unknowns, tree, parent, start, row, processes)
      class(joint_supernodes_type), intent(inout) :: self
      !> The first common supernode of this process; rows of the matrix.
      integer, intent(in) :: first, unknowns
      !> The common supernodes, without children.
      type(common_tree_type), intent(in) :: tree
      !> Of each supernode before, the common one that is its parent, or 0; its rows, common columns counted from 1.
      integer, intent(in) :: parent(:), row(:)
      integer(long), intent(in) :: start(:)
      type(processes_type), intent(in) :: processes
      integer, allocatable :: here(:), all(:)
      integer :: lengths(0:processes%number - 1), numbers(0:processes%number - 1), process, s, k, i, next

      self%first = first
      self%unknowns = unknowns
      self%leads = processes%rank == 0
      self%communicator = processes%communicator
      self%processes = processes%number
      self%rank = processes%rank
      self%tree = tree
      call self%tree%find_children()
      allocate (here(sum([(merge(3 + int(start(s + 1) - start(s)), 0, parent(s) > 0), s=1, size(parent))])))
      k = 0
      do s = 1, size(parent)
         if (parent(s) == 0) cycle
         associate (rows => int(start(s + 1) - start(s)))
            here(k + 1:k + 3) = [s, parent(s), rows]
            here(k + 4:k + 3 + rows) = row(start(s):start(s + 1) - 1)
            k = k + 3 + rows
         end associate
      end do
      call MPI_Allgather(size(here), 1, MPI_INTEGER, lengths, 1, MPI_INTEGER, self%communicator)
      call MPI_Allgather(count(parent > 0), 1, MPI_INTEGER, numbers, 1, MPI_INTEGER, self%communicator)
      allocate (all(sum(lengths)), self%roots(sum(numbers)))
      call MPI_Allgatherv(here, size(here), MPI_INTEGER, all, lengths, before(lengths), MPI_INTEGER, self%communicator)
      i = 0
      k = 0
      do process = 0, self%processes - 1
         do next = 1, numbers(process)
            i = i + 1
            associate (root => self%roots(i), rows => all(k + 3))
               root%process = process
               root%number = all(k + 1)
               root%parent = all(k + 2)
               allocate (root%row, source=all(k + 4:k + 3 + rows))
               k = k + 3 + rows
            end associate
         end do
      end do
   end subroutine begin

   pure real(wp) function bytes(self)
      class(joint_supernodes_type), intent(in) :: self
      integer :: s

      bytes = 0
      do s = 1, size(self%tree%first) - 1
         associate (rows => real(self%tree%rows(s), wp))
            bytes = max(bytes, real_bytes*rows*(rows/self%processes + 4*widest))
         end associate
      end do
   end function bytes

   logical function any_of(self, here)
      class(joint_supernodes_type), intent(in) :: self
      logical, intent(in) :: here

      call MPI_Allreduce(here, any_of, 1, MPI_LOGICAL, MPI_LOR, self%communicator)
   end function any_of

   subroutine sum_rows(self, rows)
      class(joint_supernodes_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: rows(:, :)

      call MPI_Allreduce(MPI_IN_PLACE, rows, size(rows), MPI_DOUBLE_PRECISION, MPI_SUM, self%communicator)
   end subroutine sum_rows

   subroutine eliminate(self, matrix, update, enclosure, terms, offset, lower, pivot, no_memory, monitor)
      class(joint_supernodes_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(common_updates_type), intent(inout) :: update(:)
      type(enclosure_type), intent(inout) :: enclosure
      real(wp), intent(in) :: terms(:)
      integer(long), intent(in) :: offset(:)
      real(wp), allocatable, intent(inout) :: lower(:)
      real(wp), intent(inout) :: pivot(:)
      logical, intent(out) :: no_memory
      class(monitor_type), optional, intent(inout) :: monitor
      type(shared_front_type) :: front
      type(shared_update_type), allocatable :: mine(:)
      type(workspace_type) :: work
      integer :: s, state, status

      ! What the subtrees left free lies between update matrices.
      call return_memory()
      call make_room(self, front, mine, work, status)
      no_memory = self%any_of(status /= 0)
      state = merge(lacks_memory, goes_on, no_memory)
      if (enclosure%side /= 0 .and. .not. no_memory) call count_terms(self, terms, work%terms)
      do s = 1, size(self%tree%first) - 1
         if (state /= goes_on) exit
         call front%begin(self%tree, s, mine, status)
         work%no_memory = status /= 0
         if (.not. work%no_memory) call front%add_matrix(matrix, matrix%columns - self%tree%columns())
         call add_subtrees(self, s, front, update, enclosure%side /= 0, work)
         ! That of the update matrices added.
         call return_memory()
         associate (first => self%tree%first(s), last => self%tree%first(s + 1) - 1)
            enclosure%rows = size(front%row)
            enclosure%columns = front%columns
            if (enclosure%side /= 0) enclosure%terms(:front%columns) = work%terms(first:last)
            call factor_diagonal(self, front, enclosure, work, pivot(first:last), state, monitor)
            if (state == goes_on) call share_columns(self, front, enclosure, pivot(first:last), work, mine(s), offset(s), lower)
         end associate
      end do
      no_memory = state == lacks_memory
      do s = 1, size(update)
         if (associated(update(s)%matrix%entries)) deallocate (update(s)%matrix%entries)
      end do
   end subroutine eliminate

   ! Allocates the work arrays.
   subroutine make_room(self, front, mine, work, status)
      type(joint_supernodes_type), intent(in) :: self
      type(shared_front_type), intent(inout) :: front
      type(shared_update_type), allocatable, intent(out) :: mine(:)
      type(workspace_type), intent(inout) :: work
      integer, intent(out) :: status
      integer(long) :: all, here
      integer :: s

      all = 0
      here = 0
      do s = 1, size(self%tree%first) - 1
         associate (columns => int(self%tree%first(s + 1) - self%tree%first(s), long), &
            row => self%tree%row(self%tree%start(s):self%tree%start(s + 1) - 1))
            all = max(all, columns*size(row))
            here = max(here, columns*count(process_of_row(row, self%processes) == self%rank))
         end associate
      end do
      associate (columns => self%tree%columns())
         allocate (mine(size(self%tree%first) - 1), front%place(columns), front%here(columns), work%terms(columns), &
            work%panel(here + widest**2), work%below(here), work%all(all), work%scaled(max(all, int(widest, long)**2)), &
            work%block(widest*(widest + 1) + 1), work%sent(widest*(widest + 1) + 1), &
            work%gathered(widest*(widest + 1) + self%processes), work%values(max(message_values, self%tree%most_rows())), &
            stat=status)
      end associate
      front%processes = self%processes
      front%rank = self%rank
   end subroutine make_room

   ! Counts the entries of each row of L before its diagonal, those in columns of all processes.
   subroutine count_terms(self, here, terms)
      type(joint_supernodes_type), intent(in) :: self
      real(wp), intent(in) :: here(:)
      real(wp), intent(out) :: terms(:)
      integer :: s, k

      call MPI_Allreduce(here, terms, size(terms), MPI_DOUBLE_PRECISION, MPI_SUM, self%communicator)
      do s = 1, size(self%tree%first) - 1
         associate (first => self%tree%first(s), columns => self%tree%first(s + 1) - self%tree%first(s), &
            row => self%tree%row(self%tree%start(s):self%tree%start(s + 1) - 1))
            terms(first:first + columns - 1) = terms(first:first + columns - 1) + [(k, k=0, columns - 1)]
            terms(row) = terms(row) + columns
         end associate
      end do
   end subroutine count_terms

   ! Adds the update matrices of the subtrees below supernode s, one after the other: each process gets its rows of them.
   subroutine add_subtrees(self, s, front, update, with_sums, work)
      type(joint_supernodes_type), intent(in) :: self
      integer, intent(in) :: s
      type(shared_front_type), intent(inout) :: front
      type(common_updates_type), intent(inout) :: update(:)
      logical, intent(in) :: with_sums
      type(workspace_type), intent(inout) :: work
      integer :: r, first, wide

      do r = 1, size(self%roots)
         if (self%roots(r)%parent /= s) cycle
         associate (root => self%roots(r))
            wide = max(1, message_values/max(size(root%row), 1))
            do first = 1, size(root%row), wide
               call add_columns(first, min(first + wide - 1, size(root%row)))
            end do
            if (with_sums) call add_sums()
            if (root%process == self%rank) deallocate (update(root%number)%matrix%entries)
         end associate
      end do

   contains

      subroutine add_columns(first, last)
         integer, intent(in) :: first, last
         integer :: step, process, many

         associate (root => self%roots(r))
            ! The last one is this process.
            do step = 1, self%processes
               process = mod(self%rank + step, self%processes)
               if (root%process /= self%rank .and. process /= self%rank) cycle
               if (root%process == self%rank) then
                  call pack_columns(process, first, last, update(root%number), many)
                  if (process /= self%rank .and. many > 0) &
                     call MPI_Send(work%values, many, MPI_DOUBLE_PRECISION, process, 0, self%communicator)
               else
                  call count_values(first, last, many)
                  if (many > 0) call MPI_Recv(work%values, many, MPI_DOUBLE_PRECISION, root%process, 0, self%communicator, &
                     MPI_STATUS_IGNORE)
               end if
            end do
            if (.not. work%no_memory) call front%add_update(root%row, first, last, work%values)
         end associate
      end subroutine add_columns

      ! The values of the rows that a process has.
      subroutine pack_columns(process, first, last, update, many)
         integer, intent(in) :: process, first, last
         type(common_updates_type), intent(in) :: update
         integer, intent(out) :: many
         integer(long) :: at
         integer :: i, j, k

         many = 0
         k = 1
         associate (rows => rows_of(process, first))
            do j = first, last
               if (k <= size(rows)) then
                  if (rows(k) < j) k = k + 1
               end if
               at = update%matrix%place(update%eliminated, update%eliminated + j)
               do i = k, size(rows)
                  work%values(many + i - k + 1) = update%matrix%entries(at + rows(i))
               end do
               many = many + size(rows) - k + 1
            end do
         end associate
      end subroutine pack_columns

      subroutine count_values(first, last, many)
         integer, intent(in) :: first, last
         integer, intent(out) :: many

         associate (mine => rows_of(self%rank, first))
            many = sum(min(mine, last) - first + 1)
         end associate
      end subroutine count_values

      ! The rows of the root from one on that a process has.
      pure function rows_of(process, first) result(rows)
         integer, intent(in) :: process, first
         integer, allocatable :: rows(:)
         integer :: k

         associate (row => self%roots(r)%row)
            rows = pack([(k, k=first, size(row))], process_of_row(row(first:), self%processes) == process)
         end associate
      end function rows_of

      ! The sums of rows.
      subroutine add_sums()
         integer :: step, process

         associate (root => self%roots(r))
            do step = 1, self%processes
               process = mod(self%rank + step, self%processes)
               associate (rows => rows_of(process, 1))
                  if (root%process == self%rank) then
                     work%values(:size(rows)) = update(root%number)%sum(rows)
                     if (process /= self%rank) &
                        call MPI_Send(work%values, size(rows), MPI_DOUBLE_PRECISION, process, 0, self%communicator)
                  else if (process == self%rank) then
                     call MPI_Recv(work%values, size(rows), MPI_DOUBLE_PRECISION, root%process, 0, self%communicator, &
                        MPI_STATUS_IGNORE)
                  end if
                  if (process == self%rank .and. .not. work%no_memory) then
                     associate (here => front%here(root%row(rows)))
                        front%matrix%sum(here) = front%matrix%sum(here) + work%values(:size(rows))
                     end associate
                  end if
               end associate
            end do
         end associate
      end subroutine add_sums
   end subroutine add_subtrees

   ! Gathers the diagonal block in the first process, factors it there, and tells all what it is and how to go on.
   subroutine factor_diagonal(self, front, enclosure, work, pivot, state, monitor)
      type(joint_supernodes_type), intent(in) :: self
      type(shared_front_type), intent(in) :: front
      type(enclosure_type), intent(inout) :: enclosure
      type(workspace_type), intent(inout) :: work
      real(wp), intent(inout) :: pivot(:)
      integer, intent(out) :: state
      class(monitor_type), optional, intent(inout) :: monitor
      integer :: process(front%columns), counts(0:self%processes - 1), p

      process = process_of_row(front%row(:front%columns), self%processes)
      associate (columns => front%columns)
         counts = [(1 + (columns + 1)*count(process == p), p=0, self%processes - 1)]
         work%sent(:counts(self%rank)) = merge(1, 0, work%no_memory)
         if (.not. work%no_memory) call front%pack_diagonal(work%sent(2:counts(self%rank)))
         call MPI_Gatherv(work%sent, counts(self%rank), MPI_DOUBLE_PRECISION, work%gathered, counts, before(counts), &
            MPI_DOUBLE_PRECISION, 0, self%communicator)
         if (self%leads) call factor_block(work%block, work%block(columns**2 + 1:columns**2 + columns), &
            work%block(columns**2 + columns + 1))
         call MPI_Bcast(work%block, columns**2 + columns + 1, MPI_DOUBLE_PRECISION, 0, self%communicator)
         pivot = work%block(columns**2 + 1:columns**2 + columns)
         state = nint(work%block(columns**2 + columns + 1))
      end associate

   contains

      subroutine factor_block(block, pivot, state)
         real(wp), intent(inout) :: block(front%columns, front%columns), pivot(front%columns)
         real(wp), intent(out) :: state
         integer, allocatable :: place(:)
         logical :: lacks
         integer :: p, j, k, at

         lacks = .false.
         at = 0
         pivot = 0
         do p = 0, self%processes - 1
            place = pack([(k, k=1, size(process))], process == p)
            lacks = lacks .or. work%gathered(at + 1) > 0
            at = at + 1
            do j = 1, front%columns
               block(place, j) = work%gathered(at + 1:at + size(place))
               at = at + size(place)
            end do
            if (enclosure%side /= 0) enclosure%sum(place) = work%gathered(at + 1:at + size(place))
            at = at + size(place)
         end do
         state = goes_on
         if (lacks) then
            state = lacks_memory
         else if (is_stopped(monitor)) then
            state = ends
         else
            call factor_panel(front%columns, front%columns, block, front%columns, pivot, work%scaled, enclosure)
            if (.not. all(abs(pivot) > 0)) state = stops
         end if
      end subroutine factor_block
   end subroutine factor_diagonal

   ! Computes L below the diagonal block, each process its rows, stores them, and subtracts the update.
   subroutine share_columns(self, front, enclosure, pivot, work, update, offset, lower)
      type(joint_supernodes_type), intent(in) :: self
      type(shared_front_type), intent(inout) :: front
      type(enclosure_type), intent(in) :: enclosure
      real(wp), intent(in) :: pivot(:)
      type(workspace_type), intent(inout) :: work
      type(shared_update_type), intent(inout) :: update
      integer(long), intent(in) :: offset
      real(wp), allocatable, intent(inout) :: lower(:)
      integer :: counts(0:self%processes - 1), process(size(front%row) - front%columns), j, p
      integer(long) :: at

      associate (columns => front%columns, below => size(front%mine) - front%diagonal)
         call front%factor_mine(work%block, pivot, enclosure, work%panel, work%below)
         if (allocated(lower)) then
            at = offset
            do j = 1, columns - 1
               lower(at:at + columns - j - 1) = work%block((j - 1)*columns + j + 1:j*columns)
               at = at + columns - j
            end do
            lower(at:at + int(below, long)*columns - 1) = work%below(:int(below, long)*columns)
         end if
         if (size(process) == 0) return
         process = process_of_row(front%row(columns + 1:), self%processes)
         counts = [(columns*count(process == p), p=0, self%processes - 1)]
         call MPI_Allgatherv(work%below, counts(self%rank), MPI_DOUBLE_PRECISION, work%all, counts, before(counts), &
            MPI_DOUBLE_PRECISION, self%communicator)
         call scale_rows(work%scaled)
         call front%subtract_columns(work%below, work%scaled, update)
      end associate

   contains

      ! In the order of the front, times pivots.
      subroutine scale_rows(scaled)
         real(wp), intent(inout) :: scaled(size(process), front%columns)
         integer, allocatable :: place(:)
         integer :: p, j, k, at

         at = 0
         do p = 0, self%processes - 1
            place = pack([(k, k=1, size(process))], process == p)
            do j = 1, front%columns
               scaled(place, j) = pivot(j)*work%all(at + 1:at + size(place))
               at = at + size(place)
            end do
         end do
      end subroutine scale_rows
   end subroutine share_columns

   ! Exclusive prefix sums.
   pure function before(numbers)
      integer, intent(in) :: numbers(:)
      integer :: before(size(numbers))
      integer :: p

      before = [(sum(numbers(:p - 1)), p=1, size(numbers))]
   end function before
end module kschur_joint_supernodes
