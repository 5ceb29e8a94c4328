!> The common supernodes of an LDL^T over several processes, by MPI: the first process leads.
module kschur_joint_supernodes
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_kinds, only: wp, long
   use kschur_processes, only: processes_type
   use mpi_f08, only: MPI_Allreduce, MPI_Bcast, MPI_Comm, MPI_DOUBLE_PRECISION, MPI_Get_count, MPI_IN_PLACE, MPI_LOGICAL, MPI_LOR, &
      MPI_Recv, MPI_Reduce, MPI_Send, MPI_Status, MPI_SUM
   implicit none
   private
   public :: joint_supernodes, joint_supernodes_type

   !> Of a group of processes.
   type, extends(common_supernodes_type) :: joint_supernodes_type
      private
      type(MPI_Comm) :: communicator
      integer :: processes = 1
      ! Of another process.
      real(wp), allocatable :: incoming(:)
   contains
      procedure :: make_room
      procedure :: any_of
      procedure :: add_up
      procedure :: sum_rows
      procedure :: spread_rows
   end type joint_supernodes_type

contains

   !> Supernodes from `first` on of a matrix with `unknowns` rows.
   function joint_supernodes(first, unknowns, processes) result(common)
      integer, intent(in) :: first, unknowns
      type(processes_type), intent(in) :: processes
      type(joint_supernodes_type) :: common

      common%first = first
      common%unknowns = unknowns
      common%leads = processes%rank == 0
      common%communicator = processes%communicator
      common%processes = processes%number
   end function joint_supernodes

   subroutine make_room(self, entries, status)
      class(joint_supernodes_type), intent(inout) :: self
      integer(long), intent(in) :: entries
      integer, intent(out) :: status

      status = 0
      if (.not. self%leads) return
      if (allocated(self%incoming)) deallocate (self%incoming)
      allocate (self%incoming(entries), stat=status)
   end subroutine make_room

   logical function any_of(self, here)
      class(joint_supernodes_type), intent(in) :: self
      logical, intent(in) :: here

      call MPI_Allreduce(here, any_of, 1, MPI_LOGICAL, MPI_LOR, self%communicator)
   end function any_of

   subroutine add_up(self, is_empty, values)
      class(joint_supernodes_type), intent(inout) :: self
      logical, intent(in) :: is_empty
      real(wp), contiguous, intent(inout) :: values(:)
      type(MPI_Status) :: status
      integer :: process, entries

      if (.not. self%leads) then
         call MPI_Send(values, merge(0, size(values), is_empty), MPI_DOUBLE_PRECISION, 0, 0, self%communicator)
         return
      end if
      do process = 1, self%processes - 1
         call MPI_Recv(self%incoming, size(values), MPI_DOUBLE_PRECISION, process, 0, self%communicator, status)
         call MPI_Get_count(status, MPI_DOUBLE_PRECISION, entries)
         values(:entries) = values(:entries) + self%incoming(:entries)
      end do
   end subroutine add_up

   subroutine sum_rows(self, rows)
      class(joint_supernodes_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: rows(:, :)

      if (self%leads) then
         call MPI_Reduce(MPI_IN_PLACE, rows, size(rows), MPI_DOUBLE_PRECISION, MPI_SUM, 0, self%communicator)
      else
         call MPI_Reduce(rows, rows, size(rows), MPI_DOUBLE_PRECISION, MPI_SUM, 0, self%communicator)
      end if
   end subroutine sum_rows

   subroutine spread_rows(self, rows)
      class(joint_supernodes_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: rows(:, :)

      call MPI_Bcast(rows, size(rows), MPI_DOUBLE_PRECISION, 0, self%communicator)
   end subroutine spread_rows
end module kschur_joint_supernodes
