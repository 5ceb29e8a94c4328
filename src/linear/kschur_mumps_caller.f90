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
   !> Jobs beside those of MUMPS: the others get rows of the matrix, and of right-hand sides.
   integer, parameter, public :: job_take_rows = 0, job_take_vectors = 4

   !> One factorisation.
   type :: mumps_caller_type
      !> For MUMPS: who works on it.
      integer :: communicator = 0
      !> How many they are.
      integer :: processes = 1
   contains
      procedure :: begin
      !> To be called before MUMPS does a job.
      procedure :: announce
      !> To be called before MUMPS solves.
      procedure :: require
      !> Gives another process its rows of the matrix.
      procedure :: send_rows
      !> Fails where one of them did.
      procedure :: agree
      !> Gives another process its rows of a right-hand side.
      procedure :: send_vector
      !> Which rows of solutions another process has, and of one of them the values.
      procedure :: receive_rows
      procedure :: receive_vector
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

   subroutine require(self, bytes, error)
      class(mumps_caller_type), intent(in) :: self
      !> What MUMPS takes in each process.
      real(wp), intent(in) :: bytes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, also => bytes, none => error)
      end associate
   end subroutine require

   subroutine send_rows(self, to, row, column, value, error)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: to, row(:), column(:)
      type(c_ptr), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, also => to, too => row, neither => column, nor => value, none => error)
      end associate
   end subroutine send_rows

   subroutine agree(self, error)
      class(mumps_caller_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, unchanged => error)
      end associate
   end subroutine agree

   subroutine send_vector(self, to, values, number)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: to, number
      type(c_ptr), intent(in) :: values

      associate (unused => self, also => to, too => number, neither => values)
      end associate
   end subroutine send_vector

   subroutine receive_rows(self, from, row)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: from
      integer, allocatable, intent(inout) :: row(:)

      associate (unused => self, also => from, unchanged => row)
      end associate
   end subroutine receive_rows

   subroutine receive_vector(self, from, values, number)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: from, number
      type(c_ptr), intent(in) :: values

      associate (unused => self, also => from, too => number, neither => values)
      end associate
   end subroutine receive_vector
end module kschur_mumps_caller
