!> An LDL^T over several processes: each has the factors of some subtrees of the elimination tree, and some rows of those of the
!> common supernodes above. Procedures are collective.
module kschur_joint_factors
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: supernodal_factors_type
   use kschur_growth, only: add_terms, has_grown
   use kschur_joint_supernodes, only: joint_supernodes_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_memory, only: integer_bytes, real_bytes, require_memory, return_memory
   use kschur_monitor, only: monitor_type
   use kschur_processes, only: processes_type, spread_error
   use kschur_shared_fronts, only: common_tree_type
   use kschur_solution_rows, only: solution_rows_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_substitution, only: sides_at_once, substitute
   use kschur_subtrees, only: cut_subtrees, subtrees_type
   use kschur_supernodal, only: eliminate
   use kschur_symbolic, only: symbolic_type
   use kschur_tree_shares, only: owners_of_supernodes, take_common, take_share, take_values
   use mpi_f08, only: MPI_Allreduce, MPI_Bcast, MPI_DOUBLE_PRECISION, MPI_INTEGER, MPI_INTEGER8, MPI_LOGICAL, MPI_MAX, MPI_Recv, &
      MPI_Send, MPI_STATUS_IGNORE, MPI_SUM
   implicit none
   private
   public :: joint_factors_type, pivot_counts_type

   !> Pivots of all processes.
   type :: pivot_counts_type
      !> That are negative, not positive, not finite; not larger than the bound for zero; of unknowns and multipliers, with the
      !> sign of the other; those of a singular matrix that were replaced; all.
      integer :: negative = 0, not_positive = 0, not_finite = 0, zero = 0, negative_unknowns = 0, positive_multipliers = 0, &
         replaced = 0, all = 0
      !> Whether the replaced ones follow all multipliers.
      logical :: nulls_last = .true.
      !> Whether rounding may be large, of a regular matrix without multipliers whose pivots have both signs; false if L is not
      !> kept.
      logical :: have_grown = .false.
      !> Bytes of the factors in the process that has most.
      integer(long) :: bytes = 0
   end type pivot_counts_type

   !> The part of one process.
   type :: joint_factors_type
      private
      type(processes_type), pointer :: processes => null()
      type(joint_supernodes_type) :: common
      type(symbolic_type) :: symbolic
      type(subtrees_type) :: subtrees
      type(supernodal_factors_type) :: factors
      ! The lower triangle of the columns here, by columns; dropped when no more factors are wanted.
      type(csr_matrix_type) :: matrix
      ! The columns whose pivots are counted here, and their rows of the matrix; D of these, if solutions are scaled.
      integer, allocatable :: column(:), unknown(:)
      real(wp), allocatable :: scaling(:)
      !> Numbers of rows and multipliers of the whole matrix.
      integer, public :: n = 0, multipliers = 0
      ! What replaces a smaller pivot.
      real(wp) :: least = 0
      ! Vectors by rows, and whole in the first process.
      type(solution_rows_type) :: rows, whole
   contains
      !> The first process shares the tree and the matrix.
      procedure :: share
      !> Factors; the first process gets an error if its monitor cancels.
      procedure :: factor
      !> Counts pivots.
      procedure :: count_pivots
      !> Frees the matrix, for no more factors are wanted; local.
      procedure :: drop_matrix
      !> x := A^{-1} x, x by rows, or whole in the first process.
      procedure :: solve
      !> From now on the solutions are x = D A^{-1} D b.
      procedure :: scale
   end type joint_factors_type

   ! Bytes that messages of MPI may take.
   real(wp), parameter :: message_bytes = 5.0e7_wp

contains

   subroutine share(self, processes, error, matrix, whole, multipliers)
      class(joint_factors_type), intent(inout) :: self
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      !> Given in the first process only: the matrix, its analysis, and the number of multipliers.
      type(csr_matrix_type), optional, intent(in) :: matrix
      type(symbolic_type), optional, intent(in) :: whole
      integer, optional, intent(in) :: multipliers
      integer, allocatable :: owner(:), place(:)
      type(common_tree_type) :: common
      integer :: own, process, k

      self%processes => processes
      own = 0
      ! The matrix and the analysis of a process, and places.
      if (present(matrix)) call require_memory(matrix%bytes() + integer_bytes*(2.0_wp*size(whole%row) + 10.0_wp*matrix%rows), &
         "the LDL^T factors", error)
      call spread_error(processes%communicator, error)
      if (allocated(error)) return
      if (present(matrix)) then
         owner = owners_of_supernodes(whole, processes%number)
         call take_common(whole, owner, common)
         self%n = matrix%rows
         self%multipliers = multipliers
         ! The share of this process is made last, so that only one is in memory at a time.
         do process = processes%number - 1, 0, -1
            call take_share(whole, owner, process, common, processes%number, self%symbolic, self%unknown, self%column, place)
            own = count(owner == process)
            call take_values(matrix, whole, self%symbolic%first(own + 1) - 1, self%column, place, self%matrix)
            if (process > 0) call send_share(self, own, process, error)
         end do
      else
         call receive_share(self, own, error)
      end if
      call spread_error(processes%communicator, error)
      if (allocated(error)) return
      call spread_common(self, common)
      self%symbolic%order = [(k, k=1, self%matrix%columns)]
      self%symbolic%position = self%symbolic%order
      call set_supernodes(self%symbolic)
      associate (columns => self%symbolic%first(own + 1) - 1)
         call self%common%begin(own + 1, self%n, common, [(common_parent(self%symbolic, k, own), k=1, own)], &
            self%symbolic%start(:own + 1), self%symbolic%row(:self%symbolic%start(own + 1) - 1) - columns, processes)
      end associate
      self%subtrees = cut_subtrees(self%symbolic, own + 1)
      call self%rows%begin(self%n - self%multipliers, self%multipliers, processes)
      call self%whole%begin_whole(self%n, processes)
      self%rows%is_fixed = .true.
      self%whole%is_fixed = .true.
      call require_memory(bytes_of_factors(self) + message_bytes, "the LDL^T factors", error)
      call spread_error(processes%communicator, error)
   end subroutine share

   ! The common supernode that is the parent of supernode s, which is not; 0 if its parent is not either.
   pure integer function common_parent(symbolic, s, own) result(parent)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s, own

      parent = max(symbolic%parent(s) - own, 0)
   end function common_parent

   ! Sends the common supernodes to all processes.
   subroutine spread_common(self, common)
      type(joint_factors_type), intent(in) :: self
      type(common_tree_type), intent(inout) :: common
      integer :: sizes(2)

      if (allocated(common%first)) sizes = [size(common%first), size(common%row)]
      associate (communicator => self%processes%communicator)
         call MPI_Bcast(sizes, 2, MPI_INTEGER, 0, communicator)
         if (.not. allocated(common%first)) allocate (common%first(sizes(1)), common%start(sizes(1)), common%row(sizes(2)))
         call MPI_Bcast(common%first, sizes(1), MPI_INTEGER, 0, communicator)
         call MPI_Bcast(common%start, sizes(1), MPI_INTEGER8, 0, communicator)
         call MPI_Bcast(common%row, sizes(2), MPI_INTEGER, 0, communicator)
      end associate
   end subroutine spread_common

   ! Bytes of the factors here, and of the work arrays of one thread.
   pure real(wp) function bytes_of_factors(self) result(bytes)
      type(joint_factors_type), intent(in) :: self
      real(wp) :: columns, rows, most
      integer :: s

      bytes = 0
      most = 0
      do s = 1, size(self%symbolic%first) - 1
         columns = self%symbolic%first(s + 1) - self%symbolic%first(s)
         rows = real(self%symbolic%start(s + 1) - self%symbolic%start(s), wp)
         bytes = bytes + real_bytes*columns*((columns - 1)/2 + rows)
         most = max(most, columns*(columns + rows))
      end do
      bytes = bytes + 3*real_bytes*most + self%symbolic%update_bytes() + self%common%bytes() + &
         6*integer_bytes*size(self%symbolic%order)
   end function bytes_of_factors

   subroutine set_supernodes(symbolic)
      type(symbolic_type), intent(inout) :: symbolic
      integer :: s

      allocate (symbolic%supernode(size(symbolic%order)))
      do s = 1, size(symbolic%first) - 1
         symbolic%supernode(symbolic%first(s):symbolic%first(s + 1) - 1) = s
      end do
   end subroutine set_supernodes

   ! Sends a share, which the first process holds in the place of its own; fails if the receiver has no memory for it.
   subroutine send_share(self, own, to, error)
      type(joint_factors_type), intent(in) :: self
      integer, intent(in) :: own, to
      type(error_type), allocatable, intent(inout) :: error
      integer(long) :: sizes(8)
      logical :: has_room

      associate (communicator => self%processes%communicator, symbolic => self%symbolic, matrix => self%matrix)
         sizes = [integer(long) :: self%n, self%multipliers, own, size(symbolic%first), matrix%columns, size(matrix%column), &
            size(self%unknown), size(symbolic%row)]
         call MPI_Send(sizes, size(sizes), MPI_INTEGER8, to, 0, communicator)
         call MPI_Recv(has_room, 1, MPI_LOGICAL, to, 0, communicator, MPI_STATUS_IGNORE)
         if (.not. has_room) then
            if (.not. allocated(error)) call new_error(error, error_memory, "no memory for the LDL^T factors")
            return
         end if
         call MPI_Send(symbolic%start, size(symbolic%start), MPI_INTEGER8, to, 0, communicator)
         call MPI_Send(symbolic%first, size(symbolic%first), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(symbolic%row, size(symbolic%row), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(self%unknown, size(self%unknown), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(self%column, size(self%column), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(matrix%row_start, size(matrix%row_start), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(matrix%column, size(matrix%column), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(matrix%value, size(matrix%value), MPI_DOUBLE_PRECISION, to, 0, communicator)
      end associate
   end subroutine send_share

   subroutine receive_share(self, own, error)
      type(joint_factors_type), intent(inout) :: self
      integer, intent(out) :: own
      type(error_type), allocatable, intent(inout) :: error
      integer(long) :: sizes(8)
      integer :: status

      associate (communicator => self%processes%communicator, symbolic => self%symbolic, matrix => self%matrix)
         call MPI_Recv(sizes, size(sizes), MPI_INTEGER8, 0, 0, communicator, MPI_STATUS_IGNORE)
         self%n = int(sizes(1))
         self%multipliers = int(sizes(2))
         own = int(sizes(3))
         matrix%rows = int(sizes(5))
         matrix%columns = int(sizes(5))
         allocate (symbolic%start(sizes(4)), symbolic%first(sizes(4)), symbolic%row(sizes(8)), self%unknown(sizes(7)), &
            self%column(sizes(7)), matrix%row_start(sizes(5) + 1), matrix%column(sizes(6)), matrix%value(sizes(6)), stat=status)
         if (status /= 0) call new_error(error, error_memory, "no memory for the LDL^T factors")
         ! What is made of it, and the common supernodes.
         call require_memory(message_bytes + integer_bytes*(10.0_wp*sizes(5) + sizes(8)), "the LDL^T factors", error)
         call MPI_Send(.not. allocated(error), 1, MPI_LOGICAL, 0, 0, communicator)
         if (allocated(error)) return
         call MPI_Recv(symbolic%start, size(symbolic%start), MPI_INTEGER8, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(symbolic%first, size(symbolic%first), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(symbolic%row, size(symbolic%row), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(self%unknown, size(self%unknown), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(self%column, size(self%column), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(matrix%row_start, size(matrix%row_start), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(matrix%column, size(matrix%column), MPI_INTEGER, 0, 0, communicator, MPI_STATUS_IGNORE)
         call MPI_Recv(matrix%value, size(matrix%value), MPI_DOUBLE_PRECISION, 0, 0, communicator, MPI_STATUS_IGNORE)
      end associate
   end subroutine receive_share

   subroutine factor(self, side, singular, error, monitor)
      class(joint_factors_type), target, intent(inout) :: self
      !> As in `eliminate`: the same in all processes.
      integer, intent(in) :: side
      !> As in `matrix_structure_type`.
      logical, intent(in) :: singular
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      type(matrix_structure_type) :: structure

      structure%singular = singular
      structure%multipliers = self%multipliers
      self%least = structure%least_pivot()
      ! Factors and update matrices are too large for what the matrices left free.
      call return_memory()
      call eliminate(self%matrix, self%symbolic, self%subtrees, side, self%factors, error, monitor, self%least, side /= 0, &
         self%common)
      call spread_error(self%processes%communicator, error)
   end subroutine factor

   subroutine count_pivots(self, bound, counts)
      class(joint_factors_type), intent(in) :: self
      !> A pivot is zero if it is not larger than this fraction of its diagonal entry.
      real(wp), intent(in) :: bound
      type(pivot_counts_type), intent(out) :: counts
      integer :: here(7), all(7), ends(2), last(2), before, j, k, p
      integer(long) :: bytes
      real(wp) :: diagonal(size(self%unknown))

      here = 0
      ! The first column with a replaced pivot, with a minus sign, and the last one of a multiplier, among the common ones; those
      ! before may be eliminated in any order, and are number 0.
      ends = [-self%n - 1, -1]
      before = self%symbolic%first(self%common%first) - 1
      do k = 1, size(self%unknown)
         j = self%column(k)
         diagonal(k) = 0
         do p = self%matrix%row_start(j), self%matrix%row_start(j + 1) - 1
            if (self%matrix%column(p) == j) diagonal(k) = abs(self%matrix%value(p))
         end do
         associate (pivot => self%factors%pivot(j), is_multiplier => self%unknown(k) > self%n - self%multipliers)
            here = here + merge(1, 0, [pivot < 0, .not. pivot > 0, .not. abs(pivot) <= huge(pivot), &
               .not. abs(pivot) > bound*diagonal(k), pivot < 0 .and. .not. is_multiplier, pivot > 0 .and. is_multiplier, &
               .not. abs(pivot) > self%least])
            if (.not. abs(pivot) > self%least) ends(1) = max(ends(1), -max(j - before, 0))
            if (is_multiplier) ends(2) = max(ends(2), j - before, 0)
         end associate
      end do
      call MPI_Allreduce(here, all, size(here), MPI_INTEGER, MPI_SUM, self%processes%communicator)
      call MPI_Allreduce(ends, last, size(ends), MPI_INTEGER, MPI_MAX, self%processes%communicator)
      bytes = 0
      if (allocated(self%factors%lower)) bytes = int(real_bytes, long)*size(self%factors%lower, kind=long)
      call MPI_Allreduce(bytes, counts%bytes, 1, MPI_INTEGER8, MPI_MAX, self%processes%communicator)
      counts%negative = all(1)
      counts%not_positive = all(2)
      counts%not_finite = all(3)
      counts%zero = all(4)
      counts%negative_unknowns = all(5)
      counts%positive_multipliers = all(6)
      counts%replaced = all(7)
      counts%all = self%n
      counts%nulls_last = -last(1) > last(2)
      if (self%multipliers == 0 .and. .not. self%least > 0 .and. all(1) > 0 .and. all(1) < self%n .and. all(4) == 0 .and. &
         counts%bytes > 0) counts%have_grown = self%common%any_of(grow(self, diagonal))
   end subroutine count_pivots

   ! Whether rounding may be large in a row here; collective.
   logical function grow(self, diagonal)
      class(joint_factors_type), intent(in) :: self
      !> Of the columns that are counted here.
      real(wp), intent(in) :: diagonal(:)
      real(wp) :: terms(size(self%symbolic%order), 1)
      integer :: s

      terms = 0
      terms(self%column, 1) = abs(self%factors%pivot(self%column))
      ! Each process has the diagonal blocks of the common supernodes.
      call add_terms(self%symbolic, self%factors, [(s < self%common%first .or. self%common%leads, &
         s=1, size(self%symbolic%first) - 1)], terms(:, 1))
      call self%common%sum_rows(terms(self%symbolic%first(self%common%first):, :))
      grow = any(has_grown(terms(self%column, 1), diagonal))
   end function grow

   subroutine drop_matrix(self)
      class(joint_factors_type), intent(inout) :: self

      self%matrix = csr_matrix_type()
   end subroutine drop_matrix

   subroutine scale(self, scaling)
      class(joint_factors_type), intent(inout) :: self
      !> D, of the first process; empty in others.
      real(wp), intent(in) :: scaling(:)
      real(wp) :: part(size(self%unknown), 1)

      call self%whole%collect(self%unknown, reshape(scaling, [size(scaling), 1]), part)
      self%scaling = part(:, 1)
   end subroutine scale

   subroutine solve(self, x, by_rows, error)
      class(joint_factors_type), intent(inout) :: self
      !> With `by_rows` the rows of `joint_ranges_type`; else all in the first process, none in others.
      real(wp), contiguous, intent(inout) :: x(:, :)
      logical, intent(in) :: by_rows
      !> The same in all processes.
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: sides(:, :)
      integer :: status

      ! The rows sent and received, and those of a block.
      call require_memory(message_bytes + real_bytes*size(x, 2)*(2.0_wp*size(x, 1) + 5.0_wp*size(self%symbolic%order)), &
         "the right-hand sides", error)
      allocate (sides(size(self%unknown), size(x, 2)), stat=status)
      if (status /= 0 .and. .not. allocated(error)) call new_error(error, error_memory, "no memory for the right-hand sides")
      call spread_error(self%processes%communicator, error)
      if (allocated(error)) return
      if (by_rows) then
         call self%rows%collect(self%unknown, x, sides)
      else
         call self%whole%collect(self%unknown, x, sides)
      end if
      call substitute_blocks(self, sides, error)
      if (allocated(error)) return
      if (by_rows) then
         call self%rows%redistribute(self%unknown, sides, x)
      else
         call self%whole%redistribute(self%unknown, sides, x)
      end if
   end subroutine solve

   ! Solves for right-hand sides in the processes of their pivots.
   subroutine substitute_blocks(self, sides, error)
      type(joint_factors_type), intent(in) :: self
      real(wp), intent(inout) :: sides(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: y(:, :)
      integer :: first, last, joint, own, j, status

      ! Columns before the common ones, all of which are here.
      own = self%symbolic%first(self%common%first) - 1
      last = 0
      do while (last < size(sides, 2))
         first = last + 1
         joint = sides_at_once(size(sides, 2) - last)
         last = min(last + joint, size(sides, 2))
         if (allocated(y)) then
            if (size(y, 1) /= joint) deallocate (y)
         end if
         status = 0
         if (.not. allocated(y)) allocate (y(joint, size(self%symbolic%order)), stat=status)
         if (self%common%any_of(status /= 0)) then
            call new_error(error, error_memory, "no memory for the right-hand sides")
            return
         end if
         associate (columns => last - first + 1)
            y(:, own + 1:) = 0
            y(columns + 1:, :own) = 0
            do j = 1, columns
               y(j, self%column) = sides(:, first + j - 1)
               if (allocated(self%scaling)) y(j, self%column) = y(j, self%column)*self%scaling
            end do
            call substitute(self%symbolic, self%subtrees, self%factors, y, error, self%common)
            if (allocated(error)) return
            do j = 1, columns
               sides(:, first + j - 1) = y(j, self%column)
               if (allocated(self%scaling)) sides(:, first + j - 1) = sides(:, first + j - 1)*self%scaling
            end do
         end associate
      end do
   end subroutine substitute_blocks
end module kschur_joint_factors
