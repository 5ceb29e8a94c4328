!> LDL^T over several processes. This build has one process, and the solver fails; `with/mpi` has the module for several.
module kschur_joint_ldl
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_last_analysis, only: last_analysis_type
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_processes, only: processes_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: joint_ldl_type

   !> Fails (error_usage).
   type, extends(real_linear_solver_type) :: joint_ldl_type
      type(processes_type), pointer :: processes => null()
      type(last_analysis_type), pointer :: last => null()
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
      procedure :: bound_negative
   end type joint_ldl_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(joint_ldl_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, also => matrix, too => structure)
      end associate
      call new_error(error, error_usage, &
         "this kschur was built without MPI and has one process")
   end subroutine factorize

   subroutine solve(self, x, error)
      class(joint_ldl_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, unchanged => x)
      end associate
      call new_error(error, error_usage, &
         "this kschur was built without MPI and has one process")
   end subroutine solve

   subroutine bound_negative(self, matrix, structure, least, most, error)
      class(joint_ldl_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(out) :: least, most
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, too => structure)
      end associate
      least = 0
      most = matrix%rows
      call new_error(error, error_usage, &
         "this kschur was built without MPI and has one process")
   end subroutine bound_negative
end module kschur_joint_ldl
