!> Iterative solver for real sparse systems, preconditioned by single-precision factors.
module kschur_iterative_real
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_convergence, error_memory, error_usage
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_memory, only: real_bytes
   use kschur_processes, only: processes_type
   use kschur_single_factors, only: single_factors_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude
   use kschur_tolerances, only: contraction, cycle_reduction, rounding_of_sums
   implicit none
   private
   public :: iterative_real_type

#define SCALAR real(wp)
#define MATRIX_TYPE csr_matrix_type
#define PARENT_TYPE real_linear_solver_type
#define SOLVER_TYPE iterative_real_type
#define FACTORS_TYPE single_factors_type
#define ADJOINT_OF(x) x
#include "kschur_iterative.inc"
end module kschur_iterative_real
