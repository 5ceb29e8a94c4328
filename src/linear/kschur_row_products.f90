!> Sparse matrix-vector products on bare CSR arrays.
module kschur_row_products
   use kschur_kinds, only: wp
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: add_rows, add_four_rows

   !> y := y + alpha A x for one vector, summed in the order of the row.
   interface add_rows
      module procedure add_rows_real, add_rows_complex, add_rows_all_complex
   end interface add_rows

contains

   subroutine add_rows_real(row_start, column, value, alpha, x, y)
      !> As in `csr_matrix_type`.
      integer, contiguous, intent(in) :: row_start(:), column(:)
      real(wp), contiguous, intent(in) :: value(:)
      real(wp), intent(in) :: alpha
      real(wp), contiguous, intent(in) :: x(:)
      real(wp), contiguous, intent(inout) :: y(:)
      integer :: i, k
      real(wp) :: total

      !$omp parallel do schedule(static) private(k, total) if (size(y) > panel_rows)
      do i = 1, size(row_start) - 1
         total = 0
         do k = row_start(i), row_start(i + 1) - 1
            total = total + value(k)*x(column(k))
         end do
         y(i) = y(i) + alpha*total
      end do
      !$omp end parallel do
   end subroutine add_rows_real

   ! Real and imaginary sums: complex multiplication would also multiply by the zero imaginary part.
   subroutine add_rows_complex(row_start, column, value, alpha, x, y)
      integer, contiguous, intent(in) :: row_start(:), column(:)
      real(wp), contiguous, intent(in) :: value(:)
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:)
      complex(wp), contiguous, intent(inout) :: y(:)
      integer :: i, k
      real(wp) :: re, im

      !$omp parallel do schedule(static) private(k, re, im) if (size(y) > panel_rows)
      do i = 1, size(row_start) - 1
         re = 0
         im = 0
         do k = row_start(i), row_start(i + 1) - 1
            re = re + value(k)*real(x(column(k)), wp)
            im = im + value(k)*aimag(x(column(k)))
         end do
         y(i) = y(i) + alpha*cmplx(re, im, wp)
      end do
      !$omp end parallel do
   end subroutine add_rows_complex

   subroutine add_rows_all_complex(row_start, column, value, alpha, x, y)
      integer, contiguous, intent(in) :: row_start(:), column(:)
      complex(wp), contiguous, intent(in) :: value(:)
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:)
      complex(wp), contiguous, intent(inout) :: y(:)
      integer :: i, k
      complex(wp) :: total

      !$omp parallel do schedule(static) private(k, total) if (size(y) > panel_rows)
      do i = 1, size(row_start) - 1
         total = 0
         do k = row_start(i), row_start(i + 1) - 1
            total = total + value(k)*x(column(k))
         end do
         y(i) = y(i) + alpha*total
      end do
      !$omp end parallel do
   end subroutine add_rows_all_complex

   !> As `add_rows` for four vectors with the same digits; reads the matrix once.
   subroutine add_four_rows(row_start, column, value, alpha, x, y)
      integer, contiguous, intent(in) :: row_start(:), column(:)
      real(wp), contiguous, intent(in) :: value(:)
      real(wp), intent(in) :: alpha
      !> At least four columns each.
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, k
      real(wp) :: total(4)

      !$omp parallel do schedule(static) private(k, total) if (size(y, 1) > panel_rows)
      do i = 1, size(row_start) - 1
         total = 0
         do k = row_start(i), row_start(i + 1) - 1
            total = total + value(k)*x(column(k), :4)
         end do
         y(i, :4) = y(i, :4) + alpha*total
      end do
      !$omp end parallel do
   end subroutine add_four_rows
end module kschur_row_products
