!> Polishes modes that an iteration left inaccurate or in doubt, and refines those of small problems, cluster by cluster
!> (docs/theory.md, section 11).
module kschur_finishing
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_effort, only: for_refinement
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, keep_pairs
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_hidden, only: are_known, may_be_infinite
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: judge_pairs, mode_request_type
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_yes, inaccurate_above
   use kschur_polish, only: polished_type, polisher_type
   use kschur_residual_parts, only: residual_parts
   use kschur_scaling, only: constraint_factors
   use kschur_shapes, only: independent_part, independent_parts
   use kschur_split, only: cluster_type, split
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: cancelled, dependent_state, equal_value, no_correct_digits, root_epsilon, rounding_of_row, &
      same_shape, same_value, uneven
   implicit none
   private
   public :: are_good, finish_modes, is_small, refine_modes

   ! Radius, relative to the eigenvalue, in which a doubtful one is searched for.
   real(wp), parameter :: doubtful_radius = 0.5_wp
   ! Error bounds of doubtful eigenvalues count up to this part of the radius, so that a shift outside of them stays inside it.
   real(wp), parameter :: part_of_radius = 1/30.0_wp
   ! Beyond this number of unknowns and multipliers factors beside each mode cost more than the modes.
   integer, parameter :: largest_refined = 200

   !> Accuracy of a mode, and what polishing found in its place.
   type :: judgement_type
      !> Backward error, or if larger and units are uneven, residual relative to its own terms.
      real(wp) :: error = 0
      !> Whether `error` is worth reducing; whether the error bound is so large that it may be no eigenvalue; whether polishing did
      !> not find it again; whether it found others in its place.
      logical :: poor = .false., doubtful = .false., not_found = .false., led_elsewhere = .false.
   end type judgement_type

contains

   !> Polishes each cluster in which a mode is inaccurate, in doubt, or linearly dependent on the others. Its members are replaced
   !> by the eigenpairs that an iteration finds there with factors beside the cluster. A doubtful member that is not found again is
   !> dropped as no eigenvalue, unless the number of eigenvalues was certified.
   subroutine finish_modes(s, modes, keeps_eigenvalues, error)
      type(solve_context_type), intent(inout) :: s
      !> Of the iterated problem, in balanced units: in the units as given, a few large entries may hide errors.
      type(modes_type), intent(inout) :: modes
      !> Whether eigenvalues stay as they are polished, as where modes have been refined; else they are corrected.
      logical, intent(in) :: keeps_eigenvalues
      type(error_type), allocatable, intent(out) :: error
      type(judgement_type), allocatable :: judgements(:)
      type(cluster_type), allocatable :: clusters(:)

      call s%hold(whole_iterated, error)
      if (allocated(error)) return
      call find_suspects()
      call polish_clusters(s, modes, clusters, judgements, .false., keeps_eigenvalues, error)
      if (.not. (allocated(error) .or. is_counted(s))) call modes%leave_out(judgements%not_found)

   contains

      ! Decides which modes are inaccurate or in doubt, splits all into clusters, and keeps those to be polished, as wide as the
      ! errors of their members may be: where a member is inaccurate or in doubt, or members are linearly dependent.
      subroutine find_suspects()
         real(wp), allocatable :: discs(:)
         logical, allocatable :: candidates(:), is_suspect(:)
         logical :: by_terms
         integer :: i

         allocate (judgements(size(modes%lambda)))
         judgements%error = modes%backward_error
         ! Backward errors are relative to the largest terms, and say little about small eigenvalues or small units. So if units are
         ! uneven, or the set is complete and each of its eigenvalues must be accurate, residuals are compared with their own terms.
         by_terms = s%plan%spread_of_units() > uneven .or. (s%known%total%exact .and. modes%found == s%known%total%number)
         if (by_terms) judgements%error = max(judgements%error, residual_parts(s%work, modes, &
            modes%backward_error <= s%options%good_enough()))
         ! Rigid motions and their decays are known from the examination.
         allocate (candidates, source=abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda))
         ! A pair with a larger backward error is not near an eigenpair, except in those two cases.
         if (.not. by_terms) candidates = candidates .and. judgements%error <= no_correct_digits
         ! What lies below the real axis, as with losses, is no mode, unless its error moved it there.
         judgements%poor = candidates .and. (judgements%error > s%options%good_enough() .or. aimag(modes%lambda) < 0)
         judgements%doubtful = candidates .and. modes%uncertainty > no_correct_digits*abs(modes%lambda)
         if (any(judgements%doubtful)) judgements%doubtful = &
            unpack(may_be_infinite(s%work, chosen_pairs(modes, judgements%doubtful)), judgements%doubtful, .false.)
         allocate (discs, source=same_value*abs(modes%lambda))
         where (judgements%poor) discs = max(discs, min(modes%uncertainty, no_correct_digits*abs(modes%lambda)))
         call split(modes%lambda, discs, clusters, lossy=s%is_lossy())
         allocate (is_suspect(size(clusters)))
         do i = 1, size(clusters)
            clusters(i)%disc = 0
            associate (cluster => clusters(i), members => clusters(i)%members)
               is_suspect(i) = any(judgements(members)%poor .or. judgements(members)%doubtful)
               if (.not. is_suspect(i) .and. size(members) > 1 .and. abs(cluster%centre) > 0) &
                  is_suspect(i) = any(independent_parts(modes, members) <= dependent_state)
               if (any(judgements(members)%poor)) call cluster%widen(no_correct_digits)
               if (any(judgements(members)%doubtful)) call cluster%widen(doubtful_radius)
            end associate
         end do
         clusters = pack(clusters, is_suspect)
      end subroutine find_suspects
   end subroutine finish_modes

   !> Refines the modes of a small problem: of unsymmetric problems all, as no Rayleigh functional makes eigenvalues more accurate
   !> than shapes, and a small residual bounds their errors badly; of symmetric problems those with large error bounds. A mode that
   !> is not found again, alone or with others within a hundredth, is dropped as inaccurate; in a dense set of an unsymmetric
   !> problem, or if others of its cluster are found again, it stays as uncertain, until its error bound judges it.
   subroutine refine_modes(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      !> Of the iterated problem.
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      type(judgement_type), allocatable :: judgements(:)
      type(cluster_type), allocatable :: clusters(:)
      real(wp), allocatable :: discs(:)
      integer :: pass, i

      if (.not. is_small(s)) return
      allocate (judgements(size(modes%lambda)))
      judgements%doubtful = abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda)
      if (s%problem%symmetric) judgements%doubtful = judgements%doubtful .and. modes%uncertainty > equal_value*abs(modes%lambda)
      do pass = 1, 2
         if (.not. any(judgements%doubtful)) exit
         discs = min(modes%uncertainty, no_correct_digits*abs(modes%lambda))
         if (pass == 2) discs = merge(no_correct_digits*abs(modes%lambda), 0.0_wp, judgements%doubtful)
         discs = max(same_value*abs(modes%lambda), discs)
         call split(modes%lambda, discs, clusters, lossy=s%is_lossy())
         clusters = pack(clusters, [(may_refine(clusters(i)), i=1, size(clusters))])
         do i = 1, size(clusters)
            associate (cluster => clusters(i), uncertain => maxval(modes%uncertainty(clusters(i)%members)))
               ! If modes may be missing, a step beyond a hundredth and the error bound may have led to one of them.
               cluster%radius = cluster%gap/2
               if (.not. is_counted(s)) cluster%radius = min(cluster%radius, cluster%spread + &
                  max(no_correct_digits*abs(cluster%centre), uncertain))
            end associate
         end do
         judgements%error = modes%backward_error
         call polish_clusters(s, modes, clusters, judgements, .true., .true., error)
         if (allocated(error)) return
      end do
      where (judgements%led_elsewhere) modes%uncertainty = huge(1.0_wp)
      if (s%dense .and. .not. s%problem%symmetric) then
         where (judgements%not_found) modes%uncertainty = max(modes%uncertainty, abs(modes%lambda))
      else
         call modes%leave_out(judgements%not_found)
      end if

   contains

      ! Whether a cluster can be refined, and has a chosen member.
      logical function may_refine(cluster)
         type(cluster_type), intent(in) :: cluster

         associate (members => cluster%members)
            may_refine = any(judgements(members)%doubtful) .and. &
               all(abs(modes%lambda(members)) > 0 .and. .not. are_known(s, modes%lambda(members)))
            ! With losses an eigenvalue on the real axis would get a side of it by rounding.
            if (s%is_lossy()) may_refine = may_refine .and. all(abs(aimag(modes%lambda(members))) > 0)
         end associate
      end function may_refine
   end subroutine refine_modes

   !> Whether the problem is so small that factors beside each mode cost no more than the modes.
   pure logical function is_small(s)
      type(solve_context_type), intent(in) :: s

      is_small = s%work%unknowns() + s%work%multipliers() <= largest_refined
   end function is_small

   ! Polishes clusters, and replaces their members by the pairs found, the last modes of the list then.
   subroutine polish_clusters(s, modes, clusters, judgements, refines, keeps_eigenvalues, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(cluster_type), intent(in) :: clusters(:)
      !> Of each mode; on return those of the new list.
      type(judgement_type), allocatable, intent(inout) :: judgements(:)
      !> Whether they are refined; whether eigenvalues stay as they are polished.
      logical, intent(in) :: refines, keeps_eigenvalues
      type(error_type), allocatable, intent(out) :: error
      type(polisher_type) :: polisher
      type(eigenpairs_type) :: found
      type(modes_type) :: new_modes
      type(cluster_type) :: outer
      logical, allocatable :: replaced(:)
      integer :: i

      allocate (replaced(size(modes%lambda)), source=.false.)
      if (size(clusters) == 0) return
      call polisher%begin(constraint_factors(s%work, s%options%constraint_scaling, s%shift), &
         s%known%redundant - s%plan%redundant, s%options%good_enough(), s%inner%complex)
      polisher%refines = refines
      found = chosen_pairs(modes, replaced)
      allocate (found%paired(0))
      do i = 1, size(clusters)
         if (s%is_stopped()) exit
         call polish_cluster(clusters(i))
         if (allocated(error)) return
         if (refines .or. .not. any(judgements(clusters(i)%members)%not_found)) cycle
         ! Within the error bounds of doubtful members the matrix may be singular to rounding: once more from outside.
         outer = clusters(i)
         outer%disc = min(maxval(modes%uncertainty(outer%members)), part_of_radius*outer%radius)
         call polish_cluster(outer)
         if (allocated(error)) return
      end do
      call s%effort%add_solves(polisher%solver)
      call modes%drop(replaced)
      judgements = pack(judgements, .not. replaced)
      ! The polished pairs of a wide cluster may include neighbours that stay in the list.
      call drop_dependent(found, modes)
      if (size(found%lambda) == 0) return
      call judge_pairs(s%work, mode_request_type(target=s%options%target, reference=s%reference(), refined=keeps_eigenvalues), &
         found, new_modes)
      call modes%append(new_modes)
      judgements = [judgements, spread(judgement_type(), 1, size(new_modes%lambda))]

   contains

      ! Factors the problem beside one cluster, polishes it, and accepts the pairs found there or leaves the members as they were.
      ! A singular matrix, no convergence or a cancellation leaves them, too.
      subroutine polish_cluster(cluster)
         type(cluster_type), intent(in) :: cluster
         ! Random vectors beside one or several members, for copies not yet found.
         integer, parameter :: guards(2) = [2, 4]
         type(polished_type) :: polished
         type(eigenpairs_type) :: members
         complex(wp) :: shift
         complex(wp), allocatable :: certain(:)
         integer :: guard_vectors, number_before, i
         logical :: accepted, credible
         logical, dimension(size(cluster%members)) :: found_again, independent

         members = chosen_pairs(modes, [(any(cluster%members == i), i=1, size(modes%lambda))])
         number_before = cluster%count_eigenvalues(members%lambda)
         call members%make_complex()
         call polisher%factor_beside(s%work, cluster, shift, error)
         if (.not. allocated(error)) then
            call s%effort%add_factors(polisher%solver, for_refinement)
            guard_vectors = guards(min(size(cluster%members), 2))
            ! The count by inertia shows missing copies in the symmetric forms.
            if (refines .or. (modes%is_real() .and. size(cluster%members) == 1)) guard_vectors = 0
            call polisher%polish(s%work, cluster, shift, members, maxval(judgements(cluster%members)%error), guard_vectors, &
               polished, error)
         end if
         if (allocated(error)) then
            if (any(error%code == [error_singular, error_convergence, error_cancelled])) deallocate (error)
            return
         end if
         associate (lost => judgements(cluster%members)%not_found, doubtful => judgements(cluster%members)%doubtful, &
            worst_before => maxval(judgements(cluster%members)%error))
            if (refines) then
               ! Roots of a defective eigenvalue have one shape, and may be found as one root beside them.
               found_again = [(any(abs(polished%pairs%lambda - members%lambda(i)) <= same_value*abs(members%lambda(i))), &
                  i=1, size(found_again))]
               independent = found_again .or. independent_parts(modes, cluster%members) > dependent_state
               credible = polished%complete .and. polished%worst() <= max(rounding_of_row, no_correct_digits*worst_before)
               ! They are no more than the members, and no fewer than those of them that are certain: that were not lost before,
               ! and are found again or independent of the others, where a pair is one if it is real to rounding or its bound.
               ! Residuals did not grow, as where zeros make the factors singular to rounding; in a space that is not invariant,
               ! they are those of rounding or far smaller, and members had moved.
               certain = members%lambda
               where (abs(aimag(certain)) <= max(modes%uncertainty(cluster%members), equal_value*abs(certain))) &
                  certain = real(certain, wp)
               certain = pack(certain, .not. lost .and. (found_again .or. independent))
               accepted = polished%complete .and. polished%eigenvalues <= number_before .and. &
                  polished%eigenvalues >= cluster%count_eigenvalues(certain) .and. size(polished%pairs%lambda) >= size(certain)
               accepted = accepted .and. ((polished%residual <= root_epsilon .and. &
                  polished%worst() <= max(rounding_of_row, worst_before)) .or. &
                  (credible .and. .not. (all(found_again) .and. polished%eigenvalues == number_before)))
            else
               ! They are as many as the members that are certain, that is independent and not in doubt (all, if a certificate
               ! counts them), and all Ritz values in the cluster are accurate; or they are as many as the members, and accurate
               ! enough or more accurate.
               certain = pack(members%lambda, is_counted(s) .or. &
                  (independent_parts(modes, cluster%members) > dependent_state .and. .not. doubtful))
               accepted = (polished%complete .and. polished%eigenvalues >= cluster%count_eigenvalues(certain)) .or. &
                  (polished%eigenvalues >= number_before .and. &
                  (polished%worst() <= polisher%tolerance .or. polished%worst() < worst_before))
            end if
         end associate
         if (accepted) then
            replaced(cluster%members) = .true.
            if (modes%is_real()) call make_real(s%transform%map, polished%pairs)
            ! Two clusters of inaccurate eigenvalues may be the same: both find the same pairs then.
            call drop_dependent(polished%pairs, found)
            call append_pairs(found, polished%pairs)
         else if (polished%eigenvalues == 0) then
            judgements(cluster%members)%not_found = judgements(cluster%members)%doubtful .or. &
               judgements(cluster%members)%error > inaccurate_above
         else
            if (polished%eigenvalues >= number_before) judgements(cluster%members)%not_found = .false.
            if (.not. refines) return
            where (credible .and. independent .and. .not. found_again) judgements(cluster%members)%led_elsewhere = .true.
         end if
      end subroutine polish_cluster
   end subroutine polish_clusters

   ! Whether all eigenvalues were computed densely, and a certificate confirms their number.
   pure logical function is_counted(s)
      type(solve_context_type), intent(in) :: s

      is_counted = s%dense .and. s%transform%certificate%verdict == certified_yes
   end function is_counted

   ! Removes pairs whose states are linearly dependent on those of known pairs with nearly the same eigenvalue.
   subroutine drop_dependent(pairs, known)
      type(eigenpairs_type), intent(inout) :: pairs
      class(eigenpairs_type), intent(in) :: known
      integer :: j

      call keep_pairs(pairs, [(independent_part(known, pairs, j, same_value) > dependent_state, j=1, size(pairs%lambda))])
   end subroutine drop_dependent

   !> Whether no mode needs polishing for its backward error: it is small enough, beyond repair, or that of a rigid motion.
   pure logical function are_good(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      are_good = all(modes%backward_error <= s%options%good_enough() .or. modes%backward_error > no_correct_digits .or. &
         modes%motion > 0)
   end function are_good

   ! Makes the shapes of undamped or proportionally damped modes real: they are real but for a complex factor, or, for copies,
   ! complex combinations of real shapes, which are made orthogonal.
   subroutine make_real(map, pairs)
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(inout) :: pairs
      ! Their factors make the real and the imaginary part real.
      complex(wp), parameter :: turns(2) = [(1.0_wp, 0.0_wp), (0.0_wp, -1.0_wp)]
      complex(wp) :: xi(size(pairs%xi, 1)), reaction
      real(wp) :: shape(pairs%rows()), overlap
      integer :: i, j, part

      allocate (pairs%real_phi(pairs%rows(), size(pairs%lambda)))
      do j = 1, size(pairs%lambda)
         ! Multipliers of a real shape are real but for the factor of damping.
         reaction = map%reaction(pairs%lambda(j))
         do part = 1, size(turns)
            shape = real(turns(part)*pairs%phi(:, j), wp)
            xi = reaction*real(turns(part)*(pairs%xi(:, j)/reaction), wp)
            do i = 1, j - 1
               if (abs(pairs%lambda(i) - pairs%lambda(j)) > cancelled*abs(pairs%lambda(j))) cycle
               overlap = dot_product(pairs%real_phi(:, i), shape)
               shape = shape - overlap*pairs%real_phi(:, i)
               xi = xi - overlap*pairs%xi(:, i)
            end do
            if (norm2(shape) > same_shape) exit
         end do
         if (part <= size(turns)) then
            pairs%real_phi(:, j) = shape/norm2(shape)
            pairs%xi(:, j) = xi/norm2(shape)
         else
            ! Both parts depend on shapes before: a double root has one shape.
            pairs%real_phi(:, j) = real(pairs%phi(:, j), wp)
         end if
      end do
      deallocate (pairs%phi)
   end subroutine make_real
end module kschur_finishing
