!> Residuals summed in extended precision.
module kschur_extended_residual
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: extended_product, residual_of, violations_of

   !> A x, summed in extended precision.
   interface extended_product
      module procedure real_product, complex_product
   end interface extended_product

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

   !> The constraint violation Cq phi.
   function violations_of(constraints, phi)
      type(csr_matrix_type), intent(in) :: constraints
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: violations_of(constraints%rows)

      violations_of = cmplx(complex_product(constraints, cmplx(phi, kind=xp)), kind=wp)
   end function violations_of

   pure function complex_product(matrix, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      complex(xp), intent(in) :: x(:)
      complex(xp) :: y(matrix%rows)
      integer :: i

      do i = 1, matrix%rows
         y(i) = row_product(matrix, i, x)
      end do
   end function complex_product

   pure complex(xp) function row_product(matrix, i, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i
      complex(xp), intent(in) :: x(:)
      integer :: k

      y = 0
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
         y = y + matrix%value(k)*x(matrix%column(k))
      end do
   end function row_product

   pure function real_product(matrix, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      real(xp), intent(in) :: x(:, :)
      real(xp) :: y(matrix%rows, size(x, 2))
      real(xp) :: total
      integer :: i, j, k

      do j = 1, size(x, 2)
         do i = 1, matrix%rows
            total = 0
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               total = total + matrix%value(k)*x(matrix%column(k), j)
            end do
            y(i, j) = total
         end do
      end do
   end function real_product
end module kschur_extended_residual
