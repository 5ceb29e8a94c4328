!> Krylov bases of real vectors.
module kschur_basis_real
   use kschur_archive, only: archive_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_gram_schmidt_real, only: orthonormalize, place_last
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_lapack, only: dgemm
   use kschur_operator, only: real_operator_type
   use kschur_pages, only: prefer_large_pages
   use kschur_random, only: random_vector
   use kschur_tall_products_real, only: form_combinations
   use kschur_text, only: text
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: basis_type, plain_basis_type, combine_columns, move_columns, rotate_columns

#define SCALAR real(wp)
#define OPERATOR_TYPE real_operator_type
#define GEMM dgemm
#include "kschur_basis.inc"

   !> The combinations q y of the first columns.
   subroutine combine_columns(q, y, vectors)
      real(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), contiguous, intent(in) :: y(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      real(wp), allocatable :: parts(:, :), parts_of_y(:, :)
      integer :: k

      ! Real and imaginary parts side by side, for one reading.
      k = size(y, 2)
      allocate (vectors(size(q, 1), k), parts(size(q, 1), 2*k), parts_of_y(size(y, 1), 2*k))
      parts_of_y(:, :k) = real(y, wp)
      parts_of_y(:, k + 1:) = aimag(y)
      call form_combinations(q, parts_of_y, parts)
      vectors = cmplx(parts(:, :k), parts(:, k + 1:), wp)
   end subroutine combine_columns
end module kschur_basis_real
