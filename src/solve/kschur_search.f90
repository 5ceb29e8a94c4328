!> Searches for the wanted modes, until they are found or it is known that there are no more.
module kschur_search
   use kschur_backward_error, only: judge_as_given
   use kschur_certificate, only: indistinct
   use kschur_context, only: solve_context_type, whole_given
   use kschur_effort, only: phase_judge, phase_recover
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize, replace_pair
   use kschur_error, only: error_cancelled, error_type, error_singular, take_cancelled
   use kschur_iteration, only: iterate
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_finishing, only: are_good, finish_modes, is_small, refine_modes
   use kschur_mode_selection, only: accept_pairs, distances, drop_spurious, largest_rate, judge_pairs, &
      keep_nearer_unlisted, nearest_first, mode_request_type
   use kschur_modes, only: eigenvalues_of, modes_type, no_modes
   use kschur_oscillators, only: judge_damped
   use kschur_outcome, only: certified_unknown, certified_yes, inaccurate_above, reason_cancelled, reason_converged, &
      reason_fewer_modes, reason_inaccurate, reason_max_restarts
   use kschur_shapes, only: independent_part
   use kschur_shared_judgement, only: judge_by_rows
   use kschur_shift, only: factor_beside, move_to_modes
   use kschur_text, only: text
   use kschur_tolerances, only: equal_value, no_correct_digits, same_shape, too_far
   use kschur_options, only: formulation_quadratic
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: find_modes, take_rigid

contains

   !> Computes the wanted modes of the problem as given: iterates on the current transform, and at other shifts if eigenvalues are
   !> known to be missing, polishes and refines the modes, and judges them. Sets why the search ended, and whether a count
   !> certifies them.
   subroutine find_modes(s, modes, error, refines)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      !> Whether modes of small problems are refined. Absent: they are.
      logical, optional, intent(in) :: refines
      ! Whether the iteration is certain to have no more modes; whether it had too few.
      logical :: complete, lacking, refined
      integer, allocatable :: order(:)

      refined = .not. s%options%is_plain()
      if (present(refines)) refined = refined .and. refines
      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      call search_here(s, modes, complete, error)
      if (allocated(error)) return
      lacking = .false.
      if (.not. s%options%is_plain() .and. modes%reason /= reason_cancelled) then
         ! Modes that polishing could not make accurate may be infinite eigenvalues.
         if (has_too_few(s, modes) .and. s%known%total%exact) call modes%drop(modes%backward_error > inaccurate_above)
         lacking = (has_too_few(s, modes) .and. complete) .or. misses_nearer(s, modes)
         if (lacking .and. s%known%total%exact .and. modes%found < s%known%total%number) call search_elsewhere(s, modes, error)
         if (allocated(error)) return
      end if
      if (refined .and. modes%reason /= reason_cancelled) call refine_modes(s, modes, error)
      if (.not. allocated(error)) call expand_modes(s, modes, error)
      if (allocated(error)) return
      if (.not. (s%options%is_plain() .or. modes%reason == reason_cancelled .or. are_good(s, modes))) then
         ! Modes that are accurate in balanced units may not be so in the units as given.
         call contract_modes(s, modes, error)
         if (.not. allocated(error)) call finish_modes(s, modes, refined .and. is_small(s), error)
         if (.not. allocated(error)) call expand_modes(s, modes, error)
         if (allocated(error)) return
      end if
      ! With losses, refinement may have moved eigenvalues below the real axis: they are no modes.
      call modes%drop(aimag(modes%lambda) < 0)
      allocate (order, source=nearest_first(modes%lambda, s%options%target))
      call modes%take(order(:min(size(order), s%options%modes)))
      call drop_spurious(modes)
      if (s%is_stopped()) modes%reason = reason_cancelled
      if (all_known(s, modes)) modes%unlisted = [complex(wp) ::]
      ! A count tells of finite eigenvalues among them.
      if (all_known(s, modes) .or. s%transform%certificate%verdict == certified_yes) modes%infinite = [complex(wp) ::]
      call keep_nearer_unlisted(mode_request_type(s%options%modes, s%options%target), modes)
      call set_reason()
      call certify_by_count(s, modes)
      call s%end_step(phase_judge)

   contains

      ! Sets the reason why the search ended.
      subroutine set_reason()
         logical :: all_found

         associate (total => s%known%total)
            all_found = merge(all_known(s, modes), complete .and. size(modes%unlisted) == 0, total%exact)
            ! With losses the modes are not counted: unknowns without mass make as many infinite ones, others taken as such are
            ! finite.
            if (s%is_lossy()) all_found = all_found .and. size(modes%infinite) <= s%known%massless
            if (any(modes%reason == [reason_max_restarts, reason_cancelled]) .and. .not. (total%exact .and. all_found)) then
               ! The converged modes need not be the nearest ones.
               return
            else if (.not. has_too_few(s, modes)) then
               modes%reason = merge(reason_inaccurate, reason_converged, &
                  ((lacking .or. misses_nearer(s, modes)) .and. .not. all_found) .or. size(modes%unlisted) > 0 .or. &
                  any(modes%backward_error > inaccurate_above))
            else
               ! Refinement may have made a pair of two real eigenvalues, after others were cut off.
               all_found = all_found .and. eigenvalues_of(modes%lambda, modes%motion >= 0) >= modes%found
               modes%reason = merge(reason_fewer_modes, reason_inaccurate, all_found)
               if (total%exact .and. modes%found /= total%number) call s%add_note(text(total%number)//" eigenvalues exist and "// &
                  text(modes%found)//" were found")
            end if
         end associate
      end subroutine set_reason
   end subroutine find_modes

   !> Makes the modes from the rigid motions and their decays alone, for a problem that has no others.
   subroutine take_rigid(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(out) :: modes
      type(eigenpairs_type) :: pairs

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      pairs = s%known%rigid
      call accept_pairs(s%problem, mode_request_type(s%options%modes, s%options%target, size(pairs%lambda), size(pairs%lambda)), &
         pairs, modes)
      if (has_too_few(s, modes)) modes%reason = reason_fewer_modes
   end subroutine take_rigid

   ! Whether the list has fewer modes than are wanted.
   pure logical function has_too_few(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      has_too_few = size(modes%lambda) < s%options%modes
   end function has_too_few

   ! Whether an iteration may have missed modes nearer than the furthest: from the shift these look infinite, and no count tells.
   pure logical function misses_nearer(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      misses_nearer = any(modes%reason == [reason_converged, reason_fewer_modes]) .and. &
         s%transform%certificate%verdict /= certified_yes .and. &
         maxval([0.0_wp, distances(modes%lambda, s%options%target)]) + abs(s%options%target) > too_far*max(abs(s%shift), s%scale)
   end function misses_nearer

   ! Whether all eigenvalues of the problem were found, by their exact number.
   pure logical function all_known(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      all_known = s%known%total%exact .and. modes%found == s%known%total%number
   end function all_known

   ! Searches from the current shift, or from a better one at the scale of the modes found. If the Ritz pairs make fewer modes than
   ! wanted, because some near zero turned out to be the same mode, more are computed in another round, as long as that adds modes.
   subroutine search_here(s, modes, complete, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_rounds = 5
      type(eigenpairs_type) :: pairs
      type(krylov_statistics_type) :: statistics
      integer :: applications, wanted, missing, missing_before, round, moves
      logical :: moved, cancelled, is_last
      real(wp) :: complete_radius

      complete = .false.
      wanted = min(s%options%modes, s%known%total%number)
      missing_before = s%options%modes + 1
      moves = 0
      round = 1
      do
         applications = s%effort%operator_applications
         call iterate(s, wanted, pairs, complete_radius, statistics, error)
         if (allocated(error)) return
         moved = .false.
         if (moves < most_rounds .and. statistics%reason /= reason_cancelled) call move_to_modes(s, pairs%lambda, moved, error)
         call take_cancelled(error, cancelled)
         if (allocated(error)) return
         ! The pairs are those from the shift before.
         if (cancelled) statistics%reason = reason_cancelled
         if (moved .and. .not. cancelled) then
            moves = moves + 1
            cycle
         end if
         call s%end_step(phase_recover)
         call require_memory(s%bytes_of_shapes(2*(size(pairs%lambda) + size(s%known%rigid%lambda))), "mode shapes", error)
         if (allocated(error)) return
         call append_pairs(pairs, s%contract(s%known%rigid))
         call judge_pairs(s%work, mode_request_type(s%options%modes, s%options%target, merge(huge(1), s%known%total%number, &
            s%is_lossy()), size(s%known%rigid%lambda), s%reference(), complete_radius, merge(s%known%deflation%zero_noise, 0.0_wp, &
            s%is_lossy())), pairs, modes)
         missing = s%options%modes - size(modes%lambda)
         is_last = s%options%is_plain() .or. wanted == s%known%total%number .or. statistics%reason /= reason_converged .or. &
            round == most_rounds .or. missing >= missing_before
         if (.not. s%options%is_plain() .and. statistics%reason /= reason_cancelled .and. &
            (is_last .or. .not. has_too_few(s, modes))) then
            call s%announce_phase("refinement")
            call finish_modes(s, modes, .false., error)
            if (allocated(error)) return
         end if
         call drop_spurious(modes)
         call s%end_step(phase_judge)
         missing = s%options%modes - size(modes%lambda)
         if (missing <= 0 .or. is_last) exit
         round = round + 1
         missing_before = missing
         wanted = min(wanted + max(missing, wanted/4), s%known%total%number)
      end do
      ! An infinite eigenvalue among the nearest shows that there are no more, unless it looks nearer to the target than zero is.
      complete = statistics%reason == reason_fewer_modes .or. wanted == s%known%total%number .or. &
         any(distances(modes%infinite, s%options%target) > abs(s%options%target))
      modes%reason = statistics%reason
      modes%locking_error = statistics%locking_error
      modes%history = statistics%history
      modes%history%operator_applications = applications + modes%history%operator_applications
   end subroutine search_here

   ! Searches for missing eigenvalues at shifts above and below the first one, until as many are found as the problem has: from the
   ! first shift, far eigenvalues are filtered out like infinite ones. Uses the quadratic form, with accepted modes locked.
   subroutine search_elsewhere(s, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: shift_factors(8) = [1.0_wp, 1.0e2_wp, 1.0e-2_wp, 1.0e4_wp, 1.0e-4_wp, 1.0e6_wp, 1.0e-6_wp, 1.0e8_wp]
      ! Factor that avoids the first shift; from a shift beyond this multiple of the highest frequency all eigenvalues look alike.
      real(wp), parameter :: off_first_shift = 3, beyond_all = 10
      type(eigenpairs_type) :: found
      type(modes_type) :: more
      type(krylov_statistics_type) :: statistics
      class(transform_type), allocatable :: first_transform
      real(wp) :: first_scale, complete_radius
      complex(wp) :: first_shift
      integer :: first_formulation, i
      logical :: first_dense

      call s%end_step(phase_judge)
      ! Later steps, as that for left vectors, need the factors at the first shift.
      call move_alloc(s%transform, first_transform)
      call s%begin_step()
      first_shift = s%shift
      first_formulation = s%formulation
      first_dense = s%dense
      s%formulation = formulation_quadratic
      s%dense = .false.
      first_scale = s%reference()
      ! What was found and is not listed is found again.
      modes%found = eigenvalues_of(modes%lambda, modes%motion == 0) + &
         eigenvalues_of(s%known%rigid%lambda, spread(.true., 1, size(s%known%rigid%lambda)))
      do i = 1, size(shift_factors)
         if (modes%found >= s%known%total%number) exit
         if (shift_factors(i) > 1 .and. off_first_shift*shift_factors(i)*first_scale > beyond_all*largest_rate(s%work)) cycle
         call factor_beside(s, cmplx(off_first_shift*shift_factors(i)*first_scale, 0, wp), error)
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_cancelled])) exit
            deallocate (error)
            if (s%is_stopped()) exit
            cycle
         end if
         s%known%deflation%locked = chosen_pairs(modes, modes%motion == 0 .and. modes%backward_error <= inaccurate_above)
         call s%known%deflation%locked%make_complex()
         call iterate(s, s%known%total%number, found, complete_radius, statistics, error)
         s%known%deflation%locked = eigenpairs_type()
         if (allocated(error)) exit
         call s%end_step(phase_recover)
         call append_pairs(found, s%contract(s%known%rigid))
         call judge_pairs(s%work, mode_request_type(target=s%options%target, rigid=size(s%known%rigid%lambda), &
            reference=first_scale), found, more)
         call add_modes(more, modes)
         call finish_modes(s, modes, .false., error)
         if (allocated(error)) exit
         call drop_spurious(modes)
      end do
      s%formulation = first_formulation
      s%dense = first_dense
      if (allocated(error)) return
      call s%drop_transform()
      call s%end_step(phase_judge)
      call move_alloc(first_transform, s%transform)
      call s%begin_step()
      s%shift = first_shift
      call modes%drop(modes%backward_error > inaccurate_above)
   end subroutine search_elsewhere

   ! Expands modes of the iterated problem to the problem as given, and computes their backward errors and error bounds there: those
   ! of damped modes in the damped problem, by rows if the problem is distributed. Else, and for multipliers that follow from it,
   ! whole matrices of the iterated problem may be freed.
   subroutine expand_modes(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      call require_memory(s%bytes_of_shapes(2*size(modes%lambda)), "mode shapes", error)
      if (.not. allocated(error) .and. (.not. allocated(s%norms) .or. s%plan%eliminated > 0)) call s%hold(whole_given, error)
      if (.not. allocated(error)) call s%expand(modes%eigenpairs_type, error)
      if (allocated(error)) return
      do j = 1, size(modes%lambda)
         if (modes%motion(j) == 0) call normalize(modes, j)
         if (modes%motion(j) > 0) call replace_pair(modes, j, s%known%rigid, modes%motion(j))
      end do
      if (allocated(s%norms)) then
         call judge_by_rows(s%shared, s%processes, s%norms, modes%eigenpairs_type, modes%motion > 0, modes%backward_error, &
            modes%error_bound, error)
      else if (associated(s%damped)) then
         call judge_damped(s%damped, modes)
      else
         call judge_as_given(s%problem, modes%eigenpairs_type, modes%motion > 0, modes%backward_error, modes%error_bound)
      end if
   end subroutine expand_modes

   ! Restricts modes of the problem as given to the iterated problem.
   subroutine contract_modes(s, modes, error)
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
   end subroutine contract_modes

   ! Appends the modes from another shift that are not in the list, but no zeros: these are known from the examination.
   subroutine add_modes(added, modes)
      !> Those that are in the list are dropped.
      type(modes_type), intent(inout) :: added
      type(modes_type), intent(inout) :: modes
      logical, allocatable :: is_known(:)
      integer :: j

      allocate (is_known, source=.not. abs(added%lambda) > 0)
      do j = 1, size(is_known)
         if (added%motion(j) > 0) is_known(j) = is_known(j) .or. any(modes%motion == added%motion(j))
         ! Roots of a defective eigenvalue that were found from different shifts lie apart, with one shape.
         if (.not. is_known(j)) is_known(j) = independent_part(modes, added, j, no_correct_digits) <= same_shape
      end do
      call added%drop(is_known)
      call modes%append(added)
   end subroutine add_modes

   ! Sets `certified` from the verdict of the iteration's count: the modes are proved to be the nearest ones if they lie within the
   ! radius of the certificate.
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
         ! Distances from an eigenvalue are rounding.
         slack = max(2*indistinct(furthest, maxval(abs(modes%lambda))), equal_value*maxval(abs(modes%lambda)))
         if (furthest > certificate%reach + slack) modes%certified = certified_unknown
         ! If all eigenvalues were computed, none that is nearer than the furthest mode may be missing in the list.
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

      ! Number of eigenvalues nearer to the target than this, both of a conjugate pair counted.
      integer function nearer_than(distance, lambda)
         real(wp), intent(in) :: distance
         complex(wp), intent(in) :: lambda(:)

         nearer_than = eigenvalues_of(lambda, distances(lambda, s%options%target) < distance)
      end function nearer_than
   end subroutine certify_by_count
end module kschur_search
