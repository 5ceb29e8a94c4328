!> The processes that the program runs in. In this build there is one; `with/mpi` has the module for several.
module cli_processes
   use kschur, only: error_type, modal_options_type, read_hdf5_shared_problem, shared_problem_type
   implicit none
   private
   public :: end_processes, gather_processes, read_together, start_processes

contains

   !> Returns in the first process only, and where there is no memory to begin.
   subroutine start_processes(error)
      type(error_type), allocatable, intent(out) :: error

      associate (none => error)
      end associate
   end subroutine start_processes

   !> All processes read a problem in an HDF5 file, each its rows.
   subroutine read_together(path, shared, error, symmetric)
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> How symmetric matrices are stored in it.
      integer, intent(in) :: symmetric

      call read_hdf5_shared_problem(shared, path, error, trial=.true., symmetric=symmetric)
   end subroutine read_together

   !> To be called before each solve: all processes take part in it.
   subroutine gather_processes(options)
      type(modal_options_type), intent(inout) :: options

      if (allocated(options%communicator)) deallocate (options%communicator)
   end subroutine gather_processes

   !> All processes end with this exit status, this one when it likes.
   subroutine end_processes(status)
      integer, intent(in) :: status

      associate (unused => status)
      end associate
   end subroutine end_processes
end module cli_processes
