!> The structured quadratic operator at a real shift.
module kschur_quadratic_real
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_operator, only: real_operator_type
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_random, only: random_vector
   use kschur_row_matrix, only: row_matrix_type
   use kschur_saddle, only: saddle_blocks, saddle_structure
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_tolerances, only: known_well, rounding_of_sums, singular_shift
   implicit none
   private
   public :: quadratic_operator_type, new_quadratic_operator

#define SCALAR real(wp)
#define FROM_COMPLEX(z) real(z, wp)
#define MATRIX_TYPE csr_matrix_type
#define OPERATOR_TYPE real_operator_type
#define SOLVER_TYPE real_linear_solver_type
#define SHIFTED(problem, blocks, shift) linear_combination([shift**2, shift, 1.0_wp], blocks)
#include "kschur_quadratic.inc"
end module kschur_quadratic_real
