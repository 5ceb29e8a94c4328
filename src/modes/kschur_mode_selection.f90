!> From eigenpairs to modes: which of them are the same, how accurate they are, which are wanted.
module kschur_mode_selection
   use kschur_backward_error, only: judge_as_given
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, keep_pairs, normalize
   use kschur_kinds, only: wp
   use kschur_modes, only: eigenvalues_of, modes_type
   use kschur_problem, only: modal_problem_type
   use kschur_eigenvalue_correction, only: correct_eigenvalues
   use kschur_shapes, only: repeats_zero
   use kschur_sorting, only: ascending_order
   use kschur_split, only: match_conjugates
   use kschur_threads, only: panel_rows
   use kschur_tolerances, only: equal_value, no_correct_digits, nearly_zero, real_tolerance, same_value, spurious
   implicit none
   private
   public :: accept_pairs, distances, drop_spurious, highest, judge_pairs, keep_nearer_unlisted, nearest_first, wanted_type

   ! Infinite eigenvalues are further off than the modes by this factor, whatever rounding made of them.
   real(wp), parameter :: far = 10

   !> Which modes are wanted, and what is known of where they are.
   type :: wanted_type
      integer :: modes = huge(1)
      !> The modes nearest to this lambda (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> There are no more finite eigenvalues than this, both of a conjugate pair counted. What is beyond
      !> belongs to multipliers, however small its backward error is.
      integer :: most = huge(1)
      !> The last so many pairs are rigid motions, known exactly: all of the eigenvalue zero, and
      !> others.
      integer :: rigid = 0
      !> A size of lambda (1/s), as the shift, against which zeros are seen.
      real(wp) :: reference = 0
      !> Eigenvalues are known as far as this from the target (1/s).
      real(wp) :: reach = huge(1.0_wp)
      !> Of motions whose zeros have a root space that is not known, what rounding hides (1/s).
      real(wp) :: zero_noise = 0
   end type wanted_type

contains

   !> Modes from eigenpairs: conjugate pairs once, spurious pairs dropped, nearest to the target first, no more than
   !> are wanted.
   subroutine accept_pairs(problem, wanted, pairs, modes)
      type(modal_problem_type), intent(in) :: problem
      type(wanted_type), intent(in) :: wanted
      !> Used up.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes
      integer, allocatable :: motions(:)
      real(wp), allocatable :: errors(:), bounds(:)
      integer :: j

      call judge_pairs(problem, wanted, pairs, modes)
      ! What is known was not asked for its errors.
      allocate (motions, source=pack([(j, j=1, size(modes%motion))], modes%motion > 0))
      if (size(motions) > 0) then
         allocate (errors(size(motions)), bounds(size(motions)))
         call judge_as_given(problem, chosen_pairs(modes, modes%motion > 0), spread(.true., 1, size(motions)), errors, bounds)
         modes%backward_error(motions) = errors
         modes%error_bound(motions) = bounds
      end if
      call drop_spurious(modes)
   end subroutine accept_pairs

   !> The same, with those among the wanted ones that are known badly.
   subroutine judge_pairs(problem, wanted, pairs, modes)
      type(modal_problem_type), intent(in) :: problem
      type(wanted_type), intent(in) :: wanted
      !> Used up.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes
      logical, allocatable :: accepted(:), badly(:), mirrored(:), repeated(:)
      integer, allocatable :: order(:), motion(:)
      integer :: j, k

      k = size(pairs%lambda) - wanted%rigid
      if (.not. allocated(pairs%paired)) allocate (pairs%paired(size(pairs%lambda)), source=.false.)
      if (allocated(problem%loss)) then
         ! What is below the axis belongs to another problem.
         call keep_pairs(pairs, aimag(pairs%lambda) >= -real_tolerance*abs(pairs%lambda))
         k = size(pairs%lambda) - wanted%rigid
         allocate (mirrored(k), source=.false.)
         call normalize_first(pairs, k)
      else
         allocate (mirrored(k))
         call match_conjugates(pairs%lambda(:k), same_value*abs(pairs%lambda(:k)), pairs%paired(:k), mirrored)
         call make_canonical(pairs, k)
      end if
      call correct_eigenvalues(problem, pairs, wanted%rigid, modes%backward_error, modes%error_bound, modes%uncertainty)
      ! Real shapes stayed as they were.
      if (.not. pairs%is_real()) call normalize_first(pairs, k)
      allocate (repeated, source=repeats_zero(problem, pairs, k, wanted%rigid, wanted%reference, wanted%zero_noise))
      allocate (accepted(size(pairs%lambda)), source=.true.)
      accepted(:k) = .not. (mirrored .or. repeated)
      if (allocated(problem%loss)) accepted(:k) = accepted(:k) .and. aimag(pairs%lambda(:k)) >= 0
      call leave_infinite(problem, wanted, pairs%lambda, modes, accepted, badly)
      call rank(wanted, pairs%lambda, accepted, order)
      modes%unlisted = pack(pairs%lambda, badly)
      ! What is neither known well nor listed will never be looked at, so it is not counted either.
      accepted = accepted .and. modes%backward_error <= spurious
      accepted(:k) = accepted(:k) .and. .not. modes%uncertainty(:k) > no_correct_digits*abs(pairs%lambda(:k))
      accepted(order) = .true.
      modes%found = eigenvalues_of(pairs%lambda, accepted)
      allocate (motion, source=[spread(0, 1, k), (j, j=1, wanted%rigid), spread(0, 1, size(pairs%lambda) - k - wanted%rigid)])
      call move_alloc(motion, modes%motion)
      call move_pairs(pairs, modes)
      call modes%take(order)
   end subroutine judge_pairs

   ! The first k in the upper half plane, of unit norm, the largest entry real and positive.
   subroutine make_canonical(pairs, k)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: k
      integer :: j

      do j = 1, k
         if (.not. aimag(pairs%lambda(j)) < 0) cycle
         pairs%lambda(j) = conjg(pairs%lambda(j))
         if (.not. pairs%is_real()) pairs%phi(:, j) = conjg(pairs%phi(:, j))
         pairs%xi(:, j) = conjg(pairs%xi(:, j))
      end do
      call normalize_first(pairs, k)
   end subroutine make_canonical

   subroutine normalize_first(pairs, k)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: k
      integer :: j

      !$omp parallel do schedule(static) if (pairs%rows() > panel_rows)
      do j = 1, k
         call normalize(pairs, j)
      end do
      !$omp end parallel do
   end subroutine normalize_first

   ! Leaves out what is known badly and lies where infinite eigenvalues do, and what is more than there is.
   subroutine leave_infinite(problem, wanted, lambda, modes, accepted, badly)
      type(modal_problem_type), intent(in) :: problem
      type(wanted_type), intent(in) :: wanted
      complex(wp), intent(in) :: lambda(:)
      type(modes_type), intent(inout) :: modes
      logical, intent(inout) :: accepted(:)
      !> Those that are more than there is, and known badly.
      logical, allocatable, intent(out) :: badly(:)
      logical :: infinite(size(lambda)), dropped
      real(wp) :: limit

      associate (errors => modes%backward_error)
         limit = max(highest(problem), far*max(wanted%reference, maxval(abs(lambda), accepted .and. errors <= spurious)))
         infinite = errors > spurious .and. .not. abs(lambda) <= limit
         accepted = accepted .and. .not. infinite
         allocate (badly, source=accepted .and. errors > spurious .and. eigenvalues_of(lambda, accepted) > wanted%most)
         accepted = accepted .and. .not. badly
         call drop_beyond(lambda, modes%uncertainty, wanted%most, accepted, dropped)
         modes%beyond = dropped .or. any(infinite)
      end associate
   end subroutine leave_infinite

   !> Takes out what is known so badly that it may be no mode.
   subroutine drop_spurious(modes)
      type(modes_type), intent(inout) :: modes

      associate (badly => modes%backward_error > spurious)
         modes%unlisted = [modes%unlisted, pack(modes%lambda, badly)]
         call modes%drop(badly)
      end associate
   end subroutine drop_spurious

   !> Of what is too inaccurate to be listed, keeps what may be nearer to the target than the furthest of a full list.
   subroutine keep_nearer_unlisted(wanted, modes)
      type(wanted_type), intent(in) :: wanted
      type(modes_type), intent(inout) :: modes

      if (size(modes%lambda) < wanted%modes) return
      modes%unlisted = pack(modes%unlisted, distances(modes%unlisted, wanted%target) <= &
         maxval(distances(modes%lambda, wanted%target)))
   end subroutine keep_nearer_unlisted

   ! The wanted ones of those that are accepted and so near that none can lie between them.
   subroutine rank(wanted, lambda, accepted, order)
      type(wanted_type), intent(in) :: wanted
      complex(wp), intent(in) :: lambda(:)
      logical, intent(in) :: accepted(:)
      integer, allocatable, intent(out) :: order(:)
      integer :: known, j

      allocate (order(count(accepted)), source=pack([(j, j=1, size(lambda))], accepted))
      order = order(nearest_first(lambda(order), wanted%target))
      known = size(order)
      if (eigenvalues_of(lambda, accepted) < wanted%most) known = count(distances(lambda(order), wanted%target) <= &
         wanted%reach + max(nearly_zero*min(wanted%reach, abs(lambda(order))), equal_value*abs(lambda(order))))
      order = order(:min(known, wanted%modes))
   end subroutine rank

   subroutine move_pairs(pairs, modes)
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes

      call move_alloc(pairs%lambda, modes%lambda)
      ! Those that are not allocated leave none behind.
      call move_alloc(pairs%phi, modes%phi)
      call move_alloc(pairs%real_phi, modes%real_phi)
      call move_alloc(pairs%xi, modes%xi)
   end subroutine move_pairs

   ! Takes out of a list of more eigenvalues than there are those that may be anything, and then the largest: they
   ! are infinite ones that rounding blurred.
   pure subroutine drop_beyond(lambda, uncertainty, most, accepted, dropped)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: uncertainty(:)
      integer, intent(in) :: most
      logical, intent(inout) :: accepted(:)
      logical, intent(out) :: dropped
      logical :: doubtful(size(lambda))

      dropped = .false.
      do while (eigenvalues_of(lambda, accepted) > most)
         doubtful = accepted .and. uncertainty > no_correct_digits*abs(lambda)
         if (any(doubtful)) then
            accepted(maxloc(uncertainty/max(abs(lambda), tiny(1.0_wp)), 1, doubtful)) = .false.
         else
            accepted(maxloc(abs(lambda), 1, accepted)) = .false.
         end if
         dropped = .true.
      end do
   end subroutine drop_beyond

   !> About the highest frequency or decay (1/s) that the matrices have.
   pure real(wp) function highest(problem)
      type(modal_problem_type), intent(in) :: problem

      highest = 0
      associate (mass => problem%mass%infinity_norm())
         if (mass > 0) highest = max(sqrt(problem%stiffness%infinity_norm()/mass), problem%damping%infinity_norm()/mass)
      end associate
   end function highest

   !> From a target to the nearer one of lambda and its conjugate.
   elemental real(wp) function distances(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distances = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distances

   !> The positions in a list of eigenvalues, by the distance of the nearer of the pair from a target.
   function nearest_first(lambda, target) result(order)
      complex(wp), intent(in) :: lambda(:), target
      integer :: order(size(lambda))

      order = ascending_order(distances(lambda, target))
   end function nearest_first
end module kschur_mode_selection
