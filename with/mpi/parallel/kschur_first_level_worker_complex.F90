!> Serves requests on the first level of a complex two-level basis in other processes.
module kschur_first_level_worker_complex
   use kschur_basis_rows_complex, only: basis_rows_type
   use kschur_error, only: error_type
   use kschur_first_level_complex, only: append_images, append_vector, draw_state, form_parts, orthogonalize_images, to_extend, &
      to_randomize
   use kschur_kinds, only: wp, long
   use kschur_quadratic_complex, only: quadratic_operator_type
   use kschur_row_team, only: row_team_type, to_give, to_take
   implicit none
   private
   public :: serve_first_level

#define SCALAR complex(wp)
#include "kschur_first_level_worker.inc"
end module kschur_first_level_worker_complex
