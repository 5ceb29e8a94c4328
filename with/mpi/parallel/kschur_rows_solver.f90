!> Solvers in the first process that use joint factors for collective solves with distributed vectors.
module kschur_rows_solver
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type, real_linear_solver_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   implicit none
   private
   public :: complex_rows_solver_type, real_rows_solver_type

   !> `solve` is `solve_rows` of `original`, which has the factors.
   type, extends(real_linear_solver_type) :: real_rows_solver_type
      class(real_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => factorize_real
      procedure :: solve => solve_real
      procedure :: solve_adjoint => refuse_real
   end type real_rows_solver_type

   !> As above, complex.
   type, extends(complex_linear_solver_type) :: complex_rows_solver_type
      class(complex_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => factorize_complex
      procedure :: solve => solve_complex
      procedure :: solve_adjoint => refuse_complex
   end type complex_rows_solver_type

contains

   ! The factors are those of `original`.
   subroutine factorize_real(self, matrix, structure, error)
      class(real_rows_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      call self%original%factorize(matrix, structure, error)
   end subroutine factorize_real

   subroutine solve_real(self, x, error)
      class(real_rows_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%original%solve_rows(x, error)
   end subroutine solve_real

   subroutine refuse_real(self, x, error)
      class(real_rows_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, unchanged => x)
      end associate
      call new_error(error, error_usage, "rows of vectors are not solved for with the adjoint")
   end subroutine refuse_real

   subroutine factorize_complex(self, matrix, structure, error)
      class(complex_rows_solver_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      call self%original%factorize(matrix, structure, error)
   end subroutine factorize_complex

   subroutine solve_complex(self, x, error)
      class(complex_rows_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%original%solve_rows(x, error)
   end subroutine solve_complex

   subroutine refuse_complex(self, x, error)
      class(complex_rows_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, unchanged => x)
      end associate
      call new_error(error, error_usage, "rows of vectors are not solved for with the adjoint")
   end subroutine refuse_complex
end module kschur_rows_solver
