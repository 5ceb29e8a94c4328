!> Trial solutions measure the backward error of a solver: without pivoting there is no bound in advance.
module kschur_trial_solution
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: try_solver

contains

   !> Solves for a random right-hand side, and returns the largest row-wise backward error: in a normwise one, large entries
   !> would hide errors in rows of small ones.
   subroutine try_solver(solver, matrix, multipliers, backward_error, error, refinements)
      !> Has factored the matrix.
      class(real_linear_solver_type), intent(inout) :: solver
      type(csr_matrix_type), intent(in) :: matrix
      !> Number of multipliers: their right-hand side is zero, as redundant constraints are inconsistent otherwise.
      integer, intent(in) :: multipliers
      !> Huge if the solution overflowed.
      real(wp), intent(out) :: backward_error
      type(error_type), allocatable, intent(out) :: error
      !> Number of refinement steps that callers make; absent: none.
      integer, optional, intent(in) :: refinements
      real(wp), allocatable :: x(:, :), residual(:, :), correction(:, :)
      real(wp) :: largest, scale
      integer(long) :: state
      integer :: i, k, step, steps, status

      backward_error = 0
      if (matrix%rows == 0) return
      steps = 0
      if (present(refinements)) steps = refinements
      allocate (x(matrix%rows, 1), residual(matrix%rows, 1), correction(matrix%rows, 1), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "no memory for a trial solution")
         return
      end if
      state = 1
      call random_vector(state, x(:, 1))
      x(matrix%rows - multipliers + 1:, 1) = 0
      residual = x
      largest = maxval(abs(x))
      x = 0
      do step = 0, steps
         correction = residual
         call solver%solve(correction, error)
         if (allocated(error)) return
         x = x + correction
         call matrix%add_product(-1.0_wp, correction, residual)
      end do
      do i = 1, matrix%rows
         scale = largest
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            scale = scale + abs(matrix%value(k)*x(matrix%column(k), 1))
         end do
         if (abs(residual(i, 1)) <= huge(scale) .and. scale <= huge(scale)) then
            backward_error = max(backward_error, abs(residual(i, 1))/scale)
         else
            backward_error = huge(scale)
         end if
      end do
   end subroutine try_solver
end module kschur_trial_solution
