!> The inertia of a real symmetric matrix, proved by LDL^T without pivoting.
!>
!> In floating-point arithmetic L D L^T = A + E, where |E| <= c u |L||D||L|^T, u the unit roundoff and c the number of
!> terms in a row of L and a few more (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., lemma 8.4 and
!> section 9.3). The lemma holds in whatever order and in whatever blocks the terms are summed, with fused multiplications
!> or without, as each term goes through no more additions than there are terms; so it holds for supernodes, for sums that
!> fronts and processes pass on, and for BLAS that multiplies in the conventional way. A stored zero adds nothing, but counts
!> as a term. E is bounded by a diagonal matrix
!> S,
!>
!>    |x^T E x| <= u sum_p |d_p| (sum_k sqrt(c_k) |l_kp| |x_k|)^2 <= x^T S x,
!>    S_k = u c_k ((1 + sqrt(e_k)) |d_k| + sum_{p<k} (e_p + sqrt(e_p)) |d_p| l_kp^2),
!>
!> by the inequality of Cauchy and Schwarz, e_p the number of entries below the diagonal of column p; and S_k is known
!> when pivot k is. So A is factored twice, with S subtracted from the pivots and with S added to them: the first factorisation
!> has the inertia of a matrix below A, the second that of one above A (Sylvester). If both have the same number of negative
!> pivots, A has that many negative eigenvalues, and none is zero. If a pivot is zero the factorisation stops: the leading
!> block before it has no more negative and no more positive eigenvalues than A. The second factorisation is not needed if the
!> number of negative pivots of the first equals a lower bound proved before.
module kschur_proved_inertia
   use kschur_error, only: error_type
   use kschur_fronts, only: supernodal_factors_type
   use kschur_kinds, only: wp
   use kschur_monitor, only: monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: cut_subtrees, subtrees_type
   use kschur_supernodal, only: eliminate
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: bound_negative_eigenvalues

contains

   !> Bounds the number of negative eigenvalues of a symmetric matrix by `least` and `most`.
   subroutine bound_negative_eigenvalues(matrix, symbolic, proved_negative, least, most, error, monitor)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      !> A lower bound of it that was proved before.
      integer, intent(in) :: proved_negative
      integer, intent(out) :: least, most
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      type(supernodal_factors_type) :: factors
      type(subtrees_type) :: subtrees

      least = 0
      most = matrix%rows
      subtrees = cut_subtrees(symbolic)
      call eliminate(matrix, symbolic, subtrees, -1, factors, error, monitor, pivots_only=.true.)
      if (allocated(error)) return
      ! Overflow proves nothing.
      if (all(abs(factors%pivot) <= huge(1.0_wp))) most = count(.not. factors%pivot > 0)
      if (most == proved_negative) least = proved_negative
      if (most == proved_negative) return
      call eliminate(matrix, symbolic, subtrees, 1, factors, error, monitor, pivots_only=.true.)
      if (allocated(error)) return
      if (all(abs(factors%pivot) <= huge(1.0_wp))) least = count(factors%pivot < 0)
   end subroutine bound_negative_eigenvalues
end module kschur_proved_inertia
