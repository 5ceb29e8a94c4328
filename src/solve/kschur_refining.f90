!> Modes of small problems, refined one by one.
module kschur_refining
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_hidden, only: are_known, feel_inertia
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_yes
   use kschur_pair_refinement, only: refine_pair
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: equal_value, no_correct_digits, same_value
   implicit none
   private
   public :: refine_modes

   ! Beyond this number of unknowns and multipliers dense factors for each mode cost more than the modes.
   integer, parameter :: most = 100

contains

   !> Refines the eigenvalues that are alone. Where a problem is not symmetric there is no functional that tells them better than
   !> their shapes, and a small residual says little; where it is, those that are known badly by their bounds are in need of it.
   !> What Newton's method does not hold is dropped as inaccurate.
   subroutine refine_modes(s, modes)
      type(solve_context_type), intent(in) :: s
      !> Of what is iterated.
      type(modes_type), intent(inout) :: modes
      type(csr_matrix_type) :: transposed
      type(cluster_type), allocatable :: clusters(:)
      type(eigenpairs_type) :: pair
      logical, dimension(size(modes%lambda)) :: open, unknown
      real(wp) :: change, reach
      integer :: i, k
      logical :: complete

      if (s%work%unknowns() + s%work%multipliers() > most) return
      open = abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda)
      complete = s%dense .and. s%transform%certificate%verdict == certified_yes
      if (s%problem%symmetric) then
         open = open .and. complete .and. modes%uncertainty > equal_value*abs(modes%lambda)
         if (any(open)) open = unpack(feel_inertia(s%work, chosen_pairs(modes, open)), open, .false.)
      end if
      if (.not. any(open)) return
      unknown = .false.
      transposed = transpose_csr(s%work%constraints)
      call split(modes%lambda, same_value*abs(modes%lambda), clusters)
      do i = 1, size(clusters)
         associate (j => clusters(i)%members(1))
            if (size(clusters(i)%members) > 1 .or. .not. open(j)) cycle
            if (clusters(i)%on_axis .and. abs(aimag(modes%lambda(j))) > 0) cycle
            pair = chosen_pairs(modes, [(k == j, k=1, size(open))])
            call pair%make_complex()
            ! Where some may be missing, what is another one is not the one that was to be found.
            reach = clusters(i)%gap/2
            if (.not. complete) reach = min(reach, no_correct_digits*abs(modes%lambda(j)))
            call refine_pair(s%work, transposed, pair, reach, change)
            unknown(j) = change > no_correct_digits
            modes%lambda(j) = pair%lambda(1)
            modes%xi(:, j) = pair%xi(:, 1)
            if (modes%is_real()) then
               modes%real_phi(:, j) = real(pair%phi(:, 1), wp)
            else
               modes%phi(:, j) = pair%phi(:, 1)
            end if
         end associate
      end do
      modes%unlisted = [modes%unlisted, pack(modes%lambda, unknown)]
      call modes%drop(unknown)
   end subroutine refine_modes
end module kschur_refining
