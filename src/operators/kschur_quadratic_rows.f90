!> Quadratic operators on distributed states. This build has one process with all rows; `with/mpi` has the module for several.
module kschur_quadratic_rows
   use kschur_error, only: error_type
   use kschur_processes, only: processes_type
   use kschur_quadratic_complex, only: complex_operator_type => quadratic_operator_type
   use kschur_quadratic_real, only: real_operator_type => quadratic_operator_type
   implicit none
   private
   public :: end_sharing, share_operator

   !> Distributes an operator for an iteration on distributed states; all processes must have parts of factors, mass and damping.
   interface share_operator
      module procedure share_real, share_complex
   end interface share_operator

   !> Ends the distribution.
   interface end_sharing
      module procedure end_real, end_complex
   end interface end_sharing

contains

   subroutine share_real(operator, processes, error)
      class(real_operator_type), target, intent(inout) :: operator
      !> Processes of the solve; not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, unchanged => operator)
      end associate
   end subroutine share_real

   subroutine end_real(operator)
      class(real_operator_type), intent(inout) :: operator

      associate (unchanged => operator)
      end associate
   end subroutine end_real

   subroutine share_complex(operator, processes, error)
      class(complex_operator_type), target, intent(inout) :: operator
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, unchanged => operator)
      end associate
   end subroutine share_complex

   subroutine end_complex(operator)
      class(complex_operator_type), intent(inout) :: operator

      associate (unchanged => operator)
      end associate
   end subroutine end_complex
end module kschur_quadratic_rows
