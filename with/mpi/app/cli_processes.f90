!> The MPI processes of the program. The first one executes the command line, the others take part in its solves.
module cli_processes
   use, intrinsic :: iso_c_binding, only: c_int
   use cli_environment, only: start_again_to_wait_asleep
   use cli_interrupt, only: catch_interrupts, let_signals
   use kschur, only: error_type, modal_options_type, modal_result_type, read_hdf5_shared_problem, shared_problem_type, &
      solve_modes, symmetric_check, symmetric_lower, symmetric_upper
   use kschur_memory, only: megabyte, require_memory
   use kschur_processes, only: broadcast_request
   use mpi_f08, only: MPI_Bcast, MPI_CHARACTER, MPI_Comm_rank, MPI_COMM_WORLD, MPI_Finalize, MPI_Init_thread, MPI_Initialized, &
      MPI_THREAD_FUNNELED
   implicit none
   private
   public :: end_processes, gather_processes, read_together, start_processes

   ! Requests of the first process: take part in a solve, with threads; exit, with a status; read a file, with the length of its
   ! name.
   integer, parameter :: request_solve = 1, request_end = 2, request_read = 3

   interface
      subroutine c_exit(status) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit
   end interface

contains

   !> Starts MPI. Returns in the first process only, or if memory is short.
   subroutine start_processes(error)
      type(error_type), allocatable, intent(out) :: error
      ! Address space mapped by Open MPI (MB), which may wait forever for a process that gets none.
      integer, parameter :: taken_by_mpi = 250
      integer :: provided, rank

      call require_memory(taken_by_mpi*megabyte, "MPI", error)
      if (allocated(error)) return
      ! Must precede MPI_Init.
      call start_again_to_wait_asleep()
      call MPI_Init_thread(MPI_THREAD_FUNNELED, provided)
      call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      if (rank > 0) call take_part()
   end subroutine start_processes

   ! Serves requests of the first process until it ends, then exits with its status.
   subroutine take_part()
      type(shared_problem_type) :: shared
      type(modal_options_type) :: options
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      integer :: request(2)

      options%communicator = MPI_COMM_WORLD%mpi_val
      ! mpirun and batch systems send a signal to all processes: this one ignores the first, as it ends with the first process,
      ! but not a second one.
      call catch_interrupts()
      call let_signals()
      do
         call broadcast_request(request, MPI_COMM_WORLD)
         if (request(1) == request_end) exit
         ! The first process reports the error.
         if (request(1) == request_read) then
            call read_here(repeat(" ", request(2)), shared, error, symmetric_check)
         else
            options%threads = request(2)
            call solve_modes(shared, options, result, error)
         end if
      end do
      call MPI_Finalize()
      call c_exit(int(request(2), c_int))
   end subroutine take_part

   !> Reads a problem in an HDF5 file collectively, each process its rows. If symmetric matrices are stored as halves, the first
   !> process reads them alone.
   subroutine read_together(path, shared, error, symmetric)
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> How symmetric matrices are stored in it.
      integer, intent(in) :: symmetric

      if (any(symmetric == [symmetric_lower, symmetric_upper])) then
         call read_hdf5_shared_problem(shared, path, error, trial=.true., symmetric=symmetric)
      else
         call send_request([request_read, len(path)])
         call read_here(path, shared, error, symmetric)
      end if
   end subroutine read_together

   ! Reads the rows of this process; called by all processes.
   subroutine read_here(path, shared, error, symmetric)
      !> Significant in the first process; same length in the others.
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> Significant in the first process; not a half.
      integer, intent(in) :: symmetric
      character(len=len(path)) :: name

      name = path
      call MPI_Bcast(name, len(name), MPI_CHARACTER, 0, MPI_COMM_WORLD)
      call read_hdf5_shared_problem(shared, name, error, MPI_COMM_WORLD%mpi_val, trial=.true., symmetric=symmetric)
   end subroutine read_here

   !> Call before each solve: lets all processes take part in it.
   subroutine gather_processes(options)
      type(modal_options_type), intent(inout) :: options

      call send_request([request_solve, options%threads])
      options%communicator = MPI_COMM_WORLD%mpi_val
   end subroutine gather_processes

   !> Ends the other processes with this exit status.
   subroutine end_processes(status)
      integer, intent(in) :: status
      logical :: began

      call MPI_Initialized(began)
      if (.not. began) return
      call send_request([request_end, status])
      call MPI_Finalize()
   end subroutine end_processes

   ! Sends a request to the other processes.
   subroutine send_request(request)
      integer, intent(in) :: request(2)
      integer :: sent(2)

      sent = request
      call broadcast_request(sent, MPI_COMM_WORLD)
   end subroutine send_request
end module cli_processes
