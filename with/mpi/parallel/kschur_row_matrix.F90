!> A sparse matrix that is multiplied with again and again, by all processes that work on a solve: each has some of its rows. The
!> first process says what is to be done, the others do it in `help_multiply`.
module kschur_row_matrix
   use kschur_error, only: error_type
   use kschur_halo_matrix, only: halo_matrix_type, new_halo_matrix
   use kschur_kinds, only: wp
   use kschur_matrix_rows, only: drop_entries, gather_rows, share_rows
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_processes, only: are_several, number_of_words, processes_type, spread_error, word_matrix
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_sparse, only: csr_matrix_type
   use mpi_f08, only: MPI_Bcast, MPI_Comm, MPI_Comm_rank, MPI_Comm_size, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, &
      MPI_Gatherv, MPI_Scatterv
   implicit none
   private
   public :: help_multiply, part_of, row_matrix_part_type, row_matrix_type

   ! What is done with a matrix: its rows are taken, multiplied with real or complex vectors, given to the first process,
   ! and forgotten.
   integer, parameter :: job_take = 1, job_real = 2, job_complex = 3, job_give = 4, job_forget = 5

   !> What one process has of a matrix.
   type :: row_matrix_part_type
      private
      !> As the first process counts them.
      integer :: number = 0
      !> Of rows, and of vectors.
      type(row_ranges_type) :: ranges
      type(halo_matrix_type), pointer :: rows => null()
   end type row_matrix_part_type

   !> What multiplies. Copies of it are the same matrix, and do not outlive it.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
      ! Not associated: this process alone.
      type(processes_type), pointer :: others => null()
      type(row_matrix_part_type) :: part
      ! Of the matrix, while it is put away.
      real(wp) :: norm = 0
      ! Whether all multiply together, with their rows of vectors.
      logical :: together = .false.
   contains
      !> Of a matrix that stays where it is.
      procedure :: take
      !> Of one that each process gets some rows of.
      procedure :: share
      !> Of one of any shape, to be called by all; they multiply together, each with its rows of vectors.
      procedure :: share_between
      procedure :: drop
      !> The same matrix, to be multiplied with in that way, and the number that they know it by; 0 where this one has it alone.
      procedure :: by_rows
      procedure :: shared_as
      !> Their rows are theirs no longer.
      procedure :: forget
      !> The matrix is with the processes only, and is back again.
      procedure :: put_away
      procedure :: bring_back
      !> Largest sum of magnitudes over a row.
      procedure :: infinity_norm
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
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
      self%norm = matrix%infinity_norm()
      call processes%tell([word_matrix, job_take, self%part%number, matrix%rows])
      call take_rows(self%part, matrix, processes, matrix%rows, error)
      if (.not. allocated(error)) self%others => processes
   end subroutine share

   subroutine share_between(self, matrix, rows, columns, processes, error)
      class(row_matrix_type), intent(inout) :: self
      !> Of the first process.
      type(csr_matrix_type), intent(in) :: matrix
      !> Which rows each process gets, and which entries of vectors that are multiplied it has.
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

   !> What another process than the first has of a matrix, to be multiplied with together.
   function part_of(parts, number) result(matrix)
      type(row_matrix_part_type), intent(in) :: parts(:)
      integer, intent(in) :: number
      type(row_matrix_type) :: matrix

      matrix%part = parts(findloc(parts%number, number, dim=1))
      matrix%together = .true.
   end function part_of

   ! The rows of each process, of the matrix in the first one.
   subroutine take_rows(part, matrix, processes, order, error)
      type(row_matrix_part_type), intent(inout) :: part
      type(csr_matrix_type), intent(in) :: matrix
      type(processes_type), intent(in) :: processes
      integer, intent(in) :: order
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: rows

      part%ranges = row_ranges(order, processes%number)
      call share_rows(matrix, part%ranges, order, processes%communicator, rows, error)
      if (allocated(error)) return
      allocate (part%rows)
      call new_halo_matrix(part%rows, rows, part%ranges, processes%communicator, error)
      if (allocated(error)) deallocate (part%rows)
   end subroutine take_rows

   !> Does what the first process has announced.
   subroutine help_multiply(parts, processes, words)
      !> The matrices that have begun and are not forgotten.
      type(row_matrix_part_type), allocatable, intent(inout) :: parts(:)
      type(processes_type), intent(in) :: processes
      !> Job, number of the matrix, and number of vectors or of rows, after the first word.
      integer, intent(in) :: words(number_of_words)
      type(row_matrix_part_type) :: new
      type(csr_matrix_type) :: none
      ! The first process has it as well.
      type(error_type), allocatable :: error
      real(wp) :: no_reals(0, words(4))
      complex(wp) :: no_complexes(0, words(4))
      integer :: i

      associate (job => words(2), number => words(3))
         if (job == job_take) then
            new%number = number
            call take_rows(new, none, processes, words(4), error)
            if (.not. allocated(error)) parts = [parts, new]
            return
         end if
         i = findloc(parts%number, number, dim=1)
         select case (job)
         case (job_real)
            call multiply_real(parts(i), 0.0_wp, no_reals, no_reals, processes%communicator, error)
         case (job_complex)
            call multiply_complex(parts(i), (0.0_wp, 0.0_wp), no_complexes, no_complexes, processes%communicator, error)
         case (job_give)
            call give_rows(parts(i), none, processes, error)
         case (job_forget)
            deallocate (parts(i)%rows)
            parts = pack(parts, parts%number /= number)
         end select
      end associate
   end subroutine help_multiply

   subroutine forget(self)
      class(row_matrix_type), intent(inout) :: self

      if (.not. associated(self%others)) return
      call self%others%tell([word_matrix, job_forget, self%part%number])
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
      call self%others%tell([word_matrix, job_give, self%part%number])
      call give_rows(self%part, self%matrix, self%others, error)
   end subroutine bring_back

   subroutine give_rows(part, matrix, processes, error)
      type(row_matrix_part_type), intent(in) :: part
      !> That of the first process gets its entries.
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
