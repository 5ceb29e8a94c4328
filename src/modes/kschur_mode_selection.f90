!> From eigenpairs to modes: which of them are the same, how accurate they are, which are wanted.
module kschur_mode_selection
   use kschur_backward_error, only: backward_errors
   use kschur_eigenpairs, only: eigenpairs_type, keep_pairs, normalize
   use kschur_kinds, only: wp
   use kschur_modes, only: eigenvalues_of, modes_type
   use kschur_problem, only: modal_problem_type
   use kschur_residual_parts, only: residual_parts
   use kschur_settling, only: settle_pairs
   use kschur_shapes, only: depends, repeats_zero
   use kschur_threads, only: panel_rows
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: accept_pairs, distances, drop_dependent, drop_spurious, highest, nearest_first, replace_pairs, wanted_type

   ! A pair above this backward error is no mode of the problem.
   real(wp), parameter :: spurious = 1.0e-5_wp
   ! Infinite eigenvalues are further off than the modes by this factor, whatever rounding made of them.
   real(wp), parameter :: far = 10
   ! Rounding splits a defective eigenvalue by the root of a backward error, copies of another by far less than this
   ! part of that.
   real(wp), parameter :: part_of_split = 0.1_wp
   ! Where an eigenvalue is while it is iterated, and so its distance from the target, is known no better than this; where
   ! it is the target, than this part of it.
   real(wp), parameter :: blurred = 1.0e-4_wp, rounded = 1.0e-10_wp

   ! Found from a shift far off, a shape has more of its neighbours in it than the same one found twice elsewhere.
   real(wp), parameter :: neighbours = 3.0e-2_wp

   !> Which modes are wanted, and what is known of where they are.
   type :: wanted_type
      integer :: modes = huge(1)
      !> The modes nearest to this lambda (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> There are no more finite eigenvalues than this, both of a conjugate pair counted. What is beyond
      !> belongs to multipliers, however small its backward error is.
      integer :: most = huge(1)
      !> The last so many pairs are rigid motions, known exactly: all of the eigenvalue zero, with
      !> orthonormal shapes, and others.
      integer :: rigid = 0
      !> A size of lambda (1/s), as the shift, against which zeros are seen.
      real(wp) :: reference = 0
      !> Eigenvalues are known as far as this from the target (1/s).
      real(wp) :: reach = huge(1.0_wp)
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
      logical, allocatable :: again(:), accepted(:), doubtful(:)
      integer, allocatable :: order(:)
      integer :: k

      k = size(pairs%lambda) - wanted%rigid
      call make_canonical(pairs, k, again)
      call settle_pairs(problem, pairs, wanted%rigid, modes%backward_error, modes%error_bound, modes%uncertainty)
      ! Real shapes stayed as they were.
      if (.not. pairs%is_real()) call normalize_first(pairs, k)
      ! On the real axis there are no conjugates: each eigenvalue is one of its own.
      again = [again .and. abs(aimag(pairs%lambda(:k))) > 0, spread(.false., 1, size(pairs%lambda) - k)]
      if (allocated(pairs%again)) again = again .or. pairs%again
      allocate (accepted(size(pairs%lambda)), source=.true.)
      accepted(:k) = .not. repeats_zero(problem, pairs, k, wanted%rigid, wanted%reference)
      call drop_found_again(problem, pairs, again, accepted)
      call judge(problem, wanted, k, pairs, modes, accepted, doubtful)
      modes%found = eigenvalues_of(pairs%lambda, accepted)
      call rank(wanted, pairs%lambda, accepted, order)
      ! Beyond the furthest of all that are wanted they do not matter.
      if (size(order) == wanted%modes) doubtful = doubtful .and. distances(pairs%lambda, wanted%target) <= &
         maxval(distances(pairs%lambda(order), wanted%target))
      modes%inaccurate = count(doubtful)
      call move_pairs(pairs, modes)
      call modes%take(order)
   end subroutine accept_pairs

   ! The first k in the upper half plane, of unit norm, the largest entry real and positive.
   subroutine make_canonical(pairs, k, lower)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: k
      !> Which of them were conjugated.
      logical, allocatable, intent(out) :: lower(:)
      integer :: j

      allocate (lower(k), source=aimag(pairs%lambda(:k)) < 0)
      do j = 1, k
         if (.not. lower(j)) cycle
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

   ! Of pairs that may be known already those that are.
   subroutine drop_found_again(problem, pairs, again, accepted)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: again(:)
      logical, intent(inout) :: accepted(:)
      real(wp), dimension(size(again)) :: errors, split, apart
      ! Those that were found elsewhere, or are others than the iteration found.
      logical :: changed(size(again)), others(size(again)), alone
      integer :: j

      changed = .false.
      if (allocated(pairs%again)) changed = pairs%again
      errors = residual_parts(problem, pairs, accepted .and. again)
      do j = 1, size(again)
         if (.not. (accepted(j) .and. again(j))) cycle
         ! Conjugates that stand alone are as independent as the iteration found them.
         apart = abs(pairs%lambda - pairs%lambda(j))
         alone = .not. (changed(j) .or. any(accepted .and. .not. again .and. apart <= same_value*abs(pairs%lambda(j))))
         ! Among each other those of a defective eigenvalue share a shape, but not the last digits of their places.
         split = sqrt(max(errors, errors(j), epsilon(1.0_wp)))
         others = accepted .and. &
            (.not. again .or. ((changed .or. .not. alone) .and. apart <= part_of_split*split*abs(pairs%lambda(j))))
         others(j:) = others(j:) .and. .not. again(j:)
         accepted(j) = .not. depends(pairs, others, j, roughly=.true.)
         if (accepted(j)) accepted(j) = .not. depends(pairs, others, j, part=neighbours)
      end do
   end subroutine drop_found_again

   ! Accepts what has a small backward error, no more than there are; what has not is doubtful if it may be a mode.
   subroutine judge(problem, wanted, k, pairs, modes, accepted, doubtful)
      type(modal_problem_type), intent(in) :: problem
      type(wanted_type), intent(in) :: wanted
      !> The first so many are of an iteration.
      integer, intent(in) :: k
      type(eigenpairs_type), intent(in) :: pairs
      type(modes_type), intent(inout) :: modes
      logical, intent(inout) :: accepted(:)
      logical, allocatable, intent(out) :: doubtful(:)
      real(wp) :: limit
      logical :: dropped

      associate (lambda => pairs%lambda, errors => modes%backward_error)
         limit = max(highest(problem), far*max(wanted%reference, maxval(abs(lambda), accepted .and. errors <= spurious)))
         allocate (doubtful, source=accepted .and. errors > spurious .and. abs(lambda) <= limit)
         modes%beyond = any(errors > spurious .and. .not. abs(lambda) <= limit)
         accepted = accepted .and. errors <= spurious
         if (eigenvalues_of(lambda, accepted) > wanted%most) call drop_repeated(pairs, k, wanted, accepted)
         call drop_beyond(lambda, modes%uncertainty, wanted%most, accepted, dropped)
      end associate
      if (dropped) doubtful = .false.
      if (dropped) modes%beyond = .true.
   end subroutine judge

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
         wanted%reach + max(blurred*min(wanted%reach, abs(lambda(order))), rounded*abs(lambda(order))))
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
      if (allocated(pairs%weights)) call move_alloc(pairs%weights, modes%weights)
   end subroutine move_pairs

   !> Takes out what is no eigenpair of a problem.
   subroutine drop_spurious(problem, pairs)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      real(wp) :: errors(size(pairs%lambda))

      errors = backward_errors(problem, pairs)
      call keep_pairs(pairs, errors <= spurious)
   end subroutine drop_spurious

   ! Takes out of a list of more eigenvalues than there are those that have the shapes of others: an eigenvalue
   ! found twice, if it is not a defective one, which counts as often.
   subroutine drop_repeated(pairs, k, wanted, accepted)
      type(eigenpairs_type), intent(in) :: pairs
      !> The first so many are of an iteration, and those behind the rigid motions copies of some of them.
      integer, intent(in) :: k
      type(wanted_type), intent(in) :: wanted
      logical, intent(inout) :: accepted(:)
      logical :: others(size(accepted))
      integer :: j

      do j = size(accepted), 1, -1
         if (.not. accepted(j) .or. (j > k .and. j <= k + wanted%rigid)) cycle
         if (eigenvalues_of(pairs%lambda, accepted) <= wanted%most) return
         others = accepted
         others(j) = .false.
         accepted(j) = .not. depends(pairs, others, j)
      end do
   end subroutine drop_repeated

   !> Takes out modes that have the shapes of others and their eigenvalue, the worst first: found twice, or of a defective one.
   subroutine drop_dependent(modes)
      type(modes_type), intent(inout) :: modes
      logical :: accepted(size(modes%lambda)), pending(size(modes%lambda)), others(size(modes%lambda))
      integer :: i, j

      accepted = .true.
      pending = abs(modes%lambda) > 0
      do i = 1, count(pending)
         j = maxloc(modes%backward_error, 1, pending)
         pending(j) = .false.
         others = accepted
         others(j) = .false.
         accepted(j) = .not. depends(modes%eigenpairs_type, others, j, part=neighbours)
      end do
      call modes%drop(.not. accepted)
   end subroutine drop_dependent

   ! Takes out of a list of more eigenvalues than there are those that may be anything, and then the largest: they
   ! are infinite ones that rounding blurred.
   pure subroutine drop_beyond(lambda, uncertainty, most, accepted, dropped)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: uncertainty(:)
      integer, intent(in) :: most
      logical, intent(inout) :: accepted(:)
      logical, intent(out) :: dropped
      real(wp), parameter :: anything = 1.0e-2_wp
      logical :: doubtful(size(lambda))

      dropped = .false.
      do while (eigenvalues_of(lambda, accepted) > most)
         doubtful = accepted .and. uncertainty > anything*abs(lambda)
         if (any(doubtful)) then
            accepted(maxloc(uncertainty/max(abs(lambda), tiny(1.0_wp)), 1, doubtful)) = .false.
         else
            accepted(maxloc(abs(lambda), 1, accepted)) = .false.
         end if
         dropped = .true.
      end do
   end subroutine drop_beyond

   !> Puts pairs in the place of modes: the same ones, but better. Those that became others of the list go.
   subroutine replace_pairs(problem, wanted, better, pairs, modes, gone)
      type(modal_problem_type), intent(in) :: problem
      !> No more modes than this.
      integer, intent(in) :: wanted
      !> Which are; of the others those on the real axis stay where they are, as the decays of rigid motions, which are known.
      logical, intent(in) :: better(:)
      !> Used up.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modes_type), intent(inout) :: modes
      !> Which became others, where that is known.
      logical, optional, intent(in) :: gone(:)
      type(eigenpairs_type) :: before
      real(wp), allocatable :: errors(:), bounds(:), uncertainty(:)
      logical :: repeated(size(pairs%lambda)), others(size(pairs%lambda))
      ! A copy follows the mode that it is one of.
      integer, allocatable :: order(:), origin(:)
      integer :: j, k, copies

      k = size(repeated)
      allocate (before%lambda, source=modes%lambda)
      call modes%make_complex()
      call move_alloc(modes%phi, before%phi)
      if (allocated(pairs%weights)) allocate (before%weights, source=pairs%weights)
      ! A pair that comes to the real axis is two eigenvalues there.
      if (.not. allocated(pairs%paired)) allocate (pairs%paired(k), source=abs(aimag(before%lambda)) > 0)
      call settle_pairs(problem, pairs, 0, errors, bounds, uncertainty)
      where (.not. (better .or. pairs%paired(:k)))
         pairs%lambda(:k) = before%lambda
         errors(:k) = modes%backward_error
         bounds(:k) = modes%error_bound
         uncertainty(:k) = modes%uncertainty
      end where
      call move_alloc(errors, modes%backward_error)
      call move_alloc(bounds, modes%error_bound)
      call move_alloc(uncertainty, modes%uncertainty)
      call normalize_first(pairs, size(pairs%lambda))
      repeated = .false.
      if (present(gone)) repeated(:k) = gone
      do j = 1, k
         if (present(gone)) exit
         others = .not. repeated
         others(j) = .false.
         ! Shapes of a defective eigenvalue were the same before.
         if (depends(pairs, others, j)) repeated(j) = .not. depends(before, others, j)
      end do
      allocate (order(0), origin(0))
      copies = 0
      do j = 1, k
         order = [order, j]
         origin = [origin, j]
         if (.not. pairs%paired(j) .or. abs(aimag(pairs%lambda(j))) > 0) cycle
         copies = copies + 1
         order = [order, k + copies]
         origin = [origin, j]
      end do
      modes%found = modes%found + eigenvalues_of(pairs%lambda, spread(.true., 1, size(pairs%lambda))) - &
         eigenvalues_of(before%lambda, spread(.true., 1, k))
      call move_pairs(pairs, modes)
      call modes%take(order)
      call modes%drop(repeated(origin))
      if (size(modes%lambda) > wanted) call modes%take([(j, j=1, wanted)])
   end subroutine replace_pairs

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
      real(wp) :: distance(size(lambda))
      integer :: i, j

      do i = 1, size(lambda)
         associate (d => distances(lambda(i), target))
            j = i - 1
            do while (j > 0)
               if (distance(j) <= d) exit
               distance(j + 1) = distance(j)
               order(j + 1) = order(j)
               j = j - 1
            end do
            distance(j + 1) = d
            order(j + 1) = i
         end associate
      end do
   end function nearest_first
end module kschur_mode_selection
