!> What an iteration left inaccurate or in doubt is polished, cluster by cluster.
module kschur_finishing
   use kschur_backward_error, only: judge_as_given
   use kschur_context, only: solve_context_type, whole_given, whole_iterated
   use kschur_effort, only: for_refinement
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, keep_pairs
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_hidden, only: are_known, feel_inertia
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_mode_selection, only: judge_pairs, mode_request_type
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_yes, inaccurate_above
   use kschur_polish, only: polished_type, polisher_type
   use kschur_residual_parts, only: residual_parts
   use kschur_scaling, only: constraint_factors
   use kschur_shapes, only: independent_part, independent_parts
   use kschur_split, only: cluster_type, split
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: above_all_rounding, cancelled, dependent_state, no_correct_digits, same_shape, same_value, uneven
   implicit none
   private
   public :: are_good, finish_modes, good_enough_of

   ! What may be anything is looked for as far as this part of its eigenvalue.
   real(wp), parameter :: half = 0.5_wp

   !> What is asked of each mode.
   type :: judgement_type
      !> Backward errors; where units differ much, residuals beside their own terms.
      real(wp), allocatable :: errors(:)
      !> How far eigenvalues may be off (1/s), by the better of their bounds in both units.
      real(wp), allocatable :: uncertainty(:)
      !> Which are worth polishing; which may be no eigenvalues by their error bounds.
      logical, allocatable :: poor(:), doubtful(:)
   end type judgement_type

contains

   !> Polishes each cluster in which a mode is inaccurate, in doubt, or no other than its neighbours: once
   !> factored beside and iterated, what lies where it is takes its place, whatever that is. A mode in doubt that is not
   !> found there is no eigenvalue, unless all were computed at once: these are as many after as before.
   subroutine finish_modes(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      !> Of what is iterated, in the units that balance has found: in those as given, errors may hide behind a few large entries.
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      type(judgement_type) :: judgement
      type(polisher_type) :: polisher
      type(cluster_type), allocatable :: clusters(:)
      type(eigenpairs_type) :: found
      logical, dimension(size(modes%lambda)) :: gone, nowhere
      complex(wp), allocatable :: lost(:)
      logical :: done
      integer :: i

      call judge(s, modes, judgement, error)
      if (allocated(error)) return
      allocate (lost(0))
      gone = .false.
      nowhere = .false.
      call find_suspects(modes, judgement, clusters)
      if (size(clusters) == 0) return
      call polisher%begin(constraint_factors(s%work, s%options%constraint_scaling, s%shift), good_enough_of(s), s%inner%complex)
      do i = 1, size(clusters)
         if (s%is_stopped()) exit
         call polish_cluster(s, modes, clusters(i), judgement, polisher, found, gone, nowhere, lost, error)
         if (allocated(error)) return
      end do
      call s%effort%add_solves(polisher%solver)
      if (.not. any(gone .or. nowhere)) return
      nowhere = nowhere .and. .not. gone
      if (s%dense .and. s%transform%certificate%verdict == certified_yes) then
         call keep_number(s, gone, nowhere, found, modes, done)
         if (done) return
      end if
      ! Infinite eigenvalues that rounding blurred, or modes.
      modes%unlisted = [modes%unlisted, lost, pack(modes%lambda, nowhere)]
      call replace(s, gone .or. nowhere, found, modes)
   end subroutine finish_modes

   ! The same where all eigenvalues are known: with those that were not found again, or as they were, if so many they are and none
   ! is inaccurate.
   subroutine keep_number(s, gone, nowhere, found, modes, done)
      type(solve_context_type), intent(in) :: s
      logical, intent(in) :: gone(:), nowhere(:)
      type(eigenpairs_type), intent(in) :: found
      type(modes_type), intent(inout) :: modes
      logical, intent(out) :: done
      type(modes_type) :: others
      integer :: way

      do way = 1, 3
         others = modes
         select case (way)
         case (1)
            call replace(s, gone .or. nowhere, found, others)
         case (2)
            call replace(s, gone, found, others)
         end select
         done = others%found == modes%found .and. all(others%backward_error <= inaccurate_above)
         if (.not. done) cycle
         modes = others
         return
      end do
   end subroutine keep_number

   ! Puts what was found in the place of some modes.
   subroutine replace(s, dropped, found, modes)
      type(solve_context_type), intent(in) :: s
      logical, intent(in) :: dropped(:)
      !> Not allocated: nothing.
      type(eigenpairs_type), intent(in) :: found
      type(modes_type), intent(inout) :: modes
      type(eigenpairs_type) :: others
      type(modes_type) :: more

      call modes%drop(dropped)
      if (.not. allocated(found%lambda)) return
      ! A wide cluster may have held neighbours that stay.
      others = found
      call leave_out_known(others, modes)
      call judge_pairs(s%work, mode_request_type(target=s%options%target, reference=s%reference()), others, more)
      call modes%append(more)
   end subroutine replace

   ! Takes out of some pairs those whose states lie in the span of others.
   subroutine leave_out_known(pairs, known)
      type(eigenpairs_type), intent(inout) :: pairs
      class(eigenpairs_type), intent(in) :: known
      integer :: j

      call keep_pairs(pairs, [(independent_part(known, pairs, j, same_value) > dependent_state, j=1, size(pairs%lambda))])
   end subroutine leave_out_known

   subroutine judge(s, modes, judgement, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(in) :: modes
      type(judgement_type), intent(out) :: judgement
      type(error_type), allocatable, intent(out) :: error
      logical, allocatable :: open(:)
      logical :: evenly

      allocate (judgement%errors, source=modes%backward_error)
      allocate (judgement%uncertainty, source=modes%uncertainty)
      ! Where all eigenvalues there are were found, each is one, and is to be known well in any units. Backward errors suit
      ! eigenvalues of one size only: terms of a residual tell what is poor.
      evenly = s%plan%spread_of_units() > uneven .or. (s%known%total%exact .and. modes%found == s%known%total%number)
      if (evenly) judgement%errors = max(judgement%errors, residual_parts(s%work, modes, &
         modes%backward_error <= good_enough_of(s)))
      ! Rigid motions and their decays are known.
      allocate (open, source=abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda))
      ! What has a larger backward error is not near to an eigenpair, unless units hide that it is, or all there are were found.
      if (.not. evenly) open = open .and. judgement%errors <= no_correct_digits
      allocate (judgement%poor, source=open .and. judgement%errors > good_enough_of(s))
      allocate (judgement%doubtful, source=open .and. judgement%uncertainty > no_correct_digits*abs(modes%lambda))
      if (.not. any(judgement%doubtful)) return
      call bound_in_given_units(s, modes, judgement, error)
      if (allocated(error)) return
      judgement%doubtful = unpack(feel_inertia(s%work, chosen_pairs(modes, judgement%doubtful)), judgement%doubtful, .false.)
   end subroutine judge

   ! In the units of the problem as given, modes in doubt may have better bounds.
   subroutine bound_in_given_units(s, modes, judgement, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(in) :: modes
      type(judgement_type), intent(inout) :: judgement
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: given
      real(wp), dimension(count(judgement%doubtful)) :: errors, bounds

      call require_memory(s%bytes_of_shapes(2*size(errors)), "mode shapes", error)
      if (allocated(error)) return
      given = chosen_pairs(modes, judgement%doubtful)
      call s%hold(whole_given, error)
      if (.not. allocated(error)) call s%expand(given, error)
      if (allocated(error)) return
      call judge_as_given(s%problem, given, spread(.false., 1, size(errors)), errors, bounds)
      where (.not. bounds >= 0) bounds = huge(1.0_wp)
      judgement%uncertainty = min(judgement%uncertainty, unpack(bounds, judgement%doubtful, huge(1.0_wp)))
      judgement%doubtful = judgement%doubtful .and. judgement%uncertainty > no_correct_digits*abs(modes%lambda)
      call s%hold(whole_iterated, error)
   end subroutine bound_in_given_units

   !> Whether no mode is worth polishing by its backward error.
   pure logical function are_good(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      are_good = all(modes%backward_error <= good_enough_of(s) .or. modes%backward_error > no_correct_digits .or. modes%motion > 0)
   end function are_good

   !> The backward error that is good enough.
   pure real(wp) function good_enough_of(s)
      type(solve_context_type), intent(in) :: s

      good_enough_of = max(above_all_rounding, s%options%tolerance/10)
   end function good_enough_of

   ! The clusters that are to be polished.
   subroutine find_suspects(modes, judgement, suspects)
      type(modes_type), intent(in) :: modes
      type(judgement_type), intent(in) :: judgement
      type(cluster_type), allocatable, intent(out) :: suspects(:)
      type(cluster_type), allocatable :: clusters(:)
      real(wp), allocatable :: discs(:)
      logical, allocatable :: suspect(:)
      integer :: i, j

      allocate (discs, source=same_value*abs(modes%lambda))
      where (judgement%poor) discs = max(discs, min(judgement%uncertainty, no_correct_digits*abs(modes%lambda)))
      call split(modes%lambda, discs, clusters)
      allocate (suspect, source=[(is_suspect(clusters(i)), i=1, size(clusters))])
      allocate (suspects(count(suspect)))
      j = 0
      do i = 1, size(clusters)
         if (.not. suspect(i)) cycle
         j = j + 1
         suspects(j) = clusters(i)
         associate (members => clusters(i)%members)
            if (any(judgement%poor(members))) call suspects(j)%widen(no_correct_digits)
            if (any(judgement%doubtful(members))) call suspects(j)%widen(half)
         end associate
      end do

   contains

      logical function is_suspect(cluster)
         type(cluster_type), intent(in) :: cluster

         associate (members => cluster%members)
            is_suspect = any(judgement%poor(members) .or. judgement%doubtful(members))
            if (.not. is_suspect .and. size(members) > 1 .and. abs(cluster%centre) > 0) is_suspect = &
               any(independent_parts(modes, members) <= dependent_state)
         end associate
      end function is_suspect
   end subroutine find_suspects

   ! One cluster: factored, iterated, and accepted or left as it was.
   subroutine polish_cluster(s, modes, cluster, judgement, polisher, found, gone, nowhere, lost, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(in) :: modes
      type(cluster_type), intent(in) :: cluster
      type(judgement_type), intent(in) :: judgement
      type(polisher_type), intent(inout) :: polisher
      !> Of what is iterated; what takes the place of the members is put behind. Not allocated: nothing yet.
      type(eigenpairs_type), intent(inout) :: found
      !> Members whose place is taken, and those that are no eigenvalues.
      logical, intent(inout) :: gone(:), nowhere(:)
      !> Grows by what should be there and is not.
      complex(wp), allocatable, intent(inout) :: lost(:)
      type(error_type), allocatable, intent(out) :: error
      ! Copies that may not be known, beside one or several members.
      integer, parameter :: guards(2) = [2, 4]
      type(polished_type) :: polished
      type(eigenpairs_type) :: members
      complex(wp) :: shift
      logical :: chosen(size(modes%lambda))
      integer :: few

      chosen = .false.
      chosen(cluster%members) = .true.
      members = chosen_pairs(modes, chosen)
      call members%make_complex()
      call polisher%factor_beside(s%work, cluster, shift, error)
      if (.not. allocated(error)) then
         call s%effort%add_factors(polisher%solver, for_refinement)
         few = guards(min(size(cluster%members), 2))
         ! Copies of oscillators are what Lanczos counts.
         if (modes%is_real() .and. size(cluster%members) == 1) few = 0
         call polisher%polish(s%work, cluster, shift, members, maxval(judgement%errors(cluster%members)), few, polished, error)
      end if
      if (allocated(error)) then
         if (all(error%code /= [error_singular, error_convergence, error_cancelled])) return
         deallocate (error)
         return
      end if
      if (is_accepted()) then
         gone(cluster%members) = .true.
         lost = [lost, spread(cluster%centre, 1, max(0, least_of_members() - polished%eigenvalues))]
         if (modes%is_real()) call make_real(s%transform%map, polished%pairs)
         if (allocated(found%lambda)) then
            ! Eigenvalues known so badly that they were not near to each other may be found beside both.
            call leave_out_known(polished%pairs, found)
            call append_pairs(found, polished%pairs)
         else
            found = polished%pairs
         end if
      else if (polished%eigenvalues == 0) then
         nowhere(cluster%members) = judgement%doubtful(cluster%members) .or. judgement%errors(cluster%members) > inaccurate_above
      end if

   contains

      ! How many eigenvalues those of the members that are independent, and not in doubt, stand for.
      integer function least_of_members() result(least)
         logical :: certain(size(cluster%members))

         certain = independent_parts(modes, cluster%members) > dependent_state .and. .not. judgement%doubtful(cluster%members)
         least = count(certain)
         if (cluster%on_axis) least = least + count(certain .and. abs(aimag(modes%lambda(cluster%members))) > 0)
      end function least_of_members

      ! All that there are, or as many as there were, and known better.
      logical function is_accepted()
         integer :: before

         before = size(members%lambda)
         if (cluster%on_axis) before = before + count(abs(aimag(members%lambda)) > 0)
         is_accepted = polished%complete .or. (polished%eigenvalues >= before .and. (polished%worst() <= polisher%tolerance .or. &
            polished%worst() < maxval(judgement%errors(cluster%members))))
      end function is_accepted
   end subroutine polish_cluster

   ! Shapes of oscillators are real but for their phase; those of copies are combinations, and become orthogonal.
   subroutine make_real(map, pairs)
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(inout) :: pairs
      complex(wp) :: xi(size(pairs%xi, 1), 2)
      real(wp) :: shape(pairs%rows(), 2), left(2)
      integer :: i, j, l

      allocate (pairs%real_phi(pairs%rows(), size(pairs%lambda)))
      do j = 1, size(pairs%lambda)
         ! Normalised, their largest entries are real. Multipliers of a real shape are real but for the factor of damping.
         associate (reaction => map%reaction(pairs%lambda(j)))
            shape = reshape([real(pairs%phi(:, j), wp), aimag(pairs%phi(:, j))], shape=[size(shape, 1), 2])
            xi(:, 1) = reaction*real(pairs%xi(:, j)/reaction, wp)
            xi(:, 2) = reaction*aimag(pairs%xi(:, j)/reaction)
         end associate
         do l = 1, 2
            do i = 1, j - 1
               if (abs(pairs%lambda(i) - pairs%lambda(j)) > cancelled*abs(pairs%lambda(j))) cycle
               associate (part => dot_product(pairs%real_phi(:, i), shape(:, l)))
                  shape(:, l) = shape(:, l) - part*pairs%real_phi(:, i)
                  xi(:, l) = xi(:, l) - part*pairs%xi(:, i)
               end associate
            end do
            left(l) = norm2(shape(:, l))
         end do
         l = merge(1, 2, left(1) > same_shape)
         if (left(2) > same_shape .or. l == 1) then
            pairs%real_phi(:, j) = shape(:, l)/left(l)
            pairs%xi(:, j) = xi(:, l)/left(l)
         else
            ! The shape of a double root.
            pairs%real_phi(:, j) = real(pairs%phi(:, j), wp)
         end if
      end do
      deallocate (pairs%phi)
   end subroutine make_real
end module kschur_finishing
