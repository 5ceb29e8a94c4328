!> The processes that call MUMPS. This build has one; `with/mpi` has the module for several.
module kschur_mumps_caller
   use, intrinsic :: iso_c_binding, only: c_ptr
   use kschur_error, only: error_type
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: mumps_caller_type

   !> Libraries of MUMPS, by the kind of scalar.
   integer, parameter, public :: mumps_real = 1, mumps_complex = 2, mumps_single_real = 3, mumps_single_complex = 4
   !> Requests besides the jobs of MUMPS: receive rows of the matrix; solve for whole vectors.
   integer, parameter, public :: job_take_rows = 0, job_solve_vectors = 4

   !> One factorisation.
   type :: mumps_caller_type
      !> MPI communicator passed to MUMPS.
      integer :: communicator = 0
      !> Number of processes.
      integer :: processes = 1
      !> Identification number of this factorisation among the joint ones.
      integer :: number = 0
   contains
      procedure :: begin
      !> Requests a job of MUMPS from the other processes, which call it too.
      procedure :: announce
      !> Sends another process its rows of the matrix.
      procedure :: send_rows
   end type mumps_caller_type

contains

   !> Selects the processes that factor a matrix: all of them, if there are several and the matrix is large enough.
   subroutine begin(self, processes, library, symmetry, rows)
      class(mumps_caller_type), intent(inout) :: self
      type(processes_type), pointer, intent(in) :: processes
      !> One of `mumps_*`, and SYM of MUMPS.
      integer, intent(in) :: library, symmetry, rows

      associate (unused => processes, also => library, too => symmetry, neither => rows)
      end associate
      self%communicator = 0
   end subroutine begin

   subroutine announce(self, job)
      class(mumps_caller_type), intent(inout) :: self
      !> The job and its arguments.
      integer, intent(in) :: job(:)

      associate (unused => self, also => job)
      end associate
   end subroutine announce

   subroutine send_rows(self, to, row, column, value, error)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: to, row(:), column(:)
      type(c_ptr), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, also => to, too => row, neither => column, nor => value, none => error)
      end associate
   end subroutine send_rows

end module kschur_mumps_caller
