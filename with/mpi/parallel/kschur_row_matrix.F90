!> A sparse matrix for many products, with its rows distributed over the processes of a solve. The first process sends requests,
!> which the others execute in `serve_matrix`.
module kschur_row_matrix
   use kschur_columns_real, only: subtract_columns
   use kschur_error, only: error_type
   use kschur_halo_matrix, only: halo_matrix_type, new_halo_matrix
   use kschur_kinds, only: wp
   use kschur_matrix_rows, only: drop_entries, gather_rows, share_rows
   use kschur_memory, only: complex_bytes, real_bytes, require_memory, return_memory
   use kschur_processes, only: are_several, request_length, processes_type, spread_error, request_matrix
   use kschur_row_exchange, only: gather, scatter, send_to_all
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_row_sums, only: row_sums_type
   use kschur_sparse, only: csr_matrix_type
   use mpi_f08, only: MPI_Bcast, MPI_Comm, MPI_Comm_rank, MPI_Comm_size, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, &
      MPI_Gatherv, MPI_MAX, MPI_Reduce, MPI_Scatterv
   implicit none
   private
   public :: serve_matrix, part_of, row_matrix_part_type, row_matrix_type

   ! Jobs: receive rows; multiply by real or complex vectors, or two matrices; return the rows to the first process; free them.
   integer, parameter :: job_take = 1, job_real = 2, job_complex = 3, job_give = 4, job_forget = 5, job_residual = 6

   !> Local part of a matrix.
   type :: row_matrix_part_type
      private
      !> Its number in the first process.
      integer :: number = 0
      !> Distribution of rows, and of vectors.
      type(row_ranges_type) :: ranges
      type(halo_matrix_type), pointer :: rows => null()
   end type row_matrix_part_type

   !> Pointer to a matrix; copies share it and must not outlive it.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
      ! Not associated: one process.
      type(processes_type), pointer :: others => null()
      type(row_matrix_part_type) :: part
      ! Norm of the matrix while its entries are freed.
      real(wp) :: norm = 0
      ! Whether products are collective, with distributed vectors.
      logical :: together = .false.
   contains
      !> Points to a matrix of this process.
      procedure :: take
      !> Distributes the rows of a matrix over the processes.
      procedure :: share
      !> Distributes a matrix of any shape for collective products only; collective.
      procedure :: share_between
      !> Frees the rows of this process that `share_between` has distributed.
      procedure :: drop
      !> The same matrix for collective products.
      procedure :: by_rows
      !> Its identification number; 0 if it is not distributed.
      procedure :: shared_as
      !> Frees the distributed rows.
      procedure :: forget
      !> Frees the entries of the whole matrix in the first process; restores them from the distributed rows.
      procedure :: put_away
      procedure :: bring_back
      !> Largest sum of magnitudes over a row.
      procedure :: infinity_norm
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
      !> A x - B x diag(theta), or the lengths of its columns alone.
      procedure :: residual
      procedure, private :: add_product_real, add_product_complex
   end type row_matrix_type

contains

   subroutine take(self, matrix)
      class(row_matrix_type), intent(inout) :: self
      type(csr_matrix_type), target, intent(in) :: matrix

      self%matrix => matrix
      nullify (self%others)
   end subroutine take

   subroutine share(self, matrix, processes, error)
      class(row_matrix_type), intent(inout) :: self
      !> Square.
      type(csr_matrix_type), target, intent(inout) :: matrix
      !> Not associated: this process alone.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      self%matrix => matrix
      if (.not. are_several(processes, matrix%rows)) return
      processes%matrices = processes%matrices + 1
      self%part%number = processes%matrices
      call processes%send_request([request_matrix, job_take, self%part%number, matrix%rows])
      call take_rows(self%part, matrix, processes, matrix%rows, error, self%norm)
      if (.not. allocated(error)) self%others => processes
   end subroutine share

   subroutine share_between(self, matrix, rows, columns, processes, error)
      class(row_matrix_type), intent(inout) :: self
      !> Of the first process.
      type(csr_matrix_type), intent(in) :: matrix
      !> Distribution of rows, and of vectors that are multiplied.
      type(row_ranges_type), intent(in) :: rows, columns
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: here

      self%together = .true.
      call share_rows(matrix, rows, columns%last(processes%number - 1), processes%communicator, here, error)
      if (allocated(error)) return
      allocate (self%part%rows)
      call new_halo_matrix(self%part%rows, here, columns, processes%communicator, error)
   end subroutine share_between

   subroutine drop(self)
      class(row_matrix_type), intent(inout) :: self

      if (associated(self%part%rows)) deallocate (self%part%rows)
      nullify (self%part%rows)
   end subroutine drop

   function by_rows(self) result(matrix)
      class(row_matrix_type), intent(in) :: self
      type(row_matrix_type) :: matrix

      matrix%part = self%part
      matrix%together = .true.
   end function by_rows

   pure integer function shared_as(self)
      class(row_matrix_type), intent(in) :: self

      shared_as = 0
      if (associated(self%others)) shared_as = self%part%number
   end function shared_as

   !> Returns the matrix with an identification number in another process, for collective products.
   function part_of(parts, number) result(matrix)
      type(row_matrix_part_type), intent(in) :: parts(:)
      integer, intent(in) :: number
      type(row_matrix_type) :: matrix

      matrix%part = parts(findloc(parts%number, number, dim=1))
      matrix%together = .true.
   end function part_of

   ! Scatters the rows of a matrix of the first process; each process prepares its own for products. Collective.
   subroutine take_rows(part, matrix, processes, order, error, norm)
      type(row_matrix_part_type), intent(inout) :: part
      type(csr_matrix_type), intent(in) :: matrix
      type(processes_type), intent(in) :: processes
      integer, intent(in) :: order
      type(error_type), allocatable, intent(out) :: error
      !> Infinity norm, in the first process.
      real(wp), intent(out) :: norm
      type(csr_matrix_type) :: rows

      norm = 0
      part%ranges = row_ranges(order, processes%number)
      call share_rows(matrix, part%ranges, order, processes%communicator, rows, error)
      if (allocated(error)) return
      call MPI_Reduce(rows%infinity_norm(), norm, 1, MPI_DOUBLE_PRECISION, MPI_MAX, 0, processes%communicator)
      allocate (part%rows)
      call new_halo_matrix(part%rows, rows, part%ranges, processes%communicator, error)
      if (allocated(error)) deallocate (part%rows)
   end subroutine take_rows

   !> Executes a request of the first process on the local rows of a matrix.
   subroutine serve_matrix(parts, processes, request)
      !> All matrices in use.
      type(row_matrix_part_type), allocatable, intent(inout) :: parts(:)
      type(processes_type), intent(in) :: processes
      !> After the code: job, number of the matrix, and of vectors or rows; number of another matrix, whether products are wanted.
      integer, intent(in) :: request(request_length)
      type(row_matrix_part_type) :: new
      type(csr_matrix_type) :: none
      ! The first process has the same error.
      type(error_type), allocatable :: error
      real(wp) :: no_reals(0, request(4))
      complex(wp) :: no_complexes(0, request(4))
      real(wp), dimension(merge(request(4), 0, request(2) == job_residual)) :: factors, lengths
      real(wp) :: norm
      integer :: i

      associate (job => request(2), number => request(3))
         if (job == job_take) then
            new%number = number
            call take_rows(new, none, processes, request(4), error, norm)
            if (.not. allocated(error)) parts = [parts, new]
            return
         end if
         i = findloc(parts%number, number, dim=1)
         select case (job)
         case (job_real)
            call multiply_real(parts(i), 0.0_wp, no_reals, no_reals, processes%communicator, error)
         case (job_complex)
            call multiply_complex(parts(i), (0.0_wp, 0.0_wp), no_complexes, no_complexes, processes%communicator, error)
         case (job_residual)
            associate (other => parts(findloc(parts%number, request(5), dim=1)))
               call subtract_products(parts(i), other, factors, no_reals, lengths, request(6) > 0, no_reals, processes, error)
            end associate
         case (job_give)
            call give_rows(parts(i), none, processes, error)
         case (job_forget)
            deallocate (parts(i)%rows)
            parts = pack(parts, parts%number /= number)
         end select
      end associate
   end subroutine serve_matrix

   subroutine forget(self)
      class(row_matrix_type), intent(inout) :: self

      if (.not. associated(self%others)) return
      call self%others%send_request([request_matrix, job_forget, self%part%number])
      deallocate (self%part%rows)
      nullify (self%others)
   end subroutine forget

   subroutine put_away(self)
      class(row_matrix_type), intent(in) :: self

      if (associated(self%others)) call drop_entries(self%matrix)
   end subroutine put_away

   subroutine bring_back(self, error)
      class(row_matrix_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error

      if (.not. associated(self%others)) return
      call self%others%send_request([request_matrix, job_give, self%part%number])
      call give_rows(self%part, self%matrix, self%others, error)
      ! What was freed meanwhile lies between other arrays.
      call return_memory()
   end subroutine bring_back

   ! Gathers the rows in the first process again. Collective.
   subroutine give_rows(part, matrix, processes, error)
      type(row_matrix_part_type), intent(in) :: part
      !> In the first process its entries are set.
      type(csr_matrix_type), intent(inout) :: matrix
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: rows

      call require_memory(part%rows%bytes(), "rows of a matrix", error)
      call spread_error(processes%communicator, error)
      if (allocated(error)) return
      call part%rows%join(rows)
      call gather_rows(matrix, part%ranges, processes%communicator, rows, error)
   end subroutine give_rows

   real(wp) function infinity_norm(self)
      class(row_matrix_type), intent(in) :: self

      infinity_norm = self%norm
      if (.not. associated(self%others)) infinity_norm = self%matrix%infinity_norm()
   end function infinity_norm

   subroutine residual(self, other, theta, x, lengths, error, y)
      class(row_matrix_type), intent(in) :: self
      !> B, distributed as A is.
      class(row_matrix_type), intent(in) :: other
      real(wp), intent(in) :: theta(:)
      real(wp), contiguous, intent(in) :: x(:, :)
      !> Norms of the columns.
      real(wp), intent(out) :: lengths(:)
      !> Fails if a process runs out of memory.
      type(error_type), allocatable, intent(out) :: error
      !> Absent: not wanted.
      real(wp), contiguous, optional, intent(out) :: y(:, :)
      real(wp), dimension(:, :), allocatable :: difference, subtracted

      if (associated(self%others)) then
         call self%others%send_request([request_matrix, job_residual, self%part%number, size(x, 2), other%part%number, &
            merge(1, 0, present(y))])
         if (present(y)) then
            call subtract_products(self%part, other%part, theta, x, lengths, .true., y, self%others, error)
         else
            allocate (difference(0, size(x, 2)))
            call subtract_products(self%part, other%part, theta, x, lengths, .false., difference, self%others, error)
         end if
         return
      end if
      allocate (difference(size(x, 1), size(x, 2)), subtracted(size(x, 1), size(x, 2)), source=0.0_wp)
      call self%matrix%add_product(1.0_wp, x, difference)
      call other%matrix%add_product(1.0_wp, x, subtracted)
      call subtract_columns(theta, subtracted, difference, lengths)
      if (present(y)) y = difference
   end subroutine residual

   ! The residual by rows: scatters the vectors of the first process, and adds up the norms there. Collective.
   subroutine subtract_products(part, other, theta, x, lengths, wanted, y, processes, error)
      type(row_matrix_part_type), intent(in) :: part, other
      !> Significant in the first process, as x.
      real(wp), intent(in) :: theta(:)
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), intent(out) :: lengths(:)
      !> Whether the first process gets the residual, too.
      logical, intent(in) :: wanted
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      ! Memory check: three local vectors and their halo.
      integer, parameter :: parts = 4
      real(wp), dimension(:, :), allocatable :: here, difference, subtracted
      real(wp) :: factors(size(theta), 1)
      type(row_sums_type) :: sums
      integer :: rows, j

      rows = part%ranges%rows(processes%rank)
      call require_memory(real_bytes*parts*size(theta)*real(rows, wp), "products of a matrix", error)
      call spread_error(processes%communicator, error)
      if (allocated(error)) return
      factors(:, 1) = theta
      call send_to_all(processes, factors)
      allocate (here(rows, size(theta)), difference(rows, size(theta)), subtracted(rows, size(theta)), source=0.0_wp)
      call scatter(processes, part%ranges, x, here)
      call part%rows%add_product(1.0_wp, here, difference)
      call other%rows%add_product(1.0_wp, here, subtracted)
      call subtract_columns(factors(:, 1), subtracted, difference, lengths)
      sums%communicator = processes%communicator
      do j = 1, size(lengths)
         lengths(j) = sums%length(lengths(j))
      end do
      if (wanted) call gather(processes, part%ranges, difference, y)
   end subroutine subtract_products

#define SCALAR real(wp)
#define MPI_SCALAR MPI_DOUBLE_PRECISION
#define JOB job_real
#define ADD_PRODUCT add_product_real
#define MULTIPLY multiply_real
#include "kschur_row_matrix.inc"

#define SCALAR complex(wp)
#define MPI_SCALAR MPI_DOUBLE_COMPLEX
#define JOB job_complex
#define ADD_PRODUCT add_product_complex
#define MULTIPLY multiply_complex
#include "kschur_row_matrix.inc"
end module kschur_row_matrix
