!> Right singular vectors of small, or tall and narrow, dense matrices.
module kschur_singular_vectors
   use kschur_error, only: error_type, error_convergence, error_library, new_error
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   implicit none
   private
   public :: right_singular_vectors

contains

   !> Computes all right singular vectors, those of the largest singular value first, by LAPACK's dgesvd; the last ones span the
   !> null space.
   subroutine right_singular_vectors(matrix, singular, vectors, error)
      !> r x c
      real(wp), intent(in) :: matrix(:, :)
      !> min(r, c) singular values.
      real(wp), allocatable, intent(out) :: singular(:)
      !> c x c, in columns.
      real(wp), allocatable, intent(out) :: vectors(:, :)
      !> Where an entry is not finite, or LAPACK fails.
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: a(:, :), vt(:, :), work(:)
      real(wp) :: no_u(1, 1)
      integer :: rows, columns, info

      rows = size(matrix, 1)
      columns = size(matrix, 2)
      allocate (singular(min(rows, columns)), vectors(columns, columns))
      if (columns == 0) return
      ! LAPACK may not terminate on NaN.
      if (.not. all(abs(matrix) <= huge(1.0_wp))) then
         call new_error(error, error_convergence, &
            "the chains of the eigenvalue zero are not finite: the entries of the matrices lie too far apart; choose other units")
         return
      end if
      ! OpenBLAS reads a few entries beyond the end.
      allocate (a(max(rows, 1), columns + 1), source=0.0_wp)
      a(:rows, :columns) = matrix
      allocate (vt(columns, columns), work(10*min(rows, columns) + max(rows, columns) + 10))
      call dgesvd("N", "A", rows, columns, a, max(rows, 1), singular, no_u, 1, vt, columns, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgesvd did not converge")
      vectors = transpose(vt)
   end subroutine right_singular_vectors
end module kschur_singular_vectors
