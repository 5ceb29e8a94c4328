!> Iterative refinement with residuals in extended precision (Higham 2002, section 12.1).
module kschur_refinement
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, xp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_threads, only: panel_rows
   use kschur_tolerances, only: slow_refinement
   implicit none
   private
   public :: solve_and_refine

contains

   !> Overwrites each column b by A^{-1} b: solves with the factors, and refines until corrections are negligible or no longer
   !> decrease.
   subroutine solve_and_refine(solver, matrix, x, error)
      !> Has factored A or an approximation of it.
      class(real_linear_solver_type), intent(inout) :: solver
      !> A
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 10
      ! Stops at a relative correction well below rounding, since a small correction does not imply a small next one.
      real(wp), parameter :: negligible = 0.001_wp*epsilon(1.0_wp)
      real(wp), allocatable :: rhs(:, :), correction(:, :)
      ! Largest relative correction of a column, and the one before.
      real(wp) :: change, previous
      integer :: step

      allocate (rhs, source=x)
      call solver%solve(x, error)
      if (allocated(error)) return
      allocate (correction(size(x, 1), size(x, 2)))
      previous = 1
      do step = 1, steps
         call find_residual(matrix, rhs, x, correction)
         call solver%solve(correction, error)
         if (allocated(error)) return
         change = maxval(maxval(abs(correction), 1)/max(maxval(abs(x), 1), tiny(1.0_wp)))
         if (.not. change <= slow_refinement*previous) exit
         x = x + correction
         if (change**2 <= negligible*previous) exit
         previous = change
      end do
   end subroutine solve_and_refine

   ! residual := b - A x, in extended precision.
   subroutine find_residual(matrix, rhs, x, residual)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(in) :: rhs(:, :), x(:, :)
      real(wp), contiguous, intent(out) :: residual(:, :)
      real(xp) :: total
      integer :: i, j, k

      !$omp parallel do schedule(static) private(j, k, total) if (matrix%rows > panel_rows)
      do i = 1, matrix%rows
         do j = 1, size(x, 2)
            total = rhs(i, j)
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               total = total - real(matrix%value(k), xp)*x(matrix%column(k), j)
            end do
            residual(i, j) = real(total, wp)
         end do
      end do
      !$omp end parallel do
   end subroutine find_residual
end module kschur_refinement
