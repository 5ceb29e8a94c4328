!> Who calls MUMPS. In this build it is one process; `with/mpi` has the module for several.
module kschur_mumps_caller
   use, intrinsic :: iso_c_binding, only: c_ptr
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: mumps_caller_type

   !> Which of the four libraries of MUMPS it is: by the kind of scalar.
   integer, parameter, public :: mumps_real = 1, mumps_complex = 2, mumps_single_real = 3, mumps_single_complex = 4
   !> Jobs beside those of MUMPS: the others get rows of the matrix; whole vectors are solved for.
   integer, parameter, public :: job_take_rows = 0, job_solve_vectors = 4

   !> One factorisation.
   type :: mumps_caller_type
      !> For MUMPS: who works on it.
      integer :: communicator = 0
      !> How many they are.
      integer :: processes = 1
      !> Which of their factorisations it is.
      integer :: number = 0
   contains
      procedure :: begin
      !> To be called before MUMPS does a job.
      procedure :: announce
      !> Gives another process its rows of the matrix.
      procedure :: send_rows
   end type mumps_caller_type

contains

   !> Says who factors a matrix: all of the processes, where there are others and it is worth while.
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
      !> And what it needs to know.
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
