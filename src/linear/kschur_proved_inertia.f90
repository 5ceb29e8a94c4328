!> The inertia of a real symmetric matrix, proved by LDL^T without pivoting.
!>
!> In floating-point arithmetic L D L^T = A + E, where |E| <= c u |L||D||L|^T, u the unit roundoff and c the number of
!> terms in a row of L and a few more (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., lemma 8.4 and
!> section 9.3). What E may do is less than a diagonal matrix S does,
!>
!>    |x^T E x| <= u sum_p |d_p| (sum_k sqrt(c_k) |l_kp| |x_k|)^2 <= x^T S x,
!>    S_k = u c_k ((1 + sqrt(e_k)) |d_k| + sum_{p<k} (e_p + sqrt(e_p)) |d_p| l_kp^2),
!>
!> by the inequality of Cauchy and Schwarz, e_p the number of entries below the diagonal of column p; and S_k is known
!> when pivot k is. So A is factored twice at once, S taken from the pivots of one copy and added to those of the other:
!> the one has the inertia of a matrix below A, the other of one above (Sylvester). Where both have the same number of
!> negative pivots, A has so many negative eigenvalues, and none is zero.
module kschur_proved_inertia
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: bound_negative_eigenvalues

contains

   !> The number of negative eigenvalues of a symmetric matrix is `least` or more, and `most` or less.
   subroutine bound_negative_eigenvalues(matrix, symbolic, least, most, error)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(out) :: least, most
      type(error_type), allocatable, intent(out) :: error
      ! Those of the lower copy and of the upper one.
      real(wp), allocatable :: pivot(:, :)
      integer :: status

      least = 0
      most = matrix%rows
      allocate (pivot(2, matrix%rows), stat=status)
      if (status == 0) call eliminate(matrix, symbolic, pivot, status)
      if (status /= 0) call new_error(error, error_memory, "no memory for the LDL^T factors")
      ! What has overflowed proves nothing.
      if (allocated(error)) return
      if (.not. all(abs(pivot) <= huge(1.0_wp))) return
      least = count(pivot(2, :) < 0)
      most = count(.not. pivot(1, :) > 0)
   end subroutine bound_negative_eigenvalues

   ! Row by row: row k of L solves a triangular system with the rows before it.
   subroutine eliminate(matrix, symbolic, pivot, status)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      real(wp), contiguous, intent(out) :: pivot(:, :)
      !> Not zero where there is no memory.
      integer, intent(out) :: status
      real(wp), parameter :: unit = epsilon(1.0_wp)/2
      ! Terms of second order, and the rounding of the bound itself.
      real(wp), parameter :: caution = 1.01_wp
      ! Columns of L, side by side of both copies.
      real(wp), allocatable :: lower(:, :)
      integer(c_int), allocatable :: row(:)
      real(wp), allocatable :: y(:, :), weight(:)
      integer, allocatable :: next(:), flag(:), pattern(:)
      real(wp) :: z(2), multiplier(2), d(2), rounding(2)
      integer :: n, top, first, i, j, k

      n = matrix%rows
      associate (entries => symbolic%start(n + 1))
         allocate (lower(2, entries), row(entries), y(2, n), weight(n), next(n), flag(n), pattern(n), stat=status)
      end associate
      if (status /= 0) return
      next = symbolic%start(:n) + 1
      weight = symbolic%entries + sqrt(real(symbolic%entries, wp))
      y = 0
      flag = 0
      do k = 1, n
         call scatter_row(matrix, symbolic, k, y, flag, pattern, top)
         d = y(:, k)
         y(:, k) = 0
         rounding = 0
         do j = top, n
            i = pattern(j)
            z = y(:, i)
            y(:, i) = 0
            first = symbolic%start(i) + 1
            call subtract(next(i) - first, row(first:), lower(:, first:), z, y)
            multiplier = z/pivot(:, i)
            d = d - multiplier*z
            rounding = rounding + weight(i)*abs(multiplier*z)
            row(next(i)) = k
            lower(:, next(i)) = multiplier
            next(i) = next(i) + 1
         end do
         rounding = rounding + (1 + sqrt(real(symbolic%entries(k), wp)))*abs(d)
         rounding = caution*unit*(n - top + 5)*rounding + n*tiny(1.0_wp)
         pivot(:, k) = d + [-rounding(1), rounding(2)]
      end do
   end subroutine eliminate

   ! What an entry of row k of L, times its pivot, makes of the others in its row.
   pure subroutine subtract(entries, row, column, z, y)
      integer, intent(in) :: entries
      integer(c_int), intent(in) :: row(*)
      real(wp), intent(in) :: column(2, *), z(2)
      real(wp), intent(inout) :: y(2, *)
      real(wp) :: first, second
      integer :: i, p

      ! So written, the compiler makes one instruction of both.
      do p = 1, entries
         i = row(p)
         first = y(1, i) - column(1, p)*z(1)
         second = y(2, i) - column(2, p)*z(2)
         y(1, i) = first
         y(2, i) = second
      end do
   end subroutine subtract

   ! Row k of A to y, for both copies, and to pattern(top:) where row k of L has entries, descendants in the elimination
   ! tree first.
   subroutine scatter_row(matrix, symbolic, k, y, flag, pattern, top)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: k
      real(wp), intent(inout) :: y(2, *)
      integer, intent(inout) :: flag(*), pattern(*)
      integer, intent(out) :: top
      integer :: i, p, length

      top = matrix%rows + 1
      flag(k) = k
      associate (own => symbolic%order(k) + 1)
         do p = matrix%row_start(own), matrix%row_start(own + 1) - 1
            i = symbolic%position(matrix%column(p)) + 1
            if (i > k) cycle
            y(:, i) = y(:, i) + matrix%value(p)
            length = 0
            do while (flag(i) /= k)
               length = length + 1
               pattern(length) = i
               flag(i) = k
               i = symbolic%parent(i) + 1
            end do
            do while (length > 0)
               top = top - 1
               pattern(top) = pattern(length)
               length = length - 1
            end do
         end do
      end associate
   end subroutine scatter_row
end module kschur_proved_inertia
