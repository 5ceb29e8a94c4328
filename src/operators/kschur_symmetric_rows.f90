!> Operator of symmetric problems on distributed vectors. This build has one process with all rows; `with/mpi` has the module
!> for several.
module kschur_symmetric_rows
   use kschur_error, only: error_type
   use kschur_processes, only: processes_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   implicit none
   private
   public :: end_sharing, share_operator

contains

   !> Distributes an operator for an iteration on distributed vectors; all processes must have parts of the factors and the mass.
   subroutine share_operator(operator, processes, error)
      class(symmetric_shift_invert_type), target, intent(inout) :: operator
      !> Processes of the solve; not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, unchanged => operator)
      end associate
   end subroutine share_operator

   !> Ends the distribution.
   subroutine end_sharing(operator)
      class(symmetric_shift_invert_type), intent(inout) :: operator

      associate (unchanged => operator)
      end associate
   end subroutine end_sharing
end module kschur_symmetric_rows
