!> Scatters and gathers the rows of vectors of the first process.
module kschur_row_exchange
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   use kschur_row_ranges, only: row_ranges_type
   use mpi_f08, only: MPI_Bcast, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, MPI_Gatherv, MPI_INTEGER, MPI_Scatterv
   implicit none
   private
   public :: gather, scatter, send_to_all

   !> Scatters rows of the first process; collective.
   interface scatter
      module procedure scatter_real, scatter_complex
   end interface scatter

   !> Gathers rows in the first process; collective.
   interface gather
      module procedure gather_real, gather_complex
   end interface gather

   !> Broadcasts from the first process; collective.
   interface send_to_all
      module procedure send_real, send_complex, send_integers
   end interface send_to_all

contains

   subroutine scatter_real(processes, ranges, x, part)
      type(processes_type), intent(in) :: processes
      type(row_ranges_type), intent(in) :: ranges
      !> Significant in the first process; any shape in others.
      real(wp), contiguous, intent(in) :: x(:, :)
      !> Local rows, as many columns.
      real(wp), contiguous, intent(inout) :: part(:, :)
      real(wp) :: nothing(1)
      integer :: counts(processes%number), j, p

      counts = [(ranges%rows(p), p=0, processes%number - 1)]
      do j = 1, size(part, 2)
         if (processes%rank == 0) then
            call MPI_Scatterv(x(:, j), counts, ranges%before, MPI_DOUBLE_PRECISION, part(:, j), size(part, 1), &
               MPI_DOUBLE_PRECISION, 0, processes%communicator)
         else
            call MPI_Scatterv(nothing, counts, ranges%before, MPI_DOUBLE_PRECISION, part(:, j), size(part, 1), &
               MPI_DOUBLE_PRECISION, 0, processes%communicator)
         end if
      end do
   end subroutine scatter_real

   subroutine gather_real(processes, ranges, part, x)
      type(processes_type), intent(in) :: processes
      type(row_ranges_type), intent(in) :: ranges
      real(wp), contiguous, intent(in) :: part(:, :)
      !> Significant in the first process, as many columns; any shape in others.
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp) :: nothing(1)
      integer :: counts(processes%number), j, p

      counts = [(ranges%rows(p), p=0, processes%number - 1)]
      do j = 1, size(part, 2)
         if (processes%rank == 0) then
            call MPI_Gatherv(part(:, j), size(part, 1), MPI_DOUBLE_PRECISION, x(:, j), counts, ranges%before, &
               MPI_DOUBLE_PRECISION, 0, processes%communicator)
         else
            call MPI_Gatherv(part(:, j), size(part, 1), MPI_DOUBLE_PRECISION, nothing, counts, ranges%before, &
               MPI_DOUBLE_PRECISION, 0, processes%communicator)
         end if
      end do
   end subroutine gather_real

   subroutine send_real(processes, c)
      type(processes_type), intent(in) :: processes
      real(wp), contiguous, intent(inout) :: c(:, :)

      call MPI_Bcast(c, size(c), MPI_DOUBLE_PRECISION, 0, processes%communicator)
   end subroutine send_real

   subroutine scatter_complex(processes, ranges, x, part)
      type(processes_type), intent(in) :: processes
      type(row_ranges_type), intent(in) :: ranges
      !> Significant in the first process; any shape in others.
      complex(wp), contiguous, intent(in) :: x(:, :)
      !> Local rows, as many columns.
      complex(wp), contiguous, intent(inout) :: part(:, :)
      complex(wp) :: nothing(1)
      integer :: counts(processes%number), j, p

      counts = [(ranges%rows(p), p=0, processes%number - 1)]
      do j = 1, size(part, 2)
         if (processes%rank == 0) then
            call MPI_Scatterv(x(:, j), counts, ranges%before, MPI_DOUBLE_COMPLEX, part(:, j), size(part, 1), &
               MPI_DOUBLE_COMPLEX, 0, processes%communicator)
         else
            call MPI_Scatterv(nothing, counts, ranges%before, MPI_DOUBLE_COMPLEX, part(:, j), size(part, 1), &
               MPI_DOUBLE_COMPLEX, 0, processes%communicator)
         end if
      end do
   end subroutine scatter_complex

   subroutine gather_complex(processes, ranges, part, x)
      type(processes_type), intent(in) :: processes
      type(row_ranges_type), intent(in) :: ranges
      complex(wp), contiguous, intent(in) :: part(:, :)
      !> Significant in the first process, as many columns; any shape in others.
      complex(wp), contiguous, intent(inout) :: x(:, :)
      complex(wp) :: nothing(1)
      integer :: counts(processes%number), j, p

      counts = [(ranges%rows(p), p=0, processes%number - 1)]
      do j = 1, size(part, 2)
         if (processes%rank == 0) then
            call MPI_Gatherv(part(:, j), size(part, 1), MPI_DOUBLE_COMPLEX, x(:, j), counts, ranges%before, &
               MPI_DOUBLE_COMPLEX, 0, processes%communicator)
         else
            call MPI_Gatherv(part(:, j), size(part, 1), MPI_DOUBLE_COMPLEX, nothing, counts, ranges%before, &
               MPI_DOUBLE_COMPLEX, 0, processes%communicator)
         end if
      end do
   end subroutine gather_complex

   subroutine send_complex(processes, c)
      type(processes_type), intent(in) :: processes
      complex(wp), contiguous, intent(inout) :: c(:, :)

      call MPI_Bcast(c, size(c), MPI_DOUBLE_COMPLEX, 0, processes%communicator)
   end subroutine send_complex

   subroutine send_integers(processes, numbers)
      type(processes_type), intent(in) :: processes
      integer, contiguous, intent(inout) :: numbers(:)

      call MPI_Bcast(numbers, size(numbers), MPI_INTEGER, 0, processes%communicator)
   end subroutine send_integers
end module kschur_row_exchange
