!> The processes that share one solve. This build has one; `with/mpi` has the module for several.
module kschur_processes
   use kschur_error, only: error_type, new_error, error_usage
   implicit none
   private
   public :: are_several, join_processes, may_be_several, processes_type

   !> A group of processes.
   type :: processes_type
      !> Number of processes, and the rank of this one, from 0: rank 0 leads, the others serve its requests.
      integer :: number = 1, rank = 0
   contains
      !> Threads of each process if `asked` threads were asked for (0: its share of the cores).
      procedure :: threads
      !> Before joint work: every process gets the error of the first one that has an error.
      procedure :: agree
      !> Ends the joint work: every process gets the error of the first one.
      procedure :: leave
   end type processes_type

contains

   !> Collective: forms the group of the processes of a communicator.
   subroutine join_processes(communicator, rows, processes, error)
      !> MPI handle; not allocated: this process works alone.
      integer, allocatable, intent(in) :: communicator
      !> Matrices of at least this many rows are factored by all processes jointly.
      integer, intent(in) :: rows
      type(processes_type), intent(out) :: processes
      type(error_type), allocatable, intent(out) :: error

      processes%number = min(1, max(1, rows))
      if (allocated(communicator)) call new_error(error, error_usage, &
         "this kschur was built without MPI and takes no communicator: the one with it is called kschur_mpi")
   end subroutine join_processes

   !> Whether a matrix with `rows` rows is factored by several processes jointly.
   pure logical function are_several(processes, rows)
      !> Not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      integer, intent(in) :: rows

      are_several = associated(processes) .and. rows < 0
   end function are_several

   !> Whether matrices may be factored by several processes jointly. One process then takes the same algorithmic path, so that
   !> counts and results do not depend on the number of processes.
   pure logical function may_be_several(processes)
      !> Not associated: this process factors alone.
      type(processes_type), pointer, intent(in) :: processes

      may_be_several = .false.
      if (associated(processes)) may_be_several = processes%number > 1
   end function may_be_several

   pure integer function threads(self, asked)
      class(processes_type), intent(in) :: self
      integer, intent(in) :: asked

      threads = asked/self%number
   end function threads

   subroutine agree(self, error)
      class(processes_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, unchanged => error)
      end associate
   end subroutine agree

   subroutine leave(self, error)
      class(processes_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, unchanged => error)
      end associate
   end subroutine leave
end module kschur_processes
