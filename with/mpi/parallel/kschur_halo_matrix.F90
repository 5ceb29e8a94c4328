!> Sparse matrix distributed by rows, for products with vectors distributed as its columns. Entries of vectors of other
!> processes that a process needs, its halo, are exchanged in each product.
module kschur_halo_matrix
   use kschur_csr, only: csr_matrix_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory, only: integer_bytes, require_memory
   use kschur_processes, only: spread_error
   use kschur_row_ranges, only: row_ranges_type
   use mpi_f08, only: MPI_Alltoall, MPI_Alltoallv, MPI_Comm, MPI_COMM_NULL, MPI_Comm_rank, MPI_Comm_size, MPI_DOUBLE_COMPLEX, &
      MPI_DOUBLE_PRECISION, MPI_INTEGER, MPI_Irecv, MPI_Isend, MPI_Request, MPI_STATUSES_IGNORE, MPI_Waitall
   implicit none
   private
   public :: halo_matrix_type, new_halo_matrix

   !> Entries of vectors that two processes exchange in one product, in an order both know.
   type :: neighbour_type
      integer :: rank = 0
      !> Range in the list of all neighbours.
      integer :: first = 1, last = 0
   end type neighbour_type

   !> The local rows. Products are collective over the communicator.
   type :: halo_matrix_type
      private
      type(MPI_Comm) :: communicator = MPI_COMM_NULL
      ! Entries with local columns; entries with halo columns, numbered within the halo.
      type(csr_matrix_type) :: inner, outer
      ! Number of columns, first local column, and halo columns, ascending.
      integer :: columns = 0, first = 1
      integer, allocatable :: halo(:)
      ! Owners of the halo, users of local entries, and which entries these are.
      type(neighbour_type), allocatable :: owners(:), users(:)
      integer, allocatable :: used(:)
   contains
      !> y := y + alpha A x, for real or complex blocks of vectors, of which each process has its part.
      generic :: add_product => add_product_real, add_product_complex
      !> Restores the local rows in global numbering.
      procedure :: join
      !> Memory in bytes of the local part.
      procedure :: bytes
      procedure, private :: add_product_real, add_product_complex
   end type halo_matrix_type

contains

   !> Creates the matrix from local rows. Fails in all processes if one has no memory for it.
   subroutine new_halo_matrix(matrix, rows, ranges, communicator, error)
      type(halo_matrix_type), intent(out) :: matrix
      !> Local rows with global columns.
      type(csr_matrix_type), intent(in) :: rows
      !> Distribution of the columns, as of vectors.
      type(row_ranges_type), intent(in) :: ranges
      type(MPI_Comm), intent(in) :: communicator
      type(error_type), allocatable, intent(out) :: error

      call require_memory(rows%bytes() + integer_bytes*(real(rows%rows, wp) + rows%columns), "rows of a matrix", error)
      call spread_error(communicator, error)
      if (allocated(error)) return
      matrix%communicator = communicator
      matrix%columns = rows%columns
      call find_halo(rows, ranges, communicator, matrix%halo)
      call split(matrix, rows, ranges)
      call exchange_needs(matrix, ranges)
   end subroutine new_halo_matrix

   ! Halo columns: nonlocal columns with entries here, ascending.
   subroutine find_halo(rows, ranges, communicator, halo)
      type(csr_matrix_type), intent(in) :: rows
      type(row_ranges_type), intent(in) :: ranges
      type(MPI_Comm), intent(in) :: communicator
      integer, allocatable, intent(out) :: halo(:)
      logical, allocatable :: needed(:)
      integer :: rank, j

      call MPI_Comm_rank(communicator, rank)
      allocate (needed(rows%columns), source=.false.)
      needed(rows%column) = .true.
      needed(ranges%first(rank):ranges%last(rank)) = .false.
      allocate (halo(count(needed)))
      halo = pack([(j, j=1, rows%columns)], needed)
   end subroutine find_halo

   ! Splits local rows into entries with local columns and entries with halo columns.
   subroutine split(matrix, rows, ranges)
      type(halo_matrix_type), intent(inout) :: matrix
      type(csr_matrix_type), intent(in) :: rows
      type(row_ranges_type), intent(in) :: ranges
      ! Local number of each column; negative for the halo.
      integer, allocatable :: number(:)
      integer :: rank, own, i, j, k

      call MPI_Comm_rank(matrix%communicator, rank)
      matrix%first = ranges%first(rank)
      allocate (number(rows%columns), source=0)
      do j = matrix%first, ranges%last(rank)
         number(j) = j - matrix%first + 1
      end do
      do j = 1, size(matrix%halo)
         number(matrix%halo(j)) = -j
      end do
      own = count(number(rows%column) > 0)
      call make_room(matrix%inner, rows%rows, ranges%rows(rank), own)
      call make_room(matrix%outer, rows%rows, size(matrix%halo), rows%nonzeros() - own)
      do i = 1, rows%rows
         do k = rows%row_start(i), rows%row_start(i + 1) - 1
            if (number(rows%column(k)) > 0) then
               call append(matrix%inner, i, number(rows%column(k)), rows%value(k))
            else
               call append(matrix%outer, i, -number(rows%column(k)), rows%value(k))
            end if
         end do
         matrix%inner%row_start(i + 2:min(i + 2, rows%rows + 1)) = matrix%inner%row_start(i + 1)
         matrix%outer%row_start(i + 2:min(i + 2, rows%rows + 1)) = matrix%outer%row_start(i + 1)
      end do
   end subroutine split

   ! Allocates a matrix to be filled by `append`, row by row.
   subroutine make_room(part, rows, columns, entries)
      type(csr_matrix_type), intent(out) :: part
      integer, intent(in) :: rows, columns, entries

      part%rows = rows
      part%columns = columns
      allocate (part%row_start(rows + 1), source=1)
      allocate (part%column(entries), part%value(entries))
   end subroutine make_room

   ! Appends an entry to row i, the last one begun.
   pure subroutine append(part, i, column, value)
      type(csr_matrix_type), intent(inout) :: part
      integer, intent(in) :: i, column
      real(wp), intent(in) :: value

      associate (place => part%row_start(i + 1))
         part%column(place) = column
         part%value(place) = value
         place = place + 1
      end associate
   end subroutine append

   ! Plans the exchange of the halo: each process tells the others which entries of vectors it needs from them.
   subroutine exchange_needs(matrix, ranges)
      type(halo_matrix_type), intent(inout) :: matrix
      type(row_ranges_type), intent(in) :: ranges
      integer, allocatable :: needed(:), used(:), needed_before(:), used_before(:)
      integer :: processes, p, j

      call MPI_Comm_size(matrix%communicator, processes)
      allocate (needed(0:processes - 1), source=0)
      allocate (used(0:processes - 1), needed_before(0:processes - 1), used_before(0:processes - 1))
      do j = 1, size(matrix%halo)
         p = ranges%owner(matrix%halo(j))
         needed(p) = needed(p) + 1
      end do
      call MPI_Alltoall(needed, 1, MPI_INTEGER, used, 1, MPI_INTEGER, matrix%communicator)
      call list_neighbours(needed, needed_before, matrix%owners)
      call list_neighbours(used, used_before, matrix%users)
      allocate (matrix%used(sum(used)))
      call MPI_Alltoallv(matrix%halo, needed, needed_before, MPI_INTEGER, matrix%used, used, used_before, MPI_INTEGER, &
         matrix%communicator)
      matrix%used = matrix%used - matrix%first + 1
   end subroutine exchange_needs

   ! Lists the processes with which entries are exchanged, from the number of entries of each.
   subroutine list_neighbours(entries, before, neighbours)
      integer, intent(in) :: entries(0:)
      integer, intent(out) :: before(0:)
      type(neighbour_type), allocatable, intent(out) :: neighbours(:)
      integer :: p, k

      allocate (neighbours(count(entries > 0)))
      k = 0
      do p = 0, size(entries) - 1
         before(p) = sum(entries(:p - 1))
         if (entries(p) == 0) cycle
         k = k + 1
         neighbours(k) = neighbour_type(p, before(p) + 1, before(p) + entries(p))
      end do
   end subroutine list_neighbours

   ! In each row, halo columns before the local ones, local columns, and the other halo columns.
   pure subroutine join(self, rows)
      class(halo_matrix_type), intent(in) :: self
      type(csr_matrix_type), intent(out) :: rows
      integer :: i, before, place

      associate (inner => self%inner, outer => self%outer)
         rows%rows = inner%rows
         rows%columns = self%columns
         allocate (rows%row_start, source=inner%row_start + outer%row_start - 1)
         allocate (rows%column(inner%nonzeros() + outer%nonzeros()), rows%value(inner%nonzeros() + outer%nonzeros()))
         place = 1
         do i = 1, rows%rows
            associate (from => outer%row_start(i), to => outer%row_start(i + 1) - 1, here => inner%row_start(i), &
               last => inner%row_start(i + 1) - 1)
               before = count(self%halo(outer%column(from:to)) < self%first)
               call append_all(rows, place, self%halo(outer%column(from:from + before - 1)), outer%value(from:from + before - 1))
               call append_all(rows, place, inner%column(here:last) + self%first - 1, inner%value(here:last))
               call append_all(rows, place, self%halo(outer%column(from + before:to)), outer%value(from + before:to))
            end associate
         end do
      end associate
   end subroutine join

   pure subroutine append_all(rows, place, column, value)
      type(csr_matrix_type), intent(inout) :: rows
      integer, intent(inout) :: place
      integer, intent(in) :: column(:)
      real(wp), intent(in) :: value(:)

      rows%column(place:place + size(column) - 1) = column
      rows%value(place:place + size(column) - 1) = value
      place = place + size(column)
   end subroutine append_all

   pure real(wp) function bytes(self)
      class(halo_matrix_type), intent(in) :: self

      bytes = self%inner%bytes() + self%outer%bytes() + integer_bytes*size(self%used)
   end function bytes

#define SCALAR real(wp)
#define MPI_SCALAR MPI_DOUBLE_PRECISION
#define ADD_PRODUCT add_product_real
#define RECEIVE receive_real
#define SEND send_real
#include "kschur_halo_products.inc"

#define SCALAR complex(wp)
#define MPI_SCALAR MPI_DOUBLE_COMPLEX
#define ADD_PRODUCT add_product_complex
#define RECEIVE receive_complex
#define SEND send_complex
#include "kschur_halo_products.inc"
end module kschur_halo_matrix
