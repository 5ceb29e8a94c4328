!> A block Lanczos decomposition of a self-adjoint operator C from several start vectors, which grows block by block
!> in the inner product x^T B y of its metric B.
!>
!> Sources: Golub and Underwood (1977); Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48 (1987), semidefinite B;
!> columns that depend on others are left out, as in Freund and Malhotra, Linear Algebra Appl. 254 (1997).
module kschur_block_lanczos
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_lapack, only: ddot, dgemm, dgemv
   use kschur_operator, only: symmetric_operator_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_text, only: text
   implicit none
   private
   public :: block_decomposition_type, add_directions, add_random_direction, expand_block, make_room

   ! So many columns are not worth a matrix product.
   integer, parameter :: few = 3
   ! What is left of a vector in the span of the basis.
   real(wp), parameter :: breakdown = 100*epsilon(1.0_wp)

   !> C V = V T + W N, [V, W]^T B [V, W] = 1: V are the columns of the basis that were expanded, W those behind them.
   type :: block_decomposition_type
      !> Vectors as columns; room for more.
      real(wp), allocatable :: basis(:, :)
      !> B-products of C V with the basis, T above N, in columns 1..expanded.
      real(wp), allocatable :: couplings(:, :)
      !> Number of vectors, and how many of them were expanded.
      integer :: vectors = 0, expanded = 0
      !> A lower bound of the norm of C.
      real(wp) :: scale = 0
      !> B-orthonormal vectors that C takes to nothing: kept out, as rounding would bring them back.
      real(wp), allocatable :: excluded(:, :)
      !> There are no more independent vectors than this.
      integer :: most = huge(1)
      !> Lower bounds of the norm of B, and of the length of the longest vector: their product tells what rounding leaves.
      real(wp) :: metric_scale = 0, longest = 0
      integer(long) :: random_state = 0
   contains
      !> Whether all that C can reach from what was put in is there.
      procedure :: closed
      !> Whether there is no room for what the next expansion makes.
      procedure :: full
   end type block_decomposition_type

contains

   pure logical function closed(self)
      class(block_decomposition_type), intent(in) :: self

      closed = self%expanded == self%vectors
   end function closed

   pure logical function full(self)
      class(block_decomposition_type), intent(in) :: self

      full = self%vectors >= size(self%basis, 2)
   end function full

   !> Room for so many vectors of a length.
   subroutine make_room(d, length, vectors, error)
      type(block_decomposition_type), intent(inout) :: d
      integer, intent(in) :: length, vectors
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: basis(:, :), couplings(:, :)
      integer :: status

      if (allocated(d%basis)) then
         if (size(d%basis, 2) >= vectors) return
      end if
      allocate (basis(length, vectors), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "there is no memory for a basis of "//text(vectors)// &
            " vectors of length "//text(length))
         return
      end if
      allocate (couplings(vectors, vectors), source=0.0_wp)
      if (allocated(d%basis)) then
         basis(:, :d%vectors) = d%basis(:, :d%vectors)
         couplings(:size(d%couplings, 1), :size(d%couplings, 2)) = d%couplings
      end if
      call move_alloc(basis, d%basis)
      call move_alloc(couplings, d%couplings)
   end subroutine make_room

   !> Puts vectors behind the basis, as far as they do not depend on it: X = V coefficients.
   subroutine add_directions(operator, d, x, coefficients, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(block_decomposition_type), intent(inout) :: d
      !> Columns of any length; used up.
      real(wp), contiguous, intent(inout) :: x(:, :)
      !> As many rows as there is room for vectors.
      real(wp), intent(out) :: coefficients(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: images(size(x, 1), size(x, 2)), lengths(size(x, 2))
      integer :: j

      coefficients = 0
      call operator%apply_metric(x, images, error)
      if (allocated(error)) return
      lengths = 0
      do j = 1, size(x, 2)
         lengths(j) = sqrt(max(ddot(size(x, 1), x(:, j), 1, images(:, j), 1), 0.0_wp))
         if (.not. lengths(j) > 0) cycle
         d%metric_scale = max(d%metric_scale, (lengths(j)/norm2(x(:, j)))**2)
         x(:, j) = x(:, j)/lengths(j)
      end do
      call orthonormalize(operator, d, x, 1.0_wp, coefficients, statistics, error)
      do j = 1, size(x, 2)
         coefficients(:, j) = lengths(j)*coefficients(:, j)
      end do
   end subroutine add_directions

   !> Puts C C r behind the basis, r random: C filters infinite eigenvalues. Nothing is added where there is no more.
   subroutine add_random_direction(operator, d, seed, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(block_decomposition_type), intent(inout) :: d
      integer, intent(in) :: seed
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: filter = 2
      real(wp), allocatable :: x(:, :), y(:, :)
      real(wp) :: coefficients(size(d%basis, 2), 1)
      integer :: before, i

      if (d%random_state == 0) d%random_state = state_of_seed(seed)
      before = d%vectors
      allocate (x(size(d%basis, 1), 1), y(size(d%basis, 1), 1))
      call random_vector(d%random_state, x(:, 1))
      call add_directions(operator, d, x, coefficients, statistics, error)
      do i = 1, filter
         if (allocated(error) .or. d%vectors == before) return
         x = d%basis(:, d%vectors:d%vectors)
         call operator%apply(x, y, error)
         if (allocated(error)) return
         statistics%operator_applications = statistics%operator_applications + 1
         d%vectors = before
         coefficients = 0
         call orthonormalize(operator, d, y, d%scale, coefficients, statistics, error)
         ! What the metric does not see is no direction.
         if (d%vectors > before) then
            if (breakdown*d%metric_scale*sum(d%basis(:, d%vectors)**2) > 1) d%vectors = before
         end if
      end do
   end subroutine add_random_direction

   !> Expands the vectors that were not, as far as there is room for what comes of them.
   subroutine expand_block(operator, d, statistics, error, noise)
      class(symmetric_operator_type), intent(inout) :: operator
      type(block_decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      !> What C makes of them beside the basis is rounding below this, relative to its norm.
      real(wp), optional, intent(in) :: noise
      real(wp), allocatable :: x(:, :), known(:, :), coefficients(:, :)
      real(wp) :: limit
      integer :: n, b, first, last, i, j
      integer(long) :: started

      n = size(d%basis, 1)
      first = d%expanded + 1
      last = min(d%vectors, size(d%basis, 2) - d%vectors + d%expanded)
      b = last - first + 1
      if (b <= 0) return
      allocate (x(n, b), coefficients(size(d%basis, 2), b))
      call operator%apply(d%basis(:, first:last), x, error)
      if (allocated(error)) return
      statistics%operator_applications = statistics%operator_applications + b
      started = clock()
      ! What earlier vectors have of these is known. Subtracted first, little is left to be lost.
      coefficients = 0
      do i = 1, d%expanded
         if (maxval(abs(d%couplings(first:last, i))) > epsilon(1.0_wp)*d%scale) exit
      end do
      allocate (known(d%expanded - i + 1, b))
      do j = 1, b
         known(:, j) = d%couplings(d%expanded + j, i:d%expanded)
         coefficients(i:d%expanded, j) = known(:, j)
      end do
      call subtract(d%basis(:, i:d%expanded), known, x)
      statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
      d%scale = max(d%scale, maxval(abs(coefficients)))
      limit = breakdown
      if (present(noise)) limit = noise
      call orthonormalize(operator, d, x, d%scale, coefficients, statistics, error, limit)
      if (allocated(error)) return
      d%couplings(:, first:last) = coefficients
      d%expanded = last
      d%scale = max(d%scale, maxval(abs(coefficients)))
   end subroutine expand_block

   ! Puts B-orthonormal combinations of columns behind the basis: to the coefficients is added what columns are of
   ! the basis. Passes go on until one of them changes little.
   subroutine orthonormalize(operator, d, x, scale, coefficients, statistics, error, noise)
      class(symmetric_operator_type), intent(inout) :: operator
      type(block_decomposition_type), intent(inout) :: d
      real(wp), contiguous, intent(inout) :: x(:, :)
      !> A length that the columns were made of, if theirs are less.
      real(wp), intent(in) :: scale
      real(wp), intent(inout) :: coefficients(:, :)
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      !> Below this part of that it is rounding.
      real(wp), optional, intent(in) :: noise
      integer, parameter :: passes = 4
      real(wp), parameter :: enough_left = 0.5_wp
      real(wp), allocatable :: images(:, :), c(:, :), total(:, :), triangle(:, :)
      real(wp) :: least, negligible, limit
      integer :: n, k, b, q, j, pass
      integer(long) :: started

      n = size(x, 1)
      k = d%vectors
      b = size(x, 2)
      ! X as given is V coefficients + X total.
      allocate (images(n, b), total(b, b), source=0.0_wp)
      do j = 1, b
         total(j, j) = 1
      end do
      q = b
      limit = breakdown
      if (present(noise)) limit = noise
      limit = max(limit, epsilon(1.0_wp)*sqrt(d%metric_scale)*d%longest)
      negligible = limit*scale
      call operator%apply_metric(x, images, error)
      if (allocated(error)) return
      if (.not. abs(sum(images)) <= huge(1.0_wp)) call new_error(error, error_library, &
         "the operator made a vector that is not finite")
      if (allocated(error)) return
      do pass = 1, passes
         allocate (c(k, q), triangle(q, q))
         started = clock()
         call exclude(d, x(:, :q), images(:, :q))
         least = 1
         negligible = max(negligible, limit*longest(x(:, :q), images(:, :q)))
         limit = breakdown
         if (k > 0) then
            call find_components(d%basis(:, :k), images(:, :q), c)
            least = smallest_rest(x(:, :q), images(:, :q), c)
            call subtract(d%basis(:, :k), c, x(:, :q))
            coefficients(:k, :) = coefficients(:k, :) + matmul(c, total(:q, :))
            call operator%apply_metric(x(:, :q), images(:, :q), error)
            if (allocated(error)) return
         end if
         call orthonormalize_among(x(:, :q), images(:, :q), negligible, triangle, j, least)
         total(:j, :) = matmul(triangle(:j, :), total(:q, :))
         q = min(j, d%most - k)
         statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
         if (q == 0 .or. least >= enough_left) exit
         negligible = 0
         deallocate (c, triangle)
      end do
      d%basis(:, k + 1:k + q) = x(:, :q)
      coefficients(k + 1:k + q, :) = coefficients(k + 1:k + q, :) + total(:q, :)
      d%vectors = k + q
      d%longest = max(d%longest, maxval([0.0_wp, (norm2(x(:, j)), j=1, q)]))
   end subroutine orthonormalize

   subroutine exclude(d, x, images)
      type(block_decomposition_type), intent(in) :: d
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), contiguous, intent(in) :: images(:, :)
      real(wp), allocatable :: components(:, :)

      if (.not. allocated(d%excluded)) return
      allocate (components(size(d%excluded, 2), size(x, 2)))
      call find_components(d%excluded, images, components)
      call subtract(d%excluded, components, x)
   end subroutine exclude

   ! C = V^T Y. A matrix product packs V first, which a few columns are not worth.
   subroutine find_components(v, y, c)
      real(wp), contiguous, intent(in) :: v(:, :), y(:, :)
      real(wp), contiguous, intent(out) :: c(:, :)
      integer :: n, k, q, j
      ! OpenBLAS reads a few entries beyond the end.
      real(wp) :: column(size(v, 2) + 4)

      n = size(v, 1)
      k = size(v, 2)
      q = size(y, 2)
      if (q > few) then
         call dgemm("T", "N", k, q, n, 1.0_wp, v, n, y, n, 0.0_wp, c, k)
         return
      end if
      do j = 1, q
         column = 0
         call dgemv("T", n, k, 1.0_wp, v, n, y(:, j), 1, 0.0_wp, column, 1)
         c(:, j) = column(:k)
      end do
   end subroutine find_components

   ! X := X - V C.
   subroutine subtract(v, c, x)
      real(wp), contiguous, intent(in) :: v(:, :), c(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer :: n, k, q, j
      real(wp) :: column(size(v, 2) + 4)

      n = size(v, 1)
      k = size(v, 2)
      q = size(x, 2)
      if (k == 0) return
      if (q > few) then
         call dgemm("N", "N", n, q, k, -1.0_wp, v, n, c, k, 1.0_wp, x, n)
         return
      end if
      do j = 1, q
         column = 0
         column(:k) = c(:, j)
         call dgemv("N", n, k, -1.0_wp, v, n, column, 1, 1.0_wp, x(:, j), 1)
      end do
   end subroutine subtract

   pure real(wp) function longest(x, images)
      real(wp), intent(in) :: x(:, :), images(:, :)
      integer :: j

      longest = sqrt(maxval([0.0_wp, (dot_product(x(:, j), images(:, j)), j=1, size(x, 2))]))
   end function longest

   ! The smallest part of the length of a column that is left without its components.
   pure real(wp) function smallest_rest(x, images, components)
      real(wp), intent(in) :: x(:, :), images(:, :), components(:, :)
      real(wp) :: square
      integer :: j

      smallest_rest = 1
      do j = 1, size(x, 2)
         square = dot_product(x(:, j), images(:, j))
         if (square > 0) smallest_rest = min(smallest_rest, sqrt(max(1 - sum(components(:, j)**2)/square, 0.0_wp)))
      end do
   end function smallest_rest

   ! Modified Gram-Schmidt on columns and their images alike; columns shorter than `negligible` are left out.
   subroutine orthonormalize_among(x, images, negligible, triangle, kept, least)
      real(wp), intent(inout) :: x(:, :), images(:, :)
      real(wp), intent(in) :: negligible
      !> The columns as given are combinations of those that were kept.
      real(wp), intent(out) :: triangle(:, :)
      integer, intent(out) :: kept
      !> The smallest part of a column that was left, if that is less.
      real(wp), intent(inout) :: least
      real(wp) :: before, length
      integer :: n, i, j

      n = size(x, 1)
      triangle = 0
      kept = 0
      do j = 1, size(x, 2)
         before = sqrt(max(ddot(n, x(:, j), 1, images(:, j), 1), 0.0_wp))
         do i = 1, kept
            triangle(i, j) = ddot(n, x(:, i), 1, images(:, j), 1)
            x(:, j) = x(:, j) - triangle(i, j)*x(:, i)
            images(:, j) = images(:, j) - triangle(i, j)*images(:, i)
         end do
         length = sqrt(max(ddot(n, x(:, j), 1, images(:, j), 1), 0.0_wp))
         if (.not. length > negligible) cycle
         kept = kept + 1
         triangle(kept, j) = length
         least = min(least, length/before)
         x(:, kept) = x(:, j)/length
         images(:, kept) = images(:, j)/length
      end do
   end subroutine orthonormalize_among
end module kschur_block_lanczos
