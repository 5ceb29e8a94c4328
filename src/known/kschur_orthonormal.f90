!> Gram-Schmidt orthogonalization of blocks of real vectors, against others and within the block.
module kschur_orthonormal
   use kschur_kinds, only: wp, long
   use kschur_random, only: random_vector
   use kschur_row_sums, only: row_sums_type
   use kschur_tall_products_real, only: column_length, inner_products, subtract_combinations
   use kschur_tolerances, only: dependent
   implicit none
   private
   public :: lengths, orthonormalize, subtract

contains

   !> Orthonormalizes the columns of X against a basis and against each other, by Gram-Schmidt with reorthogonalization in the
   !> inner product of the first n rows; the other rows are combined alike. Drops a column that is linearly dependent to rounding
   !> or, with a state of random numbers, replaces it by a random vector: inverse iteration may amplify one vector so much that
   !> others are lost in it.
   subroutine orthonormalize(basis, n, x, state)
      !> Orthonormal in its first n rows.
      real(wp), contiguous, intent(in) :: basis(:, :)
      integer, intent(in) :: n
      real(wp), allocatable, intent(inout) :: x(:, :)
      !> State of the random numbers. Absent: dependent columns are dropped.
      integer(long), optional, intent(inout) :: state
      ! Two passes suffice; the third serves a random replacement.
      integer, parameter :: passes = 3
      integer :: i, pass

      do i = 1, size(x, 2)
         do pass = 1, passes
            x(:, i) = x(:, i)/max(column_length(x(:, i:i), n), tiny(1.0_wp))
            call subtract(basis, basis, x(:, i:i), n)
            call subtract(x(:, :i - 1), x(:, :i - 1), x(:, i:i), n)
            if (.not. column_length(x(:, i:i), n) < dependent) cycle
            x(:, i) = 0
            if (present(state)) call random_vector(state, x(:n, i))
         end do
         x(:, i) = x(:, i)/max(column_length(x(:, i:i), n), tiny(1.0_wp))
      end do
      if (.not. present(state)) x = x(:, pack([(i, i=1, size(x, 2))], lengths(x, n) > dependent))
   end subroutine orthonormalize

   !> Projects X := X - B A^T X, for n x k blocks A and B and a n x p block X.
   subroutine subtract(a, b, x, rows, sums)
      real(wp), contiguous, intent(in) :: a(:, :), b(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      !> Number of leading rows of A and X in the inner products. Absent: all.
      integer, optional, intent(in) :: rows
      !> Sums over the processes that share the rows. Absent: one process has all.
      type(row_sums_type), optional, intent(in) :: sums
      real(wp) :: coefficients(size(a, 2), size(x, 2))

      if (size(a, 2) == 0) return
      call inner_products(a, x, coefficients, rows, sums)
      call subtract_combinations(b, coefficients, x)
   end subroutine subtract

   !> Euclidean norms of the first n rows of each column.
   function lengths(x, n)
      real(wp), contiguous, intent(in) :: x(:, :)
      integer, intent(in) :: n
      real(wp) :: lengths(size(x, 2))
      integer :: j

      lengths = [(column_length(x(:, j:j), n), j=1, size(x, 2))]
   end function lengths
end module kschur_orthonormal
