!> Products with tall and narrow complex blocks, by panels of rows.
module kschur_tall_products_complex
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgemm, zgemv
   use kschur_row_sums, only: row_sums_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: column_length, complete_and_combine, form_combinations, inner_products, project_again, subtract_combinations

#define SCALAR complex(wp)
#define GEMV zgemv
#define GEMM zgemm
#define CONJUGATE_TRANSPOSE "C"
#include "kschur_tall_products.inc"
end module kschur_tall_products_complex
