!> Residuals of eigenpairs relative to the magnitudes of their terms.
module kschur_residual_parts
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: add_magnitudes
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: forces_of, residual_part, residual_parts

contains

   !> Residuals of chosen pairs relative to their terms; zero for the others.
   function residual_parts(problem, pairs, chosen) result(parts)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: chosen(:)
      real(wp) :: parts(size(pairs%lambda))
      integer :: j

      parts = 0
      do j = 1, size(parts)
         if (chosen(j)) parts(j) = residual_part(problem, pairs, j)
      end do
   end function residual_parts

   !> Norm of the residual of pair j relative to the norm of the magnitudes of its terms (2-norms): unlike a backward error it does
   !> not depend on the magnitude of the eigenvalue.
   real(wp) function residual_part(problem, pairs, j) result(part)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      complex(wp) :: phi(pairs%rows(), 1)
      real(wp) :: terms(pairs%rows(), 1)

      phi(:, 1) = pairs%column(j)
      terms = 0
      call add_magnitudes(problem%mass, abs(pairs%lambda(j)**2*phi), terms)
      call add_magnitudes(problem%damping, abs(pairs%lambda(j)*phi), terms)
      call add_magnitudes(problem%stiffness, abs(phi), terms)
      if (allocated(problem%loss)) call add_magnitudes(problem%loss, abs(phi), terms)
      call add_transposed_sizes(problem%constraints, pairs%xi(:, j), terms(:, 1))
      part = norm2(abs(sum(forces_of(problem, pairs, j), 2)))/max(norm2(terms), tiny(1.0_wp))
   end function residual_part

   !> The forces of pair j: lambda^2 M phi, lambda R phi, and K phi + i H phi + Cq^T xi; n x 3.
   function forces_of(problem, pairs, j) result(forces)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      complex(wp), dimension(pairs%rows(), 1) :: phi
      complex(wp) :: forces(pairs%rows(), 3)

      phi(:, 1) = pairs%column(j)
      forces = 0
      call problem%mass%add_product(pairs%lambda(j)**2, phi, forces(:, 1:1))
      call problem%damping%add_product(pairs%lambda(j), phi, forces(:, 2:2))
      call problem%stiffness%add_product((1.0_wp, 0.0_wp), phi, forces(:, 3:3))
      if (allocated(problem%loss)) call problem%loss%add_product((0.0_wp, 1.0_wp), phi, forces(:, 3:3))
      call problem%constraints%add_transposed_product((1.0_wp, 0.0_wp), pairs%xi(:, j:j), forces(:, 3:3))
   end function forces_of

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
