!> Modes of a search: accepted eigenpairs with their errors, before they become a result.
module kschur_modes
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_outcome, only: certified_unknown, history_type, reason_converged
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: eigenvalues_of, modes_type, no_modes, take_columns

   !> Moves the columns `order` of a block to its front. A complex block shrinks to them; a real block keeps its size, with the
   !> others behind, as it is permuted in place.
   interface take_columns
      module procedure take_real_columns, take_complex_columns
   end interface take_columns

   !> Eigenpairs with their errors, nearest to the target first: those of the reduced problem, until the last step of a search
   !> expands them to the problem as given.
   type, extends(eigenpairs_type) :: modes_type
      !> Backward error of each mode.
      real(wp), allocatable :: backward_error(:)
      !> Absolute bounds of the errors (1/s); NaN where not known.
      real(wp), allocatable :: error_bound(:)
      !> Estimates of the errors of the eigenvalues (1/s): these bounds, or where not known the lower limit of any bound, or what
      !> the residual asks for; huge where refinement led elsewhere.
      real(wp), allocatable :: uncertainty(:)
      !> Left vectors, their multipliers and the condition numbers; not allocated unless asked for.
      complex(wp), allocatable :: left_phi(:, :), left_xi(:, :)
      real(wp), allocatable :: condition(:)
      !> Position of each mode among the rigid motions of the examination; 0: it is none of them.
      integer, allocatable :: motion(:)
      !> Number of eigenvalues found, both of a conjugate pair counted, whether listed or not.
      integer :: found = 0
      !> Eigenvalues of pairs that were too inaccurate to be listed; at the end of a search, of those that may belong in the list.
      complex(wp), allocatable :: unlisted(:)
      !> Eigenvalues of pairs that were taken as infinite ones: no finite eigenvalue is left that the iteration could find.
      complex(wp), allocatable :: infinite(:)
      !> The same as in `modal_result_type`.
      integer :: reason = reason_converged, certified = certified_unknown, missing = -1
      real(wp) :: locking_error = 0
      type(history_type) :: history
   contains
      !> Keeps the modes `order` alone.
      procedure :: take
      !> Drops modes, which no longer count as found.
      procedure :: drop
      !> Drops modes, and lists their eigenvalues as unlisted.
      procedure :: leave_out
      !> Appends other modes, which count as found.
      procedure :: append
   end type modes_type

contains

   !> Keeps the modes `order` alone, in this order.
   subroutine take(self, order)
      class(modes_type), intent(inout) :: self
      integer, intent(in) :: order(:)

      self%lambda = self%lambda(order)
      if (self%is_real()) then
         call take_columns(self%real_phi, order)
      else
         call take_columns(self%phi, order)
      end if
      call take_columns(self%xi, order)
      self%backward_error = self%backward_error(order)
      self%error_bound = self%error_bound(order)
      self%uncertainty = self%uncertainty(order)
      self%motion = self%motion(order)
      if (.not. allocated(self%condition)) return
      call take_columns(self%left_phi, order)
      call take_columns(self%left_xi, order)
      self%condition = self%condition(order)
   end subroutine take

   !> Drops modes, and subtracts the number of their eigenvalues from `found`.
   subroutine drop(self, dropped)
      class(modes_type), intent(inout) :: self
      logical, intent(in) :: dropped(:)
      integer :: j

      if (.not. any(dropped)) return
      self%found = self%found - eigenvalues_of(self%lambda, dropped)
      call self%take(pack([(j, j=1, size(dropped))], .not. dropped))
   end subroutine drop

   !> Drops modes whose eigenvalues may belong in the list.
   subroutine leave_out(self, dropped)
      class(modes_type), intent(inout) :: self
      logical, intent(in) :: dropped(:)

      self%unlisted = [self%unlisted, pack(self%lambda, dropped)]
      call self%drop(dropped)
   end subroutine leave_out

   !> Appends other modes, and adds their `found`.
   subroutine append(self, more)
      class(modes_type), intent(inout) :: self
      type(modes_type), intent(in) :: more

      if (size(more%lambda) == 0) return
      call append_pairs(self%eigenpairs_type, more%eigenpairs_type)
      self%backward_error = [self%backward_error, more%backward_error]
      self%error_bound = [self%error_bound, more%error_bound]
      self%uncertainty = [self%uncertainty, more%uncertainty]
      self%motion = [self%motion, more%motion]
      self%found = self%found + more%found
   end subroutine append

   !> An empty list of modes of a problem with given numbers of unknowns and constraints.
   function no_modes(unknowns, constraints) result(modes)
      integer, intent(in) :: unknowns, constraints
      type(modes_type) :: modes

      allocate (modes%lambda(0), modes%phi(unknowns, 0), modes%xi(constraints, 0), modes%motion(0))
      allocate (modes%backward_error(0), modes%error_bound(0), modes%uncertainty(0), modes%unlisted(0), modes%infinite(0))
      allocate (modes%history%converged(0), modes%history%operator_applications(0), modes%history%residual(0))
   end function no_modes

   !> Counts the eigenvalues of chosen entries of a list, which has one of each conjugate pair: two for a pair, one for a real
   !> eigenvalue.
   pure integer function eigenvalues_of(lambda, chosen) result(total)
      complex(wp), intent(in) :: lambda(:)
      logical, intent(in) :: chosen(:)

      total = count(chosen) + count(chosen .and. abs(aimag(lambda)) > 0)
   end function eigenvalues_of

   ! Permutes the columns in place, cycle by cycle, as there may be no memory for a copy: columns `order` first, the others behind.
   pure subroutine take_real_columns(block, order)
      real(wp), intent(inout) :: block(:, :)
      integer, intent(in) :: order(:)
      real(wp) :: column(size(block, 1))
      logical :: pending(size(block, 2))
      integer :: from(size(block, 2)), start, i, j

      pending = .true.
      pending(order) = .false.
      from = [order, pack([(j, j=1, size(from))], pending)]
      pending = .true.
      do start = 1, size(from)
         if (.not. pending(start) .or. from(start) == start) cycle
         column = block(:, start)
         i = start
         do while (from(i) /= start)
            block(:, i) = block(:, from(i))
            pending(i) = .false.
            i = from(i)
         end do
         block(:, i) = column
         pending(i) = .false.
      end do
   end subroutine take_real_columns

   ! Replaces a block by its columns `order`: permutes it in place if these are all of them, else copies them.
   subroutine take_complex_columns(block, order)
      complex(wp), allocatable, intent(inout) :: block(:, :)
      integer, intent(in) :: order(:)
      complex(wp), allocatable :: taken(:, :)
      integer :: j

      if (is_identity(order, size(block, 2))) return
      if (size(order) == size(block, 2)) then
         call permute(block, order)
         return
      end if
      allocate (taken(size(block, 1), size(order)))
      !$omp parallel do schedule(static) if (size(block, 1) > panel_rows)
      do j = 1, size(order)
         taken(:, j) = block(:, order(j))
      end do
      !$omp end parallel do
      call move_alloc(taken, block)
   end subroutine take_complex_columns

   ! Permutes all columns in place, a few rows at a time.
   subroutine permute(block, order)
      complex(wp), contiguous, intent(inout) :: block(:, :)
      integer, intent(in) :: order(:)
      ! Number of rows at a time: small, as there may be many columns.
      integer, parameter :: panel = 16
      complex(wp) :: rows(panel, size(order))
      integer :: first, last, j

      !$omp parallel do schedule(static) private(last, j, rows) if (size(block, 1) > panel_rows)
      do first = 1, size(block, 1), panel
         last = min(first + panel - 1, size(block, 1))
         do j = 1, size(order)
            rows(:last - first + 1, j) = block(first:last, order(j))
         end do
         block(first:last, :) = rows(:last - first + 1, :)
      end do
      !$omp end parallel do
   end subroutine permute

   ! Whether `order` is the identity.
   pure logical function is_identity(order, columns)
      integer, intent(in) :: order(:), columns
      integer :: j

      is_identity = size(order) == columns
      if (is_identity) is_identity = all(order == [(j, j=1, columns)])
   end function is_identity
end module kschur_modes
