!> The processes that work on one solve. The first one leads: it goes the way of a solve as if it were alone, and where
!> others can help it tells them so. They wait for what it says, so that none decides anything on its own, and none waits
!> for one that failed.
module kschur_processes
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp, long
   use mpi_f08, only: operator(==), MPI_Allreduce, MPI_Bcast, &
      MPI_CHARACTER, MPI_Comm, MPI_Comm_dup, MPI_Comm_free, MPI_COMM_NULL, MPI_Comm_rank, &
      MPI_COMM_SELF, MPI_Comm_size, MPI_Comm_split, MPI_Comm_split_type, MPI_COMM_TYPE_SHARED, MPI_Ibcast, MPI_INFO_NULL, &
      MPI_Initialized, MPI_INTEGER, MPI_MIN, MPI_Request, MPI_STATUS_IGNORE, MPI_Test, &
      MPI_UNDEFINED
   use omp_lib, only: omp_get_num_procs
   implicit none
   private
   public :: are_several, broadcast_words, join_processes, may_be_several, nap, processes_type, spread_error

   !> What the first process may say; further words go with it.
   integer, parameter, public :: word_end = 0, word_mumps = 1, word_parts = 2, word_basis = 3, word_matrix = 4, &
      word_operator = 5, word_together = 6, word_problem = 7, word_quadratic = 8, word_two_level = 9
   integer, parameter, public :: number_of_words = 9

   !> Who works together.
   type :: processes_type
      !> How many they are, and which of them this is, from 0: the first one leads, the others help.
      integer :: number = 1, rank = 0
      !> All of them; MPI_COMM_NULL: none but this one.
      type(MPI_Comm) :: communicator = MPI_COMM_NULL
      !> How many factorisations they have begun.
      integer :: factorizations = 0
      !> How many bases and matrices they have begun to share.
      integer :: bases = 0, matrices = 0
      integer, private :: rows = 1, on_this_machine = 1
      ! Whether one of them could not even begin.
      logical, private :: failed = .false.
   contains
      !> The threads of each where so many were asked for (0: its share of the cores).
      procedure :: threads
      !> The first one says something; the others hear it.
      procedure :: tell
      procedure :: hear
      !> Cuts them into groups of neighbours, each of which works as these did.
      procedure :: split
      !> How many unknowns from which on a matrix is distributed.
      procedure :: distribute
      !> All get the error of the first one that has one, before they begin.
      procedure :: agree
      !> Ends what they do together: all get the error of the first one that has one.
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

   !> Brings together the processes of a communicator, each of which calls this.
   subroutine join_processes(communicator, rows, processes, error)
      !> A handle of MPI; not allocated: this process works alone.
      integer, allocatable, intent(in) :: communicator
      !> Matrices of so many rows and more are factored by all together.
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
      call look_around(processes)
   end subroutine join_processes

   subroutine look_around(processes)
      type(processes_type), intent(inout) :: processes
      type(MPI_Comm) :: machine

      call MPI_Comm_size(processes%communicator, processes%number)
      call MPI_Comm_rank(processes%communicator, processes%rank)
      call MPI_Comm_split_type(processes%communicator, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, machine)
      call MPI_Comm_size(machine, processes%on_this_machine)
      call MPI_Comm_free(machine)
   end subroutine look_around

   !> Whether a matrix of so many rows is factored by several processes together.
   pure logical function are_several(processes, rows)
      !> Not associated: one.
      type(processes_type), pointer, intent(in) :: processes
      integer, intent(in) :: rows

      are_several = .false.
      if (associated(processes)) are_several = processes%number > 1 .and. rows >= processes%rows
   end function are_several

   !> Whether a matrix might be factored by several processes together: then one process alone takes the same way, so that
   !> counts and results are those of any number.
   pure logical function may_be_several(processes)
      !> Not associated: it is factored by this process.
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

   subroutine tell(self, words)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: words(:)
      integer :: said(number_of_words)

      if (self%number == 1) return
      said = 0
      said(:size(words)) = words
      call broadcast_words(said, self%communicator)
   end subroutine tell

   subroutine hear(self, words)
      class(processes_type), intent(in) :: self
      integer, intent(out) :: words(number_of_words)

      words = 0
      call broadcast_words(words, self%communicator)
   end subroutine hear

   !> From the first process to the others, which sleep while it has nothing to say: a core may be wanted for its threads.
   subroutine broadcast_words(words, communicator)
      integer, asynchronous, contiguous, intent(inout) :: words(:)
      type(MPI_Comm), intent(in) :: communicator
      type(MPI_Request) :: request
      integer(long) :: started
      logical :: done

      call MPI_Ibcast(words, size(words), MPI_INTEGER, 0, communicator, request)
      started = clock()
      do
         call MPI_Test(request, done, MPI_STATUS_IGNORE)
         if (done) exit
         call nap(seconds_since(started))
      end do
   end subroutine broadcast_words

   !> Sleeps for a small part of the time that was waited; not at all at first.
   subroutine nap(waited)
      !> Seconds.
      real(wp), intent(in) :: waited
      real(wp), parameter :: part = 0.05_wp, longest = 1.0e-3_wp, shortest = 2.0e-5_wp
      real(wp) :: seconds
      integer(c_int) :: ignored

      seconds = min(part*waited, longest)
      if (seconds > shortest) ignored = c_usleep(int(1.0e6_wp*seconds, c_int))
   end subroutine nap

   !> Process r is in group r*groups/number, counted from 0; to be called by all.
   subroutine split(self, groups, group, leaders)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: groups
      type(processes_type), intent(out) :: group
      !> Of the first processes of all groups; MPI_COMM_NULL in the others.
      type(MPI_Comm), intent(out) :: leaders

      group%rows = self%rows
      call MPI_Comm_split(self%communicator, int(int(self%rank, long)*groups/self%number), self%rank, group%communicator)
      call look_around(group)
      group%on_this_machine = self%on_this_machine
      call MPI_Comm_split(self%communicator, merge(0, MPI_UNDEFINED, group%rank == 0), self%rank, leaders)
   end subroutine split

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
         if (self%rank == 0) call self%tell([word_end])
         call spread_error(self%communicator, error)
      end if
      call MPI_Comm_free(self%communicator)
   end subroutine leave

   !> All processes of a communicator get the error of the first one that has one.
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
