!> Scatters the rows of a matrix of the first process over all processes, and gathers them there.
module kschur_matrix_rows
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory, only: integer_bytes, real_bytes, require_memory, return_memory
   use kschur_processes, only: spread_error
   use kschur_row_ranges, only: row_ranges_type
   use kschur_sparse, only: csr_matrix_type
   use mpi_f08, only: MPI_Comm, MPI_Comm_rank, MPI_Comm_size, MPI_DOUBLE_PRECISION, MPI_Gatherv, MPI_INTEGER, &
      MPI_Scatter, MPI_Scatterv
   implicit none
   private
   public :: drop_entries, gather_matrix, gather_rows, share_rows

contains

   !> Scatters the rows of a matrix. Fails in all processes if one has no memory for them.
   subroutine share_rows(matrix, ranges, columns, communicator, rows, error)
      !> Significant in the first process.
      type(csr_matrix_type), intent(in) :: matrix
      !> Distribution of the rows.
      type(row_ranges_type), intent(in) :: ranges
      integer, intent(in) :: columns
      type(MPI_Comm), intent(in) :: communicator
      type(csr_matrix_type), intent(out) :: rows
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: entries(:), before(:), length(:), lengths(:)
      integer :: processes, rank, own, p, i

      call MPI_Comm_size(communicator, processes)
      call MPI_Comm_rank(communicator, rank)
      allocate (entries(0:processes - 1), before(0:processes - 1), source=0)
      allocate (lengths(0))
      if (rank == 0) then
         lengths = matrix%row_start(2:) - matrix%row_start(:matrix%rows)
         call count_entries(matrix, ranges, entries, before)
      end if
      call MPI_Scatter(entries, 1, MPI_INTEGER, own, 1, MPI_INTEGER, 0, communicator)
      rows%rows = ranges%rows(rank)
      rows%columns = columns
      call require_memory((integer_bytes + real_bytes)*own + 2*integer_bytes*rows%rows, "rows of a matrix", error)
      call spread_error(communicator, error)
      if (allocated(error)) return
      allocate (rows%row_start(rows%rows + 1), rows%column(own), rows%value(own), length(rows%rows))
      associate (numbers => [(ranges%rows(p), p=0, processes - 1)])
         call MPI_Scatterv(lengths, numbers, ranges%before, MPI_INTEGER, length, rows%rows, MPI_INTEGER, 0, communicator)
      end associate
      rows%row_start(1) = 1
      do i = 1, rows%rows
         rows%row_start(i + 1) = rows%row_start(i) + length(i)
      end do
      if (rank == 0) then
         call MPI_Scatterv(matrix%column, entries, before, MPI_INTEGER, rows%column, own, MPI_INTEGER, 0, communicator)
         call MPI_Scatterv(matrix%value, entries, before, MPI_DOUBLE_PRECISION, rows%value, own, MPI_DOUBLE_PRECISION, 0, &
            communicator)
      else
         call MPI_Scatterv(lengths, entries, before, MPI_INTEGER, rows%column, own, MPI_INTEGER, 0, communicator)
         call MPI_Scatterv(lengths, entries, before, MPI_DOUBLE_PRECISION, rows%value, own, MPI_DOUBLE_PRECISION, 0, &
            communicator)
      end if
   end subroutine share_rows

   ! Counts the entries in the rows of each process, and those before them.
   pure subroutine count_entries(matrix, ranges, entries, before)
      type(csr_matrix_type), intent(in) :: matrix
      type(row_ranges_type), intent(in) :: ranges
      integer, intent(out) :: entries(0:), before(0:)
      integer :: p

      do p = 0, size(entries) - 1
         before(p) = matrix%row_start(ranges%first(p)) - 1
         entries(p) = matrix%row_start(ranges%last(p) + 1) - 1 - before(p)
      end do
   end subroutine count_entries

   !> Frees the entries of a matrix, but keeps its extents and row starts, and returns the memory to the system, which does not
   !> happen automatically for memory between other arrays.
   subroutine drop_entries(matrix)
      type(csr_matrix_type), intent(inout) :: matrix

      deallocate (matrix%column, matrix%value)
      allocate (matrix%column(0), matrix%value(0))
      call return_memory()
   end subroutine drop_entries

   !> Gathers the whole matrix in the first process. Fails in all processes if it has no memory for it.
   subroutine gather_matrix(matrix, ranges, communicator, rows, error)
      !> Significant in the first process.
      type(csr_matrix_type), intent(inout) :: matrix
      !> Of all rows.
      type(row_ranges_type), intent(in) :: ranges
      type(MPI_Comm), intent(in) :: communicator
      type(csr_matrix_type), intent(in) :: rows
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: length(:), lengths(:)
      integer :: processes, rank, all, p, i

      call MPI_Comm_size(communicator, processes)
      call MPI_Comm_rank(communicator, rank)
      all = merge(ranges%last(processes - 1), 0, rank == 0)
      call require_memory(integer_bytes*(real(rows%rows, wp) + 2*real(all, wp)), "rows of a matrix", error)
      call spread_error(communicator, error)
      if (allocated(error)) return
      allocate (lengths(all))
      allocate (length, source=rows%row_start(2:) - rows%row_start(:rows%rows))
      associate (numbers => [(ranges%rows(p), p=0, processes - 1)])
         call MPI_Gatherv(length, rows%rows, MPI_INTEGER, lengths, numbers, ranges%before, MPI_INTEGER, 0, communicator)
      end associate
      if (rank == 0) then
         matrix%rows = all
         matrix%columns = rows%columns
         if (allocated(matrix%row_start)) deallocate (matrix%row_start)
         allocate (matrix%row_start(all + 1))
         matrix%row_start(1) = 1
         do i = 1, all
            matrix%row_start(i + 1) = matrix%row_start(i) + lengths(i)
         end do
      end if
      call gather_rows(matrix, ranges, communicator, rows, error)
   end subroutine gather_matrix

   !> Gathers the entries of a matrix in the first process, which knows its row starts. Fails in all processes if it has no memory
   !> for them.
   subroutine gather_rows(matrix, ranges, communicator, rows, error)
      !> In the first process `row_start` is set.
      type(csr_matrix_type), intent(inout) :: matrix
      !> Of all rows.
      type(row_ranges_type), intent(in) :: ranges
      type(MPI_Comm), intent(in) :: communicator
      type(csr_matrix_type), intent(in) :: rows
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: entries(:), before(:)
      integer :: processes, rank

      call MPI_Comm_size(communicator, processes)
      call MPI_Comm_rank(communicator, rank)
      allocate (entries(0:processes - 1), before(0:processes - 1), source=0)
      if (rank == 0) then
         call count_entries(matrix, ranges, entries, before)
         call require_memory((integer_bytes + real_bytes)*sum(real(entries, wp)), "the matrices", error)
      end if
      call spread_error(communicator, error)
      if (allocated(error)) return
      if (allocated(matrix%column)) deallocate (matrix%column, matrix%value)
      allocate (matrix%column(sum(entries)), matrix%value(sum(entries)))
      associate (own => rows%nonzeros())
         call MPI_Gatherv(rows%column, own, MPI_INTEGER, matrix%column, entries, before, MPI_INTEGER, 0, communicator)
         call MPI_Gatherv(rows%value, own, MPI_DOUBLE_PRECISION, matrix%value, entries, before, MPI_DOUBLE_PRECISION, 0, &
            communicator)
      end associate
   end subroutine gather_rows
end module kschur_matrix_rows
