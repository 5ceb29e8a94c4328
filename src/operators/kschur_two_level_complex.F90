!> Two-level Krylov bases of complex quadratic operators.
module kschur_two_level_complex
   use kschur_archive, only: archive_type
   use kschur_basis_complex, only: basis_type
   use kschur_basis_rows_complex, only: basis_rows_type
   use kschur_clock, only: clock, seconds_since
   use kschur_columns_complex, only: combine_columns, move_columns, rotate_columns
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_first_level_complex, only: append_images, append_vector, draw_state, form_parts, orthogonalize_images, &
      to_extend, to_randomize
   use kschur_gram_schmidt_complex, only: orthonormalize, orthonormalize_last
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_lapack, only: zgesvd
   use kschur_quadratic_complex, only: quadratic_operator_type
   use kschur_row_team, only: row_team_type
   use kschur_text, only: text
   implicit none
   private
   public :: two_level_basis_type

#define SCALAR complex(wp)
#define OPERATOR_TYPE quadratic_operator_type
#define ADJOINT(x) conjg(transpose(x))
#define GESVD zgesvd
#define RWORK , rwork
#include "kschur_two_level.inc"
end module kschur_two_level_complex
