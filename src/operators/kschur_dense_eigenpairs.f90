!> All eigenpairs of an operator from its dense matrix by LAPACK, for problems so small that a Krylov space would span nearly
!> everything.
module kschur_dense_eigenpairs
   use kschur_error, only: error_type, error_library, new_error
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dgeqp3, dormqr, dpstrf, dtrevc, dtrsm, dtrsna
   use kschur_operator, only: complex_operator_type, real_operator_type, symmetric_operator_type
   use kschur_projected, only: independent_eigenvectors, schur_form, symmetric_eigenvectors
   implicit none
   private
   public :: complex_eigenpairs, dense_eigenpairs_type, general_eigenpairs, matrix_eigenpairs, symmetric_eigenpairs

   !> Eigenvalues, and eigenvectors as combinations of basis columns.
   type :: dense_eigenpairs_type
      complex(wp), allocatable :: values(:)
      !> Order of the operator x k.
      real(wp), allocatable :: basis(:, :)
      !> Schur form in this basis, k x k, whose last eigenvalues are `values`; not allocated: the basis columns are
      !> eigenvectors.
      real(wp), allocatable :: schur(:, :)
      !> Both of a complex matrix, in the place of these.
      complex(wp), allocatable :: complex_basis(:, :), complex_schur(:, :)
      !> Rounding level of couplings between copies of an eigenvalue, relative to it.
      real(wp) :: noise = 0
      !> Number of vectors the operator was applied to.
      integer :: applications = 0
   contains
      !> Selected eigenvectors of unit norm; real for a self-adjoint operator.
      procedure :: vectors, real_vectors
      !> Errors of the values by rounding of a real matrix, to first order.
      procedure :: errors
   end type dense_eigenpairs_type

   !> As `general_eigenpairs` for a given matrix, in its own coordinates.
   interface matrix_eigenpairs
      module procedure real_matrix_eigenpairs, complex_matrix_eigenpairs
   end interface matrix_eigenpairs

   ! Householder QR factorisation of a few columns: Q as reflectors, and R.
   type :: reflections_type
      real(wp), allocatable :: vectors(:, :), tau(:), triangle(:, :)
   contains
      procedure :: apply, apply_to_complex
   end type reflections_type

   ! Block size of LAPACK.
   integer, parameter :: block_size = 32

contains

   !> Nonzero eigenpairs of a self-adjoint C: with V orthonormal in its metric B they are those of V^T B C V. V comes from a
   !> pivoted Cholesky factorisation; B may be semidefinite.
   subroutine symmetric_eigenpairs(operator, motions, pairs, error)
      class(symmetric_operator_type), intent(inout) :: operator
      !> Basis of a space that contains the range of C, order x p.
      real(wp), contiguous, intent(in) :: motions(:, :)
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: v(:, :), w(:, :), g(:, :), values(:)
      integer :: n, r

      call metric_basis(operator, motions, v, error)
      if (allocated(error)) return
      n = size(v, 1)
      r = size(v, 2)
      pairs%applications = r
      allocate (w(n, r), g(r, r))
      allocate (pairs%basis(n, r))
      call operator%apply(v, w, error)
      if (.not. allocated(error)) call operator%apply_metric(v, pairs%basis, error)
      if (allocated(error) .or. r == 0) then
         allocate (pairs%values(0))
         return
      end if
      call dgemm("T", "N", r, r, n, 1.0_wp, pairs%basis, n, w, n, 0.0_wp, g, r)
      g = (g + transpose(g))/2
      call symmetric_eigenvectors(g, values, error)
      if (allocated(error)) return
      call dgemm("N", "N", n, r, r, 1.0_wp, v, n, g, r, 0.0_wp, pairs%basis, n)
      allocate (pairs%values(r), source=cmplx(values, 0, wp))
   end subroutine symmetric_eigenpairs

   ! Finds a B-orthonormal basis of the span of the motions, without the null space of B.
   subroutine metric_basis(operator, motions, v, error)
      class(symmetric_operator_type), intent(inout) :: operator
      real(wp), contiguous, intent(in) :: motions(:, :)
      real(wp), allocatable, intent(out) :: v(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: images(:, :), gram(:, :), factors(:), work(:)
      integer, allocatable :: pivots(:)
      integer :: n, p, r, i, info

      n = size(motions, 1)
      p = size(motions, 2)
      allocate (images(n, p), gram(p, p), factors(p), work(2*p + 1), pivots(p))
      call operator%apply_metric(motions, images, error)
      if (allocated(error)) return
      r = 0
      if (p > 0) call dgemm("T", "N", p, p, n, 1.0_wp, motions, n, images, n, 0.0_wp, gram, p)
      ! Scales to unit diagonal, so that motions of large mass do not hide others.
      factors = 0
      do i = 1, p
         if (gram(i, i) > 0) factors(i) = 1/sqrt(gram(i, i))
      end do
      do i = 1, p
         gram(:, i) = factors*gram(:, i)*factors(i)
      end do
      if (p > 0) call dpstrf("L", p, gram, p, pivots, r, -1.0_wp, work, info)
      allocate (v(n, r))
      do i = 1, r
         v(:, i) = factors(pivots(i))*motions(:, pivots(i))
      end do
      if (r > 0) call dtrsm("R", "L", "T", "N", n, r, 1.0_wp, gram, p, v, n)
   end subroutine metric_basis

   !> Eigenpairs of C outside a given invariant subspace: with Q = [Q1, Q2] orthogonal, Q1 spanning it, Q^T C Q is block
   !> triangular.
   subroutine general_eigenpairs(operator, basis, dual, invariant, noise, pairs, error)
      class(real_operator_type), intent(inout) :: operator
      !> Dual bases B and D of a space that contains the range of C, D^T B = 1, order x k: the matrix of C is D^T C B.
      real(wp), contiguous, intent(in) :: basis(:, :), dual(:, :)
      type(invariant_type), intent(in) :: invariant
      !> Rounding level of couplings between copies of an eigenvalue, relative to it.
      real(wp), intent(in) :: noise
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      type(reflections_type) :: householder
      real(wp), allocatable :: w(:, :), h(:, :), u(:, :)
      integer :: n, k, s, l

      n = size(basis, 1)
      k = size(basis, 2)
      s = size(invariant%vectors, 2)
      l = k - s
      pairs%applications = l
      call factor(householder, matmul(transpose(dual), invariant%vectors), error)
      if (allocated(error)) return
      allocate (pairs%basis, source=basis)
      allocate (pairs%values(l), h(k, l), w(n, l))
      if (l == 0) return
      call householder%apply("R", "N", pairs%basis)
      call operator%apply(pairs%basis(:, s + 1:), w, error)
      if (allocated(error)) return
      call dgemm("T", "N", k, l, n, 1.0_wp, dual, n, w, n, 0.0_wp, h, k)
      call householder%apply("L", "T", h)
      call triangular_form(householder, h, invariant, noise, pairs, u, error)
      if (allocated(error)) return
      w = pairs%basis(:, s + 1:)
      call dgemm("N", "N", n, l, l, 1.0_wp, w, n, u, l, 0.0_wp, pairs%basis(:, s + 1:), n)
   end subroutine general_eigenpairs

   !> Eigenpairs of a complex C on states (x, v), x and v in the span of some motions, outside a given invariant subspace.
   subroutine complex_eigenpairs(operator, motions, invariant, noise, pairs, error)
      class(complex_operator_type), intent(inout) :: operator
      !> Orthonormal, n x p.
      real(wp), contiguous, intent(in) :: motions(:, :)
      type(invariant_type), intent(in) :: invariant
      real(wp), intent(in) :: noise
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: states(:, :), images(:, :), matrix(:, :)
      type(invariant_type) :: projected
      integer :: n, p

      n = size(motions, 1)
      p = size(motions, 2)
      allocate (states(2*n, 2*p), images(2*n, 2*p), source=(0.0_wp, 0.0_wp))
      states(:n, :p) = motions
      states(n + 1:, p + 1:) = motions
      if (p > 0) call operator%apply(states, images, error)
      if (allocated(error)) return
      allocate (matrix(2*p, 2*p))
      matrix(:p, :) = matmul(transpose(motions), images(:n, :))
      matrix(p + 1:, :) = matmul(transpose(motions), images(n + 1:, :))
      allocate (projected%vectors, source=matmul(transpose(real(states, wp)), invariant%vectors))
      projected%projected = invariant%projected
      call matrix_eigenpairs(matrix, projected, noise, pairs, error)
      if (allocated(error)) return
      pairs%applications = 2*p
      pairs%complex_basis = matmul(states, pairs%complex_basis)
   end subroutine complex_eigenpairs

   subroutine real_matrix_eigenpairs(matrix, invariant, noise, pairs, error)
      !> Square; deallocated.
      real(wp), allocatable, intent(inout) :: matrix(:, :)
      type(invariant_type), intent(in) :: invariant
      real(wp), intent(in) :: noise
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      type(reflections_type) :: householder
      real(wp), allocatable :: u(:, :)
      integer :: k, s, i

      k = size(matrix, 1)
      s = size(invariant%vectors, 2)
      allocate (pairs%values(k - s))
      call factor(householder, invariant%vectors, error)
      if (allocated(error)) return
      call householder%apply("R", "N", matrix)
      call householder%apply("L", "T", matrix)
      call triangular_form(householder, matrix(:, s + 1:), invariant, noise, pairs, u, error)
      if (allocated(error)) return
      call move_alloc(matrix, pairs%basis)
      pairs%basis = 0
      do i = 1, s
         pairs%basis(i, i) = 1
      end do
      pairs%basis(s + 1:, s + 1:) = u
      call householder%apply("L", "N", pairs%basis)
   end subroutine real_matrix_eigenpairs

   subroutine complex_matrix_eigenpairs(matrix, invariant, noise, pairs, error)
      !> Square; deallocated.
      complex(wp), allocatable, intent(inout) :: matrix(:, :)
      type(invariant_type), intent(in) :: invariant
      real(wp), intent(in) :: noise
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      type(reflections_type) :: householder
      complex(wp), allocatable :: t(:, :), u(:, :)
      integer :: k, s, i

      k = size(matrix, 1)
      s = size(invariant%vectors, 2)
      allocate (pairs%values(k - s), u(k - s, k - s))
      call factor(householder, invariant%vectors, error)
      if (allocated(error)) return
      call householder%apply_to_complex("R", "N", matrix)
      call householder%apply_to_complex("L", "T", matrix)
      allocate (t, source=matrix(s + 1:, s + 1:))
      call schur_form(t, u, pairs%values, error)
      if (allocated(error)) return
      pairs%noise = noise
      call move_alloc(matrix, pairs%complex_schur)
      associate (schur => pairs%complex_schur, triangle => householder%triangle, projected => invariant%projected)
         schur(:s, :s) = cmplx(similarity(triangle, real(projected, wp)), similarity(triangle, aimag(projected)), wp)
         schur(:s, s + 1:) = matmul(schur(:s, s + 1:), u)
         schur(s + 1:, :s) = 0
         schur(s + 1:, s + 1:) = t
      end associate
      allocate (pairs%complex_basis(k, k), source=(0.0_wp, 0.0_wp))
      do i = 1, s
         pairs%complex_basis(i, i) = 1
      end do
      pairs%complex_basis(s + 1:, s + 1:) = u
      call householder%apply_to_complex("L", "N", pairs%complex_basis)
   end subroutine complex_matrix_eigenpairs

   ! Schur form of [R T R^{-1}, H], and the Schur vectors of the block after the invariant subspace.
   subroutine triangular_form(householder, h, invariant, noise, pairs, u, error)
      type(reflections_type), intent(in) :: householder
      !> Q^T C Q2
      real(wp), intent(in) :: h(:, :)
      type(invariant_type), intent(in) :: invariant
      real(wp), intent(in) :: noise
      type(dense_eigenpairs_type), intent(inout) :: pairs
      real(wp), allocatable, intent(out) :: u(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: t(:, :)
      integer :: k, l, s

      k = size(h, 1)
      l = size(h, 2)
      s = k - l
      allocate (t, source=h(s + 1:, :))
      allocate (u(l, l), pairs%schur(k, k))
      call schur_form(t, u, pairs%values, error)
      if (allocated(error)) return
      pairs%noise = noise
      pairs%schur = 0
      pairs%schur(:s, :s) = similarity(householder%triangle, real(invariant%projected, wp))
      pairs%schur(:s, s + 1:) = matmul(h(:s, :), u)
      pairs%schur(s + 1:, s + 1:) = t
   end subroutine triangular_form

   ! QR factorisation of a few columns.
   subroutine factor(factors, columns, error)
      type(reflections_type), intent(out) :: factors
      real(wp), intent(in) :: columns(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: work(:)
      integer :: n, s, i, info
      integer, allocatable :: in_their_order(:)

      n = size(columns, 1)
      s = size(columns, 2)
      allocate (factors%vectors, source=columns)
      allocate (factors%tau(s), factors%triangle(s, s), work(block_size*(n + s + 3)))
      allocate (in_their_order(s), source=1)
      if (s > 0) call dgeqp3(n, s, factors%vectors, n, in_their_order, factors%tau, work, size(work), info)
      do i = 1, s
         factors%triangle(:i, i) = factors%vectors(:i, i)
         factors%triangle(i + 1:, i) = 0
      end do
      if (s > 0 .and. info /= 0) call new_error(error, error_library, "LAPACK could not make orthogonal factors")
   end subroutine factor

   ! C := op(Q) C or C op(Q).
   subroutine apply(self, side, trans, c)
      class(reflections_type), intent(in) :: self
      character, intent(in) :: side, trans
      real(wp), contiguous, intent(inout) :: c(:, :)
      real(wp), allocatable :: work(:)
      integer :: info

      if (size(self%tau) == 0 .or. size(c) == 0) return
      allocate (work(block_size*(maxval(shape(c)) + block_size + 1)))
      call dormqr(side, trans, size(c, 1), size(c, 2), size(self%tau), self%vectors, size(self%vectors, 1), self%tau, c, &
         size(c, 1), work, size(work), info)
   end subroutine apply

   subroutine apply_to_complex(self, side, trans, c)
      class(reflections_type), intent(in) :: self
      character, intent(in) :: side, trans
      complex(wp), intent(inout) :: c(:, :)
      real(wp), dimension(size(c, 1), size(c, 2)) :: re, im

      if (size(self%tau) == 0) return
      re = real(c, wp)
      im = aimag(c)
      call self%apply(side, trans, re)
      call self%apply(side, trans, im)
      c = cmplx(re, im, wp)
   end subroutine apply_to_complex

   ! R T R^{-1} of two triangular matrices.
   pure function similarity(r, t)
      real(wp), intent(in) :: r(:, :), t(:, :)
      real(wp), dimension(size(r, 1), size(r, 1)) :: similarity, x
      integer :: j

      do j = 1, size(r, 1)
         x(:, j) = (t(:, j) - matmul(x(:, :j - 1), r(:j - 1, j)))/r(j, j)
      end do
      similarity = matmul(r, x)
   end function similarity

   ! Rounding of the matrix by epsilon ||T||_F over the cosine of left and right eigenvectors (Golub, Van Loan, Matrix Computations,
   ! 2013, section 7.2.2); zero where LAPACK fails, or where there is no Schur form.
   function errors(self)
      class(dense_eigenpairs_type), intent(in) :: self
      real(wp) :: errors(size(self%values))
      real(wp), allocatable :: t(:, :), left(:, :), right(:, :), work(:), unused(:)
      logical, allocatable :: all_of_them(:)
      integer :: k, l, found, info, unused_too(1)

      errors = 0
      l = size(self%values)
      if (.not. allocated(self%schur) .or. l == 0) return
      k = size(self%schur, 1)
      allocate (t, source=self%schur(k - l + 1:, k - l + 1:))
      allocate (left(l, l), right(l, l), work(3*l), unused(l))
      allocate (all_of_them(l), source=.true.)
      call dtrevc("B", "A", all_of_them, l, t, l, left, l, right, l, l, found, work, info)
      if (info == 0) call dtrsna("E", "A", all_of_them, l, t, l, left, l, right, l, errors, unused, l, found, work, 1, unused_too, &
         info)
      ! The cosines are zero where eigenvectors are parallel.
      errors = merge(epsilon(1.0_wp)*norm2(t)/max(errors, epsilon(1.0_wp)**2), 0.0_wp, info == 0)
   end function errors

   function vectors(self, chosen)
      class(dense_eigenpairs_type), intent(in) :: self
      !> Their positions.
      integer, intent(in) :: chosen(:)
      complex(wp), allocatable :: vectors(:, :)
      real(wp), allocatable :: re(:, :), im(:, :)
      complex(wp), allocatable :: y(:, :)
      integer :: n, k, l, j

      l = size(chosen)
      if (allocated(self%complex_schur)) then
         call independent_eigenvectors(self%complex_schur, self%noise, size(self%complex_schur, 1) - size(self%values) + chosen, y)
         allocate (vectors, source=matmul(self%complex_basis, y))
         do j = 1, l
            vectors(:, j) = vectors(:, j)/norm2(abs(vectors(:, j)))
         end do
         return
      end if
      n = size(self%basis, 1)
      k = size(self%basis, 2)
      allocate (vectors(n, l), re(n, l), im(n, l))
      if (l == 0) return
      call independent_eigenvectors(self%schur, self%noise, k - size(self%values) + chosen, y)
      call dgemm("N", "N", n, l, k, 1.0_wp, self%basis, n, real(y, wp), k, 0.0_wp, re, n)
      call dgemm("N", "N", n, l, k, 1.0_wp, self%basis, n, aimag(y), k, 0.0_wp, im, n)
      do j = 1, l
         vectors(:, j) = cmplx(re(:, j), im(:, j), wp)/norm2([norm2(re(:, j)), norm2(im(:, j))])
      end do
   end function vectors

   function real_vectors(self, chosen) result(vectors)
      class(dense_eigenpairs_type), intent(in) :: self
      integer, intent(in) :: chosen(:)
      real(wp) :: vectors(size(self%basis, 1), size(chosen))
      integer :: j

      do j = 1, size(chosen)
         vectors(:, j) = self%basis(:, chosen(j))/norm2(self%basis(:, chosen(j)))
      end do
   end function real_vectors
end module kschur_dense_eigenpairs
