!> Queue of parts of a band: a counter in the first process, incremented by remote access.
module kschur_part_queue
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_ptr
   use mpi_f08, only: MPI_ADDRESS_KIND, MPI_Comm, MPI_Comm_rank, MPI_Fetch_and_op, MPI_INFO_NULL, MPI_INTEGER, &
      MPI_LOCK_EXCLUSIVE, MPI_SUM, MPI_Win, MPI_Win_allocate, MPI_Win_free, MPI_Win_lock, MPI_Win_unlock
   implicit none
   private
   public :: part_queue_type

   !> The counter, as seen by any process.
   type :: part_queue_type
      private
      type(MPI_Win) :: window
   contains
      !> Creates and frees the counter; collective over a communicator.
      procedure :: begin
      procedure :: finish
      !> Returns the next number, from 1, and advances the counter by one, or by `past`.
      procedure :: take
   end type part_queue_type

contains

   subroutine begin(self, communicator)
      class(part_queue_type), intent(inout) :: self
      type(MPI_Comm), intent(in) :: communicator
      integer(MPI_ADDRESS_KIND) :: bytes
      type(c_ptr) :: address
      integer(c_int), pointer :: number
      integer :: rank

      call MPI_Comm_rank(communicator, rank)
      bytes = merge(4, 0, rank == 0)
      call MPI_Win_allocate(bytes, 4, MPI_INFO_NULL, communicator, address, self%window)
      if (rank > 0) return
      call c_f_pointer(address, number)
      call MPI_Win_lock(MPI_LOCK_EXCLUSIVE, 0, 0, self%window)
      number = 1
      call MPI_Win_unlock(0, self%window)
   end subroutine begin

   integer function take(self, past)
      class(part_queue_type), intent(in) :: self
      integer, intent(in), optional :: past
      integer, asynchronous :: step, taken

      step = 1
      if (present(past)) step = past
      call MPI_Win_lock(MPI_LOCK_EXCLUSIVE, 0, 0, self%window)
      call MPI_Fetch_and_op(step, taken, MPI_INTEGER, 0, 0_MPI_ADDRESS_KIND, MPI_SUM, self%window)
      call MPI_Win_unlock(0, self%window)
      take = taken
   end function take

   subroutine finish(self)
      class(part_queue_type), intent(inout) :: self

      call MPI_Win_free(self%window)
   end subroutine finish
end module kschur_part_queue
