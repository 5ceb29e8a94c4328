!> The problem with M, R and K transposed, whose modes are the conjugated left
!> ones of the problem, and its operator on the factors of the problem's.
module kschur_transposed
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_inner_solvers, only: inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type, real_linear_solver_type
   use kschur_pencil_transform, only: new_pencil_transform, pencil_transform_type
   use kschur_problem, only: modal_problem_type, new_modal_problem
   use kschur_quadratic_transform_complex, only: complex_quadratic_type => quadratic_transform_type, &
      new_complex_quadratic => new_quadratic_transform
   use kschur_quadratic_transform_real, only: real_quadratic_type => quadratic_transform_type, &
      new_real_quadratic => new_quadratic_transform
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type, transpose_csr
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: transpose_problem, new_transposed_transform

   ! The factors of a matrix, used as those of its transpose.
   type, extends(real_linear_solver_type) :: transposed_real_type
      class(real_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => adopt_real
      procedure :: solve => solve_real
      procedure :: solve_adjoint => solve_adjoint_real
   end type transposed_real_type

   type, extends(complex_linear_solver_type) :: transposed_complex_type
      class(complex_linear_solver_type), pointer :: original => null()
   contains
      procedure :: factorize => adopt_complex
      procedure :: solve => solve_complex
      procedure :: solve_adjoint => solve_adjoint_complex
   end type transposed_complex_type

contains

   !> (M^T, R^T, K^T, Cq): P(lambda)^T chi + Cq^T zeta = 0 makes psi = conj(chi)
   !> and eta = conj(zeta) the left vectors of the problem, psi^* P(lambda) + eta^* Cq = 0.
   subroutine transpose_problem(problem, transposed, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type), intent(out) :: transposed
      type(error_type), allocatable, intent(out) :: error

      call new_modal_problem(transposed, transpose_csr(problem%mass), transpose_csr(problem%stiffness), error, &
         transpose_csr(problem%damping), problem%constraints, kind_of=problem)
   end subroutine transpose_problem

   !> The operator of a transposed problem at the shift of the problem's own,
   !> whose factors it borrows: these must live as long. Only the damped pencils of
   !> Table 1, whose transposes are no such pencils, give way to the structured
   !> quadratic form and its own factors.
   subroutine new_transposed_transform(transform, problem, deflation, original, lambda, inner, own_factors, error)
      class(transform_type), allocatable, intent(out) :: transform
      !> The transposed problem.
      type(modal_problem_type), target, intent(in) :: problem
      !> The motions to be kept out of the iteration.
      type(deflation_type), target, intent(in) :: deflation
      !> The operator of the unsymmetric problem itself.
      class(transform_type), target, intent(in) :: original
      !> The shift (1/s).
      complex(wp), intent(in) :: lambda
      type(inner_solvers_type), intent(in) :: inner
      !> Whether a matrix had to be factored.
      logical, intent(out) :: own_factors
      type(error_type), allocatable, intent(out) :: error
      class(real_linear_solver_type), allocatable :: solver
      type(transposed_real_type), allocatable :: borrowed
      type(real_quadratic_type), allocatable :: quadratic

      own_factors = .false.
      select type (original)
      type is (real_quadratic_type)
         allocate (borrowed, quadratic)
         borrowed%original => original%operator%solver
         call move_alloc(borrowed, solver)
         call new_real_quadratic(quadratic, problem, deflation, original%operator%factors, original%operator%unit, &
            real(lambda, wp), solver, error)
         call move_alloc(quadratic, transform)
      class default
         ! gfortran 12 cannot have both quadratic types in one construct.
         call transpose_complex(transform, problem, deflation, original, lambda, inner, own_factors, error)
      end select
   end subroutine new_transposed_transform

   subroutine transpose_complex(transform, problem, deflation, original, lambda, inner, own_factors, error)
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(transform_type), target, intent(in) :: original
      complex(wp), intent(in) :: lambda
      type(inner_solvers_type), intent(in) :: inner
      logical, intent(out) :: own_factors
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      type(transposed_complex_type), allocatable :: borrowed
      type(complex_quadratic_type), allocatable :: quadratic
      type(pencil_transform_type), allocatable :: pencil

      own_factors = .false.
      allocate (borrowed)
      select type (original)
      type is (complex_quadratic_type)
         allocate (quadratic)
         borrowed%original => original%operator%solver
         call move_alloc(borrowed, solver)
         call new_complex_quadratic(quadratic, problem, deflation, original%operator%factors, original%operator%unit, lambda, &
            solver, error)
         call move_alloc(quadratic, transform)
      type is (pencil_transform_type)
         associate (given => original%operator%pencil)
            own_factors = given%is_damped()
            if (own_factors) then
               allocate (quadratic)
               allocate (solver, source=inner%complex)
               call new_complex_quadratic(quadratic, problem, deflation, given%factors, given%unit, lambda, solver, error)
               call move_alloc(quadratic, transform)
            else
               allocate (pencil)
               borrowed%original => original%operator%solver
               call move_alloc(borrowed, solver)
               call new_pencil_transform(pencil, problem, deflation, given%formulation, given%factors, given%unit, lambda, &
                  solver, error)
               call move_alloc(pencil, transform)
            end if
         end associate
      end select
   end subroutine transpose_complex

   ! The matrix is the transpose of the one that was factored.
   subroutine adopt_real(self, matrix, structure, error)
      class(transposed_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => matrix, neither => structure)
         self%null_pivots = self%original%null_pivots
         self%factor_entries = self%original%factor_entries
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
end module kschur_transposed
