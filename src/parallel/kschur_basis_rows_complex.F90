!> The vectors of a complex basis.
module kschur_basis_rows_complex
   use kschur_archive, only: archive_type
   use kschur_columns_complex, only: combine_columns, move_columns, rotate_columns
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_gram_schmidt_complex, only: orthogonalize_column => orthogonalize_but_last_update, &
      orthonormalize_columns => orthonormalize, place_column => orthonormalize_last
   use kschur_kinds, only: wp
   use kschur_pages, only: prefer_large_pages
   use kschur_processes, only: processes_type
   use kschur_row_team, only: row_team_type
   use kschur_tall_products_complex, only: complete_column => complete_and_combine, form_combinations, inner_products, &
      subtract_combinations
   use kschur_text, only: text
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: basis_rows_type

#define SCALAR complex(wp)
#include "kschur_basis_rows.inc"
end module kschur_basis_rows_complex
