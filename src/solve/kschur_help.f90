!> What all processes but the first one do of a solve. In this build there is none; `with/mpi` has the module for several.
module kschur_help
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: help

contains

   !> Waits for what the first process asks for, until it ends: there is nothing to wait for.
   subroutine help(processes)
      type(processes_type), intent(inout) :: processes

      processes%number = 1
   end subroutine help
end module kschur_help
