!> The processes of the program. This build has one; `with/mpi` has the module for several.
module cli_processes
   use kschur, only: error_type, modal_options_type, read_hdf5_shared_problem, shared_problem_type
   implicit none
   private
   public :: end_processes, gather_processes, read_together, start_processes

contains

   !> Starts the processes of the program. Returns in the first one only, or with an error if memory is short.
   subroutine start_processes(error)
      type(error_type), allocatable, intent(out) :: error

      associate (none => error)
      end associate
   end subroutine start_processes

   !> Reads a problem in an HDF5 file collectively, each process its rows.
   subroutine read_together(path, shared, error, symmetric)
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> How symmetric matrices are stored in it.
      integer, intent(in) :: symmetric

      call read_hdf5_shared_problem(shared, path, error, trial=.true., symmetric=symmetric)
   end subroutine read_together

   !> Call before each solve: lets all processes take part in it.
   subroutine gather_processes(options)
      type(modal_options_type), intent(inout) :: options

      if (allocated(options%communicator)) deallocate (options%communicator)
   end subroutine gather_processes

   !> Ends the other processes with this exit status.
   subroutine end_processes(status)
      integer, intent(in) :: status

      associate (unused => status)
      end associate
   end subroutine end_processes
end module cli_processes
