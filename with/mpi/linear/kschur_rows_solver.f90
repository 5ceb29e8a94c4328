!> Factors that several processes have, used by each for its rows of vectors.
module kschur_rows_solver
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: rows_solver_type

   !> In the first process; all of them solve together.
   type, extends(real_linear_solver_type) :: rows_solver_type
      class(real_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
   end type rows_solver_type

contains

   ! What is factored is the original's.
   subroutine factorize(self, matrix, structure, error)
      class(rows_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      call self%original%factorize(matrix, structure, error)
   end subroutine factorize

   subroutine solve(self, x, error)
      class(rows_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%original%solve_rows(x, error)
   end subroutine solve

   ! Of a symmetric matrix it is the same.
   subroutine solve_adjoint(self, x, error)
      class(rows_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%solve(x, error)
   end subroutine solve_adjoint
end module kschur_rows_solver
