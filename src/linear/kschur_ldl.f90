!> Direct solutions with real symmetric definite matrices by the simplicial
!> LDL^T of SuiteSparse, in the order of its AMD: no pivoting and no fronts,
!> which pays where the factor is hardly denser than the matrix.
!> T. A. Davis, Algorithm 849, ACM TOMS 31 (2005), doi 10.1145/1114268.1114277.
module kschur_ldl
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_memory, error_singular, error_usage
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: analyze, symbolic_type
   use kschur_text, only: text
   implicit none
   private
   public :: ldl_real_type

   !> Sparse LDL^T without pivoting. Refuses, with the reason as the error's
   !> message, what it is not made for: unsymmetric matrices and multipliers
   !> (error_usage), pivots of both signs (error_library) or that are zero to
   !> rounding (error_singular).
   type, extends(real_linear_solver_type) :: ldl_real_type
      !> A matrix whose factor has more entries a column is refused (error_library).
      integer :: most_entries = huge(1)
      !> Takes multipliers with negative diagonal entries: their pivots have to come out negative, all others positive.
      logical :: quasi_definite = .false.
      ! The matrix has been factored.
      logical, private :: factored = .false.
      ! Unknown order(k) is the k-th to be eliminated.
      integer(c_int), allocatable, private :: order(:)
      ! Column k of L, without its unit diagonal, holds the entries start(k) ... start(k+1)-1.
      integer(c_int), allocatable, private :: start(:), row(:)
      real(c_double), allocatable, private :: lower(:), pivot(:)
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
   end type ldl_real_type

   ! Right-hand sides that share one pass over L.
   integer, parameter :: block = 4

   interface
      integer(c_int) function ldl_numeric(n, start, row, value, lower_start, parent, entries, lower_row, lower, &
         pivot, work, pattern, flag, order, position) bind(C)
         import :: c_double, c_int
         integer(c_int), value :: n
         integer(c_int), intent(in) :: start(*), row(*), lower_start(*), parent(*), order(*), position(*)
         real(c_double), intent(in) :: value(*)
         integer(c_int), intent(out) :: entries(*), lower_row(*), pattern(*), flag(*)
         real(c_double), intent(out) :: lower(*), pivot(*), work(*)
      end function ldl_numeric
   end interface

contains

   subroutine factorize(self, matrix, structure, error)
      class(ldl_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(symbolic_type) :: symbolic
      integer(long) :: started

      call release(self)
      if (matrix%rows /= matrix%columns) then
         call new_error(error, error_usage, "only a square matrix can be factored")
      else if (.not. structure%symmetric) then
         call new_error(error, error_usage, "the matrix is unsymmetric")
      else if (structure%multipliers > 0 .and. .not. self%quasi_definite) then
         call new_error(error, error_usage, "the matrix has "//text(structure%multipliers)//" multipliers")
      end if
      if (allocated(error)) return

      started = clock()
      call analyze(matrix, structure, self%most_entries, symbolic, error)
      self%analyze_seconds = seconds_since(started)
      if (.not. allocated(error)) then
         started = clock()
         call eliminate(self, matrix, structure%multipliers, symbolic, error)
         self%factorize_seconds = seconds_since(started)
      end if
      if (allocated(error)) call release(self)
      self%factored = .not. allocated(error)
   end subroutine factorize

   ! L and D; checks the signs of D.
   subroutine eliminate(self, matrix, multipliers, symbolic, error)
      class(ldl_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: multipliers
      type(symbolic_type), intent(in) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      ! Below this part of its diagonal entry a pivot is what rounding left. Quasi-definite factors grow
      ! with the reciprocal of the smallest.
      real(wp), parameter :: rounding = 64*epsilon(1.0_wp), unstable = 1.0e-12_wp
      integer(c_int), allocatable :: entries(:), pattern(:), flag(:)
      real(c_double), allocatable :: work(:), diagonal(:)
      integer :: n, done, status
      logical :: singular

      n = matrix%rows
      associate (most => symbolic%start(n + 1))
         allocate (self%row(most), self%lower(most), self%pivot(n), work(n), diagonal(n), entries(n), pattern(n), flag(n), &
            stat=status)
      end associate
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      done = ldl_numeric(n, matrix%row_start - 1, matrix%column - 1, matrix%value, symbolic%start, symbolic%parent, &
         entries, self%row, self%lower, self%pivot, work, pattern, flag, symbolic%order, symbolic%position)
      self%factor_entries = symbolic%factor_entries
      self%order = symbolic%order + 1
      self%start = symbolic%start + 1
      self%row = self%row + 1
      diagonal = matrix%diagonal()
      diagonal = diagonal(self%order)
      singular = done < n
      if (.not. singular) singular = .not. all(abs(self%pivot) > merge(unstable, rounding, self%quasi_definite)*abs(diagonal))
      if (singular) then
         call new_error(error, error_singular, "a pivot of the matrix is zero")
      else if (self%quasi_definite .and. any(self%pivot > 0 .eqv. self%order > n - multipliers)) then
         call new_error(error, error_library, "the matrix is not quasi-definite")
      else if (.not. self%quasi_definite .and. any(self%pivot > 0) .and. any(self%pivot < 0)) then
         call new_error(error, error_library, "the matrix is indefinite")
      end if
      if (allocated(error)) return
      self%null_pivots = 0
      self%negative_pivots = count(self%pivot < 0)
      self%description = "ldl: "//trim(merge("quasi-definite    ", "symmetric definite", self%quasi_definite))//", "// &
         text(symbolic%entries_a_column())//" entries a column"
   end subroutine eliminate

   subroutine no_memory(error)
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_memory, "no memory for the LDL^T factors")
   end subroutine no_memory

   subroutine release(self)
      class(ldl_real_type), intent(inout) :: self

      self%factored = .false.
      if (allocated(self%order)) deallocate (self%order)
      if (allocated(self%start)) deallocate (self%start)
      if (allocated(self%row)) deallocate (self%row)
      if (allocated(self%lower)) deallocate (self%lower)
      if (allocated(self%pivot)) deallocate (self%pivot)
   end subroutine release

   subroutine solve(self, x, error)
      class(ldl_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: y(:)
      integer :: first, n, status
      integer(long) :: started

      if (.not. self%factored) then
         call new_error(error, error_usage, "a matrix must be factored before it can be solved with")
         return
      end if
      n = size(self%order)
      if (size(x, 1) /= n) then
         call new_error(error, error_usage, "the right-hand sides do not fit the factored matrix")
         return
      end if
      started = clock()
      allocate (y(n*min(size(x, 2), block)), stat=status)
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      associate (order => self%order, start => self%start, row => self%row, lower => self%lower, pivot => self%pivot)
         do first = 1, size(x, 2) - block + 1, block
            call substitute_block(n, order, start, row, lower, pivot, x(:, first:first + block - 1), y)
         end do
         do first = first, size(x, 2)
            call substitute_one(n, order, start, row, lower, pivot, x(:, first), y)
         end do
      end associate
      self%solve_seconds = self%solve_seconds + seconds_since(started)
   end subroutine solve

   ! x := A^{-1} x; y is workspace. Written twice, because the inner loops are
   ! fast only where the compiler knows their width.
   subroutine substitute_one(n, order, start, row, lower, pivot, x, y)
      integer, intent(in) :: n
      integer(c_int), intent(in) :: order(n), start(n + 1), row(*)
      real(wp), intent(in) :: lower(*), pivot(n)
      real(wp), intent(inout) :: x(n)
      real(wp), intent(out) :: y(n)
      real(wp) :: z
      integer :: j, k

      y = x(order)
      do j = 1, n
         z = y(j)
         do k = start(j), start(j + 1) - 1
            y(row(k)) = y(row(k)) - lower(k)*z
         end do
         y(j) = z/pivot(j)
      end do
      do j = n, 1, -1
         z = y(j)
         do k = start(j), start(j + 1) - 1
            z = z - lower(k)*y(row(k))
         end do
         y(j) = z
      end do
      x(order) = y
   end subroutine substitute_one

   ! The same for a block: y holds the right-hand sides of an unknown side by side.
   subroutine substitute_block(n, order, start, row, lower, pivot, x, y)
      integer, intent(in) :: n
      integer(c_int), intent(in) :: order(n), start(n + 1), row(*)
      real(wp), intent(in) :: lower(*), pivot(n)
      real(wp), intent(inout) :: x(n, block)
      real(wp), intent(out) :: y(block, n)
      real(wp) :: z(block)
      integer :: j, k

      do j = 1, n
         y(:, j) = x(order(j), :)
      end do
      do j = 1, n
         z = y(:, j)
         do k = start(j), start(j + 1) - 1
            y(:, row(k)) = y(:, row(k)) - lower(k)*z
         end do
         y(:, j) = z/pivot(j)
      end do
      do j = n, 1, -1
         z = y(:, j)
         do k = start(j), start(j + 1) - 1
            z = z - lower(k)*y(:, row(k))
         end do
         y(:, j) = z
         x(order(j), :) = z
      end do
   end subroutine substitute_block
end module kschur_ldl
