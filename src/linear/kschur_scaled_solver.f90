!> Solver that uses the factors of a scaled matrix for the matrix itself.
module kschur_scaled_solver
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: scaled_real_type

   !> A^{-1} f = D (D A D)^{-1} D f, D a diagonal of powers of two, so that scaling is exact. `factorize` does nothing:
   !> the factors are those that it has taken.
   type, extends(real_linear_solver_type) :: scaled_real_type
      ! Of D A D.
      class(real_linear_solver_type), allocatable, private :: factors
      ! D; not allocated: `factors` scales.
      real(wp), allocatable, private :: scaling(:)
   contains
      !> Takes over the factors and D.
      procedure :: take
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: forget_factors
      procedure :: shared_as
      procedure :: solve_rows
   end type scaled_real_type

contains

   subroutine take(self, factors, scaling)
      class(scaled_real_type), intent(inout) :: self
      !> Of D A D.
      class(real_linear_solver_type), allocatable, intent(inout) :: factors
      !> D.
      real(wp), allocatable, intent(inout) :: scaling(:)
      logical :: is_absorbed

      call move_alloc(factors, self%factors)
      call self%factors%absorb_scaling(scaling, is_absorbed)
      if (.not. is_absorbed) call move_alloc(scaling, self%scaling)
   end subroutine take

   subroutine factorize(self, matrix, structure, error)
      class(scaled_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => matrix, neither => structure)
         self%factor_entries = self%factors%factor_entries
         self%factor_bytes = self%factors%factor_bytes
         self%null_pivots = self%factors%null_pivots
         self%negative_pivots = self%factors%negative_pivots
         self%description = self%factors%description
      end associate
   end subroutine factorize

   subroutine solve(self, x, error)
      class(scaled_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (allocated(self%scaling)) call scale_rows(self%scaling, x)
      call self%factors%solve(x, error)
      if (allocated(error)) return
      if (allocated(self%scaling)) call scale_rows(self%scaling, x)
      self%solve_seconds = self%factors%solve_seconds
   end subroutine solve

   subroutine solve_adjoint(self, x, error)
      class(scaled_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (allocated(self%scaling)) call scale_rows(self%scaling, x)
      call self%factors%solve_adjoint(x, error)
      if (allocated(error)) return
      if (allocated(self%scaling)) call scale_rows(self%scaling, x)
      self%solve_seconds = self%factors%solve_seconds
   end subroutine solve_adjoint

   ! Vectors distributed by rows are not scaled here.
   integer function shared_as(self)
      class(scaled_real_type), intent(in) :: self

      shared_as = 0
      if (.not. allocated(self%scaling)) shared_as = self%factors%shared_as()
   end function shared_as

   subroutine solve_rows(self, x, error)
      class(scaled_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%factors%solve_rows(x, error)
      self%solve_seconds = self%factors%solve_seconds
   end subroutine solve_rows

   ! x := D x.
   pure subroutine scale_rows(scaling, x)
      real(wp), intent(in) :: scaling(:)
      real(wp), intent(inout) :: x(:, :)
      integer :: j

      do j = 1, size(x, 2)
         x(:, j) = scaling*x(:, j)
      end do
   end subroutine scale_rows

   ! Keeps nothing: the object serves one matrix only.
   subroutine forget_factors(self, kept)
      class(scaled_real_type), intent(inout) :: self
      logical, intent(out) :: kept

      call self%factors%forget_factors(kept)
      kept = .false.
   end subroutine forget_factors
end module kschur_scaled_solver
