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

   !> What multiplies. Copies of it are the same matrix, and do not outlive it.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
   contains
      !> Of a matrix that stays where it is.
      procedure :: take
      !> Of one that each process gets some rows of.
      procedure :: share
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
   end subroutine take

   subroutine share(self, matrix, processes, error)
      class(row_matrix_type), intent(inout) :: self
      type(csr_matrix_type), target, intent(inout) :: matrix
      !> Not associated: this process alone.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes)
      end associate
      self%matrix => matrix
   end subroutine share

   subroutine forget(self)
      class(row_matrix_type), intent(inout) :: self

      nullify (self%matrix)
   end subroutine forget

   subroutine put_away(self)
      class(row_matrix_type), intent(in) :: self

      associate (unused => self)
      end associate
   end subroutine put_away

   subroutine bring_back(self, error)
      class(row_matrix_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self)
      end associate
   end subroutine bring_back

   real(wp) function infinity_norm(self)
      class(row_matrix_type), intent(in) :: self

      infinity_norm = self%matrix%infinity_norm()
   end function infinity_norm

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
