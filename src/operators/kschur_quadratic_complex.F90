!> The structured quadratic operator at a complex shift.
module kschur_quadratic_complex
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_operator, only: complex_operator_type
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_random, only: random_vector
   use kschur_row_matrix, only: row_matrix_type
   use kschur_saddle, only: saddle_blocks, saddle_structure, shifted_saddle
   use kschur_sparse, only: csr_matrix_type, complex_csr_matrix_type
   use kschur_tolerances, only: known_well, rounding_of_sums, singular_shift
   implicit none
   private
   public :: quadratic_operator_type, new_quadratic_operator

#define SCALAR complex(wp)
#define FROM_COMPLEX(z) z
#define MATRIX_TYPE complex_csr_matrix_type
#define OPERATOR_TYPE complex_operator_type
#define SOLVER_TYPE complex_linear_solver_type
#define SHIFTED(problem, blocks, shift) shifted_saddle(problem, blocks, shift)
#include "kschur_quadratic.inc"
end module kschur_quadratic_complex
