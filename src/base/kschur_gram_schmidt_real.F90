!> Gram-Schmidt orthogonalisation of real columns.
module kschur_gram_schmidt_real
   use kschur_kinds, only: wp
   use kschur_row_sums, only: row_sums_type
   use kschur_tall_products_real, only: column_length, complete_and_combine, inner_products, project_again, &
      subtract_combinations
   implicit none
   private
   public :: orthogonalize_but_last_update, orthonormalize, orthonormalize_last

#define SCALAR real(wp)
#include "kschur_gram_schmidt.inc"
end module kschur_gram_schmidt_real
