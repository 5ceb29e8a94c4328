!> A sparse matrix that is multiplied with again and again, by all processes that work on a solve. In this build there is one;
!> `with/mpi` has the module for several.
module kschur_row_matrix
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: row_matrix_type

   !> Products of a matrix.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
   contains
      !> Takes a matrix, which stays where it is.
      procedure :: begin
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
      procedure, private :: add_product_real, add_product_complex
   end type row_matrix_type

contains

   subroutine begin(self, matrix, processes, error)
      class(row_matrix_type), intent(inout) :: self
      type(csr_matrix_type), target, intent(in) :: matrix
      !> Who works together; not associated: this process alone.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes)
      end associate
      self%matrix => matrix
   end subroutine begin

   subroutine add_product_real(self, alpha, x, y, error)
      class(row_matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      !> Memory of one of the processes may end.
      type(error_type), allocatable, intent(out) :: error

      call self%matrix%add_product(alpha, x, y)
   end subroutine add_product_real

   subroutine add_product_complex(self, alpha, x, y, error)
      class(row_matrix_type), intent(in) :: self
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%matrix%add_product(alpha, x, y)
   end subroutine add_product_complex
end module kschur_row_matrix
