!> Multipliers of constraints that balance given forces.
module kschur_reactions
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesv
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: balance_forces

contains

   !> Finds the multipliers xi for which f + Cq^T xi is smallest, by the normal equations, which suit few and well independent
   !> constraints, and adds Cq^T xi to f.
   subroutine balance_forces(constraints, forces, xi, lengths)
      !> Cq, m x n, without zero rows.
      type(csr_matrix_type), intent(in) :: constraints
      !> f, n x k.
      real(wp), contiguous, intent(inout) :: forces(:, :)
      !> m x k; zero if the constraints are dependent.
      real(wp), contiguous, intent(out) :: xi(:, :)
      !> Norms of the rows of Cq.
      real(wp), intent(out) :: lengths(:)
      real(wp) :: gram(constraints%rows, constraints%rows), row(constraints%columns)
      integer :: pivots(constraints%rows), i, j, info

      gram = 0
      row = 0
      do i = 1, constraints%rows
         associate (a => constraints%row_start(i), z => constraints%row_start(i + 1) - 1)
            lengths(i) = norm2(constraints%value(a:z))
            row(constraints%column(a:z)) = constraints%value(a:z)/lengths(i)
            do j = 1, i
               associate (b => constraints%row_start(j), y => constraints%row_start(j + 1) - 1)
                  gram(i, j) = dot_product(constraints%value(b:y), row(constraints%column(b:y)))/lengths(j)
                  gram(j, i) = gram(i, j)
               end associate
            end do
            row(constraints%column(a:z)) = 0
         end associate
      end do
      xi = 0
      call constraints%add_product(-1.0_wp, forces, xi)
      do i = 1, constraints%rows
         xi(i, :) = xi(i, :)/lengths(i)
      end do
      call dgesv(constraints%rows, size(xi, 2), gram, constraints%rows, pivots, xi, constraints%rows, info)
      if (info /= 0) xi = 0
      do i = 1, constraints%rows
         xi(i, :) = xi(i, :)/lengths(i)
      end do
      call constraints%add_transposed_product(1.0_wp, xi, forces)
   end subroutine balance_forces
end module kschur_reactions
