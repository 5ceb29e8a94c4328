!> Residuals summed in extended precision.
module kschur_extended_residual
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: extended_product, residual_of, violations_of

contains

   !> The force M a + R v + (K + i H) x + Cq^T xi of a motion.
   function residual_of(problem, transposed, x, velocity, acceleration, xi)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      complex(xp), intent(in) :: x(:), velocity(:), acceleration(:)
      !> Multipliers.
      complex(wp), intent(in) :: xi(:)
      complex(wp) :: residual_of(size(x))
      real(xp) :: force(size(x), 2)

      ! One after the other, as products take memory.
      force = extended_product(problem%mass, parts(acceleration))
      force = force + extended_product(problem%damping, parts(velocity))
      force = force + extended_product(problem%stiffness, parts(x))
      force = force + extended_product(transposed, parts(cmplx(xi, kind=xp)))
      if (allocated(problem%loss)) force = force + extended_product(problem%loss, parts((0.0_xp, 1.0_xp)*x))
      residual_of = cmplx(force(:, 1), force(:, 2), wp)
   end function residual_of

   !> The constraint violation Cq phi.
   function violations_of(constraints, phi)
      type(csr_matrix_type), intent(in) :: constraints
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: violations_of(constraints%rows)
      real(xp) :: violations(constraints%rows, 2)

      violations = extended_product(constraints, parts(cmplx(phi, kind=xp)))
      violations_of = cmplx(violations(:, 1), violations(:, 2), wp)
   end function violations_of

   ! The real and the imaginary part of a vector, as columns.
   pure function parts(x)
      complex(xp), intent(in) :: x(:)
      real(xp) :: parts(size(x), 2)

      parts(:, 1) = real(x, xp)
      parts(:, 2) = aimag(x)
   end function parts

   !> A X, summed in extended precision.
   pure function extended_product(matrix, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      real(xp), intent(in) :: x(:, :)
      real(xp) :: y(matrix%rows, size(x, 2)), total(size(x, 2))
      integer :: i, k

      do i = 1, matrix%rows
         total = 0
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            total = total + matrix%value(k)*x(matrix%column(k), :)
         end do
         y(i, :) = total
      end do
   end function extended_product
end module kschur_extended_residual
