!> The processes of one solve. The first one runs the algorithm as if alone, and sends requests where others can share the work.
!> They only serve requests: none decides by itself, and none waits for one that failed.
module kschur_processes
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp, long
   use kschur_memory, only: machine_memory
   use mpi_f08, only: operator(==), MPI_Allreduce, MPI_Bcast, &
      MPI_CHARACTER, MPI_Comm, MPI_Comm_dup, MPI_Comm_free, MPI_COMM_NULL, MPI_Comm_rank, &
      MPI_COMM_SELF, MPI_Comm_size, MPI_Comm_split, MPI_Comm_split_type, MPI_COMM_TYPE_SHARED, MPI_Ibcast, MPI_INFO_NULL, &
      MPI_Initialized, MPI_INTEGER, MPI_MIN, MPI_Request, MPI_STATUS_IGNORE, MPI_Test, &
      MPI_UNDEFINED
   use omp_lib, only: omp_get_num_procs
   implicit none
   private
   public :: are_several, broadcast_request, join_processes, may_be_several, sleep_briefly, processes_type, spread_error

   !> Codes of requests; further integers follow.
   integer, parameter, public :: request_end = 0, request_mumps = 1, request_parts = 2, request_basis = 3, request_matrix = 4, &
      request_operator = 5, request_together = 6, request_problem = 7, request_quadratic = 8, request_two_level = 9, &
      request_ldl = 10, request_judge = 11
   integer, parameter, public :: request_length = 9

   !> A group of processes.
   type :: processes_type
      !> Number of processes, and the rank of this one, from 0: rank 0 leads, the others serve its requests.
      integer :: number = 1, rank = 0
      !> Communicator; MPI_COMM_NULL: this process alone.
      type(MPI_Comm) :: communicator = MPI_COMM_NULL
      !> Number of joint factorisations begun.
      integer :: factorizations = 0
      !> Numbers of distributed bases and matrices begun.
      integer :: bases = 0, matrices = 0
      integer, private :: rows = 1, on_this_machine = 1
      ! Whether a process failed at the start.
      logical, private :: failed = .false.
   contains
      !> Threads of each process if `asked` threads were asked for (0: its share of the cores).
      procedure :: threads
      !> The first process sends a request; the others receive it.
      procedure :: send_request
      procedure :: receive_request
      !> Splits them into groups of consecutive ranks.
      procedure :: split
      !> Memory of the machines that they run on, if each machine is as this one (bytes).
      procedure :: memory
      !> Number of unknowns from which on a matrix is distributed.
      procedure :: distribute
      !> Before joint work: every process gets the error of the first one that has an error.
      procedure :: agree
      !> Ends the joint work: every process gets the error of the first one that has an error.
      procedure :: leave
   end type processes_type

   interface
      integer(c_int) function c_usleep(microseconds) bind(c, name="usleep")
         import :: c_int
         integer(c_int), value :: microseconds
      end function c_usleep

      integer(c_int) function c_cores() bind(c, name="get_nprocs")
         import :: c_int
      end function c_cores
   end interface

contains

   !> Collective: forms the group of the processes of a communicator.
   subroutine join_processes(communicator, rows, processes, error)
      !> MPI handle; not allocated: this process works alone.
      integer, allocatable, intent(in) :: communicator
      !> Matrices of at least this many rows are factored by all processes jointly.
      integer, intent(in) :: rows
      type(processes_type), intent(out) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(MPI_Comm) :: given
      logical :: ready

      call MPI_Initialized(ready)
      if (.not. ready) then
         call new_error(error, error_usage, "MPI is not initialised: this kschur wants MPI_Init before it solves")
         return
      end if
      processes%rows = rows
      given = MPI_COMM_SELF
      if (allocated(communicator)) given%mpi_val = communicator
      call MPI_Comm_dup(given, processes%communicator)
      call count_local_processes(processes)
   end subroutine join_processes

   ! Sets the number of processes, the rank, and the number of processes on this machine.
   subroutine count_local_processes(processes)
      type(processes_type), intent(inout) :: processes
      type(MPI_Comm) :: machine

      call MPI_Comm_size(processes%communicator, processes%number)
      call MPI_Comm_rank(processes%communicator, processes%rank)
      call MPI_Comm_split_type(processes%communicator, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, machine)
      call MPI_Comm_size(machine, processes%on_this_machine)
      call MPI_Comm_free(machine)
   end subroutine count_local_processes

   !> Whether a matrix with `rows` rows is factored by several processes jointly.
   pure logical function are_several(processes, rows)
      !> Not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      integer, intent(in) :: rows

      are_several = .false.
      if (associated(processes)) are_several = processes%number > 1 .and. rows >= processes%rows
   end function are_several

   !> Whether matrices may be factored by several processes jointly. One process then takes the same algorithmic path, so that
   !> counts and results do not depend on the number of processes.
   pure logical function may_be_several(processes)
      !> Not associated: this process factors alone.
      type(processes_type), pointer, intent(in) :: processes

      may_be_several = associated(processes)
   end function may_be_several

   integer function threads(self, asked)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: asked

      threads = asked
      if (asked == 0 .and. self%on_this_machine > 1) &
         threads = min(omp_get_num_procs(), max(1, int(c_cores())/self%on_this_machine))
   end function threads

   subroutine send_request(self, request)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: request(:)
      integer :: padded(request_length)

      if (self%number == 1) return
      padded = 0
      padded(:size(request)) = request
      call broadcast_request(padded, self%communicator)
   end subroutine send_request

   subroutine receive_request(self, request)
      class(processes_type), intent(in) :: self
      integer, intent(out) :: request(request_length)

      request = 0
      call broadcast_request(request, self%communicator)
   end subroutine receive_request

   !> Broadcasts a request. Receivers sleep while they wait, since the first process may need their cores for its threads.
   subroutine broadcast_request(request, communicator)
      integer, asynchronous, contiguous, intent(inout) :: request(:)
      type(MPI_Comm), intent(in) :: communicator
      type(MPI_Request) :: handle
      integer(long) :: started
      logical :: done

      call MPI_Ibcast(request, size(request), MPI_INTEGER, 0, communicator, handle)
      started = clock()
      do
         call MPI_Test(handle, done, MPI_STATUS_IGNORE)
         if (done) exit
         call sleep_briefly(seconds_since(started))
      end do
   end subroutine broadcast_request

   !> Sleeps for a small fraction of the time waited so far, so that short waits are not prolonged.
   subroutine sleep_briefly(waited)
      !> Seconds.
      real(wp), intent(in) :: waited
      real(wp), parameter :: part = 0.05_wp, longest = 1.0e-3_wp, shortest = 2.0e-5_wp
      real(wp) :: seconds
      integer(c_int) :: ignored

      seconds = min(part*waited, longest)
      if (seconds > shortest) ignored = c_usleep(int(1.0e6_wp*seconds, c_int))
   end subroutine sleep_briefly

   !> Splits the processes into groups: process r goes to group r*groups/number, counted from 0; collective.
   subroutine split(self, groups, group, leaders)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: groups
      type(processes_type), intent(out) :: group
      !> Communicator of the first processes of all groups; MPI_COMM_NULL in others.
      type(MPI_Comm), intent(out) :: leaders

      group%rows = self%rows
      call MPI_Comm_split(self%communicator, int(int(self%rank, long)*groups/self%number), self%rank, group%communicator)
      call count_local_processes(group)
      group%on_this_machine = self%on_this_machine
      call MPI_Comm_split(self%communicator, merge(0, MPI_UNDEFINED, group%rank == 0), self%rank, leaders)
   end subroutine split

   real(wp) function memory(self)
      class(processes_type), intent(in) :: self

      memory = machine_memory()*self%number/self%on_this_machine
   end function memory

   pure integer function distribute(self)
      class(processes_type), intent(in) :: self

      distribute = self%rows
   end function distribute

   subroutine agree(self, error)
      class(processes_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error

      call spread_error(self%communicator, error)
      self%failed = allocated(error)
   end subroutine agree

   subroutine leave(self, error)
      class(processes_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error

      if (self%communicator == MPI_COMM_NULL) return
      if (.not. self%failed) then
         if (self%rank == 0) call self%send_request([request_end])
         call spread_error(self%communicator, error)
      end if
      call MPI_Comm_free(self%communicator)
   end subroutine leave

   !> All processes of a communicator get the error of the first one that has an error.
   subroutine spread_error(communicator, error)
      type(MPI_Comm), intent(in) :: communicator
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: message
      integer :: raised(2), from, first, rank

      call MPI_Comm_rank(communicator, rank)
      from = merge(rank, huge(from), allocated(error))
      call MPI_Allreduce(from, first, 1, MPI_INTEGER, MPI_MIN, communicator)
      if (first == huge(from)) return
      raised = 0
      if (rank == first) raised = [error%code, len(error%message)]
      call MPI_Bcast(raised, 2, MPI_INTEGER, first, communicator)
      allocate (character(len=raised(2)) :: message)
      if (rank == first) message = error%message
      call MPI_Bcast(message, raised(2), MPI_CHARACTER, first, communicator)
      if (rank /= first) call new_error(error, raised(1), message)
   end subroutine spread_error
end module kschur_processes
