!> Trial solutions measure the backward error of a complex solver: without pivoting there is no bound in advance.
module kschur_trial_solution_complex
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: complex_csr_matrix_type
   implicit none
   private
   public :: try_solver

#define SCALAR complex(wp)
#define MATRIX_TYPE complex_csr_matrix_type
#define SOLVER_TYPE complex_linear_solver_type
#include "kschur_trial_solution.inc"
end module kschur_trial_solution_complex
