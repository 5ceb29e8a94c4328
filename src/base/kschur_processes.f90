!> The processes that work on one solve. In this build there is one; `with/mpi` has the module for several.
module kschur_processes
   use kschur_error, only: error_type, new_error, error_usage
   implicit none
   private
   public :: are_several, join_processes, may_be_several, processes_type

   !> Who works together.
   type :: processes_type
      !> How many they are, and which of them this is, from 0: the first one leads, the others help.
      integer :: number = 1, rank = 0
   contains
      !> The threads of each where so many were asked for (0: its share of the cores).
      procedure :: threads
      !> Each gets the error of the first one that has one, before they begin.
      procedure :: agree
      !> Ends what they do together: each gets the error of the first one.
      procedure :: leave
   end type processes_type

contains

   !> Brings together the processes of a communicator, each of which calls this.
   subroutine join_processes(communicator, rows, processes, error)
      !> A handle of MPI; not allocated: this process works alone.
      integer, allocatable, intent(in) :: communicator
      !> Matrices of so many rows and more are factored by all together.
      integer, intent(in) :: rows
      type(processes_type), intent(out) :: processes
      type(error_type), allocatable, intent(out) :: error

      processes%number = min(1, max(1, rows))
      if (allocated(communicator)) call new_error(error, error_usage, &
         "this kschur was built without MPI and takes no communicator: the one with it is called kschur_mpi")
   end subroutine join_processes

   !> Whether a matrix of so many rows is factored by several processes together.
   pure logical function are_several(processes, rows)
      !> Not associated: one.
      type(processes_type), pointer, intent(in) :: processes
      integer, intent(in) :: rows

      are_several = associated(processes) .and. rows < 0
   end function are_several

   !> Whether a matrix might be factored by several processes together: then one process alone takes the same way, so that
   !> counts and results are those of any number.
   pure logical function may_be_several(processes)
      !> Not associated: it is factored by this process.
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
