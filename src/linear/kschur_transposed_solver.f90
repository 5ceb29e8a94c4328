!> Solver that uses the factors of a matrix for its transpose.
module kschur_transposed_solver
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type, real_linear_solver_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   implicit none
   private
   public :: transposed_complex_type, transposed_real_type

   !> `factorize` does nothing: the matrix must be the transpose of the one that `original` has factored.
   type, extends(real_linear_solver_type) :: transposed_real_type
      class(real_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => adopt_real
      procedure :: solve => solve_real
      procedure :: solve_adjoint => solve_adjoint_real
   end type transposed_real_type

   !> As above, complex.
   type, extends(complex_linear_solver_type) :: transposed_complex_type
      class(complex_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => adopt_complex
      procedure :: solve => solve_complex
      procedure :: solve_adjoint => solve_adjoint_complex
   end type transposed_complex_type

contains

   ! Takes over the statistics of the factors. Does not check that the matrix is the transpose of theirs.
   subroutine adopt_real(self, matrix, structure, error)
      class(transposed_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => matrix, neither => structure)
         self%null_pivots = self%original%null_pivots
         self%factor_entries = self%original%factor_entries
         self%factor_bytes = self%original%factor_bytes
      end associate
   end subroutine adopt_real

   subroutine solve_real(self, x, error)
      class(transposed_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%original%solve_adjoint(x, error)
   end subroutine solve_real

   subroutine solve_adjoint_real(self, x, error)
      class(transposed_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%original%solve(x, error)
   end subroutine solve_adjoint_real

   subroutine adopt_complex(self, matrix, structure, error)
      class(transposed_complex_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => matrix, neither => structure)
         self%null_pivots = self%original%null_pivots
         self%factor_entries = self%original%factor_entries
         self%factor_bytes = self%original%factor_bytes
      end associate
   end subroutine adopt_complex

   ! A^{-T} b is the conjugate of A^{-*} conj(b).
   subroutine solve_complex(self, x, error)
      class(transposed_complex_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      x = conjg(x)
      call self%original%solve_adjoint(x, error)
      x = conjg(x)
   end subroutine solve_complex

   subroutine solve_adjoint_complex(self, x, error)
      class(transposed_complex_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      x = conjg(x)
      call self%original%solve(x, error)
      x = conjg(x)
   end subroutine solve_adjoint_complex
end module kschur_transposed_solver
