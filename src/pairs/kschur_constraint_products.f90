!> Products of the constraint Jacobian with eigenpairs, several at a time: violation, reactions, and their effect on eigenvalues.
module kschur_constraint_products
   use kschur_kinds, only: wp, xp
   use kschur_sparse, only: csr_matrix_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: constraint_products_type, multiply_constraints

   !> Constraint products of a few pairs.
   type :: constraint_products_type
      !> ||Cq phi|| of each pair.
      real(wp), allocatable :: violation(:)
      !> Size of the reactions of each pair: the norm of |xi_r| ||Cq_r|| over the rows r.
      real(wp), allocatable :: reaction(:)
      !> Error of its eigenvalue by rounding of the entries of constraints, times phi^T P'(lambda) phi: the sum of
      !> epsilon |xi_r| (|Cq| |phi|)_r. The effect of the violation is removed by Rayleigh's functional.
      real(wp), allocatable :: effect(:)
      ! xi^T Cq phi, of each real and imaginary part of phi and of xi: parts x 2 x pairs.
      real(xp), allocatable, private :: work(:, :, :)
   contains
      !> xi^T Cq phi of pair l, summed in more than the working precision.
      procedure :: work_of
   end type constraint_products_type

contains

   !> Computes the constraint products of a few pairs in one pass over Cq. Sums of row panels are added up in order, so that the
   !> result does not depend on the number of threads.
   subroutine multiply_constraints(constraints, phi, xi, parts, pairs, products)
      !> Cq, m x n.
      type(csr_matrix_type), intent(in) :: constraints
      !> Shapes, lanes x n: real parts and, of complex shapes, imaginary parts of each entry side by side. Multipliers,
      !> lanes x m x 2/parts: both parts; those of real shapes have the imaginary parts in the second slice.
      real(wp), contiguous, intent(in) :: phi(:, :), xi(:, :, :)
      !> Number of parts of each shape, 1 if real, 2 if complex, and number of pairs.
      integer, intent(in) :: parts, pairs
      type(constraint_products_type), intent(out) :: products
      ! Squares of violations and of reactions, and effects, of each panel.
      real(xp), allocatable :: sums(:, :, :), work(:, :, :, :)
      real(wp) :: magnitude(size(phi, 1))
      real(xp) :: violations(size(phi, 1)), terms(size(phi, 1)), multiplier(2)
      real(xp) :: row_square, violation, reaction
      integer :: panels, first, last, i, j, k, l

      panels = (constraints%rows + panel_rows - 1)/panel_rows
      allocate (sums(pairs, 3, panels), work(parts, 2, pairs, panels), source=0.0_xp)
      !$omp parallel do schedule(static) &
      !$omp    private(first, last, j, k, l, terms, violations, magnitude, multiplier, row_square, violation, reaction) &
      !$omp    if (panels > 1)
      do i = 1, panels
         do k = (i - 1)*panel_rows + 1, min(i*panel_rows, constraints%rows)
            row_square = 0
            violations = 0
            magnitude = 0
            do j = constraints%row_start(k), constraints%row_start(k + 1) - 1
               terms = real(constraints%value(j), xp)*phi(:, constraints%column(j))
               violations = violations + terms
               magnitude = magnitude + real(abs(terms), wp)
               row_square = row_square + real(constraints%value(j), xp)**2
            end do
            do l = 1, pairs
               first = parts*(l - 1) + 1
               last = parts*l
               multiplier = reshape(xi(first:last, k, :), [2])
               violation = sum(violations(first:last)**2)
               reaction = sum(multiplier**2)
               sums(l, :, i) = sums(l, :, i) + [violation, reaction*row_square, sqrt(reaction)*epsilon(1.0_wp)* &
                  norm2(magnitude(first:last))]
               do j = 1, 2
                  work(:, j, l, i) = work(:, j, l, i) + multiplier(j)*violations(first:last)
               end do
            end do
         end do
      end do
      !$omp end parallel do
      allocate (products%violation(pairs), products%reaction(pairs), products%effect(pairs), products%work(parts, 2, pairs))
      products%violation = real(sqrt(sum(sums(:, 1, :), 2)), wp)
      products%reaction = real(sqrt(sum(sums(:, 2, :), 2)), wp)
      products%effect = real(sum(sums(:, 3, :), 2), wp)
      products%work = sum(work, 4)
   end subroutine multiply_constraints

   !> xi^T Cq phi of pair l.
   pure complex(xp) function work_of(self, l) result(work)
      class(constraint_products_type), intent(in) :: self
      integer, intent(in) :: l

      work = cmplx(self%work(1, 1, l), self%work(1, 2, l), xp)
      if (size(self%work, 1) == 2) work = work + cmplx(-self%work(2, 2, l), self%work(2, 1, l), xp)
   end function work_of
end module kschur_constraint_products
