!> Refines single modes of small problems by Newton's method (docs/theory.md, section 11).
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
   integer, parameter :: largest_size = 100

contains

   !> Refines simple eigenvalues with their shapes. Of unsymmetric problems all: no Rayleigh functional makes them more accurate
   !> than the shapes, and a small residual bounds their errors badly. Of symmetric problems those with large error bounds, if all
   !> eigenvalues are known. A mode that Newton's method does not confirm is dropped as inaccurate.
   subroutine refine_modes(s, modes)
      type(solve_context_type), intent(in) :: s
      !> Of the iterated problem.
      type(modes_type), intent(inout) :: modes
      type(csr_matrix_type) :: transposed
      type(cluster_type), allocatable :: clusters(:)
      type(eigenpairs_type) :: pair
      logical, dimension(size(modes%lambda)) :: chosen, unconfirmed
      real(wp) :: correction, radius
      integer :: i, k
      logical :: complete

      if (s%work%unknowns() + s%work%multipliers() > largest_size) return
      chosen = abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda)
      complete = s%dense .and. s%transform%certificate%verdict == certified_yes
      if (s%problem%symmetric) then
         chosen = chosen .and. complete .and. modes%uncertainty > equal_value*abs(modes%lambda)
         if (any(chosen)) chosen = unpack(feel_inertia(s%work, chosen_pairs(modes, chosen)), chosen, .false.)
      end if
      if (.not. any(chosen)) return
      unconfirmed = .false.
      transposed = transpose_csr(s%work%constraints)
      call split(modes%lambda, same_value*abs(modes%lambda), clusters)
      do i = 1, size(clusters)
         associate (j => clusters(i)%members(1))
            if (size(clusters(i)%members) > 1 .or. .not. chosen(j)) cycle
            if (clusters(i)%on_axis .and. abs(aimag(modes%lambda(j))) > 0) cycle
            pair = chosen_pairs(modes, [(k == j, k=1, size(chosen))])
            call pair%make_complex()
            ! If modes may be missing, a step of more than a hundredth may have led to one of them.
            radius = clusters(i)%gap/2
            if (.not. complete) radius = min(radius, no_correct_digits*abs(modes%lambda(j)))
            call refine_pair(s%work, transposed, pair, radius, correction)
            unconfirmed(j) = correction > no_correct_digits
            modes%lambda(j) = pair%lambda(1)
            modes%xi(:, j) = pair%xi(:, 1)
            if (modes%is_real()) then
               modes%real_phi(:, j) = real(pair%phi(:, 1), wp)
            else
               modes%phi(:, j) = pair%phi(:, 1)
            end if
         end associate
      end do
      modes%unlisted = [modes%unlisted, pack(modes%lambda, unconfirmed)]
      call modes%drop(unconfirmed)
   end subroutine refine_modes
end module kschur_refining
