!> Selection of modes from eigenpairs: drops duplicates and spurious pairs, assesses accuracy, keeps those nearest to the target.
module kschur_mode_selection
   use kschur_backward_error, only: judge_as_given
   use kschur_eigenpairs, only: eigenpairs_type, move_pairs, normalize
   use kschur_kinds, only: wp
   use kschur_modes, only: eigenvalues_of, modes_type
   use kschur_problem, only: modal_problem_type
   use kschur_eigenvalue_correction, only: correct_eigenvalues
   use kschur_shapes, only: repeats_rigid_motion
   use kschur_sorting, only: ascending_order
   use kschur_split, only: match_conjugates
   use kschur_threads, only: panel_rows
   use kschur_tolerances, only: blurred_value, equal_value, no_correct_digits, nearly_zero, same_value, spurious
   implicit none
   private
   public :: accept_pairs, distances, drop_spurious, judge_pairs, keep_nearer_unlisted, largest_rate, mode_request_type, &
      nearest_first

   ! Inaccurate eigenvalues larger than accurate ones by this factor are taken as infinite ones that rounding made finite.
   real(wp), parameter :: far_factor = 10

   !> Which modes are asked for, and what bounds their number and size.
   type :: mode_request_type
      !> Number of modes asked for.
      integer :: modes = huge(1)
      !> Those nearest to this lambda (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> Upper bound of the number of finite eigenvalues, both of a conjugate pair counted. More are infinite ones, however small
      !> their backward errors are.
      integer :: max_eigenvalues = huge(1)
      !> Number of rigid motions and their decays, the last pairs: known from the examination, zeros exactly.
      integer :: rigid = 0
      !> Size of lambda (1/s), as the shift, relative to which zeros are recognized.
      real(wp) :: reference = 0
      !> Radius around the target (1/s) within which all eigenvalues were found.
      real(wp) :: search_radius = huge(1.0_wp)
      !> Eigenvalues below this (1/s) are rounding errors of zeros whose root space was not computed.
      real(wp) :: zero_noise = 0
      !> Whether the eigenvalues are refined: they are not corrected.
      logical :: refined = .false.
   end type mode_request_type

contains

   !> Makes modes from eigenpairs as `judge_pairs` does, with the errors of all, and without spurious ones.
   subroutine accept_pairs(problem, request, pairs, modes)
      type(modal_problem_type), intent(in) :: problem
      type(mode_request_type), intent(in) :: request
      !> Moved to the modes.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes

      call judge_pairs(problem, request, pairs, modes)
      ! Exact zeros were not judged.
      call judge_as_given(problem, modes%eigenpairs_type, modes%motion > 0, modes%backward_error, modes%error_bound)
      call drop_spurious(modes)
   end subroutine accept_pairs

   !> Makes modes from eigenpairs: conjugate pairs once, duplicates dropped, nearest to the target first, at most as many as are
   !> asked for. Keeps inaccurate pairs among the nearest, so that they can be refined, and does not compute the errors of zeros;
   !> with losses also keeps those below the real axis that errors may have moved there, which `drop_spurious` drops once they are
   !> accurate. Sets the number found, as `unlisted` the inaccurate pairs that are dropped because there are more pairs than finite
   !> eigenvalues, and as `infinite` those of infinite eigenvalues.
   subroutine judge_pairs(problem, request, pairs, modes)
      type(modal_problem_type), intent(in) :: problem
      type(mode_request_type), intent(in) :: request
      !> Moved to the modes.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes
      logical, allocatable :: accepted(:), mirrored(:), repeated(:), below(:)
      ! Inaccurate pairs that were dropped as there are too many eigenvalues.
      logical, allocatable :: inaccurate(:)
      integer, allocatable :: order(:)
      integer :: j, k

      if (.not. allocated(pairs%paired)) allocate (pairs%paired(size(pairs%lambda)), source=.false.)
      if (allocated(problem%loss)) pairs%paired = .false.
      k = size(pairs%lambda) - request%rigid
      allocate (mirrored(k), source=.false.)
      if (.not. allocated(problem%loss)) then
         call match_conjugates(pairs%lambda(:k), same_value*abs(pairs%lambda(:k)), pairs%paired(:k), mirrored)
         call move_above_axis()
      end if
      !$omp parallel do schedule(static) if (pairs%rows() > panel_rows)
      do j = 1, k
         call normalize(pairs, j)
      end do
      !$omp end parallel do
      call correct_eigenvalues(problem, pairs, request%rigid, request%refined, modes%backward_error, modes%error_bound, &
         modes%uncertainty)
      allocate (below(size(pairs%lambda)), source=.false.)
      ! With H, eigenvalues below the real axis are no conjugates: they belong to the problem with -H. Those that errors may have
      ! moved there stay until they are polished.
      if (allocated(problem%loss)) below = aimag(pairs%lambda) < -max(blurred_value*abs(pairs%lambda), &
         merge(modes%uncertainty, 0.0_wp, modes%backward_error <= spurious))
      allocate (repeated, source=repeats_rigid_motion(problem, pairs, k, request%rigid, request%reference, request%zero_noise))
      allocate (accepted(size(pairs%lambda)), source=.true.)
      accepted(:k) = .not. (mirrored .or. repeated .or. below(:k))
      call drop_infinite()
      call select_nearest(pairs%lambda)
      modes%unlisted = pack(pairs%lambda, inaccurate)
      ! Slow decays of rigid motions look like zeros found again. Those of symmetric problems are known.
      if (.not. (problem%symmetric .or. allocated(problem%loss))) &
         modes%unlisted = [modes%unlisted, pack(pairs%lambda(:k), repeated .and. .not. mirrored)]
      ! A pair that is inaccurate and not listed will not be refined: it is not counted as found.
      accepted = accepted .and. modes%backward_error <= spurious .and. aimag(pairs%lambda) >= 0
      accepted(:k) = accepted(:k) .and. .not. modes%uncertainty(:k) > no_correct_digits*abs(pairs%lambda(:k))
      accepted(order) = .true.
      modes%found = eigenvalues_of(pairs%lambda, accepted)
      modes%motion = [spread(0, 1, k), (j, j=1, request%rigid), spread(0, 1, size(pairs%lambda) - k - request%rigid)]
      call move_pairs(pairs, modes%eigenpairs_type)
      deallocate (modes%paired)
      call modes%take(order)

   contains

      ! Conjugates those of the first k pairs that lie in the lower half plane.
      subroutine move_above_axis()
         integer :: j

         do j = 1, k
            if (.not. aimag(pairs%lambda(j)) < 0) cycle
            pairs%lambda(j) = conjg(pairs%lambda(j))
            if (.not. pairs%is_real()) pairs%phi(:, j) = conjg(pairs%phi(:, j))
            pairs%xi(:, j) = conjg(pairs%xi(:, j))
         end do
      end subroutine move_above_axis

      ! Drops pairs of infinite eigenvalues, and lists them: inaccurate ones far above all accurate ones, and those in excess of the
      ! number of finite eigenvalues.
      subroutine drop_infinite()
         logical, dimension(size(pairs%lambda)) :: infinite, candidates
         real(wp) :: limit

         associate (errors => modes%backward_error, lambda => pairs%lambda)
            limit = max(largest_rate(problem), &
               far_factor*max(request%reference, maxval(abs(lambda), accepted .and. errors <= spurious)))
            infinite = errors > spurious .and. .not. (abs(lambda) <= limit .or. below)
            accepted = accepted .and. .not. infinite
            allocate (inaccurate, source=accepted .and. errors > spurious .and. &
               eigenvalues_of(lambda, accepted) > request%max_eigenvalues)
            accepted = accepted .and. .not. inaccurate
            candidates = accepted
            call drop_excess(lambda, modes%uncertainty)
            modes%infinite = pack(lambda, infinite .or. (candidates .and. .not. accepted))
         end associate
      end subroutine drop_infinite

      ! Selects of the accepted pairs those nearest to the target: at most as many as are asked for, and, unless they are all
      ! finite eigenvalues, only those in the radius that was searched, as others may be missing beyond it. Those below the real
      ! axis, which may turn out to be no modes, are selected beside as many others.
      subroutine select_nearest(lambda)
         complex(wp), intent(in) :: lambda(:)
         integer :: complete, chosen, j

         allocate (order(count(accepted)), source=pack([(j, j=1, size(lambda))], accepted))
         order = order(nearest_first(lambda(order), request%target))
         complete = size(order)
         if (eigenvalues_of(lambda, accepted) < request%max_eigenvalues) &
            complete = count(distances(lambda(order), request%target) <= request%search_radius + &
            max(nearly_zero*min(request%search_radius, abs(lambda(order))), equal_value*abs(lambda(order))))
         chosen = 0
         do j = 1, complete
            if (chosen == request%modes) exit
            if (aimag(lambda(order(j))) >= 0) chosen = chosen + 1
         end do
         order = order(:j - 1)
      end subroutine select_nearest

      ! Drops the eigenvalues in excess of a number, which are infinite ones that rounding made finite: first those without correct
      ! digits, then the largest.
      subroutine drop_excess(lambda, uncertainty)
         complex(wp), intent(in) :: lambda(:)
         real(wp), intent(in) :: uncertainty(:)
         logical :: doubtful(size(lambda))

         do while (eigenvalues_of(lambda, accepted) > request%max_eigenvalues)
            doubtful = accepted .and. uncertainty > no_correct_digits*abs(lambda)
            if (any(doubtful)) then
               accepted(maxloc(uncertainty/max(abs(lambda), tiny(1.0_wp)), 1, doubtful)) = .false.
            else
               accepted(maxloc(abs(lambda), 1, accepted)) = .false.
            end if
         end do
      end subroutine drop_excess
   end subroutine judge_pairs

   !> Drops spurious modes, those with backward errors above `spurious`, and appends their eigenvalues to `unlisted`; and
   !> eigenvalues below the real axis, which with losses are no modes, and without do not occur.
   subroutine drop_spurious(modes)
      type(modes_type), intent(inout) :: modes

      call modes%leave_out(modes%backward_error > spurious)
      call modes%drop(aimag(modes%lambda) < 0)
   end subroutine drop_spurious

   !> Drops from `unlisted` what cannot belong in the list of modes: if that is full, eigenvalues further from the target than its
   !> furthest mode. Those taken as infinite are larger than they look, and only known to lie beyond their magnitude: appends those
   !> that may lie nearer, as if the target is higher than what can be seen from the shift.
   subroutine keep_nearer_unlisted(request, modes)
      type(mode_request_type), intent(in) :: request
      type(modes_type), intent(inout) :: modes
      real(wp) :: furthest

      if (size(modes%lambda) < request%modes) return
      furthest = maxval(distances(modes%lambda, request%target))
      modes%unlisted = [pack(modes%unlisted, distances(modes%unlisted, request%target) <= furthest), &
         pack(modes%infinite, abs(modes%infinite) - abs(request%target) <= furthest)]
   end subroutine keep_nearer_unlisted

   !> Estimates the largest frequency or decay rate (1/s) from the norms of the matrices.
   pure real(wp) function largest_rate(problem)
      type(modal_problem_type), intent(in) :: problem

      largest_rate = 0
      associate (mass => problem%mass%infinity_norm())
         if (mass > 0) largest_rate = max(sqrt(problem%stiffness%infinity_norm()/mass), problem%damping%infinity_norm()/mass)
      end associate
   end function largest_rate

   !> Distance (1/s) of the nearer one of lambda and its conjugate from a target.
   elemental real(wp) function distances(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distances = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distances

   !> Sorts a list of eigenvalues by `distances` from a target: returns the positions.
   function nearest_first(lambda, target) result(order)
      complex(wp), intent(in) :: lambda(:), target
      integer :: order(size(lambda))

      order = ascending_order(distances(lambda, target))
   end function nearest_first
end module kschur_mode_selection
