!> Refines modes of small problems by Newton's method (docs/theory.md, section 11).
module kschur_refining
   use kschur_cluster_refinement, only: refine_cluster
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_finishing, only: make_real
   use kschur_hidden, only: are_known, may_be_infinite
   use kschur_kinds, only: wp
   use kschur_modes, only: eigenvalues_of, modes_type
   use kschur_outcome, only: certified_yes
   use kschur_problem, only: damping_none
   use kschur_shapes, only: independent_part
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: dependent_state, equal_value, no_correct_digits, same_value
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
      logical, allocatable :: chosen(:), dropped(:)
      real(wp), allocatable :: discs(:), changes(:)

      allocate (chosen, source=abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda))
      if (s%problem%symmetric) chosen = chosen .and. modes%uncertainty > equal_value*abs(modes%lambda)
      if (.not. any(chosen)) return
      allocate (changes(size(chosen)), source=0.0_wp)
      discs = max(same_value*abs(modes%lambda), min(modes%uncertainty, no_correct_digits*abs(modes%lambda)))
      call refine_clusters(s, discs, chosen, modes, changes)
      ! What does not converge alone may belong to others.
      chosen = changes > 0
      discs = merge(no_correct_digits, same_value, chosen)*abs(modes%lambda)
      call refine_clusters(s, discs, chosen, modes, changes)
      allocate (dropped, source=changes > no_correct_digits)
      ! Rounding of the stiffness may be what hides a mode of a symmetric problem: its bound says so.
      if (s%problem%symmetric .and. any(dropped)) &
         dropped = unpack(may_be_infinite(s%work, chosen_pairs(modes, dropped)), dropped, .false.)
      modes%unlisted = [modes%unlisted, pack(modes%lambda, dropped)]
      call modes%drop(dropped)
   end subroutine refine_modes

   ! Refines the clusters of chosen modes.
   subroutine refine_clusters(s, discs, chosen, modes, changes)
      type(solve_context_type), intent(in) :: s
      !> Radius of the disc of each eigenvalue (1/s).
      real(wp), intent(in) :: discs(:)
      logical, intent(in) :: chosen(:)
      type(modes_type), intent(inout) :: modes
      !> Corrections at which refinement first ended without success, relative to each eigenvalue; zero for all others.
      real(wp), allocatable, intent(inout) :: changes(:)
      type(csr_matrix_type) :: transposed
      type(cluster_type), allocatable :: clusters(:)
      type(refined_type), allocatable :: refined(:)
      real(wp) :: change, radius
      integer :: i, k
      logical :: complete

      if (.not. any(chosen)) return
      complete = s%dense .and. s%transform%certificate%verdict == certified_yes
      transposed = transpose_csr(s%work%constraints)
      call split(modes%lambda, discs, clusters, lossy=s%is_lossy())
      allocate (refined(size(clusters)))
      do i = 1, size(clusters)
         associate (members => clusters(i)%members)
            if (.not. any(chosen(members))) cycle
            if (.not. may_refine(s, modes, clusters(i))) cycle
            refined(i)%pairs = chosen_pairs(modes, [(any(members == k), k=1, size(changes))])
            call refined(i)%pairs%make_complex()
            ! If modes may be missing, a step beyond a hundredth and the error bound may have led to one of them.
            radius = clusters(i)%gap/2
            if (.not. complete) radius = min(radius, max(no_correct_digits*abs(clusters(i)%centre), &
               maxval(modes%uncertainty(members))))
            call refine_cluster(s%work, transposed, clusters(i)%on_axis, refined(i)%pairs, radius, change, &
               refined(i)%found)
            ! A symmetric problem without damping has no defective eigenvalues.
            if (.not. refined(i)%found .and. size(members) > 1 .and. s%problem%symmetric .and. &
               s%problem%damping_kind == damping_none .and. .not. s%is_lossy()) &
               call refine_one_by_one(s, transposed, modes, clusters(i), radius, refined(i))
            if (refined(i)%found) then
               if (modes%is_real()) call make_real(s%transform%map, refined(i)%pairs)
               changes(members) = 0
            else
               where (chosen(members) .and. .not. changes(members) > 0) changes(members) = change
            end if
         end associate
      end do
      call replace_refined(clusters, refined, modes, changes)
   end subroutine refine_clusters

   ! Refines the members of a cluster one by one: an iteration whose space holds an eigenvector only inaccurately may have found it
   ! several times. Leaves the cluster unless each member converges.
   subroutine refine_one_by_one(s, transposed, modes, cluster, radius, refined)
      type(solve_context_type), intent(in) :: s
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      type(modes_type), intent(in) :: modes
      type(cluster_type), intent(in) :: cluster
      !> Largest change of an eigenvalue (1/s).
      real(wp), intent(in) :: radius
      type(refined_type), intent(inout) :: refined
      type(eigenpairs_type) :: pairs, pair
      real(wp) :: change
      logical :: found
      integer :: i, j

      pairs = chosen_pairs(modes, spread(.false., 1, size(modes%lambda)))
      call pairs%make_complex()
      do j = 1, size(cluster%members)
         pair = chosen_pairs(modes, [(i == cluster%members(j), i=1, size(modes%lambda))])
         call pair%make_complex()
         call refine_cluster(s%work, transposed, cluster%on_axis, pair, radius, change, found)
         if (.not. found) return
         if (independent_part(pairs, pair, 1, same_value) > dependent_state) call append_pairs(pairs, pair)
      end do
      refined%pairs = pairs
      refined%found = .true.
   end subroutine refine_one_by_one

   ! Whether a cluster can be refined.
   logical function may_refine(s, modes, cluster)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      type(cluster_type), intent(in) :: cluster

      associate (members => cluster%members)
         may_refine = s%work%unknowns() + s%work%multipliers() + size(members) <= largest_order .and. &
            all(abs(modes%lambda(members)) > 0 .and. .not. are_known(s, modes%lambda(members)))
         ! With losses an eigenvalue on the real axis would get a side of it by rounding.
         if (s%is_lossy() .and. .not. all(abs(aimag(modes%lambda(members))) > 0)) may_refine = .false.
      end associate
   end function may_refine

   ! Replaces the members of refined clusters; the list is then in the order of clusters. Two conjugates may have become two real
   ! eigenvalues, or these a pair, and several pairs one.
   subroutine replace_refined(clusters, refined, modes, changes)
      type(cluster_type), intent(in) :: clusters(:)
      type(refined_type), intent(in) :: refined(:)
      type(modes_type), intent(inout) :: modes
      !> For the list as it becomes.
      real(wp), allocatable, intent(inout) :: changes(:)
      integer, allocatable :: order(:)
      integer :: first(size(clusters)), i, j, l

      allocate (order(0))
      do i = 1, size(clusters)
         first(i) = size(order)
         associate (members => clusters(i)%members)
            if (refined(i)%found) then
               order = [order, (members(min(l, size(members))), l=1, size(refined(i)%pairs%lambda))]
               modes%found = modes%found + eigenvalues_of(refined(i)%pairs%lambda, abs(refined(i)%pairs%lambda) > 0) - &
                  eigenvalues_of(modes%lambda(members), abs(modes%lambda(members)) > 0)
            else
               order = [order, members]
            end if
         end associate
      end do
      call modes%take(order)
      changes = changes(order)
      do i = 1, size(clusters)
         if (.not. refined(i)%found) cycle
         associate (pairs => refined(i)%pairs)
            do l = 1, size(pairs%lambda)
               j = first(i) + l
               modes%lambda(j) = pairs%lambda(l)
               modes%xi(:, j) = pairs%xi(:, l)
               if (modes%is_real()) then
                  modes%real_phi(:, j) = pairs%real_phi(:, l)
               else
                  modes%phi(:, j) = pairs%phi(:, l)
               end if
            end do
         end associate
      end do
   end subroutine replace_refined
end module kschur_refining
