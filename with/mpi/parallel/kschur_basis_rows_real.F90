!> The vectors of a real basis, whose rows several processes may share.
module kschur_basis_rows_real
   use kschur_archive, only: archive_type
   use kschur_basis_requests, only: real_basis, to_choose, to_combine, to_complete, to_form, to_move, to_orthogonalize, &
      to_orthonormalize, to_read, to_release, to_reserve, to_rotate, to_store, to_subtract, to_take_out
   use kschur_columns_real, only: combine_columns, move_columns, rotate_columns
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_gram_schmidt_real, only: orthogonalize_column => orthogonalize_but_last_update, &
      orthonormalize_columns => orthonormalize
   use kschur_kinds, only: wp
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_pages, only: prefer_large_pages
   use kschur_processes, only: are_several, processes_type, spread_error, request_basis
   use kschur_row_exchange, only: gather, scatter, send_to_all
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_row_sums, only: row_sums_type
   use kschur_row_team, only: row_team_type
   use kschur_tall_products_real, only: complete_column => complete_and_combine, form_combinations, inner_products, &
      subtract_combinations
   use kschur_text, only: text
   implicit none
   private
   public :: basis_rows_type

#define SCALAR real(wp)
#define KIND_OF_BASIS real_basis
#include "kschur_basis_rows.inc"
#include "kschur_basis_products.inc"
end module kschur_basis_rows_real
