!> Iterative solver for complex sparse systems, preconditioned by single-precision factors.
module kschur_iterative_complex
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_convergence, error_memory, error_usage
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_mumps_single_complex, only: mumps_single_complex_type
   use kschur_memory, only: real_bytes
   use kschur_processes, only: processes_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_text, only: magnitude
   use kschur_tolerances, only: contraction, cycle_reduction, rounding_of_sums
   implicit none
   private
   public :: iterative_complex_type

#define SCALAR complex(wp)
#define MATRIX_TYPE complex_csr_matrix_type
#define PARENT_TYPE complex_linear_solver_type
#define SOLVER_TYPE iterative_complex_type
#define FACTORS_TYPE mumps_single_complex_type
#define ADJOINT_OF(x) conjg(x)
#include "kschur_iterative.inc"
end module kschur_iterative_complex
