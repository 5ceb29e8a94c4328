!> Krylov-Schur for complex operators.
module kschur_krylov_complex
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_lapack, only: zgemm, zgemv
   use kschur_monitor, only: monitor_type
   use kschur_operator, only: complex_operator_type
   use kschur_projected, only: schur_form, move_to_head, triangular_eigenvectors
   use kschur_random, only: random_vector
   use kschur_result, only: reason_cancelled, reason_converged, reason_fewer_modes, reason_max_restarts
   use kschur_selection, only: selection_type, order_by_preference
   use kschur_text, only: text
   implicit none
   private
   public :: krylov_schur

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#define GEMM zgemm
#define GEMV zgemv
#define CONJUGATE_TRANSPOSE "C"
#include "kschur_krylov.inc"
end module kschur_krylov_complex
