!> Krylov bases of real vectors.
module kschur_basis_real
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_gram_schmidt_real, only: orthonormalize, place_last
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_lapack, only: dgemm
   use kschur_operator, only: real_operator_type
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
      real(wp), allocatable :: part(:, :), part_of_y(:, :)
      complex(wp), parameter :: units(2) = [(1.0_wp, 0.0_wp), (0.0_wp, 1.0_wp)]
      integer :: i

      allocate (vectors(size(q, 1), size(y, 2)), source=(0.0_wp, 0.0_wp))
      if (size(y) == 0) return
      allocate (part(size(q, 1), size(y, 2)), part_of_y(size(y, 1), size(y, 2)))
      do i = 1, 2
         part_of_y = real(y/units(i), wp)
         call form_combinations(q, part_of_y, part)
         vectors = vectors + units(i)*part
      end do
   end subroutine combine_columns
end module kschur_basis_real
