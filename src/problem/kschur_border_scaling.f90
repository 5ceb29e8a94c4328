!> Scaling of a symmetric matrix that constraints border, [A, Cq^T; Cq, 0], to entries of size one.
module kschur_border_scaling
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tied_levels, only: spread_levels
   implicit none
   private
   public :: find_scalings

contains

   !> Finds powers of two, so that scaling is exact: of unknowns by the largest entry of their rows of A, or of those that
   !> constraints tie them to; of constraints by their largest entry after that.
   subroutine find_scalings(a, constraints, scaling, constraint_scaling)
      !> n x n, and Cq, m x n.
      type(csr_matrix_type), intent(in) :: a, constraints
      !> Factors of the n unknowns and m constraints.
      real(wp), intent(out) :: scaling(:), constraint_scaling(:)
      real(wp) :: level(a%rows), softest
      integer :: i

      level = a%row_maxima()
      if (all(.not. level > 0)) level = 1
      softest = minval(level, level > 0)
      call spread_levels(constraints, level)
      where (.not. level > 0) level = maxval(level)
      ! A tie by an entry that is a rounding error must not lower a level below the softest row.
      level = max(level, softest)
      scaling = scale(1.0_wp, -exponent(level)/2)
      do i = 1, constraints%rows
         associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
            constraint_scaling(i) = scale(1.0_wp, -exponent(maxval( &
               abs(constraints%value(first:last)*scaling(constraints%column(first:last))))))
         end associate
      end do
   end subroutine find_scalings
end module kschur_border_scaling
