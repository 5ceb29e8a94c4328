!> The processes that the program runs in: those that mpirun has started. The first one does what the command line says,
!> the others take part in its solves.
module cli_processes
   use, intrinsic :: iso_c_binding, only: c_int
   use cli_environment, only: start_again_to_wait_asleep
   use cli_interrupt, only: catch_interrupts, let_signals
   use kschur, only: error_type, modal_options_type, modal_result_type, read_hdf5_shared_problem, shared_problem_type, &
      solve_modes, symmetric_check, symmetric_lower, symmetric_upper
   use kschur_memory, only: megabyte, require_memory
   use kschur_processes, only: broadcast_words
   use mpi_f08, only: MPI_Bcast, MPI_CHARACTER, MPI_Comm_rank, MPI_COMM_WORLD, MPI_Finalize, MPI_Init_thread, MPI_Initialized, &
      MPI_THREAD_FUNNELED
   implicit none
   private
   public :: end_processes, gather_processes, read_together, start_processes

   ! What the first process may say: that there is a solve to take part in, with threads, that this is the end, with a
   ! status, or that a file is to be read, with the length of its name.
   integer, parameter :: word_solve = 1, word_end = 2, word_read = 3

   interface
      subroutine c_exit(status) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit
   end interface

contains

   !> Returns in the first process only, and where there is no memory to begin.
   subroutine start_processes(error)
      type(error_type), allocatable, intent(out) :: error
      ! Of addresses, which Open MPI maps: it may wait for ever for a process where it gets none.
      integer, parameter :: taken_by_mpi = 250
      integer :: provided, rank

      call require_memory(taken_by_mpi*megabyte, "MPI", error)
      if (allocated(error)) return
      ! Once MPI has begun it would be too late.
      call start_again_to_wait_asleep()
      call MPI_Init_thread(MPI_THREAD_FUNNELED, provided)
      call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      if (rank > 0) call take_part()
   end subroutine start_processes

   subroutine take_part()
      type(shared_problem_type) :: shared
      type(modal_options_type) :: options
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      integer :: words(2)

      options%communicator = MPI_COMM_WORLD%mpi_val
      ! mpirun and batch systems send a signal to all processes: this one ends with the first, and of a second one.
      call catch_interrupts()
      call let_signals()
      do
         call broadcast_words(words, MPI_COMM_WORLD)
         if (words(1) == word_end) exit
         ! What is wrong the first process tells the user.
         if (words(1) == word_read) then
            call read_here(repeat(" ", words(2)), shared, error, symmetric_check)
         else
            options%threads = words(2)
            call solve_modes(shared, options, result, error)
         end if
      end do
      call MPI_Finalize()
      call c_exit(int(words(2), c_int))
   end subroutine take_part

   !> All processes read a problem in an HDF5 file, each its rows; halves of symmetric matrices the first one alone.
   subroutine read_together(path, shared, error, symmetric)
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> How symmetric matrices are stored in it.
      integer, intent(in) :: symmetric

      if (any(symmetric == [symmetric_lower, symmetric_upper])) then
         call read_hdf5_shared_problem(shared, path, error, trial=.true., symmetric=symmetric)
      else
         call say([word_read, len(path)])
         call read_here(path, shared, error, symmetric)
      end if
   end subroutine read_together

   subroutine read_here(path, shared, error, symmetric)
      !> That of the first process counts; those of the others are as long.
      character(len=*), intent(in) :: path
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      !> That of the first process counts, and is no half.
      integer, intent(in) :: symmetric
      character(len=len(path)) :: name

      name = path
      call MPI_Bcast(name, len(name), MPI_CHARACTER, 0, MPI_COMM_WORLD)
      call read_hdf5_shared_problem(shared, name, error, MPI_COMM_WORLD%mpi_val, trial=.true., symmetric=symmetric)
   end subroutine read_here

   !> To be called before each solve: all processes take part in it.
   subroutine gather_processes(options)
      type(modal_options_type), intent(inout) :: options

      call say([word_solve, options%threads])
      options%communicator = MPI_COMM_WORLD%mpi_val
   end subroutine gather_processes

   !> All processes end with this exit status, this one when it likes.
   subroutine end_processes(status)
      integer, intent(in) :: status
      logical :: began

      call MPI_Initialized(began)
      if (.not. began) return
      call say([word_end, status])
      call MPI_Finalize()
   end subroutine end_processes

   subroutine say(words)
      integer, intent(in) :: words(2)
      integer :: said(2)

      said = words
      call broadcast_words(said, MPI_COMM_WORLD)
   end subroutine say
end module cli_processes
