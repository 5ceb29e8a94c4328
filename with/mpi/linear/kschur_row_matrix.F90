!> A sparse matrix that is multiplied with again and again, by all processes that work on a solve: each has some of its rows. The
!> first process says what is to be done, the others do it in `help_multiply`.
module kschur_row_matrix
   use kschur_error, only: error_type
   use kschur_halo_matrix, only: halo_matrix_type, new_halo_matrix
   use kschur_kinds, only: wp
   use kschur_matrix_rows, only: share_rows
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_processes, only: are_several, number_of_words, processes_type, spread_error, word_matrix
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_sparse, only: csr_matrix_type
   use mpi_f08, only: MPI_Bcast, MPI_Comm, MPI_Comm_rank, MPI_Comm_size, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, &
      MPI_Gatherv, MPI_Scatterv
   implicit none
   private
   public :: help_multiply, row_matrix_part_type, row_matrix_type

   ! What is done with a matrix: its rows are taken, multiplied with real or complex vectors, and forgotten.
   integer, parameter :: job_take = 1, job_real = 2, job_complex = 3, job_forget = 4

   !> What one process has of a matrix.
   type :: row_matrix_part_type
      private
      !> As the first process counts them.
      integer :: number = 0
      !> Of rows, and of vectors.
      type(row_ranges_type) :: ranges
      type(halo_matrix_type), pointer :: rows => null()
   end type row_matrix_part_type

   !> Products of a matrix.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
      ! Not associated: this process alone.
      type(processes_type), pointer :: others => null()
      type(row_matrix_part_type) :: part
   contains
      !> Takes a matrix, which stays where it is.
      procedure :: begin
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
      procedure, private :: add_product_real, add_product_complex
      final :: forget
   end type row_matrix_type

contains

   subroutine begin(self, matrix, processes, error)
      class(row_matrix_type), intent(inout) :: self
      !> Square.
      type(csr_matrix_type), target, intent(in) :: matrix
      !> Who works together; not associated: this process alone.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      call forget(self)
      self%matrix => matrix
      if (.not. are_several(processes, matrix%rows)) return
      processes%matrices = processes%matrices + 1
      self%part%number = processes%matrices
      call processes%tell([word_matrix, job_take, self%part%number, matrix%rows])
      call take(self%part, matrix, processes, matrix%rows, error)
      if (.not. allocated(error)) self%others => processes
   end subroutine begin

   ! The rows of each process, of the matrix in the first one.
   subroutine take(part, matrix, processes, order, error)
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
   end subroutine take

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
            call take(new, none, processes, words(4), error)
            if (.not. allocated(error)) parts = [parts, new]
            return
         end if
         i = findloc(parts%number, number, dim=1)
         select case (job)
         case (job_real)
            call multiply_real(parts(i), 0.0_wp, no_reals, no_reals, processes%communicator, error)
         case (job_complex)
            call multiply_complex(parts(i), (0.0_wp, 0.0_wp), no_complexes, no_complexes, processes%communicator, error)
         case (job_forget)
            deallocate (parts(i)%rows)
            parts = pack(parts, parts%number /= number)
         end select
      end associate
   end subroutine help_multiply

   impure elemental subroutine forget(self)
      type(row_matrix_type), intent(inout) :: self

      if (.not. associated(self%others)) return
      call self%others%tell([word_matrix, job_forget, self%part%number])
      deallocate (self%part%rows)
      nullify (self%others)
   end subroutine forget

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
