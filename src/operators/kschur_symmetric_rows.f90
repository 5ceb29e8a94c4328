!> The operator of symmetric problems on rows of vectors, of which several processes have some each. In this build there is one;
!> `with/mpi` has the module for several.
module kschur_symmetric_rows
   use kschur_error, only: error_type
   use kschur_processes, only: processes_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   implicit none
   private
   public :: end_sharing, share_operator

contains

   !> Gives each process its part, where all of them have the factors and the mass.
   subroutine share_operator(operator, processes, error)
      class(symmetric_shift_invert_type), target, intent(inout) :: operator
      !> Who works on it; not associated: this process alone.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, unchanged => operator)
      end associate
   end subroutine share_operator

   !> Takes them back.
   subroutine end_sharing(operator)
      class(symmetric_shift_invert_type), intent(inout) :: operator

      associate (unchanged => operator)
      end associate
   end subroutine end_sharing
end module kschur_symmetric_rows
