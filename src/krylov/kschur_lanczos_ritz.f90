!> Ritz pairs of a Lanczos decomposition: convergence, locking and thick restart.
!>
!> Source: Wu and Simon, SIAM J. Matrix Anal. Appl. 22 (2000).
module kschur_lanczos_ritz
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, real_ritz_pairs_type
   use kschur_projected, only: symmetric_eigenvectors
   use kschur_selection, only: selection_type, order_by_preference
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: decomposition_type, extract, project, ritz_type, truncate

   !> The first `locked` columns are converged Ritz vectors.
   type, extends(block_decomposition_type) :: decomposition_type
      integer :: locked = 0
      !> Largest dimension of the Krylov space.
      integer :: dimension = 0
      !> Whether the basis spans the whole space.
      logical :: exhausted = .false.
      real(wp) :: dropped = 0
   end type decomposition_type

   !> The Ritz pairs of the active part, most wanted first, and which are wanted.
   type :: ritz_type
      real(wp), allocatable :: values(:), vectors(:, :)
      ! Norm of N times each vector; the same relative to the Ritz value.
      real(wp), allocatable :: couplings(:), residuals(:)
      ! Number of values, locked ones included, that contain all wanted ones.
      integer :: needed = 0
      logical, allocatable :: locked_is_wanted(:)
      ! All values, locked ones included, most wanted first, with residuals; and their positions: first the locked, then the
      ! active in ascending order.
      integer, allocatable :: order(:)
      real(wp), allocatable :: all_values(:), all_residuals(:)
      ! Number of leading wanted values.
      integer :: wanted = 0
      integer :: converged = 0
      ! Whether all wanted values have converged.
      logical :: settled = .false.
   end type ritz_type

contains

   !> Computes the Ritz pairs of the active part, their residuals, and which are wanted.
   subroutine project(d, selection, options, ritz, error)
      type(decomposition_type), intent(in) :: d
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(ritz_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: values(:)
      integer, allocatable :: active_order(:)
      integer :: active, i, near, m

      m = d%expanded
      active = m - d%locked
      allocate (ritz%couplings(active), ritz%residuals(active))
      allocate (ritz%vectors(active, active), source=d%couplings(d%locked + 1:m, d%locked + 1:m))
      call symmetric_eigenvectors(ritz%vectors, ritz%values, error)
      if (allocated(error)) return

      allocate (values(m))
      allocate (ritz%all_residuals(m), source=0.0_wp)
      values(:d%locked) = [(cmplx(d%couplings(i, i), 0.0_wp, wp), i=1, d%locked)]
      do i = 1, active
         values(d%locked + i) = ritz%values(i)
         if (d%locked == 0) cycle
         ! A new copy of a locked value may differ from it by rounding only: it is not more wanted.
         near = minloc(abs(values(:d%locked) - ritz%values(i)), 1)
         if (abs(values(near) - ritz%values(i)) <= rounding_of_sums*d%scale) values(d%locked + i) = values(near)
      end do
      allocate (ritz%order(m), source=order_by_preference(selection, values))
      ritz%needed = selection%needed(values(ritz%order))
      associate (chosen => ritz%order(:min(ritz%needed, m)))
         allocate (ritz%locked_is_wanted(d%locked), source=[(any(chosen == i), i=1, d%locked)])
         ritz%wanted = count(chosen > d%locked)
      end associate

      allocate (active_order(active), source=pack(ritz%order, ritz%order > d%locked) - d%locked)
      ritz%values = ritz%values(active_order)
      ritz%vectors = ritz%vectors(:, active_order)
      associate (outward => d%outward())
         ritz%couplings = norm2(matmul(outward(:, d%locked + 1:), ritz%vectors), 1)
      end associate
      ritz%residuals = abs(ritz%couplings)/max(abs(ritz%values), epsilon(1.0_wp)/options%tolerance*d%scale, tiny(1.0_wp))
      ritz%all_residuals(d%locked + active_order) = ritz%residuals
      ritz%all_residuals = ritz%all_residuals(ritz%order)
      allocate (ritz%all_values(m), source=real(values(ritz%order), wp))
      ritz%converged = count(ritz%residuals(:ritz%wanted) <= options%tolerance) + count(ritz%locked_is_wanted)
      ritz%settled = ritz%converged == ritz%needed
      ! If the active part has no wanted value, its best value must be accurate enough to prove that: the error of a Ritz value
      ! is quadratic in the residual.
      if (ritz%wanted == 0 .and. .not. d%exhausted) ritz%settled = ritz%settled .and. &
         any(ritz%residuals(:min(active, 1)) <= sqrt(options%tolerance))
   end subroutine project

   !> Thick restart. Locks converged wanted pairs and unlocks those no longer wanted. Until all have converged, also keeps the
   !> other wanted ones and half of the rest as a buffer.
   subroutine truncate(d, ritz, options, statistics)
      type(decomposition_type), intent(inout) :: d
      type(ritz_type), intent(in) :: ritz
      type(krylov_options_type), intent(in) :: options
      type(krylov_statistics_type), intent(inout) :: statistics
      logical :: lockable(size(ritz%values))
      integer :: i, active, keep, remaining

      active = size(ritz%values)
      keep = ritz%wanted
      ! Leaves room for a new block.
      if (.not. ritz%settled) keep = max(min(keep + max((active - keep)/2, 1), active - max(d%vectors - d%expanded, 1)), 0)
      lockable = [(i <= min(keep, ritz%wanted), i=1, active)] .and. ritz%residuals <= options%tolerance
      remaining = 0
      do i = 1, d%locked
         if (.not. ritz%locked_is_wanted(i)) cycle
         remaining = remaining + 1
         if (remaining == i) cycle
         call d%basis%move(i, remaining, 1)
         d%couplings(remaining, remaining) = d%couplings(i, i)
      end do
      call rotate(d, ritz, remaining, [pack([(i, i=1, keep)], lockable(:keep)), &
         pack([(i, i=1, keep)], .not. lockable(:keep))], statistics)
      d%locked = remaining + count(lockable)
      d%dropped = hypot(d%dropped, norm2(pack(ritz%couplings, lockable)))
   end subroutine truncate

   ! Replaces the active part, after the first `before` columns, by the chosen Ritz vectors; drops the residual block when all
   ! wanted values have converged.
   subroutine rotate(d, ritz, before, chosen, statistics)
      type(decomposition_type), intent(inout) :: d
      type(ritz_type), intent(in) :: ritz
      integer, intent(in) :: before, chosen(:)
      type(krylov_statistics_type), intent(inout) :: statistics
      real(wp), allocatable :: outward(:, :)
      integer :: keep, width, i
      integer(long) :: started

      started = clock()
      d%start = d%start(:0, :0)
      keep = size(chosen)
      width = merge(0, d%vectors - d%expanded, ritz%settled)
      allocate (outward, source=d%outward())
      outward = matmul(outward(:, d%locked + 1:), ritz%vectors(:, chosen))
      call d%basis%rotate(d%locked + 1, ritz%vectors(:, chosen), before + 1)
      call d%basis%move(d%expanded + 1, before + keep + 1, width)
      d%images = d%images(:, :width)
      d%couplings(:, before + 1:) = 0
      do i = 1, keep
         d%couplings(before + i, before + i) = ritz%values(chosen(i))
      end do
      d%expanded = before + keep
      d%vectors = d%expanded + width
      d%couplings(d%expanded + 1:d%vectors, before + 1:d%expanded) = outward(:width, :)
      statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
   end subroutine rotate

   !> Extracts the wanted pairs: locked ones, and active ones that converged.
   subroutine extract(d, ritz, selection, options, pairs)
      type(decomposition_type), intent(in) :: d
      type(ritz_type), intent(in) :: ritz
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      type(real_ritz_pairs_type), intent(inout) :: pairs
      real(wp), allocatable :: values(:), u(:, :)
      integer :: n, k, i, active, found
      integer(long) :: started

      started = clock()
      n = d%basis%length()
      k = d%expanded
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
            values(found) = d%couplings(ritz%order(i), ritz%order(i))
            u(ritz%order(i), found) = 1
         end if
      end do
      found = min(found, selection%needed(cmplx(values(:found), 0.0_wp, wp)))
      allocate (pairs%values, source=values(:found))
      allocate (pairs%vectors(n, found))
      call d%basis%form(u(:, :found), pairs%vectors)
      pairs%statistics%orthogonalize_seconds = pairs%statistics%orthogonalize_seconds + seconds_since(started)
   end subroutine extract
end module kschur_lanczos_ritz
