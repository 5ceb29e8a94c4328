!> The search for the wanted modes: it ends when they are there, or when it is known that there are no more.
module kschur_search
   use kschur_backward_error, only: judge_as_given
   use kschur_certificate, only: indistinct
   use kschur_context, only: solve_context_type, whole_given, whole_iterated
   use kschur_effort, only: phase_judge, phase_recover
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, near, normalize
   use kschur_error, only: error_cancelled, error_type, error_singular, take_cancelled
   use kschur_iteration, only: iterate
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_finishing, only: are_good, finish_modes
   use kschur_mode_selection, only: accept_pairs, distances, drop_spurious, largest_rate, judge_pairs, &
      keep_nearer_unlisted, nearest_first, mode_request_type
   use kschur_modes, only: eigenvalues_of, modes_type, no_modes
   use kschur_outcome, only: certified_unknown, certified_yes, inaccurate_above, reason_cancelled, reason_converged, &
      reason_fewer_modes, reason_inaccurate, reason_max_restarts
   use kschur_refining, only: refine_modes
   use kschur_shapes, only: independent_part, independent_parts
   use kschur_shift, only: factor_beside, move_to_modes
   use kschur_text, only: text
   use kschur_tolerances, only: dependent_state, no_correct_digits, same_shape, same_value
   use kschur_options, only: formulation_quadratic
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: find_modes, take_rigid

contains

   !> The wanted modes, from the transform that was factored.
   subroutine find_modes(s, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      ! Whether it is certain that the iteration has no more modes to give.
      logical :: complete
      integer, allocatable :: order(:)

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      call search_here(s, modes, complete, error)
      if (allocated(error)) return
      if (.not. s%options%is_plain() .and. modes%reason /= reason_cancelled) then
         ! What polishing could not mend may be infinite.
         if (fewer(s, modes) .and. s%known%total%exact) call modes%drop(modes%backward_error > inaccurate_above)
         if (fewer(s, modes) .and. s%known%total%exact .and. complete .and. modes%found < s%known%total%number) &
            call search_elsewhere(s, modes, error)
         if (allocated(error)) return
      end if
      if (.not. (s%options%is_plain() .or. modes%reason == reason_cancelled)) call refine_modes(s, modes)
      if (.not. allocated(error)) call give_shapes(s, modes, error)
      if (allocated(error)) return
      if (.not. (s%options%is_plain() .or. modes%reason == reason_cancelled .or. are_good(s, modes))) then
         ! What is accurate in even units may not be so as given.
         call take_shapes(s, modes, error)
         if (.not. allocated(error)) call finish_modes(s, modes, error)
         if (.not. allocated(error)) call give_shapes(s, modes, error)
         if (allocated(error)) return
      end if
      allocate (order, source=nearest_first(modes%lambda, s%options%target))
      call modes%take(order(:min(size(order), s%options%modes)))
      call drop_spurious(modes)
      if (s%is_stopped()) modes%reason = reason_cancelled
      if (all_known(s, modes)) modes%unlisted = [complex(wp) ::]
      call keep_nearer_unlisted(mode_request_type(s%options%modes, s%options%target), modes)
      call give_reason(s, complete, modes)
      call certify_by_count(s, modes)
      call s%end_step(phase_judge)
   end subroutine find_modes

   !> Where rigid motions are all there is, or as many as are wanted of nothing else.
   subroutine take_rigid(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(out) :: modes
      type(eigenpairs_type) :: pairs

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      pairs = s%known%rigid
      call accept_pairs(s%problem, mode_request_type(s%options%modes, s%options%target, size(pairs%lambda), size(pairs%lambda)), &
         pairs, modes)
      if (fewer(s, modes)) modes%reason = reason_fewer_modes
   end subroutine take_rigid

   pure logical function fewer(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      fewer = size(modes%lambda) < s%options%modes
   end function fewer

   ! Whether there are no more eigenvalues than were found.
   pure logical function all_known(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      all_known = s%known%total%exact .and. modes%found == s%known%total%number
   end function all_known

   ! Ritz values near zero cannot be told apart while they iterate: where they make fewer modes
   ! than they seemed to, more are asked for, as long as that helps.
   subroutine search_here(s, modes, complete, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: rounds = 5
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      integer :: applications, asked, missing, before, round, places
      logical :: moved, all_asked, cancelled, ends
      real(wp) :: reach

      complete = .false.
      asked = min(s%options%modes, s%known%total%number)
      before = s%options%modes + 1
      places = 0
      round = 1
      do
         applications = s%effort%operator_applications
         call iterate(s, asked, pairs, reach, statistics, error)
         if (allocated(error)) return
         moved = .false.
         if (places < rounds .and. statistics%reason /= reason_cancelled) call move_to_modes(s, pairs%lambda, moved, error)
         call take_cancelled(error, cancelled)
         if (allocated(error)) return
         ! They are what was found at the shift before.
         if (cancelled) statistics%reason = reason_cancelled
         if (cancelled) moved = .false.
         if (moved) then
            places = places + 1
            cycle
         end if
         call s%end_step(phase_recover)
         call require_memory(s%bytes_of_shapes(2*(size(pairs%lambda) + size(s%known%rigid%lambda))), "mode shapes", error)
         if (allocated(error)) return
         call append_pairs(pairs, s%contract(s%known%rigid))
         call judge_pairs(s%work, mode_request_type(s%options%modes, s%options%target, merge(huge(1), s%known%total%number, &
            s%is_lossy()), size(s%known%rigid%lambda), s%reference(), reach, merge(s%known%deflation%zero_noise, 0.0_wp, &
            s%is_lossy())), pairs, modes)
         missing = s%options%modes - size(modes%lambda)
         ends = s%options%is_plain() .or. asked == s%known%total%number .or. statistics%reason /= reason_converged .or. &
            round == rounds .or. missing >= before
         if (.not. s%options%is_plain() .and. statistics%reason /= reason_cancelled .and. (ends .or. .not. fewer(s, modes))) then
            call s%announce_phase("refinement")
            call finish_modes(s, modes, error)
            if (allocated(error)) return
         end if
         call drop_spurious(modes)
         call s%end_step(phase_judge)
         missing = s%options%modes - size(modes%lambda)
         if (missing <= 0 .or. ends) exit
         round = round + 1
         before = missing
         asked = min(asked + max(missing, asked/4), s%known%total%number)
      end do
      all_asked = asked == s%known%total%number
      complete = statistics%reason == reason_fewer_modes .or. modes%reached_infinite .or. all_asked
      modes%reason = statistics%reason
      modes%locking_error = statistics%locking_error
      modes%history = statistics%history
      modes%history%operator_applications = applications + modes%history%operator_applications
   end subroutine search_here

   ! Adds to the modes what is found at shifts above and below all of them, until there are as many eigenvalues as
   ! the problem has: what is far from the first shift is filtered out there as infinite eigenvalues are.
   subroutine search_elsewhere(s, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: steps(8) = [1.0_wp, 1.0e2_wp, 1.0e-2_wp, 1.0e4_wp, 1.0e-4_wp, 1.0e6_wp, 1.0e-6_wp, 1.0e8_wp]
      ! Off the first shift itself; beyond so many times the spectrum all eigenvalues look alike.
      real(wp), parameter :: off = 3, beyond_all = 10
      type(eigenpairs_type) :: more
      type(krylov_statistics_type) :: statistics
      class(transform_type), allocatable :: first
      real(wp) :: scale, reach
      complex(wp) :: shift
      integer :: formulation, i
      logical :: dense

      call s%end_step(phase_judge)
      ! What comes after takes the factors for those at the shift.
      call move_alloc(s%transform, first)
      call s%begin_step()
      shift = s%shift
      formulation = s%formulation
      dense = s%dense
      s%formulation = formulation_quadratic
      s%dense = .false.
      scale = s%reference()
      do i = 1, size(steps)
         if (modes%found >= s%known%total%number) exit
         if (steps(i) > 1 .and. off*steps(i)*scale > beyond_all*largest_rate(s%work)) cycle
         call factor_beside(s, cmplx(off*steps(i)*scale, 0, wp), error)
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_cancelled])) exit
            deallocate (error)
            if (s%is_stopped()) exit
            cycle
         end if
         s%known%deflation%locked = accepted_pairs(modes)
         call iterate(s, s%known%total%number, more, reach, statistics, error)
         s%known%deflation%locked = eigenpairs_type()
         if (allocated(error)) exit
         call s%end_step(phase_recover)
         call add_pairs(s, more, scale, modes)
         call finish_modes(s, modes, error)
         if (allocated(error)) exit
         call drop_spurious(modes)
      end do
      s%formulation = formulation
      s%dense = dense
      if (allocated(error)) return
      call s%drop_transform()
      call s%end_step(phase_judge)
      call move_alloc(first, s%transform)
      call s%begin_step()
      s%shift = shift
      call modes%drop(modes%backward_error > inaccurate_above)
   end subroutine search_elsewhere

   ! Those that need not be found again: others than roots of a defective eigenvalue, whose space is known to the root of rounding.
   function accepted_pairs(modes) result(pairs)
      type(modes_type), intent(in) :: modes
      type(eigenpairs_type) :: pairs
      real(wp) :: rests(size(modes%lambda))
      logical :: accepted(size(modes%lambda))
      integer :: j

      rests = independent_parts(modes, [(j, j=1, size(rests))])
      accepted = modes%motion == 0 .and. modes%backward_error <= inaccurate_above
      do j = 1, size(rests)
         if (rests(j) <= dependent_state) accepted = accepted .and. .not. near(modes%lambda, j, same_value)
      end do
      pairs = chosen_pairs(modes, accepted)
      call pairs%make_complex()
   end function accepted_pairs

   ! Shapes of the problem as given, and how well they satisfy it.
   subroutine give_shapes(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      call require_memory(s%bytes_of_shapes(2*size(modes%lambda)), "mode shapes", error)
      if (.not. allocated(error)) call s%hold(whole_given, error)
      if (.not. allocated(error)) call s%expand(modes%eigenpairs_type, error)
      if (allocated(error)) return
      do j = 1, size(modes%lambda)
         associate (i => modes%motion(j))
            if (i == 0) then
               call normalize(modes, j)
            else
               if (modes%is_real()) modes%real_phi(:, j) = s%known%rigid%real_phi(:, i)
               if (.not. modes%is_real()) modes%phi(:, j) = s%known%rigid%column(i)
               modes%xi(:, j) = s%known%rigid%xi(:, i)
            end if
         end associate
      end do
      call judge_as_given(s%problem, modes%eigenpairs_type, modes%motion > 0, modes%backward_error, modes%error_bound)
      call s%hold(whole_iterated, error)
   end subroutine give_shapes

   ! The same modes as what is iterated has them, with what is known of them.
   subroutine take_shapes(s, modes, error)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      call require_memory(s%bytes_of_shapes(3*size(modes%lambda)), "mode shapes", error)
      if (allocated(error)) return
      modes%eigenpairs_type = s%contract(modes)
      do j = 1, size(modes%lambda)
         call normalize(modes, j)
      end do
   end subroutine take_shapes

   ! Of what was found at another shift, what is none of the modes that there are.
   subroutine add_pairs(s, more, reference, modes)
      type(solve_context_type), intent(in) :: s
      !> Used up.
      type(eigenpairs_type), intent(inout) :: more
      !> A size of lambda (1/s), against which zeros are seen.
      real(wp), intent(in) :: reference
      type(modes_type), intent(inout) :: modes
      type(modes_type) :: others
      logical, allocatable :: again(:)
      integer :: j

      call append_pairs(more, s%contract(s%known%rigid))
      call judge_pairs(s%work, mode_request_type(target=s%options%target, rigid=size(s%known%rigid%lambda), reference=reference), &
         more, others)
      allocate (again, source=.not. abs(others%lambda) > 0)
      do j = 1, size(again)
         if (others%motion(j) > 0) again(j) = again(j) .or. any(modes%motion == others%motion(j))
         ! Roots of a defective eigenvalue that were found from different shifts lie apart, with one shape.
         if (.not. again(j)) again(j) = independent_part(modes, others, j, no_correct_digits) <= same_shape
      end do
      call others%drop(again)
      call modes%append(others)
   end subroutine add_pairs

   ! Why the search ended.
   subroutine give_reason(s, complete, modes)
      type(solve_context_type), intent(inout) :: s
      logical, intent(in) :: complete
      type(modes_type), intent(inout) :: modes
      logical :: all_found

      associate (total => s%known%total)
         all_found = complete .and. size(modes%unlisted) == 0
         if (total%exact) all_found = modes%found == total%number
         if (any(modes%reason == [reason_max_restarts, reason_cancelled]) .and. .not. (total%exact .and. all_found)) then
            ! Those that converged need not be the nearest.
            return
         else if (.not. fewer(s, modes)) then
            modes%reason = merge(reason_inaccurate, reason_converged, &
               size(modes%unlisted) > 0 .or. any(modes%backward_error > inaccurate_above))
         else
            modes%reason = merge(reason_fewer_modes, reason_inaccurate, all_found)
            if (total%exact .and. modes%found /= total%number) call s%add_note(text(total%number)//" eigenvalues exist and "// &
               text(modes%found)//" were found")
         end if
      end associate
   end subroutine give_reason

   ! The modes are the nearest to the target if they are no further than what is proved.
   subroutine certify_by_count(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(inout) :: modes
      real(wp) :: furthest, slack

      associate (certificate => s%transform%certificate)
         modes%certified = certified_unknown
         if (all(modes%reason /= [reason_converged, reason_max_restarts])) return
         modes%certified = certificate%verdict
         if (certificate%verdict /= certified_yes) return
         furthest = maxval(distances(modes%lambda, s%options%target))
         slack = 2*indistinct(furthest, maxval(abs(modes%lambda)))
         if (furthest > certificate%reach + slack) modes%certified = certified_unknown
         ! Nothing that was computed may have been lost on the way to the modes.
         if (allocated(certificate%distances)) then
            furthest = furthest - slack
            if (count(certificate%distances < furthest) + nearer_than(furthest, s%known%rigid%lambda) /= &
               nearer_than(furthest, modes%lambda)) then
               modes%certified = certified_unknown
               modes%reason = reason_inaccurate
            end if
         end if
      end associate

   contains

      ! Both of a conjugate pair counted.
      integer function nearer_than(distance, lambda)
         real(wp), intent(in) :: distance
         complex(wp), intent(in) :: lambda(:)

         nearer_than = eigenvalues_of(lambda, distances(lambda, s%options%target) < distance)
      end function nearer_than
   end subroutine certify_by_count
end module kschur_search
