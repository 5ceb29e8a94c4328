!> Sums over the rows of distributed vectors.
module kschur_row_sums
   use kschur_kinds, only: wp, xp
   use mpi_f08, only: operator(==), MPI_Allgather, MPI_Bcast, MPI_BYTE, MPI_Comm, MPI_COMM_NULL, MPI_Comm_size, &
      MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, MPI_Reduce, MPI_SUM
   implicit none
   private
   public :: row_sums_type

   !> The processes that share the rows.
   type :: row_sums_type
      !> MPI_COMM_NULL: one process.
      type(MPI_Comm) :: communicator = MPI_COMM_NULL
   contains
      !> Replaces the partial sums of each process by the total, identical in all; collective.
      generic :: add_up => add_up_real, add_up_complex, add_up_extended
      procedure, private :: add_up_real
      procedure, private :: add_up_complex
      procedure, private :: add_up_extended
      !> Broadcasts numbers of the first process; collective.
      procedure :: send
      !> The 2-norm of a distributed vector from the 2-norm of its local rows; collective.
      procedure :: length
   end type row_sums_type

contains

   ! Not by MPI_Allreduce, whose order of summation may differ between processes, so that their decisions would.
   subroutine add_up_real(self, c)
      class(row_sums_type), intent(in) :: self
      real(wp), intent(inout) :: c(:, :)
      real(wp) :: here(size(c, 1), size(c, 2)), total(size(c, 1), size(c, 2))

      if (self%communicator == MPI_COMM_NULL .or. size(c) == 0) return
      here = c
      call MPI_Reduce(here, total, size(c), MPI_DOUBLE_PRECISION, MPI_SUM, 0, self%communicator)
      call MPI_Bcast(total, size(c), MPI_DOUBLE_PRECISION, 0, self%communicator)
      c = total
   end subroutine add_up_real

   subroutine add_up_complex(self, c)
      class(row_sums_type), intent(in) :: self
      complex(wp), intent(inout) :: c(:, :)
      complex(wp) :: here(size(c, 1), size(c, 2)), total(size(c, 1), size(c, 2))

      if (self%communicator == MPI_COMM_NULL .or. size(c) == 0) return
      here = c
      call MPI_Reduce(here, total, size(c), MPI_DOUBLE_COMPLEX, MPI_SUM, 0, self%communicator)
      call MPI_Bcast(total, size(c), MPI_DOUBLE_COMPLEX, 0, self%communicator)
      c = total
   end subroutine add_up_complex

   ! MPI may have no such kind: the bytes are gathered, and added in the order of the processes.
   subroutine add_up_extended(self, c)
      class(row_sums_type), intent(in) :: self
      real(xp), intent(inout) :: c(:, :)
      integer, parameter :: bits_of_a_byte = 8
      real(xp) :: here(size(c, 1), size(c, 2))
      real(xp), allocatable :: all(:, :, :)
      integer :: bytes, processes

      if (self%communicator == MPI_COMM_NULL) return
      call MPI_Comm_size(self%communicator, processes)
      allocate (all(size(c, 1), size(c, 2), processes))
      here = c
      bytes = size(c)*(storage_size(c)/bits_of_a_byte)
      call MPI_Allgather(here, bytes, MPI_BYTE, all, bytes, MPI_BYTE, self%communicator)
      c = sum(all, 3)
   end subroutine add_up_extended

   subroutine send(self, entries, c)
      class(row_sums_type), intent(in) :: self
      integer, intent(in) :: entries
      real(wp), intent(inout) :: c(entries)

      if (.not. self%communicator == MPI_COMM_NULL) &
         call MPI_Bcast(c, entries, MPI_DOUBLE_PRECISION, 0, self%communicator)
   end subroutine send

   real(wp) function length(self, here)
      class(row_sums_type), intent(in) :: self
      real(wp), intent(in) :: here
      real(wp), allocatable :: parts(:)
      integer :: processes

      length = here
      if (self%communicator == MPI_COMM_NULL) return
      call MPI_Comm_size(self%communicator, processes)
      allocate (parts(processes))
      call MPI_Allgather(here, 1, MPI_DOUBLE_PRECISION, parts, 1, MPI_DOUBLE_PRECISION, self%communicator)
      length = norm2(parts)
   end function length
end module kschur_row_sums
