!> From eigenpairs to modes: which of them are the same, how accurate they are, which are wanted.
module kschur_modes
   use kschur_backward_error, only: backward_errors, settle_pairs
   use kschur_description, only: describe, form, no_energy
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_options, only: modal_options_type
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: drop_inaccurate, drop_modes, drop_spurious, highest, orthonormalize_zeros, replace_modes, select_modes, &
      sort_by_distance

   ! What is left of a unit vector that depends on others.
   real(wp), parameter :: dependent = 1.0e-3_wp
   ! A pair above this backward error is no mode of the problem.
   real(wp), parameter :: spurious = 1.0e-5_wp
   ! Infinite eigenvalues are further off than the modes by this factor, whatever rounding made of them.
   real(wp), parameter :: far = 10
   ! A zero eigenvalue found by iteration is below this, relative to the shift
   ! or to the first one that is not rigid.
   real(wp), parameter :: nearly_zero = 1.0e-4_wp
   ! Two roots closer than this may be one found twice if their shapes are parallel.
   real(wp), parameter :: same_pair = 1.0e-2_wp
   ! Rounding tells a copy from a root of a defective eigenvalue beyond this.
   real(wp), parameter :: same_place = 1.0e-11_wp
   ! Where an eigenvalue is while it is iterated, and so its distance from the target, is known no better than this.
   real(wp), parameter :: blurred = 1.0e-4_wp

contains

   !> Fills the modes of `result` from eigenpairs: conjugate pairs once,
   !> spurious pairs dropped, nearest to the target first, no more than were
   !> asked for.
   subroutine select_modes(problem, options, most, pairs, rigid, reference, reach, result, inaccurate, beyond, found)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      !> There are no more finite eigenvalues than this, both of a conjugate pair counted. What is beyond
      !> belongs to multipliers, however small its backward error is.
      integer, intent(in) :: most
      !> Pairs of an iteration, and behind them rigid motions. Used up.
      type(eigenpairs_type), intent(inout) :: pairs
      !> The number of rigid motions. They are known exactly: all of the eigenvalue zero, with
      !> orthonormal shapes, and others.
      integer, intent(in) :: rigid
      !> A size of lambda (1/s), as the shift, against which zeros are seen.
      real(wp), intent(in) :: reference
      !> Eigenvalues are known as far as this from the target (1/s).
      real(wp), intent(in) :: reach
      type(modal_result_type), intent(inout) :: result
      !> How many pairs among the modes were too inaccurate to be listed.
      integer, optional, intent(out) :: inaccurate
      !> Whether some pair lies where infinite eigenvalues are, so that no finite one is left.
      logical, optional, intent(out) :: beyond
      !> How many eigenvalues there are, both of a conjugate pair counted, whether wanted or not.
      integer, optional, intent(out) :: found
      logical, allocatable :: accepted(:), lower(:), others(:), doubtful(:)
      complex(wp), allocatable :: lambda(:)
      real(wp), allocatable :: errors(:), bounds(:)
      real(wp) :: limit
      logical :: dropped
      integer, allocatable :: order(:)
      integer :: k, j, known

      k = size(pairs%lambda) - rigid
      call normalize(pairs, k)
      allocate (lower(k), source=aimag(pairs%lambda(:k)) < 0)
      do j = 1, k
         if (.not. lower(j)) cycle
         pairs%lambda(j) = conjg(pairs%lambda(j))
         pairs%phi(:, j) = conjg(pairs%phi(:, j))
         pairs%xi(:, j) = conjg(pairs%xi(:, j))
      end do
      call settle_pairs(problem, pairs, rigid, errors, bounds)
      call normalize(pairs, k)
      ! On the real axis there are no conjugates: each eigenvalue is one of its own.
      lower = [lower .and. abs(aimag(pairs%lambda(:k))) > 0, spread(.false., 1, size(errors) - k)]
      if (allocated(pairs%again)) lower = lower .or. pairs%again
      allocate (accepted(size(errors)), source=.true.)
      accepted(:k) = .not. repeats_zero(problem, pairs, k, rigid, reference)
      do j = 1, size(errors)
         if (.not. (accepted(j) .and. lower(j))) cycle
         ! Among each other those of a defective eigenvalue share a shape, but not the last digits of their places.
         others = accepted .and. (.not. lower .or. abs(pairs%lambda - pairs%lambda(j)) <= same_place*abs(pairs%lambda(j)))
         others(j:) = others(j:) .and. .not. lower(j:)
         accepted(j) = .not. depends(pairs, others, j)
      end do

      allocate (lambda, source=pairs%lambda)
      limit = max(highest(problem), far*max(reference, maxval(abs(lambda), accepted .and. errors <= spurious)))
      allocate (doubtful, source=accepted .and. errors > spurious .and. abs(lambda) <= limit)
      if (present(beyond)) beyond = any(errors > spurious .and. .not. abs(lambda) <= limit)
      accepted = accepted .and. errors <= spurious
      if (eigenvalues_of(lambda, accepted) > most) call drop_repeated(pairs, k, most, accepted)
      call drop_beyond(lambda, bounds, most, accepted, dropped)
      if (dropped) doubtful = .false.
      if (dropped .and. present(beyond)) beyond = .true.
      if (present(found)) found = eigenvalues_of(lambda, accepted)
      allocate (order(count(accepted)), source=pack([(j, j=1, size(lambda))], accepted))
      call sort_by_distance(lambda, options%target, order)
      known = size(order)
      if (eigenvalues_of(lambda, accepted) < most) known = count(distances(lambda(order), options%target) <= &
         reach + blurred*min(reach, abs(lambda(order))))
      order = order(:min(known, options%modes))
      if (present(inaccurate)) then
         ! Beyond the furthest of all that were asked for they do not matter.
         if (size(order) == options%modes) doubtful = doubtful .and. distances(lambda, options%target) <= &
            maxval(distances(lambda(order), options%target))
         inaccurate = count(doubtful)
      end if

      call take_columns(pairs%phi, order)
      call take_columns(pairs%xi, order)
      result%eigenvalues = lambda(order)
      call move_alloc(pairs%phi, result%eigenvectors)
      call move_alloc(pairs%xi, result%multipliers)
      result%backward_error = errors(order)
      result%error_bound = bounds(order)
      call describe(problem, result)
   end subroutine select_modes

   !> Takes out what is no eigenpair of a problem.
   subroutine drop_spurious(problem, pairs)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      integer, allocatable :: order(:)
      real(wp) :: errors(size(pairs%lambda))
      integer :: j

      errors = backward_errors(problem, pairs)
      allocate (order, source=pack([(j, j=1, size(errors))], errors <= spurious))
      if (size(order) == size(errors)) return
      call take_columns(pairs%phi, order)
      call take_columns(pairs%xi, order)
      pairs%lambda = pairs%lambda(order)
      if (allocated(pairs%paired)) pairs%paired = pairs%paired(order)
      if (allocated(pairs%again)) pairs%again = pairs%again(order)
   end subroutine drop_spurious

   ! The number of eigenvalues that some of a list stand for, both of a conjugate pair counted.
   pure integer function eigenvalues_of(lambda, chosen) result(total)
      complex(wp), intent(in) :: lambda(:)
      logical, intent(in) :: chosen(:)

      total = count(chosen) + count(chosen .and. abs(aimag(lambda)) > 0)
   end function eigenvalues_of

   ! Takes out of a list of more eigenvalues than there are those that have the shapes of others: an eigenvalue
   ! found twice, if it is not a defective one, which counts as often.
   subroutine drop_repeated(pairs, k, most, accepted)
      type(eigenpairs_type), intent(in) :: pairs
      !> The first so many may be repeated.
      integer, intent(in) :: k, most
      logical, intent(inout) :: accepted(:)
      logical :: others(size(accepted))
      integer :: j

      do j = k, 1, -1
         if (.not. accepted(j)) cycle
         if (eigenvalues_of(pairs%lambda, accepted) <= most) return
         others = accepted
         others(j) = .false.
         accepted(j) = .not. depends(pairs, others, j)
      end do
   end subroutine drop_repeated

   ! Takes out of a list of more eigenvalues than there are those that may be anything, and then the largest: they
   ! are infinite ones that rounding blurred.
   pure subroutine drop_beyond(lambda, bounds, most, accepted, dropped)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: bounds(:)
      integer, intent(in) :: most
      logical, intent(inout) :: accepted(:)
      logical, intent(out) :: dropped
      real(wp), parameter :: anything = 1.0e-2_wp
      logical :: doubtful(size(lambda))

      dropped = .false.
      do while (eigenvalues_of(lambda, accepted) > most)
         doubtful = accepted .and. bounds > anything*abs(lambda)
         if (any(doubtful)) then
            accepted(maxloc(bounds/max(abs(lambda), tiny(1.0_wp)), 1, doubtful)) = .false.
         else
            accepted(maxloc(abs(lambda), 1, accepted)) = .false.
         end if
         dropped = .true.
      end do
   end subroutine drop_beyond

   ! Columns `order` of a block, in its own place: there may be no room for two.
   pure subroutine take_columns(block, order)
      complex(wp), allocatable, intent(inout) :: block(:, :)
      integer, intent(in) :: order(:)
      complex(wp) :: column(size(block, 1))
      integer :: i, j

      do j = 1, size(order)
         ! What stood at i < j went where column i came from.
         i = order(j)
         do while (i < j)
            i = order(i)
         end do
         if (i == j) cycle
         column = block(:, j)
         block(:, j) = block(:, i)
         block(:, i) = column
      end do
      if (size(order) < size(block, 2)) block = block(:, :size(order))
   end subroutine take_columns

   !> Puts pairs in the place of the modes of `result`: the same ones, but better.
   subroutine replace_modes(problem, pairs, result, lost)
      type(modal_problem_type), intent(in) :: problem
      !> Used up.
      type(eigenpairs_type), intent(inout) :: pairs
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues, both of a conjugate pair counted, became others that are there already.
      integer, intent(out) :: lost
      type(eigenpairs_type) :: before
      logical :: kept(size(pairs%lambda)), others(size(pairs%lambda))
      real(wp), allocatable :: errors(:), bounds(:)
      integer, allocatable :: order(:)
      integer :: j

      call settle_pairs(problem, pairs, 0, errors, bounds)
      call normalize(pairs, size(pairs%lambda))
      before%lambda = result%eigenvalues
      call move_alloc(result%eigenvectors, before%phi)
      if (allocated(pairs%weights)) before%weights = pairs%weights
      kept = .true.
      do j = 1, size(kept)
         others = kept
         others(j) = .false.
         ! Shapes of a defective eigenvalue were the same before.
         if (depends(pairs, others, j)) kept(j) = depends(before, others, j)
      end do
      lost = count(.not. kept) + count(.not. kept .and. abs(aimag(pairs%lambda)) > 0)
      allocate (order, source=pack([(j, j=1, size(kept))], kept))
      call take_columns(pairs%phi, order)
      call take_columns(pairs%xi, order)
      result%eigenvalues = pairs%lambda(order)
      result%backward_error = errors(order)
      result%error_bound = bounds(order)
      call move_alloc(pairs%phi, result%eigenvectors)
      call move_alloc(pairs%xi, result%multipliers)
      call describe(problem, result)
   end subroutine replace_modes

   !> About the highest frequency or decay (1/s) that the matrices have.
   pure real(wp) function highest(problem)
      type(modal_problem_type), intent(in) :: problem

      highest = 0
      associate (mass => problem%mass%infinity_norm())
         if (mass > 0) highest = max(sqrt(problem%stiffness%infinity_norm()/mass), problem%damping%infinity_norm()/mass)
      end associate
   end function highest

   ! The first k: unit norm, the largest entry real and positive.
   subroutine normalize(pairs, k)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: k
      complex(wp) :: factor
      integer :: j, largest

      do j = 1, k
         associate (phi => pairs%phi(:, j))
            largest = maxloc(real(phi, wp)**2 + aimag(phi)**2, 1)
            if (.not. abs(phi(largest)) > 0) cycle
            factor = conjg(phi(largest))/abs(phi(largest))/length(phi)
         end associate
         pairs%phi(:, j) = factor*pairs%phi(:, j)
         pairs%xi(:, j) = factor*pairs%xi(:, j)
      end do
   end subroutine normalize

   real(wp) function length(x)
      complex(wp), contiguous, intent(in) :: x(:)

      length = dznrm2(size(x), x, 1)
   end function length

   !> Makes the shapes of the pairs with eigenvalue zero orthonormal, and normalises all.
   subroutine orthonormalize_zeros(pairs)
      type(eigenpairs_type), intent(inout) :: pairs
      complex(wp) :: factor
      integer :: i, j, pass

      do j = 1, size(pairs%lambda)
         if (abs(pairs%lambda(j)) > 0) cycle
         do pass = 1, 2
            do i = 1, j - 1
               if (abs(pairs%lambda(i)) > 0) cycle
               factor = dot_product(pairs%phi(:, i), pairs%phi(:, j))
               pairs%phi(:, j) = pairs%phi(:, j) - factor*pairs%phi(:, i)
               pairs%xi(:, j) = pairs%xi(:, j) - factor*pairs%xi(:, i)
            end do
            factor = 1/length(pairs%phi(:, j))
            pairs%phi(:, j) = factor*pairs%phi(:, j)
            pairs%xi(:, j) = factor*pairs%xi(:, j)
         end do
      end do
      call normalize(pairs, size(pairs%lambda))
   end subroutine orthonormalize_zeros

   ! Which of the first k pairs are a zero that the rigid motions, the others, stand for already. Such a motion has the
   ! roots 0 and -r/m of lambda^2 m + lambda r = 0: it is the nearer one that an iteration blurred.
   function repeats_zero(problem, pairs, k, rigid, reference) result(repeats)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: k, rigid
      real(wp), intent(in) :: reference
      logical :: repeats(k)
      complex(wp), allocatable :: rest(:)
      ! A root whose inertia is less than this part of the terms of stiffness is made of their rounding.
      real(wp), parameter :: blurring = 100*epsilon(1.0_wp)
      complex(wp) :: m, r, s
      real(wp) :: m_terms, r_terms, k_terms, largest
      integer :: i, j

      repeats = .false.
      if (rigid == 0) return
      do j = 1, size(repeats)
         rest = pairs%phi(:, j)
         do i = k + 1, k + rigid
            if (abs(pairs%lambda(i)) > 0) cycle
            rest = rest - dot_product(pairs%phi(:, i), rest)*pairs%phi(:, i)
         end do
         repeats(j) = length(rest) <= dependent
      end do
      largest = minval(abs(pairs%lambda(:k)), .not. repeats)
      if (all(repeats)) largest = 0
      largest = max(reference, largest)
      do j = 1, size(repeats)
         if (.not. repeats(j)) cycle
         call form(problem%mass, pairs%phi(:, j), m, m_terms)
         call form(problem%damping, pairs%phi(:, j), r, r_terms)
         call form(problem%stiffness, pairs%phi(:, j), s, k_terms)
         repeats(j) = abs(pairs%lambda(j)) <= nearly_zero*largest .and. (abs(r) <= no_energy*r_terms .or. &
            abs(pairs%lambda(j)**2)*m_terms <= blurring*k_terms .or. &
            abs(pairs%lambda(j)*m) < abs(pairs%lambda(j)*m + r))
      end do
   end function repeats_zero

   ! Whether the shape of pair j lies in the span of those of `others` that share its eigenvalue.
   logical function depends(pairs, others, j)
      type(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: others(:)
      integer, intent(in) :: j
      complex(wp), allocatable :: u(:), v(:), span(:, :)
      integer :: i, l, pass, kept

      allocate (span(size(pairs%phi, 1), 0))
      allocate (u(size(pairs%phi, 1)), v(size(pairs%phi, 1)))
      depends = .true.
      call take_shape(j, v)
      do i = 1, size(others)
         if (.not. others(i)) cycle
         if (abs(pairs%lambda(i) - pairs%lambda(j)) > same_pair*abs(pairs%lambda(j))) cycle
         call take_shape(i, u)
         u = v - dot_product(u, v)*u
         if (length(u) <= dependent) return
      end do
      do i = 1, size(others) + 1
         if (i <= size(others)) then
            if (.not. others(i)) cycle
            if (abs(pairs%lambda(i) - pairs%lambda(j)) > same_value*abs(pairs%lambda(j))) cycle
         end if
         call take_shape(merge(j, i, i > size(others)), u)
         kept = size(span, 2)
         do pass = 1, 2
            do l = 1, kept
               u = u - dot_product(span(:, l), u)*span(:, l)
            end do
         end do
         if (i > size(others)) exit
         if (length(u) <= epsilon(1.0_wp)/dependent) cycle
         span = reshape([span, u/length(u)], [size(u), kept + 1])
      end do
      depends = length(u) <= dependent

   contains

      subroutine take_shape(i, shape)
         integer, intent(in) :: i
         complex(wp), contiguous, intent(out) :: shape(:)

         shape = pairs%phi(:, i)
         if (.not. allocated(pairs%weights)) return
         shape = pairs%weights*shape
         shape = shape/max(length(shape), tiny(1.0_wp))
      end subroutine take_shape
   end function depends

   !> Takes modes out of a result whose backward error is above a limit.
   subroutine drop_inaccurate(problem, limit, result, lost)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: limit
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues, both of a conjugate pair counted, these were.
      integer, intent(out) :: lost

      call drop_modes(problem, result%backward_error <= limit, result, lost)
   end subroutine drop_inaccurate

   !> Takes modes out of a result.
   subroutine drop_modes(problem, kept, result, lost)
      type(modal_problem_type), intent(in) :: problem
      !> Those to leave.
      logical, intent(in) :: kept(:)
      type(modal_result_type), intent(inout) :: result
      !> How many eigenvalues, both of a conjugate pair counted, the others were.
      integer, intent(out) :: lost
      integer, allocatable :: order(:)
      integer :: j

      lost = eigenvalues_of(result%eigenvalues, .not. kept)
      if (lost == 0) return
      allocate (order, source=pack([(j, j=1, size(kept))], kept))
      call take_columns(result%eigenvectors, order)
      call take_columns(result%multipliers, order)
      result%eigenvalues = result%eigenvalues(order)
      result%backward_error = result%backward_error(order)
      result%error_bound = result%error_bound(order)
      call describe(problem, result)
   end subroutine drop_modes

   ! Of the nearer one of lambda and its conjugate.
   elemental real(wp) function distances(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distances = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distances

   !> Sorts positions in a list of eigenvalues by the distance of the nearer of the pair from a target.
   subroutine sort_by_distance(lambda, target, order)
      complex(wp), intent(in) :: lambda(:), target
      integer, intent(inout) :: order(:)
      real(wp) :: distance(size(order))
      integer :: i, j, current

      do i = 1, size(order)
         current = order(i)
         associate (d => distances(lambda(current), target))
            j = i - 1
            do while (j > 0)
               if (distance(j) <= d) exit
               distance(j + 1) = distance(j)
               order(j + 1) = order(j)
               j = j - 1
            end do
            distance(j + 1) = d
            order(j + 1) = current
         end associate
      end do
   end subroutine sort_by_distance

end module kschur_modes
