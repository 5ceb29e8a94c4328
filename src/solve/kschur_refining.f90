!> Modes of small unsymmetric problems, refined one by one.
module kschur_refining
   use kschur_context, only: solve_context_type
   use kschur_hidden, only: are_known
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_pair_refinement, only: refine_pair
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: may_be_anything, same_value
   implicit none
   private
   public :: refine_modes

   ! Beyond this number of unknowns and multipliers dense factors for each mode cost more than the modes.
   integer, parameter :: most = 100

contains

   !> Refines the eigenvalues that are alone. Where a problem is not symmetric there is no functional that tells them better than
   !> their shapes, and a small residual says little: what Newton's method does not hold is dropped as inaccurate.
   subroutine refine_modes(s, modes)
      type(solve_context_type), intent(in) :: s
      !> Of what is iterated.
      type(modes_type), intent(inout) :: modes
      type(csr_matrix_type) :: transposed
      type(cluster_type), allocatable :: clusters(:)
      logical, dimension(size(modes%lambda)) :: known, unknown
      real(wp) :: change
      integer :: i

      if (s%problem%symmetric .or. modes%is_real() .or. s%work%unknowns() + s%work%multipliers() > most) return
      unknown = .false.
      known = are_known(s, modes%lambda) .or. .not. abs(modes%lambda) > 0
      transposed = transpose_csr(s%work%constraints)
      call split(modes%lambda, same_value*abs(modes%lambda), clusters)
      do i = 1, size(clusters)
         associate (j => clusters(i)%members(1))
            if (known(j) .or. size(clusters(i)%members) > 1) cycle
            if (clusters(i)%on_axis .and. abs(aimag(modes%lambda(j))) > 0) cycle
            call refine_pair(s%work, transposed, modes, j, clusters(i)%gap/2, change)
            unknown(j) = change > may_be_anything
         end associate
      end do
      modes%inaccurate = modes%inaccurate + count(unknown)
      call modes%drop(unknown)
   end subroutine refine_modes
end module kschur_refining
