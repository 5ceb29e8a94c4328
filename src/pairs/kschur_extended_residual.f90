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
      complex(xp) :: forces(size(x))

      forces = complex_product(problem%mass, acceleration) + complex_product(problem%damping, velocity) &
         + complex_product(problem%stiffness, x) + complex_product(transposed, cmplx(xi, kind=xp))
      if (allocated(problem%loss)) forces = forces + (0.0_xp, 1.0_xp)*complex_product(problem%loss, x)
      residual_of = cmplx(forces, kind=wp)
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
      real(xp) :: parts(matrix%rows, 2)

      parts = real_product(matrix, reshape([real(x, xp), aimag(x)], [size(x), 2]))
      y = cmplx(parts(:, 1), parts(:, 2), xp)
   end function complex_product

   pure function real_product(matrix, x) result(y)
      type(csr_matrix_type), intent(in) :: matrix
      real(xp), intent(in) :: x(:, :)
      real(xp) :: y(matrix%rows, size(x, 2))
      integer :: i, j, k

      y = 0
      do j = 1, size(x, 2)
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               y(i, j) = y(i, j) + matrix%value(k)*x(matrix%column(k), j)
            end do
         end do
      end do
   end function real_product
end module kschur_extended_residual
