!> Residuals of eigenpairs relative to the magnitudes of their terms.
module kschur_residual_parts
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: add_magnitudes
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: residual_parts

contains

   !> Norm of the residual of chosen pairs relative to the norm of the magnitudes of its terms (2-norms): unlike a backward
   !> error it does not depend on the magnitude of the eigenvalue. Zero for the others.
   function residual_parts(problem, pairs, chosen) result(parts)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: chosen(:)
      real(wp) :: parts(size(pairs%lambda))
      complex(wp), dimension(pairs%rows(), 1) :: phi, residual
      real(wp) :: terms(pairs%rows(), 1)
      integer :: j

      parts = 0
      if (.not. any(chosen)) return
      do j = 1, size(parts)
         if (.not. chosen(j)) cycle
         phi(:, 1) = pairs%column(j)
         residual = 0
         call problem%mass%add_product(pairs%lambda(j)**2, phi, residual)
         call problem%damping%add_product(pairs%lambda(j), phi, residual)
         call problem%stiffness%add_product((1.0_wp, 0.0_wp), phi, residual)
         if (allocated(problem%loss)) call problem%loss%add_product((0.0_wp, 1.0_wp), phi, residual)
         call problem%constraints%add_transposed_product((1.0_wp, 0.0_wp), pairs%xi(:, j:j), residual)
         terms = 0
         call add_magnitudes(problem%mass, abs(pairs%lambda(j)**2*phi), terms)
         call add_magnitudes(problem%damping, abs(pairs%lambda(j)*phi), terms)
         call add_magnitudes(problem%stiffness, abs(phi), terms)
         if (allocated(problem%loss)) call add_magnitudes(problem%loss, abs(phi), terms)
         call add_transposed_sizes(problem%constraints, pairs%xi(:, j), terms(:, 1))
         parts(j) = norm2(abs(residual(:, 1)))/max(norm2(terms), tiny(1.0_wp))
      end do
   end function residual_parts

   ! y := y + |A|^T |x|.
   pure subroutine add_transposed_sizes(matrix, x, y)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: y(:)
      integer :: i, k

      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            y(matrix%column(k)) = y(matrix%column(k)) + abs(matrix%value(k))*abs(x(i))
         end do
      end do
   end subroutine add_transposed_sizes
end module kschur_residual_parts
