!> Krylov bases of complex vectors.
module kschur_basis_complex
   use kschur_archive, only: archive_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_gram_schmidt_complex, only: orthonormalize, place_last
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_lapack, only: zgemm
   use kschur_operator, only: complex_operator_type
   use kschur_pages, only: prefer_large_pages
   use kschur_random, only: random_vector
   use kschur_tall_products_complex, only: form_combinations
   use kschur_text, only: text
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: basis_type, plain_basis_type, combine_columns, move_columns, rotate_columns

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#define GEMM zgemm
#include "kschur_basis.inc"

   !> The combinations q y of the first columns.
   subroutine combine_columns(q, y, vectors)
      complex(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), contiguous, intent(in) :: y(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)

      allocate (vectors(size(q, 1), size(y, 2)))
      call form_combinations(q, y, vectors)
   end subroutine combine_columns
end module kschur_basis_complex
