!> A sparse matrix for many products, with its rows distributed over the processes of a solve. This build has one process;
!> `with/mpi` has the module for several.
module kschur_row_matrix
   use kschur_columns_real, only: subtract_columns
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: row_matrix_type

   !> Pointer to a matrix; copies share it and must not outlive it.
   type :: row_matrix_type
      private
      type(csr_matrix_type), pointer :: matrix => null()
   contains
      !> Points to a matrix of this process.
      procedure :: take
      !> Distributes the rows of a matrix over the processes.
      procedure :: share
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
      !> Fails if a process runs out of memory.
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

      associate (unused => error)
      end associate
      allocate (difference(size(x, 1), size(x, 2)), subtracted(size(x, 1), size(x, 2)), source=0.0_wp)
      call self%matrix%add_product(1.0_wp, x, difference)
      call other%matrix%add_product(1.0_wp, x, subtracted)
      call subtract_columns(theta, subtracted, difference, lengths)
      if (present(y)) y = difference
   end subroutine residual
end module kschur_row_matrix
