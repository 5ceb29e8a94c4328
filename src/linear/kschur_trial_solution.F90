!> Trial solutions measure the backward error of a solver: without pivoting there is no bound in advance.
module kschur_trial_solution
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: try_solver

#define SCALAR real(wp)
#define MATRIX_TYPE csr_matrix_type
#define SOLVER_TYPE real_linear_solver_type
#include "kschur_trial_solution.inc"
end module kschur_trial_solution
