!> Products with tall and narrow real blocks, by panels of rows.
module kschur_tall_products_real
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dgemv
   use kschur_row_sums, only: row_sums_type
   use kschur_tall_panels, only: panel_complete, panel_inner, panel_project
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: column_length, complete_and_combine, form_combinations, inner_products, project_again, subtract_combinations

#define SCALAR real(wp)
#define GEMV dgemv
#define GEMM dgemm
#define CONJUGATE_TRANSPOSE "T"
#include "kschur_tall_products.inc"
end module kschur_tall_products_real
