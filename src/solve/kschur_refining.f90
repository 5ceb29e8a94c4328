!> Refines modes of small problems by Newton's method (docs/theory.md, section 11).
module kschur_refining
   use kschur_cluster_refinement, only: refine_cluster
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_hidden, only: are_known, feel_inertia
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_yes
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: equal_value, known_well, no_correct_digits, same_value
   implicit none
   private
   public :: refine_modes

   ! Beyond this number of unknowns, multipliers and members dense factors for each mode cost more than the modes.
   integer, parameter :: largest_order = 200

   ! The pairs that Newton's method made of a cluster.
   type :: refined_type
      type(eigenpairs_type) :: pairs
      logical :: found = .false.
   end type refined_type

contains

   !> Refines eigenvalues with their shapes, those of a cluster together. Of unsymmetric problems all: no Rayleigh functional makes
   !> them more accurate than the shapes, and a small residual bounds their errors badly. Of symmetric problems those with large
   !> error bounds. A mode that Newton's method does not confirm is dropped as inaccurate.
   subroutine refine_modes(s, modes)
      type(solve_context_type), intent(in) :: s
      !> Of the iterated problem.
      type(modes_type), intent(inout) :: modes
      logical, allocatable :: chosen(:)
      real(wp), allocatable :: discs(:)
      integer :: attempt

      allocate (chosen, source=abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda))
      if (s%problem%symmetric) then
         chosen = chosen .and. modes%uncertainty > equal_value*abs(modes%lambda)
         if (any(chosen)) chosen = unpack(feel_inertia(s%work, chosen_pairs(modes, chosen)), chosen, .false.)
      end if
      if (.not. any(chosen)) return
      allocate (discs, source=max(same_value*abs(modes%lambda), min(modes%uncertainty, no_correct_digits*abs(modes%lambda))))
      do attempt = 1, 2
         call refine_clusters(s, modes, discs, chosen)
         if (.not. any(chosen)) exit
         ! What does not converge alone may belong to others.
         discs = merge(no_correct_digits, same_value, chosen)*abs(modes%lambda)
      end do
      modes%unlisted = [modes%unlisted, pack(modes%lambda, chosen)]
      call modes%drop(chosen)
   end subroutine refine_modes

   ! Refines clusters with chosen members.
   subroutine refine_clusters(s, modes, discs, chosen)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(inout) :: modes
      !> Radius of the disc of each eigenvalue (1/s).
      real(wp), intent(in) :: discs(:)
      !> On return those that did not converge.
      logical, allocatable, intent(inout) :: chosen(:)
      type(csr_matrix_type) :: transposed
      type(cluster_type), allocatable :: clusters(:)
      type(refined_type), allocatable :: refined(:)
      logical, dimension(size(chosen)) :: eligible, failed
      real(wp) :: change, radius
      integer :: i, k, order
      logical :: complete

      order = s%work%unknowns() + s%work%multipliers()
      complete = s%dense .and. s%transform%certificate%verdict == certified_yes
      eligible = abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda)
      transposed = transpose_csr(s%work%constraints)
      call split(modes%lambda, discs, clusters)
      allocate (refined(size(clusters)))
      failed = .false.
      do i = 1, size(clusters)
         associate (members => clusters(i)%members, is_chosen => any(chosen(clusters(i)%members)))
            if (.not. is_chosen) cycle
            if (.not. all(eligible(members)) .or. size(members) + order > largest_order) cycle
            if (size(members) > 1 .and. modes%is_real()) cycle
            if (clusters(i)%on_axis .and. allocated(s%work%loss)) cycle
            refined(i)%pairs = chosen_pairs(modes, [(any(members == k), k=1, size(chosen))])
            call refined(i)%pairs%make_complex()
            ! If modes may be missing, a step of more than a hundredth may have led to one of them.
            radius = clusters(i)%gap/2
            if (.not. complete) radius = min(radius, no_correct_digits*abs(clusters(i)%centre))
            call refine_cluster(s%work, transposed, clusters(i)%on_axis, refined(i)%pairs, radius, change, &
               refined(i)%found)
            failed(members) = chosen(members) .and. .not. refined(i)%found .and. change > known_well
         end associate
      end do
      chosen = failed
      call replace_refined(clusters, refined, modes, chosen)
   end subroutine refine_clusters

   ! Replaces the members of refined clusters. Two conjugates may have become two real eigenvalues, or these a pair, so that the
   ! number of modes changes, though not that of eigenvalues.
   subroutine replace_refined(clusters, refined, modes, chosen)
      type(cluster_type), intent(in) :: clusters(:)
      type(refined_type), intent(in) :: refined(:)
      type(modes_type), intent(inout) :: modes
      !> A mark of each mode, for the list as it becomes.
      logical, allocatable, intent(inout) :: chosen(:)
      integer, allocatable :: order(:), places(:)
      logical :: kept(size(modes%lambda))
      logical, allocatable :: added(:)
      integer :: i, l, first, members, now

      kept = .true.
      do i = 1, size(clusters)
         if (.not. refined(i)%found) cycle
         kept(clusters(i)%members(size(refined(i)%pairs%lambda) + 1:)) = .false.
      end do
      allocate (order, source=[(l, l=1, size(kept))])
      do i = 1, size(clusters)
         if (.not. refined(i)%found) cycle
         members = size(clusters(i)%members)
         now = size(refined(i)%pairs%lambda)
         order = [order, spread(clusters(i)%members(1), 1, max(0, now - members))]
      end do
      if (size(order) > size(kept)) call modes%take(order)
      first = size(kept)
      do i = 1, size(clusters)
         if (.not. refined(i)%found) cycle
         members = size(clusters(i)%members)
         associate (pairs => refined(i)%pairs)
            now = size(pairs%lambda)
            places = [clusters(i)%members(:min(members, now)), [(first + l, l=1, now - members)]]
            first = first + max(0, now - members)
            do l = 1, now
               modes%lambda(places(l)) = pairs%lambda(l)
               modes%xi(:, places(l)) = pairs%xi(:, l)
               if (modes%is_real()) then
                  modes%real_phi(:, places(l)) = real(pairs%phi(:, l), wp)
               else
                  modes%phi(:, places(l)) = pairs%phi(:, l)
               end if
            end do
         end associate
      end do
      added = spread(.false., 1, size(order) - size(kept))
      chosen = [pack(chosen, kept), added]
      if (.not. all(kept)) call modes%take(pack([(l, l=1, size(order))], [kept, .not. added]))
   end subroutine replace_refined

end module kschur_refining
