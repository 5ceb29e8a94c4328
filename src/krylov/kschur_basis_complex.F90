!> Krylov bases of complex vectors.
module kschur_basis_complex
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: zgemm, zgemv
   use kschur_operator, only: complex_operator_type
   use kschur_random, only: random_vector
   use kschur_text, only: text
   implicit none
   private
   public :: basis_type, plain_basis_type, orthogonalize, rotate_columns, combine_columns

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#define GEMM zgemm
#define GEMV zgemv
#define CONJUGATE_TRANSPOSE "C"
#include "kschur_basis.inc"

   !> The combinations q y of the first columns.
   subroutine combine_columns(q, y, vectors)
      complex(wp), contiguous, intent(in) :: q(:, :)
      complex(wp), contiguous, intent(in) :: y(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)

      allocate (vectors(size(q, 1), size(y, 2)))
      if (size(y) > 0) call zgemm("N", "N", size(q, 1), size(y, 2), size(y, 1), one, q, size(q, 1), &
         y, size(y, 1), zero, vectors, size(q, 1))
   end subroutine combine_columns
end module kschur_basis_complex
