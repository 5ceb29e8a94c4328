!> Parts of joint factors, of MUMPS and of LDL^T, in processes other than the first.
module kschur_factor_parts
   use kschur_joint_ldl_worker, only: ldl_instance_type, ldl_part_type
   use kschur_linear_solver, only: complex_linear_solver_type, real_linear_solver_type
   use kschur_mumps_worker, only: complex_part, mumps_instance_type, real_part
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: factor_parts_type

   !> All factorisations in use. Their numbers differ, of whichever kind they are.
   type :: factor_parts_type
      type(mumps_instance_type), allocatable :: mumps(:)
      type(ldl_instance_type), allocatable :: ldl(:)
   contains
      !> Makes a solver of the part of a factorisation.
      generic :: take => take_real, take_complex
      procedure, private :: take_real, take_complex
   end type factor_parts_type

contains

   subroutine take_real(self, number, unknowns, multipliers, processes, solver)
      class(factor_parts_type), intent(in) :: self
      !> Of the factorisation, and of rows of vectors.
      integer, intent(in) :: number, unknowns, multipliers
      type(processes_type), pointer, intent(in) :: processes
      class(real_linear_solver_type), allocatable, intent(out) :: solver
      type(ldl_part_type) :: part

      if (any(self%ldl%number == number)) then
         part%part => self%ldl(findloc(self%ldl%number, number, dim=1))%part
         allocate (solver, source=part)
      else
         allocate (solver, source=real_part(self%mumps, number, unknowns, multipliers, processes))
      end if
   end subroutine take_real

   subroutine take_complex(self, number, unknowns, multipliers, processes, solver)
      class(factor_parts_type), intent(in) :: self
      integer, intent(in) :: number, unknowns, multipliers
      type(processes_type), pointer, intent(in) :: processes
      class(complex_linear_solver_type), allocatable, intent(out) :: solver

      allocate (solver, source=complex_part(self%mumps, number, unknowns, multipliers, processes))
   end subroutine take_complex
end module kschur_factor_parts
