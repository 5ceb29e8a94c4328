!> The structured quadratic form as a transform at a real shift.
module kschur_quadratic_transform_real
   use kschur_arpack, only: arpack
   use kschur_arpack_options, only: arpack_options_type
   use kschur_deflation, only: deflation_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_krylov_real, only: krylov_schur
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type, real_linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_quadratic_real, only: quadratic_operator_type, new_quadratic_operator
   use kschur_quadratic_rows, only: end_sharing, share_operator
   use kschur_random, only: random_vector
   use kschur_ritz_real, only: decomposition_type
   use kschur_sorting, only: ascending_order
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_staircase, only: root_space_type, undamped_zeros, zero_and_infinite
   use kschur_tolerances, only: above_all_rounding
   use kschur_transform, only: transform_type
   use kschur_transposed_solver, only: transposed_real_type
   use kschur_two_level_real, only: two_level_basis_type
   implicit none
   private
   public :: quadratic_transform_type, new_quadratic_transform

#define SCALAR real(wp)
#define PARTS 2
#define SOLVER_TYPE real_linear_solver_type
#define SPARE real
#define TRANSPOSED_SOLVER_TYPE transposed_real_type
#define FROM_COMPLEX(z) real(z, wp)
#include "kschur_quadratic_transform.inc"

   ! x+ and xi+ of complex states by the real operator.
   subroutine extend_complex(operator, x, v, x_plus, xi_plus, work, error)
      type(quadratic_operator_type), intent(inout) :: operator
      complex(wp), intent(in) :: x(:, :), v(:, :)
      complex(wp), contiguous, intent(out) :: x_plus(:, :), xi_plus(:, :)
      real(wp), contiguous, intent(inout) :: work(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: multipliers(size(xi_plus, 1), 2*size(x, 2))
      integer :: k

      ! Real and imaginary parts form one block of right-hand sides.
      k = size(x, 2)
      work(:, :k, 1) = real(x, wp)
      work(:, k + 1:2*k, 1) = aimag(x)
      work(:, :k, 2) = real(v, wp)
      work(:, k + 1:2*k, 2) = aimag(v)
      call operator%extend_with_multipliers(work(:, :2*k, 1), work(:, :2*k, 2), work(:, :2*k, 3), multipliers, error)
      if (allocated(error)) return
      x_plus = cmplx(work(:, :k, 3), work(:, k + 1:2*k, 3), wp)
      xi_plus = cmplx(multipliers(:, :k), multipliers(:, k + 1:), wp)
   end subroutine extend_complex
end module kschur_quadratic_transform_real
