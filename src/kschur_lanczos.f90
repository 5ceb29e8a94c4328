!> Thick-restart Lanczos: wanted eigenpairs of an operator C that is self-adjoint
!> in the inner product x^T B y, B symmetric and positive semidefinite, with one
!> application of C and one of B a step.
!>
!> Sources: Wu and Simon, SIAM J. Matrix Anal. Appl. 22 (2000), the restart;
!> Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48 (1987), semidefinite B;
!> Daniel, Gragg, Kaufman, Stewart, Math. Comp. 30 (1976), orthogonalisation twice
!> where needed; Hernandez, Roman, Tomas, Parallel Computing 33 (2007), its norm
!> from Pythagoras.
module kschur_lanczos
   use kschur_census, only: census_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_lapack, only: ddot, dgemm, dgemv, dsyevd
   use kschur_monitor, only: monitor_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_random, only: random_vector
   use kschur_outcome, only: reason_cancelled, reason_converged, reason_fewer_modes, reason_max_restarts
   use kschur_selection, only: selection_type, order_by_preference
   use kschur_text, only: text
   implicit none
   private
   public :: lanczos, decomposition_type

   ! A second orthogonalisation when the first left less than this of the norm.
   real(wp), parameter :: enough_left = 0.7_wp
   ! What is left of a vector in the span of the basis, or in the null space of B.
   real(wp), parameter :: breakdown = 100*epsilon(1.0_wp)
   ! Convergence is tested after so many steps, or after this part of the dimension.
   integer, parameter :: check_every = 8, check_part = 16
   ! Rows of the basis rotated at a time, so that a panel stays in the cache.
   integer, parameter :: panel = 256

   !> A Lanczos decomposition C V = V T + beta v e^T, V^T B V = I: V are the columns
   !> 1..dimension of `basis`, v is the next one, e the last unit vector. B V is not
   !> kept: V^T (B y) needs one product with B a step, as (B V)^T y would, and half
   !> the memory. The first `locked` columns are converged Ritz vectors.
   type :: decomposition_type
      private
      real(wp), allocatable :: basis(:, :)
      ! The upper triangle of T.
      real(wp), allocatable :: projected(:, :)
      ! B v, but for the last orthogonalisation of v.
      real(wp), allocatable :: image(:, :)
      integer :: dimension = 0
      integer :: locked = 0
      real(wp) :: beta = 0
      ! Whether the basis spans all there is: beta = 0 and v does not exist.
      logical :: exhausted = .false.
      integer(long) :: random_state = 1
      ! Lower bounds of the norms of C and of B.
      real(wp) :: scale = 0, metric_scale = 0
      real(wp) :: dropped = 0
   end type decomposition_type

   ! The Ritz pairs of the active part, most wanted first, and which are wanted.
   type :: ritz_type
      real(wp), allocatable :: values(:), vectors(:, :)
      ! beta times the last entry of each vector; the same relative to the value.
      real(wp), allocatable :: couplings(:), residuals(:)
      ! Of all values, locked ones included, it takes so many.
      integer :: needed = 0
      logical, allocatable :: locked_is_wanted(:)
      ! All values, locked ones included, most wanted first, and their residuals;
      ! where they stand: the locked first, then the active as LAPACK had them.
      integer, allocatable :: order(:)
      real(wp), allocatable :: all_values(:), all_residuals(:)
      ! The first so many are wanted.
      integer :: wanted = 0
      integer :: converged = 0
      ! Whether all that is wanted has converged.
      logical :: settled = .false.
   end type ritz_type

contains

   !> Wanted eigenvalues and eigenvectors of a self-adjoint operator, most wanted
   !> first: those that converged. `vectors` is B-orthonormal. The basis has
   !> `options%subspace` columns, but at least `selection%wanted` + 2. Convergence
   !> is tested within a restart too, so that no more steps are made than needed.
   !> Not converging is `statistics%reason`, not an error.
   subroutine lanczos(operator, selection, options, values, vectors, statistics, error, monitor, verify, census, kept)
      class(symmetric_operator_type), intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      real(wp), allocatable, intent(out) :: values(:)
      real(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      !> Whether to search the complement of what was found, from a fresh random
      !> vector, until nothing wanted is there: one Krylov space holds one copy
      !> only of a multiple eigenvalue. .true. where absent.
      logical, optional, intent(in) :: verify
      !> Ends that search where it knows that nothing is missing.
      class(census_type), optional, intent(inout) :: census
      !> The decomposition of an earlier call with this operator, to go on from.
      type(decomposition_type), optional, target, intent(inout) :: kept
      type(decomposition_type), target :: own
      type(decomposition_type), pointer :: d
      type(ritz_type) :: ritz
      logical :: proceed, search, complete
      integer :: restart

      search = .true.
      if (present(verify)) search = verify
      d => own
      if (present(kept)) d => kept
      call start(operator, selection, options, d, statistics, error)
      if (allocated(error)) return
      allocate (statistics%history%converged(0), statistics%history%operator_applications(0), &
         statistics%history%residual(0))
      proceed = .true.
      do restart = 1, max(options%max_restarts, 1)
         do
            call expand(operator, selection, options, d, statistics, error)
            if (.not. allocated(error)) call project(d, selection, options, ritz, error)
            if (allocated(error)) return
            if (ritz%settled .or. d%exhausted .or. d%dimension == size(d%projected, 2)) exit
         end do
         call record(statistics, restart, ritz)
         if (present(monitor)) call monitor%report(restart, ritz%converged, ritz%needed, &
            statistics%history%residual(restart), proceed)

         complete = .not. search
         if (ritz%settled .and. search .and. present(census)) &
            call census%examine(ritz%all_values, ritz%all_residuals, ritz%needed, complete)
         if (ritz%settled .and. (complete .or. d%exhausted .or. ritz%wanted == 0)) then
            statistics%reason = reason_converged
            exit
         else if (d%exhausted) then
            statistics%reason = reason_fewer_modes
            exit
         else if (.not. proceed) then
            statistics%reason = reason_cancelled
            exit
         else if (restart >= options%max_restarts) then
            statistics%reason = reason_max_restarts
            exit
         end if
         call truncate(d, ritz, options, statistics)
         if (ritz%settled) call fresh_direction(operator, options, d, d%locked, statistics, error)
         if (allocated(error)) return
      end do
      call extract(d, ritz, selection, options, statistics, values, vectors)
      call purify(operator, options, d%scale, values, vectors, statistics, error)
      statistics%locking_error = d%dropped/max(d%scale, tiny(1.0_wp))
   end subroutine lanczos

   ! Allocates the decomposition and fills its first column; enlarges one that is kept.
   subroutine start(operator, selection, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: basis(:, :), projected(:, :)
      integer :: n, m, k, status

      n = operator%order()
      m = options%subspace
      ! A restart, and the verification, need two columns beside the wanted ones.
      if (options%max_restarts > 1) m = max(m, selection%wanted + 2)
      m = max(min(m, n), 1)
      k = d%dimension
      if (allocated(d%basis)) then
         if (size(d%projected, 2) >= m) return
      end if
      allocate (basis(n, m + 1), stat=status)
      if (status == 0 .and. .not. allocated(d%image)) allocate (d%image(n, 1), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "there is no memory for a Lanczos basis of "// &
            text(m + 1)//" vectors of length "//text(n))
         return
      end if
      allocate (projected(m, m), source=0.0_wp)
      if (k > 0) then
         basis(:, :k + 1) = d%basis(:, :k + 1)
         projected(:k, :k) = d%projected(:k, :k)
      end if
      call move_alloc(basis, d%basis)
      call move_alloc(projected, d%projected)
      if (k > 0) return
      d%random_state = 1 + mod(abs(int(options%seed, long))*69621_long, 2147483645_long)
      call fresh_direction(operator, options, d, 0, statistics, error)
   end subroutine start

   ! Makes column k+1 a filtered random vector B-orthonormal to columns 1..k; or
   ! finds the basis exhausted.
   subroutine fresh_direction(operator, options, d, k, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      real(wp) :: coefficients(k), length
      real(wp), allocatable :: x(:, :)
      integer :: attempt, i

      allocate (x(size(d%basis, 1), 1))
      coefficients = 0
      do attempt = 1, attempts
         call random_vector(d%random_state, d%basis(:, k + 1))
         call orthogonalize(operator, d, k, 0.0_wp, coefficients, length, error)
         do i = 1, options%filter
            if (allocated(error) .or. .not. length > 0) exit
            x(:, 1) = d%basis(:, k + 1)
            call operator%apply(x, d%basis(:, k + 1:k + 1), error)
            if (allocated(error)) return
            statistics%operator_applications = statistics%operator_applications + 1
            call orthogonalize(operator, d, k, breakdown*d%scale, coefficients, length, error)
         end do
         if (allocated(error) .or. length > 0) return
      end do
      d%exhausted = .true.
   end subroutine fresh_direction

   ! Orthonormalises column k+1 against columns 1..k by classical Gram-Schmidt;
   ! `length` is the B-norm that was left, zero where nothing but rounding is.
   subroutine orthogonalize(operator, d, k, negligible, coefficients, length, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      ! A B-norm that is rounding of what the column was made of.
      real(wp), intent(in) :: negligible
      ! What was subtracted is added to the first k.
      real(wp), intent(inout) :: coefficients(:)
      real(wp), intent(out) :: length
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: passes = 3
      ! The gemv of OpenBLAS reads a few entries beyond the end of its vector.
      real(wp) :: correction(k + 4), before, smallest, y_squared
      integer :: pass, n

      n = size(d%basis, 1)
      correction = 0
      smallest = negligible
      associate (y => d%basis(:, k + 1:k + 1))
         do pass = 1, passes
            call operator%apply_metric(y, d%image, error)
            if (allocated(error)) return
            before = sqrt(max(ddot(n, y, 1, d%image, 1), 0.0_wp))
            y_squared = max(ddot(n, y, 1, y, 1), tiny(1.0_wp))
            d%metric_scale = max(d%metric_scale, before**2/y_squared)
            smallest = max(smallest, merge(breakdown*before, 0.0_wp, pass == 1), &
               sqrt(breakdown*d%metric_scale*y_squared))
            length = 0
            if (.not. before > smallest) exit
            call dgemv("T", n, k, 1.0_wp, d%basis, n, d%image, 1, 0.0_wp, correction, 1)
            call dgemv("N", n, k, -1.0_wp, d%basis, n, correction, 1, 1.0_wp, y, 1)
            coefficients(:k) = coefficients(:k) + correction(:k)
            length = sqrt(max(before**2 - sum(correction(:k)**2), 0.0_wp))
            if (length > enough_left*before) exit
            if (pass == passes) length = 0
         end do
         if (length > 0) then
            y = y/length
            d%image = d%image/length
         end if
      end associate
   end subroutine orthogonalize

   ! Lanczos steps up to the next test of convergence.
   subroutine expand(operator, selection, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: coefficients(size(d%projected, 2))
      integer :: k, last
      integer(long) :: started

      last = max(d%dimension + max(check_every, d%dimension/check_part), selection%wanted)
      do k = d%dimension + 1, min(last, size(d%projected, 2))
         if (d%exhausted) return
         call operator%apply(d%basis(:, k:k), d%basis(:, k + 1:k + 1), error)
         if (allocated(error)) return
         statistics%operator_applications = statistics%operator_applications + 1
         started = clock()
         call subtract_neighbours(d, k, coefficients)
         if (.not. abs(coefficients(k)) <= huge(1.0_wp)) call new_error(error, error_library, &
            "the operator made a vector that is not finite")
         if (allocated(error)) return
         d%scale = max(d%scale, maxval(abs(coefficients(:k))))
         call orthogonalize(operator, d, k, breakdown*d%scale, coefficients, d%beta, error)
         if (allocated(error)) return
         statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
         d%projected(:k, k) = coefficients(:k)
         d%scale = max(d%scale, maxval(abs(coefficients(:k))))
         d%dimension = k
         if (.not. d%beta > 0) call fresh_direction(operator, options, d, k, statistics, error)
         if (allocated(error)) return
      end do
   end subroutine expand

   ! The three-term recurrence. Without it, what the basis lacks of orthogonality
   ! would pass through the Gram-Schmidt step times the subtracted coefficients,
   ! and grow from step to step; with it, little is left to be subtracted there.
   subroutine subtract_neighbours(d, k, coefficients)
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      real(wp), intent(out) :: coefficients(:)

      coefficients = 0
      coefficients(k) = ddot(size(d%basis, 1), d%image, 1, d%basis(:, k + 1), 1)
      d%basis(:, k + 1) = d%basis(:, k + 1) - coefficients(k)*d%basis(:, k)
      if (.not. d%beta > 0) return
      coefficients(k - 1) = d%beta
      d%basis(:, k + 1) = d%basis(:, k + 1) - d%beta*d%basis(:, k - 1)
   end subroutine subtract_neighbours

   ! Ritz pairs of the active part, and how far they are from what is wanted.
   subroutine project(d, selection, options, ritz, error)
      type(decomposition_type), intent(in) :: d
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(ritz_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: values(:)
      real(wp), allocatable :: work(:)
      integer, allocatable :: active_order(:), iwork(:)
      integer :: active, i, near, info

      active = d%dimension - d%locked
      allocate (ritz%values(active), ritz%couplings(active), ritz%residuals(active))
      allocate (ritz%vectors(active, active), source=d%projected(d%locked + 1:d%dimension, d%locked + 1:d%dimension))
      allocate (work(1 + 6*active + 2*active**2), iwork(3 + 5*active))
      call dsyevd("V", "U", active, ritz%vectors, max(active, 1), ritz%values, work, size(work), iwork, size(iwork), info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute the eigenvalues of the projected problem: dsyevd returned "//text(info))
         return
      end if

      allocate (values(d%dimension))
      allocate (ritz%all_residuals(d%dimension), source=0.0_wp)
      values(:d%locked) = [(cmplx(d%projected(i, i), 0.0_wp, wp), i=1, d%locked)]
      do i = 1, active
         values(d%locked + i) = ritz%values(i)
         if (d%locked == 0) cycle
         ! To rounding, a new copy of a locked value is not more wanted than that.
         near = minloc(abs(values(:d%locked) - ritz%values(i)), 1)
         if (abs(values(near) - ritz%values(i)) <= breakdown*d%scale) values(d%locked + i) = values(near)
      end do
      allocate (ritz%order(d%dimension), source=order_by_preference(selection, values))
      ritz%needed = selection%needed(values(ritz%order))
      associate (chosen => ritz%order(:min(ritz%needed, d%dimension)))
         allocate (ritz%locked_is_wanted(d%locked), source=[(any(chosen == i), i=1, d%locked)])
         ritz%wanted = count(chosen > d%locked)
      end associate

      allocate (active_order(active), source=pack(ritz%order, ritz%order > d%locked) - d%locked)
      ritz%values = ritz%values(active_order)
      ritz%vectors = ritz%vectors(:, active_order)
      if (active > 0) ritz%couplings = d%beta*ritz%vectors(active, :)
      ritz%residuals = abs(ritz%couplings)/max(abs(ritz%values), epsilon(1.0_wp)/options%tolerance*d%scale, tiny(1.0_wp))
      ritz%all_residuals(d%locked + active_order) = ritz%residuals
      ritz%all_residuals = ritz%all_residuals(ritz%order)
      allocate (ritz%all_values(d%dimension), source=real(values(ritz%order), wp))
      ritz%converged = count(ritz%residuals(:ritz%wanted) <= options%tolerance) + count(ritz%locked_is_wanted)
      ritz%settled = ritz%converged == ritz%needed
      ! Where nothing new is wanted, the best must be known well enough to say so:
      ! the error of a value is of second order in the residual.
      if (ritz%wanted == 0 .and. .not. d%exhausted) ritz%settled = ritz%settled .and. &
         any(ritz%residuals(:min(active, 1)) <= sqrt(options%tolerance))
   end subroutine project

   ! Restart. Locks what is wanted and has converged, and unlocks what is not
   ! wanted any more. Keeps, if not all that is wanted has converged, also the
   ! rest of it and half of the others as a buffer.
   subroutine truncate(d, ritz, options, statistics)
      type(decomposition_type), intent(inout) :: d
      type(ritz_type), intent(in) :: ritz
      type(krylov_options_type), intent(in) :: options
      type(krylov_statistics_type), intent(inout) :: statistics
      logical :: lockable(size(ritz%values))
      integer :: i, active, keep, remaining

      active = size(ritz%values)
      keep = ritz%wanted
      ! Room for one new vector at least.
      if (.not. ritz%settled) keep = max(min(keep + max((active - keep)/2, 1), active - 1), 0)
      lockable = [(i <= min(keep, ritz%wanted), i=1, active)] .and. ritz%residuals <= options%tolerance
      remaining = 0
      do i = 1, d%locked
         if (.not. ritz%locked_is_wanted(i)) cycle
         remaining = remaining + 1
         if (remaining == i) cycle
         d%basis(:, remaining) = d%basis(:, i)
         d%projected(remaining, remaining) = d%projected(i, i)
      end do
      call rotate(d, ritz, remaining, [pack([(i, i=1, keep)], lockable(:keep)), &
         pack([(i, i=1, keep)], .not. lockable(:keep))], statistics)
      d%locked = remaining + count(lockable)
      d%dropped = hypot(d%dropped, norm2(pack(ritz%couplings, lockable)))
   end subroutine truncate

   ! Replaces the active part by some of its Ritz vectors, behind the first
   ! `before` columns.
   subroutine rotate(d, ritz, before, chosen, statistics)
      type(decomposition_type), intent(inout) :: d
      type(ritz_type), intent(in) :: ritz
      integer, intent(in) :: before, chosen(:)
      type(krylov_statistics_type), intent(inout) :: statistics
      real(wp), allocatable :: block(:, :), u(:, :)
      integer :: first, active, keep, rows, n, i
      integer(long) :: started

      started = clock()
      n = size(d%basis, 1)
      first = d%locked + 1
      active = size(ritz%values)
      keep = size(chosen)
      allocate (block(panel, keep), u(active, keep))
      u = ritz%vectors(:, chosen)
      do i = 1, merge(n, 0, keep > 0), panel
         rows = min(panel, n - i + 1)
         call dgemm("N", "N", rows, keep, active, 1.0_wp, d%basis(i, first), n, u, active, 0.0_wp, block, panel)
         d%basis(i:i + rows - 1, before + 1:before + keep) = block(:rows, :)
      end do
      if (.not. d%exhausted) d%basis(:, before + keep + 1) = d%basis(:, d%dimension + 1)
      d%projected(:, before + 1:) = 0
      do i = 1, keep
         d%projected(before + i, before + i) = ritz%values(chosen(i))
      end do
      d%dimension = before + keep
      d%beta = 0
      statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
   end subroutine rotate

   ! The locked pairs and the active ones that converged, as far as they are wanted.
   subroutine extract(d, ritz, selection, options, statistics, values, vectors)
      type(decomposition_type), intent(in) :: d
      type(ritz_type), intent(in) :: ritz
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(krylov_statistics_type), intent(inout) :: statistics
      real(wp), allocatable, intent(out) :: values(:), vectors(:, :)
      real(wp), allocatable :: u(:, :)
      integer :: n, k, i, active, found
      integer(long) :: started

      started = clock()
      n = size(d%basis, 1)
      k = d%dimension
      allocate (u(k, k), source=0.0_wp)
      allocate (values(k))
      active = 0
      found = 0
      do i = 1, k
         if (ritz%order(i) > d%locked) active = active + 1
         if (ritz%all_residuals(i) > options%tolerance) cycle
         found = found + 1
         if (ritz%order(i) > d%locked) then
            values(found) = ritz%values(active)
            u(d%locked + 1:, found) = ritz%vectors(:, active)
         else
            values(found) = d%projected(ritz%order(i), ritz%order(i))
            u(ritz%order(i), found) = 1
         end if
      end do
      found = min(found, selection%needed(cmplx(values(:found), 0.0_wp, wp)))
      values = values(:found)
      allocate (vectors(n, found))
      if (found > 0) call dgemm("N", "N", n, found, k, 1.0_wp, d%basis, n, u, k, 0.0_wp, vectors, n)
      statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
   end subroutine extract

   ! C x / theta is x without the component that the metric does not see, where
   ! rounding accumulates (Nour-Omid et al.). It is worth an application for every
   ! vector if it changes the one that would have gathered most.
   subroutine purify(operator, options, scale, values, vectors, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(krylov_options_type), intent(in) :: options
      real(wp), intent(in) :: scale, values(:)
      real(wp), allocatable, intent(inout) :: vectors(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: images(:, :)
      logical :: large(size(values))
      integer :: j

      large = abs(values) > epsilon(1.0_wp)/options%tolerance*scale
      j = minloc(abs(values), 1, large)
      if (j == 0) return
      allocate (images(size(vectors, 1), 1))
      call operator%apply(vectors(:, j:j), images, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + 1
      if (norm2(images(:, 1)/values(j) - vectors(:, j)) <= 10*options%tolerance*norm2(vectors(:, j))) return
      deallocate (images)
      allocate (images(size(vectors, 1), size(values)))
      call operator%apply(vectors, images, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + size(values)
      do j = 1, size(values)
         if (large(j)) vectors(:, j) = images(:, j)/values(j)
      end do
   end subroutine purify

   subroutine record(statistics, restart, ritz)
      type(krylov_statistics_type), intent(inout) :: statistics
      integer, intent(in) :: restart
      type(ritz_type), intent(in) :: ritz

      statistics%restarts = restart
      associate (h => statistics%history)
         h%converged = [h%converged, ritz%converged]
         h%operator_applications = [h%operator_applications, statistics%operator_applications]
         h%residual = [h%residual, maxval([0.0_wp, ritz%residuals(:ritz%wanted)])]
      end associate
   end subroutine record
end module kschur_lanczos
