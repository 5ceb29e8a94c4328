!> What all processes but the first one do of a solve. In this build there is none; `with/mpi` has the module for several.
module kschur_worker_loop
   use kschur_processes, only: processes_type
   use kschur_shared_problem, only: shared_problem_type
   implicit none
   private
   public :: worker_loop

contains

   !> Waits for what the first process asks for, until it ends: there is nothing to wait for.
   subroutine worker_loop(processes, shared)
      type(processes_type), intent(inout) :: processes
      !> The problem, where its rows are shared.
      type(shared_problem_type), intent(inout), optional :: shared

      processes%number = 1
      associate (unused => shared)
      end associate
   end subroutine worker_loop
end module kschur_worker_loop
