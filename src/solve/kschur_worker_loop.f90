!> Work of the processes other than the first in a solve. This build has none; `with/mpi` has the module for several.
module kschur_worker_loop
   use kschur_processes, only: processes_type
   use kschur_shared_problem, only: shared_problem_type
   implicit none
   private
   public :: worker_loop

contains

   !> Serves requests of the first process until the solve ends: here there are none.
   subroutine worker_loop(processes, shared)
      type(processes_type), intent(inout) :: processes
      !> The problem, if its rows are distributed.
      type(shared_problem_type), intent(inout), optional :: shared

      processes%number = 1
      associate (unused => shared)
      end associate
   end subroutine worker_loop
end module kschur_worker_loop
