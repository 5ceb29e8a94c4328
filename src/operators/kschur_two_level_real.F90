!> Two-level Krylov bases of real quadratic operators.
module kschur_two_level_real
   use kschur_archive, only: archive_type
   use kschur_basis_real, only: basis_type
   use kschur_basis_rows_real, only: basis_rows_type
   use kschur_clock, only: clock, seconds_since
   use kschur_columns_real, only: combine_columns, move_columns, rotate_columns
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_first_level_real, only: append_images, append_vector, draw_state, form_parts, orthogonalize_images, &
      to_extend, to_randomize
   use kschur_gram_schmidt_real, only: orthonormalize, orthonormalize_last
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_lapack, only: dgesvd
   use kschur_quadratic_real, only: quadratic_operator_type
   use kschur_row_team, only: row_team_type
   use kschur_text, only: text
   implicit none
   private
   public :: two_level_basis_type

#define SCALAR real(wp)
#define OPERATOR_TYPE quadratic_operator_type
#define ADJOINT(x) transpose(x)
#define GESVD dgesvd
#include "kschur_two_level.inc"
end module kschur_two_level_real
