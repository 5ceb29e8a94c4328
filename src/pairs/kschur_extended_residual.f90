!> Residuals summed in extended precision.
module kschur_extended_residual
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: residual_of, violations_of

contains

   !> The force M a + R v + (K + i H) x + Cq^T xi of a motion, summed in extended precision.
   function residual_of(problem, transposed, x, velocity, acceleration, xi)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      complex(xp), intent(in) :: x(:), velocity(:), acceleration(:)
      !> Multipliers.
      complex(wp), intent(in) :: xi(:)
      complex(wp) :: residual_of(size(x))
      complex(xp) :: force, multipliers(size(xi))
      integer :: i

      multipliers = xi
      do i = 1, size(x)
         force = row_product(problem%mass, i, acceleration) + row_product(problem%damping, i, velocity) &
            + row_product(problem%stiffness, i, x) + row_product(transposed, i, multipliers)
         if (allocated(problem%loss)) force = force + (0.0_xp, 1.0_xp)*row_product(problem%loss, i, x)
         residual_of(i) = cmplx(force, kind=wp)
      end do
   end function residual_of

   !> The constraint violation Cq phi, summed in extended precision.
   function violations_of(constraints, phi)
      type(csr_matrix_type), intent(in) :: constraints
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: violations_of(constraints%rows)
      complex(xp) :: x(size(phi))
      integer :: i

      x = phi
      do i = 1, constraints%rows
         violations_of(i) = cmplx(row_product(constraints, i, x), kind=wp)
      end do
   end function violations_of

   ! Row i of a matrix times a vector, in extended precision.
   pure complex(xp) function row_product(matrix, i, x) result(total)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i
      complex(xp), intent(in) :: x(:)
      integer :: k

      total = 0
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
         total = total + matrix%value(k)*x(matrix%column(k))
      end do
   end function row_product
end module kschur_extended_residual
