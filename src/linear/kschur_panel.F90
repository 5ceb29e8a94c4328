!> Dense kernels of real LDL^T on column-major blocks: own loops for small blocks, BLAS for others.
module kschur_panel
   use kschur_enclosure, only: enclosure_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   implicit none
   private
   public :: subtract_trapezoid, factor_panel, factor_rows

#define SCALAR real(wp)
#define GEMM dgemm
#define QUOTIENT(x, d) x/d
#define MODULUS(x) x
#define CALL_COST 4000
#include "kschur_panel.inc"
end module kschur_panel
