!> Operations on the first level of two-level bases of complex quadratic operators, on columns that may be distributed over
!> processes.
module kschur_first_level_complex
   use kschur_basis_rows_complex, only: basis_rows_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_quadratic_complex, only: quadratic_operator_type
   use kschur_row_sums, only: row_sums_type
   use kschur_row_team, only: row_team_type
   implicit none
   private
   public :: append_images, append_vector, draw_state, form_parts, orthogonalize_images

#define SCALAR complex(wp)
#include "kschur_first_level.inc"
end module kschur_first_level_complex
