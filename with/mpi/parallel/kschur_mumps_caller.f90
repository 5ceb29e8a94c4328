!> The processes that call MUMPS: this one, or all processes of a solve, the others in `kschur_mumps_worker`.
module kschur_mumps_caller
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_ptr
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp
   use kschur_processes, only: are_several, processes_type, request_mumps
   use kschur_text, only: text
   use mpi_f08, only: MPI_COMM_SELF, MPI_COMPLEX, MPI_Datatype, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, MPI_INTEGER, &
      MPI_LOGICAL, MPI_REAL, MPI_Recv, MPI_Send, MPI_STATUS_IGNORE
   implicit none
   private
   public :: mumps_caller_type, scalar_of

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
      !> Number of this factorisation.
      integer :: number = 0
      ! Not associated: one process.
      type(processes_type), pointer, private :: others => null()
      integer, private :: library = 0, symmetry = 0
   contains
      procedure :: begin
      !> Announces a job of MUMPS to the other processes.
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
      !> The job and its arguments.
      integer, intent(in) :: job(:)

      if (associated(self%others)) &
         call self%others%send_request([request_mumps, self%number, job(1), self%library, self%symmetry, job(2:)])
   end subroutine announce

   !> Fails if the receiver has no memory for them; other processes are still sent theirs, as they wait for them.
   subroutine send_rows(self, to, row, column, value, error)
      class(mumps_caller_type), intent(in) :: self
      integer, intent(in) :: to, row(:), column(:)
      !> Values in the precision of the library.
      type(c_ptr), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      real(wp), pointer :: scalars(:)
      logical :: has_room

      associate (communicator => self%others%communicator)
         call MPI_Send(size(row), 1, MPI_INTEGER, to, 0, communicator)
         call MPI_Recv(has_room, 1, MPI_LOGICAL, to, 0, communicator, MPI_STATUS_IGNORE)
         if (.not. has_room) then
            call new_error(error, error_memory, "no memory for rows of the matrix in process "//text(to))
            return
         end if
         call c_f_pointer(value, scalars, [1])
         call MPI_Send(row, size(row), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(column, size(row), MPI_INTEGER, to, 0, communicator)
         call MPI_Send(scalars, size(row), scalar_of(self%library), to, 0, communicator)
      end associate
   end subroutine send_rows

   !> MPI type of the scalars of a library.
   function scalar_of(library)
      integer, intent(in) :: library
      type(MPI_Datatype) :: scalar_of

      select case (library)
      case (mumps_complex)
         scalar_of = MPI_DOUBLE_COMPLEX
      case (mumps_single_real)
         scalar_of = MPI_REAL
      case (mumps_single_complex)
         scalar_of = MPI_COMPLEX
      case default
         scalar_of = MPI_DOUBLE_PRECISION
      end select
   end function scalar_of
end module kschur_mumps_caller
