!> Block Lanczos method for an operator C that is self-adjoint in the inner product x^T B y: starts from given or random vectors
!> and expands the decomposition block by block.
!>
!> Sources: Golub and Underwood (1977); Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48 (1987), semidefinite B.
module kschur_block_lanczos
   use kschur_block_decomposition, only: block_decomposition_type, dot, drop_last, orthonormalize, rounding_limit
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_random, only: state_of_seed
   use kschur_tall_products_real, only: inner_products
   use kschur_together, only: begin_together, end_together, to_add_random, to_expand
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: add_directions, add_random_directions, add_random_here, expand_block, expand_here

contains

   !> Appends the B-orthonormalised columns of X to the basis, without dependent ones: X = V coefficients.
   subroutine add_directions(operator, d, x, coefficients, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), intent(inout) :: d
      !> Columns of any norm; overwritten.
      real(wp), contiguous, intent(inout) :: x(:, :)
      !> As many rows as vectors are allocated.
      real(wp), intent(out) :: coefficients(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: lengths(size(x, 2))
      real(wp), allocatable :: images(:, :)
      integer :: j

      coefficients = 0
      allocate (images(size(x, 1), size(x, 2)))
      call operator%apply_metric(x, images, error)
      if (allocated(error)) return
      lengths = 0
      do j = 1, size(x, 2)
         lengths(j) = sqrt(max(dot(x(:, j:j), images(:, j:j), d%sums), 0.0_wp))
         if (.not. lengths(j) > 0) cycle
         d%metric_scale = max(d%metric_scale, (lengths(j)/d%sums%length(norm2(x(:, j))))**2)
         x(:, j) = x(:, j)/lengths(j)
      end do
      call orthonormalize(operator, d, x, 1.0_wp, rounding_of_sums, coefficients, statistics, error)
      do j = 1, size(x, 2)
         coefficients(:, j) = lengths(j)*coefficients(:, j)
      end do
   end subroutine add_directions

   !> Appends C^f R to the basis, R random: C filters out infinite eigenvalues. Adds nothing if the basis spans the whole space.
   subroutine add_random_directions(operator, d, directions, filter, seed, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), target, intent(inout) :: d
      !> Number of columns of R.
      integer, intent(in) :: directions
      !> f
      integer, intent(in) :: filter
      integer, intent(in) :: seed
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error

      if (d%random_state == 0) d%random_state = state_of_seed(seed)
      call begin_together(d, to_add_random, [directions, filter], 0.0_wp)
      call add_random_here(operator, d, directions, filter, statistics, error)
      call end_together(d)
   end subroutine add_random_directions

   !> As `add_random_directions`, called by all processes that share the rows, each with its rows.
   subroutine add_random_here(operator, d, directions, filter, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), target, intent(inout) :: d
      integer, intent(in) :: directions, filter
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), y(:, :), start(:, :)
      real(wp) :: coefficients(d%basis%room(), directions)
      integer :: before, i, j

      before = d%vectors
      allocate (x(d%team%rows(d%basis%length()), directions))
      do j = 1, directions
         call d%team%draw(d%random_state, x(:, j))
      end do
      call add_directions(operator, d, x, coefficients, statistics, error)
      allocate (start, source=coefficients(:d%vectors, :))
      do i = 1, filter
         if (allocated(error) .or. d%vectors == before) return
         allocate (y(size(x, 1), d%vectors - before))
         call operator%apply(d%basis%columns(before + 1, size(y, 2)), y, error)
         if (allocated(error)) return
         statistics%operator_applications = statistics%operator_applications + size(y, 2)
         call drop_last(d, before)
         coefficients = 0
         call orthonormalize(operator, d, y, d%scale, rounding_of_sums, coefficients(:, :size(y, 2)), statistics, error)
         if (before == 0) start = matmul(coefficients(:d%vectors, :size(y, 2)), start)
         deallocate (y)
      end do
      if (before > 0 .or. d%vectors < directions) return
      call move_alloc(start, d%start)
      d%filter = filter
   end subroutine add_random_here

   !> A block Lanczos step: applies C to the residual block, as far as columns are allocated, and appends the orthonormalised
   !> images as the new residual block.
   subroutine expand_block(operator, d, statistics, error, noise)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), target, intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      !> Relative to the norm of C, components below this are rounding errors.
      real(wp), optional, intent(in) :: noise
      real(wp) :: limit

      limit = rounding_of_sums
      if (present(noise)) limit = noise
      call begin_together(d, to_expand, [integer ::], limit)
      call expand_here(operator, d, limit, statistics, error)
      call end_together(d)
   end subroutine expand_block

   !> As `expand_block`, called by all processes that share the rows, each with its rows.
   subroutine expand_here(operator, d, limit, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), target, intent(inout) :: d
      real(wp), intent(in) :: limit
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), coefficients(:, :), rest(:, :)
      integer :: b, first, last, before
      integer(long) :: started

      before = d%vectors
      first = d%expanded + 1
      last = min(d%vectors, d%basis%room() - d%vectors + d%expanded)
      b = last - first + 1
      if (b <= 0) return
      allocate (x(d%team%rows(d%basis%length()), b), coefficients(d%basis%room(), b))
      call operator%apply(d%basis%columns(first, b), x, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + b
      started = clock()
      call subtract_recurrence(d, x, coefficients)
      call operator%clean(x)
      if (.not. all(abs(coefficients(first:last, :)) <= huge(1.0_wp))) call new_error(error, error_library, &
         "the operator made a vector that is not finite")
      if (allocated(error)) return
      ! Images of the vectors that remain unexpanded, and of the new ones.
      allocate (rest(size(x, 1), d%vectors - last), source=d%images(:, b + 1:))
      call move_alloc(rest, d%images)
      statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
      d%scale = max(d%scale, maxval(abs(coefficients)))
      call orthonormalize(operator, d, x, d%scale, limit, coefficients, statistics, error)
      if (allocated(error)) return
      d%couplings(:, first:last) = coefficients
      d%expanded = last
      d%scale = max(d%scale, maxval(abs(coefficients)))
      if (d%vectors - before < b) d%discarded = max(d%discarded, rounding_limit(d, limit)*max(d%scale, norm2(coefficients)))
   end subroutine expand_here

   ! Subtracts the terms of the three-term recurrence from C W before the Gram-Schmidt step. Otherwise errors of orthogonality,
   ! multiplied by the large coefficients subtracted there, would grow from step to step.
   subroutine subtract_recurrence(d, x, coefficients)
      class(block_decomposition_type), intent(in) :: d
      !> C times the first columns of W.
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), intent(out) :: coefficients(:, :)
      real(wp), allocatable :: own(:, :)
      integer :: b, k, i, j

      b = size(x, 2)
      k = d%expanded
      coefficients = 0
      allocate (own(b, b))
      call inner_products(d%images, x, own, sums=d%sums)
      call d%basis%subtract(k + 1, own, x)
      coefficients(k + 1:k + b, :) = own
      ! Components along earlier vectors, by symmetry.
      do i = 1, k
         if (maxval(abs(d%couplings(k + 1:k + b, i))) > epsilon(1.0_wp)*d%scale) exit
      end do
      if (i > k) return
      do j = 1, b
         coefficients(i:k, j) = d%couplings(k + j, i:k)
      end do
      call d%basis%subtract(i, coefficients(i:k, :), x)
   end subroutine subtract_recurrence
end module kschur_block_lanczos
