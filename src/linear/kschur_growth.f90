!> Growth of an LDL^T without pivoting: how far |L| |D| |L^T|, in units of which rounding errors are bounded (Higham, Accuracy and
!> Stability of Numerical Algorithms, 2nd ed., theorem 11.3), exceeds the matrix. By the inequality of Cauchy and Schwarz its
!> entries are bounded by its diagonal; that equals the diagonal of the matrix if it is definite. Symmetric diagonal scaling does
!> not change their ratio.
module kschur_growth
   use kschur_fronts, only: supernodal_factors_type
   use kschur_kinds, only: long, wp
   use kschur_symbolic, only: symbolic_type
   use kschur_tolerances, only: accepted_backward_error
   implicit none
   private
   public :: add_terms, has_grown

contains

   !> Adds the diagonal of (|L| - I) |D| (|L| - I)^T, of all columns here. The square of an entry of L alone might underflow.
   pure subroutine add_terms(symbolic, factors, has_block, diagonal)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      !> Whether the diagonal block of each supernode counts here.
      logical, intent(in) :: has_block(:)
      !> In the order of elimination.
      real(wp), intent(inout) :: diagonal(:)
      integer(long) :: at
      integer :: s, j, k

      do s = 1, size(has_block)
         at = factors%offset(s)
         associate (last => symbolic%first(s + 1) - 1, row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1), &
            pivot => factors%pivot, lower => factors%lower)
            do j = symbolic%first(s), last
               if (has_block(s)) diagonal(j + 1:last) = diagonal(j + 1:last) + &
                  abs(pivot(j))*abs(lower(at:at + last - j - 1))*abs(lower(at:at + last - j - 1))
               at = at + last - j
            end do
            do j = symbolic%first(s), last
               do k = 1, size(row)
                  diagonal(row(k)) = diagonal(row(k)) + abs(pivot(j))*abs(lower(at + k - 1))*abs(lower(at + k - 1))
               end do
               at = at + size(row)
            end do
         end associate
      end do
   end subroutine add_terms

   !> Whether rounding may exceed `accepted_backward_error` in the units of the diagonal.
   elemental logical function has_grown(terms, diagonal)
      !> Diagonal entries of |L| |D| |L^T| and of the matrix.
      real(wp), intent(in) :: terms, diagonal

      has_grown = .not. epsilon(1.0_wp)*terms <= accepted_backward_error*abs(diagonal)
   end function has_grown
end module kschur_growth
