!> Dense kernels of complex LDL^T on column-major blocks: own loops for small blocks, BLAS for others.
module kschur_panel_complex
   use kschur_enclosure, only: enclosure_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgemm
   implicit none
   private
   public :: subtract_trapezoid, factor_panel, factor_rows

#define SCALAR complex(wp)
#define GEMM zgemm
#define QUOTIENT(x, d) x*(1/d)
#define MODULUS(x) abs(x)
#define CALL_COST 1000
#include "kschur_panel.inc"
end module kschur_panel_complex
