!> A block Lanczos decomposition, and its basis, which is orthonormal in the inner product x^T B y of a metric B, symmetric and
!> positive semidefinite.
!>
!> Sources: Daniel, Gragg, Kaufman, Stewart, Math. Comp. 30 (1976), reorthogonalisation; Hernandez, Roman, Tomas, Parallel
!> Computing 33 (2007), norms from Pythagoras; Freund and Malhotra, Linear Algebra Appl. 254 (1997), deflation of dependent
!> columns.
module kschur_block_decomposition
   use kschur_archive, only: archive_type
   use kschur_basis_rows_real, only: basis_rows_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: dtrsm
   use kschur_memory, only: real_bytes, require_memory
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_processes, only: processes_type
   use kschur_random_start, only: random_start_type
   use kschur_row_sums, only: row_sums_type
   use kschur_row_team, only: row_team_type
   use kschur_tall_products_real, only: column_length, inner_products, subtract_combinations
   use kschur_threads, only: panel_rows
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: block_decomposition_type, dot, drop_last, make_room, orthonormalize, rounding_limit

   ! Reorthogonalise unless at least this fraction of each norm is left.
   real(wp), parameter :: reorthogonalize_below = 0.7_wp

   !> C V = V T + W N, [V, W]^T B [V, W] = 1: V are the vectors that C was applied to (expanded), W the residual block.
   type :: block_decomposition_type
      !> Vectors as columns; more may be allocated than are used.
      type(basis_rows_type) :: basis
      !> B-products of C V with the basis, T above N, in columns 1..expanded.
      real(wp), allocatable :: couplings(:, :)
      !> Number of vectors, and how many of them were expanded.
      integer :: vectors = 0, expanded = 0
      !> A lower bound of the norm of C.
      real(wp) :: scale = 0
      !> B-orthonormal null vectors of C, kept out of the basis: rounding would bring them back.
      real(wp), allocatable :: excluded(:, :)
      !> Upper bound of the dimension of the space.
      integer :: most = huge(1)
      !> Lower bounds of the norm of B and of the largest 2-norm of a vector.
      real(wp) :: metric_scale = 0, longest = 0
      !> Whether the rounding error of B-products is estimated from these bounds: start vectors may have a 2-norm far larger
      !> than their B-norm.
      logical :: cautious = .false.
      integer(long) :: random_state = 0
      !> The first columns of V times this are C^f X, X random. Empty: these are not in the basis.
      real(wp), allocatable :: start(:, :)
      !> f
      integer :: filter = 0
      !> Norm below which columns of C V were discarded as rounding errors: so far C V = V T + W N may be wrong.
      real(wp) :: discarded = 0
      !> B W, without the last orthogonalisation of W.
      real(wp), allocatable :: images(:, :)
      !> Whether the operator takes distributed vectors; the processes that share them, and their sums.
      logical :: by_rows = .false.
      type(row_team_type) :: team
      type(row_sums_type) :: sums
   contains
      !> Whether the basis spans an invariant subspace: there is no residual block.
      procedure :: closed
      !> Whether all allocated columns are in use.
      procedure :: full
      !> The coupling block N, as many rows as W has columns.
      procedure :: outward
      !> What the space tells of its random start vectors.
      procedure :: seen_from_start
      !> Writes the changing parts to a checkpoint, or reads them.
      procedure :: carry
   end type block_decomposition_type

contains

   subroutine carry(self, archive)
      class(block_decomposition_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive

      call archive%carry(self%vectors)
      call archive%carry(self%expanded)
      call self%basis%carry(archive, self%vectors)
      call archive%carry(self%couplings)
      call self%team%carry(archive, self%basis%length(), self%images)
      call archive%carry(self%scale)
      call archive%carry(self%metric_scale)
      call archive%carry(self%longest)
      call archive%carry(self%random_state)
      call archive%carry(self%start)
      call archive%carry(self%filter)
      call archive%carry(self%discarded)
   end subroutine carry

   pure logical function closed(self)
      class(block_decomposition_type), intent(in) :: self

      closed = self%expanded == self%vectors
   end function closed

   pure logical function full(self)
      class(block_decomposition_type), intent(in) :: self

      full = self%vectors >= self%basis%room()
   end function full

   pure function outward(self)
      class(block_decomposition_type), intent(in) :: self
      real(wp) :: outward(self%vectors - self%expanded, self%expanded)

      outward = self%couplings(self%expanded + 1:self%vectors, :self%expanded)
   end function outward

   !> Without values if the random vectors were purged.
   function seen_from_start(self, values, vectors) result(seen)
      class(block_decomposition_type), intent(in) :: self
      !> All Ritz values and vectors, in terms of the expanded basis.
      real(wp), intent(in) :: values(:), vectors(:, :)
      type(random_start_type) :: seen

      if (size(self%start) == 0) return
      seen%values = cmplx(values, kind=wp)
      seen%first = cmplx(matmul(transpose(self%start), vectors(:size(self%start, 1), :)), kind=wp)
      seen%last = cmplx(matmul(self%outward(), vectors), kind=wp)
      seen%filter = self%filter
      seen%discarded = self%discarded
   end function seen_from_start

   !> Allocates room for `vectors` vectors of a length.
   subroutine make_room(d, length, vectors, processes, error)
      class(block_decomposition_type), intent(inout) :: d
      integer, intent(in) :: length, vectors
      !> Processes that may share the rows; not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      ! Work vectors: images, and those of the operator.
      integer, parameter :: spare_vectors = 16
      real(wp), allocatable :: couplings(:, :)

      if (d%basis%room() >= vectors) return
      call d%basis%reserve(length, vectors, d%vectors, processes, error)
      if (allocated(error)) return
      if (d%by_rows) d%team = d%basis%team()
      call require_memory(spare_vectors*real_bytes*d%team%rows(length), "vectors beside a Lanczos basis", error)
      if (allocated(error)) return
      allocate (couplings(vectors, vectors), source=0.0_wp)
      if (allocated(d%couplings)) couplings(:size(d%couplings, 1), :size(d%couplings, 2)) = d%couplings
      call move_alloc(couplings, d%couplings)
      if (.not. allocated(d%images)) allocate (d%images(d%team%rows(length), 0))
      if (.not. allocated(d%start)) allocate (d%start(0, 0))
   end subroutine make_room

   !> Discards all but the first `vectors` vectors.
   subroutine drop_last(d, vectors)
      class(block_decomposition_type), intent(inout) :: d
      integer, intent(in) :: vectors

      d%vectors = vectors
      d%images = d%images(:, :vectors - d%expanded)
   end subroutine drop_last

   !> B-orthonormalises columns against the basis and each other by repeated Gram-Schmidt passes, and appends them and their
   !> B-images; adds their components along all vectors to `coefficients`. Ends after a pass that changes little; norms then
   !> follow from Pythagoras. Nearly parallel columns are first orthogonalised among each other, as passes over the basis cost
   !> more.
   subroutine orthonormalize(operator, d, x, scale, noise, coefficients, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      class(block_decomposition_type), intent(inout) :: d
      real(wp), contiguous, intent(inout) :: x(:, :)
      !> Norm of the vectors that the columns were computed from, if larger than their own.
      real(wp), intent(in) :: scale
      !> Relative to that norm, columns below this are rounding errors.
      real(wp), intent(in) :: noise
      real(wp), intent(inout) :: coefficients(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      ! The last two passes do not restrict: with a shift next to an eigenvalue, the projection onto the constraints adds
      ! components along its eigenvector, and rounding errors of these violate the constraints again.
      integer, parameter :: passes = 6, restricting_passes = passes - 2
      real(wp), allocatable :: images(:, :), c(:, :), gram(:, :), total(:, :), triangle(:, :)
      real(wp) :: negligible, limit, left
      integer :: k, b, q, pass, kept
      integer(long) :: started
      logical :: settled, taken

      k = d%vectors
      b = size(x, 2)
      allocate (images(size(x, 1), b))
      ! Invariant: X as given = V coefficients + X total.
      allocate (total, source=identity(b))
      q = b
      limit = rounding_limit(d, noise)
      negligible = limit*scale
      settled = .false.
      taken = .false.
      do pass = 1, passes
         call operator%apply_metric(x(:, :q), images(:, :q), error)
         if (allocated(error)) return
         started = clock()
         call exclude(d, images(:, :q), x(:, :q))
         allocate (gram(q, q), c(k, q), triangle(q, q))
         call inner_products(x, images(:, :q), gram, sums=d%sums)
         if (.not. all(abs(gram) <= huge(1.0_wp))) call new_error(error, error_library, &
            "the operator made a vector that is not finite")
         if (allocated(error)) return
         negligible = max(negligible, limit*sqrt(maxval([0.0_wp, diagonal(gram)])))
         call separate(x(:, :q), images(:, :q), negligible, d%sums, gram, triangle)
         total(:q, :) = matmul(triangle, total(:q, :))
         call d%basis%take_out(images(:, :q), c, x(:, :q))
         ! What the restriction removed is outside the range of the operator, and so are the basis components that went with it.
         if (.not. taken) coefficients(:k, :) = coefficients(:k, :) + matmul(c, total(:q, :))
         call factor_rest(gram, c, negligible, triangle, left)
         settled = left > reorthogonalize_below
         if (settled) then
            call divide(size(x, 1), q, x, triangle)
            call divide(size(x, 1), q, images, triangle)
            kept = q
            negligible = 0
            if (pass <= restricting_passes) call operator%restrict(x(:, :q), negligible, error)
            if (allocated(error)) return
            taken = negligible > 0
            settled = .not. taken
         else
            call operator%apply_metric(x(:, :q), images(:, :q), error)
            if (allocated(error)) return
            call orthonormalize_among(x(:, :q), images(:, :q), negligible, d%sums, triangle, kept)
            negligible = 0
            taken = .false.
         end if
         total(:kept, :) = matmul(triangle(:kept, :), total(:q, :))
         q = min(kept, d%most - k)
         limit = rounding_of_sums
         deallocate (gram, c, triangle)
         statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
         if (q == 0 .or. settled) exit
      end do
      call append(d, x(:, :q), images)
      coefficients(k + 1:k + q, :) = coefficients(k + 1:k + q, :) + total(:q, :)
   end subroutine orthonormalize

   !> Relative to the norm of the vectors that columns were computed from, a length below which they are rounding errors.
   pure real(wp) function rounding_limit(d, noise) result(limit)
      class(block_decomposition_type), intent(in) :: d
      !> A lower bound of it.
      real(wp), intent(in) :: noise

      limit = noise
      if (d%cautious) limit = max(limit, epsilon(1.0_wp)*sqrt(d%metric_scale)*d%longest)
   end function rounding_limit

   ! Appends orthonormal columns to the basis, and their B-images.
   subroutine append(d, x, images)
      class(block_decomposition_type), target, intent(inout) :: d
      real(wp), contiguous, intent(in) :: x(:, :)
      !> At least as many columns; overwritten.
      real(wp), allocatable, intent(inout) :: images(:, :)
      real(wp), allocatable :: all(:, :)
      integer :: before, q, j

      q = size(x, 2)
      before = size(d%images, 2)
      call copy_columns(x, d%basis%place_for(d%vectors + 1, q))
      call d%basis%store(d%vectors + 1, q)
      d%vectors = d%vectors + q
      if (before == 0 .and. size(images, 2) == q) then
         call move_alloc(images, d%images)
      else
         allocate (all(size(x, 1), before + q))
         all(:, :before) = d%images
         all(:, before + 1:) = images(:, :q)
         call move_alloc(all, d%images)
      end if
      d%longest = max(d%longest, maxval([0.0_wp, (column_length(x(:, j:j), sums=d%sums), j=1, q)]))
   end subroutine append

   ! y := x, by all threads.
   subroutine copy_columns(x, y)
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      integer :: i, j

      do j = 1, size(x, 2)
         !$omp parallel do schedule(static) if (size(x, 1) > panel_rows)
         do i = 1, size(x, 1)
            y(i, j) = x(i, j)
         end do
         !$omp end parallel do
      end do
   end subroutine copy_columns

   ! X := X - E E^T B X, E the excluded vectors.
   subroutine exclude(d, images, x)
      class(block_decomposition_type), intent(in) :: d
      real(wp), contiguous, intent(in) :: images(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), allocatable :: components(:, :)

      if (.not. allocated(d%excluded)) return
      allocate (components(size(d%excluded, 2), size(x, 2)))
      call inner_products(d%excluded, images, components, sums=d%sums)
      call subtract_combinations(d%excluded, components, x)
   end subroutine exclude

   ! Orthogonalises columns among each other without normalising them, by the Cholesky factor of their Gram matrix, if that shows
   ! that they are nearly parallel: X as given = X T, T unit upper triangular.
   subroutine separate(x, images, negligible, sums, gram, triangle)
      real(wp), contiguous, intent(inout) :: x(:, :), images(:, :)
      real(wp), intent(in) :: negligible
      type(row_sums_type), intent(in) :: sums
      !> Gram matrix of the columns.
      real(wp), intent(inout) :: gram(:, :)
      !> T
      real(wp), intent(out) :: triangle(:, :)
      ! Smallest fraction of a column whose square a Gram matrix still resolves.
      real(wp), parameter :: visible = 1.0e-4_wp
      real(wp) :: none(0, size(x, 2)), left
      integer :: n, b, i

      n = size(x, 1)
      b = size(x, 2)
      call factor_rest(gram, none, negligible, triangle, left)
      if (left > visible .and. left <= reorthogonalize_below) then
         do i = 1, b
            triangle(i, :) = triangle(i, :)/triangle(i, i)
         end do
         call divide(n, b, x, triangle)
         call divide(n, b, images, triangle)
         call inner_products(x, images, gram, sums=sums)
      else
         triangle = identity(b)
      end if
   end subroutine separate

   ! Cholesky factor of G - c^T c: by Pythagoras the Gram matrix of columns after their components c along the basis were
   ! subtracted, G before that.
   pure subroutine factor_rest(gram, c, negligible, triangle, left)
      real(wp), intent(in) :: gram(:, :), c(:, :), negligible
      !> Upper.
      real(wp), intent(out) :: triangle(:, :)
      !> Smallest fraction of a norm that is left; 0 where that is negligible.
      real(wp), intent(out) :: left
      real(wp) :: rest(size(gram, 1), size(gram, 2))
      integer :: i, j

      rest = gram - matmul(transpose(c), c)
      triangle = 0
      left = 1
      do j = 1, size(gram, 1)
         do i = 1, j - 1
            triangle(i, j) = (rest(i, j) - dot_product(triangle(:i - 1, i), triangle(:i - 1, j)))/triangle(i, i)
         end do
         associate (square => rest(j, j) - sum(triangle(:j - 1, j)**2))
            if (.not. square > negligible**2) left = 0
            if (.not. left > 0) return
            left = min(left, sqrt(square/gram(j, j)))
            triangle(j, j) = sqrt(square)
         end associate
      end do
   end subroutine factor_rest

   ! X := X T^{-1}, T upper triangular.
   subroutine divide(n, b, x, triangle)
      integer, intent(in) :: n, b
      real(wp), intent(inout) :: x(n, b)
      real(wp), intent(in) :: triangle(b, b)
      ! Rows of a panel that fits in the cache.
      integer, parameter :: panel = 512
      integer :: first, last

      if (b == 0) return
      !$omp parallel do schedule(static) private(last) if (n > panel_rows)
      do first = 1, n, panel
         last = min(first + panel - 1, n)
         if (b == 1) then
            ! Divide: multiplying by the rounded inverse, as dtrsm does, would change unit vectors.
            x(first:last, 1) = x(first:last, 1)/triangle(1, 1)
         else
            call dtrsm("R", "U", "N", "N", last - first + 1, b, 1.0_wp, triangle, b, x(first, 1), n)
         end if
      end do
      !$omp end parallel do
   end subroutine divide

   ! Modified Gram-Schmidt on columns and their images; drops columns with norms below `negligible`.
   subroutine orthonormalize_among(x, images, negligible, sums, triangle, kept)
      real(wp), contiguous, intent(inout) :: x(:, :), images(:, :)
      real(wp), intent(in) :: negligible
      type(row_sums_type), intent(in) :: sums
      !> The columns as given in terms of those that are kept.
      real(wp), intent(out) :: triangle(:, :)
      integer, intent(out) :: kept
      real(wp) :: length
      integer :: i, j

      triangle = 0
      kept = 0
      do j = 1, size(x, 2)
         do i = 1, kept
            triangle(i, j) = dot(x(:, i:i), images(:, j:j), sums)
            x(:, j) = x(:, j) - triangle(i, j)*x(:, i)
            images(:, j) = images(:, j) - triangle(i, j)*images(:, i)
         end do
         length = sqrt(max(dot(x(:, j:j), images(:, j:j), sums), 0.0_wp))
         if (.not. length > negligible) cycle
         kept = kept + 1
         triangle(kept, j) = length
         x(:, kept) = x(:, j)/length
         images(:, kept) = images(:, j)/length
      end do
   end subroutine orthonormalize_among

   !> x^T y of single columns.
   real(wp) function dot(x, y, sums)
      real(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      type(row_sums_type), intent(in) :: sums
      real(wp) :: c(1, 1)

      call inner_products(x, y, c, sums=sums)
      dot = c(1, 1)
   end function dot

   pure function identity(n)
      integer, intent(in) :: n
      real(wp) :: identity(n, n)
      integer :: i

      identity = 0
      do i = 1, n
         identity(i, i) = 1
      end do
   end function identity

   pure function diagonal(a)
      real(wp), intent(in) :: a(:, :)
      real(wp) :: diagonal(size(a, 1))
      integer :: i

      diagonal = [(a(i, i), i=1, size(a, 1))]
   end function diagonal
end module kschur_block_decomposition
