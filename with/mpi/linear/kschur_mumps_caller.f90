!> Who calls MUMPS: this process alone, or all that work on a solve, the others in `kschur_mumps_help`.
module kschur_mumps_caller
   use kschur_processes, only: are_several, processes_type, word_mumps
   use mpi_f08, only: MPI_COMM_SELF
   implicit none
   private
   public :: mumps_caller_type

   !> Which of the four libraries of MUMPS it is: by the kind of scalar.
   integer, parameter, public :: mumps_real = 1, mumps_complex = 2, mumps_single_real = 3, mumps_single_complex = 4

   !> One factorisation.
   type :: mumps_caller_type
      !> For MUMPS: who works on it.
      integer :: communicator = 0
      !> How many they are.
      integer :: processes = 1
      ! Not associated: this process alone.
      type(processes_type), pointer, private :: others => null()
      integer, private :: number = 0, library = 0, symmetry = 0
   contains
      procedure :: begin
      !> To be called before MUMPS does a job.
      procedure :: announce
   end type mumps_caller_type

contains

   !> Says who factors a matrix: all of the processes, where there are others and it is worth while.
   subroutine begin(self, processes, library, symmetry, rows)
      class(mumps_caller_type), intent(inout) :: self
      type(processes_type), pointer, intent(in) :: processes
      !> One of `mumps_*`, and SYM of MUMPS.
      integer, intent(in) :: library, symmetry, rows

      self%communicator = MPI_COMM_SELF%mpi_val
      self%processes = 1
      nullify (self%others)
      if (.not. are_several(processes, rows)) return
      self%others => processes
      self%communicator = processes%communicator%mpi_val
      self%processes = processes%number
      processes%factorizations = processes%factorizations + 1
      self%number = processes%factorizations
      self%library = library
      self%symmetry = symmetry
   end subroutine begin

   subroutine announce(self, job)
      class(mumps_caller_type), intent(inout) :: self
      integer, intent(in) :: job

      if (associated(self%others)) call self%others%tell([word_mumps, self%number, job, self%library, self%symmetry])
   end subroutine announce
end module kschur_mumps_caller
