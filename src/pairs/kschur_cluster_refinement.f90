!> Refinement of the eigenpairs of one cluster by Newton's method with residuals in extended precision.
module kschur_cluster_refinement
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize
   use kschur_error, only: error_type
   use kschur_extended_residual, only: residual_of, violations_of
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv, zgesvd
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: independent_eigenvectors, schur_form
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, contraction, dependent, equal_value, known_well, no_correct_digits, real_tolerance, &
      rounding_of_row, slow_refinement
   implicit none
   private
   public :: refine_cluster

   ! An invariant pair: P(X, S) = M X S^2 + R X S + K X + Cq^T Xi = 0, Cq X = 0. Eigenvalues of S are eigenvalues of the problem.
   type :: invariant_pair_type
      complex(wp), allocatable :: x(:, :), xi(:, :), s(:, :)
      ! Whether the span contains the conjugates of its vectors: then X, Xi and S are real.
      logical :: real_basis = .false.
   end type invariant_pair_type

contains

   !> Refines the pairs of a cluster: one pair, copies of an eigenvalue, or eigenvalues too close to be refined one by one. Their
   !> shapes span an invariant pair (X, S), refined by the block Newton method (Kressner, Numer. Math. 114 (2009)), which needs no
   !> gap between its members. For one pair that is Newton's method for (phi, lambda) (Tisseur, SIAM J. Matrix Anal. Appl. 22
   !> (2001)).
   !> Shapes and eigenvalues are corrected together, as rounding of the shapes would limit the eigenvalues otherwise.
   subroutine refine_cluster(problem, transposed, on_axis, pairs, max_change, change, refined)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      !> Whether conjugates belong to the cluster: eigenvalues on or next to the real axis.
      logical, intent(in) :: on_axis
      !> Independent pairs with complex shapes of unit norm, one of each conjugate pair; unchanged without convergence.
      !> On return as many eigenvalues, the conjugates counted.
      type(eigenpairs_type), intent(inout) :: pairs
      !> Largest change of an eigenvalue (1/s): beyond it lies another one.
      real(wp), intent(in) :: max_change
      !> The last correction of an eigenvalue, relative to it. `huge`: convergence to others; 0 where the pairs are not independent,
      !> or the first matrix is singular.
      real(wp), intent(out) :: change
      !> Whether the iteration converged, and the pairs are replaced.
      logical, intent(out) :: refined
      integer, parameter :: steps = 10
      type(invariant_pair_type) :: pair
      type(eigenpairs_type) :: found
      complex(wp), allocatable :: dx(:, :), dxi(:, :), ds(:, :)
      real(wp) :: correction, last, next, of_values, unit, moved
      integer :: step
      logical :: done

      refined = .false.
      change = 0
      unit = maxval(abs(pairs%lambda))
      call begin_pair(pairs, on_axis, pair)
      call make_orthonormal(unit, pair, done)
      if (.not. done) return
      last = huge(1.0_wp)
      of_values = huge(1.0_wp)
      next = 0
      do step = 1, steps
         call find_correction(problem, transposed, unit, pair, dx, dxi, ds, done)
         ! Singular: it is one of several eigenvalues, and nothing speaks against it.
         if (.not. done .and. step == 1) return
         if (.not. done) exit
         next = maxval(abs(ds))/unit
         correction = max(next, norm2(abs(dx)))
         if (.not. correction <= slow_refinement*last) exit
         last = correction
         of_values = next
         pair%x = pair%x + dx
         pair%xi = pair%xi + dxi
         pair%s = pair%s + ds
         call make_orthonormal(unit, pair, done)
         if (.not. done) change = huge(1.0_wp)
         if (.not. done) return
         if (last <= epsilon(1.0_wp)) exit
      end do
      change = huge(1.0_wp)
      call split_pair(pair, found, done)
      if (.not. done) return
      moved = max(maxval([(minval(abs(pairs%lambda - found%lambda(step))), step=1, size(found%lambda))]), &
         maxval([(minval(abs(found%lambda - pairs%lambda(step))), step=1, size(pairs%lambda))]))
      if (moved > max_change) return
      ! Where copies are missing in the cluster shapes are not unique, and only the values converge.
      refined = last <= known_well .or. (last <= no_correct_digits .and. next <= equal_value)
      ! Without that, values that converge to others were no eigenvalues.
      if (refined .or. moved <= known_well*unit .or. unit*of_values > contraction*moved) change = of_values
      ! Two real eigenvalues do not become a pair, unless by rounding.
      if (size(found%lambda) < size(pairs%lambda)) call part_pairs(found)
      if (size(found%lambda) < size(pairs%lambda)) refined = .false.
      if (.not. refined) return
      ! Newton steps from an axis stay on it; what leads off it is rounding.
      if (.not. any(abs(real(pairs%lambda, wp)) > 0)) found%lambda = cmplx(0, aimag(found%lambda), wp)
      pairs = found
   end subroutine refine_cluster

   ! Makes an invariant pair of eigenpairs. Next to the real axis it is that of real and imaginary parts.
   subroutine begin_pair(pairs, on_axis, pair)
      type(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: on_axis
      type(invariant_pair_type), intent(out) :: pair
      integer :: j, k, members

      members = size(pairs%lambda)
      if (on_axis) members = members + count(abs(aimag(pairs%lambda)) > 0)
      pair%real_basis = on_axis
      allocate (pair%x(pairs%rows(), members), pair%xi(size(pairs%xi, 1), members))
      allocate (pair%s(members, members), source=(0.0_wp, 0.0_wp))
      k = 0
      do j = 1, size(pairs%lambda)
         k = k + 1
         associate (lambda => pairs%lambda(j), phi => pairs%phi(:, j), xi => pairs%xi(:, j))
            pair%x(:, k) = phi
            pair%xi(:, k) = xi
            pair%s(k, k) = lambda
            if (.not. on_axis) cycle
            pair%x(:, k) = real(phi, wp)
            pair%xi(:, k) = real(xi, wp)
            pair%s(k, k) = real(lambda, wp)
            if (.not. abs(aimag(lambda)) > 0) cycle
            k = k + 1
            pair%x(:, k) = aimag(phi)
            pair%xi(:, k) = aimag(xi)
            pair%s(k, k) = real(lambda, wp)
            pair%s(k, k - 1) = -aimag(lambda)
            pair%s(k - 1, k) = aimag(lambda)
         end associate
      end do
   end subroutine begin_pair

   ! Makes [X; X S/u] orthonormal, by a QR factorisation: X := X R^{-1}, S := R S R^{-1}.
   subroutine make_orthonormal(unit, pair, done)
      real(wp), intent(in) :: unit
      type(invariant_pair_type), intent(inout) :: pair
      !> Whether its columns are independent.
      logical, intent(out) :: done
      complex(wp) :: v(2*size(pair%x, 1), size(pair%x, 2)), factor
      real(wp) :: length
      integer :: n, i, j, k, pass

      n = size(pair%x, 1)
      v(:n, :) = pair%x
      v(n + 1:, :) = matmul(pair%x, pair%s)/unit
      do j = 1, size(v, 2)
         length = norm2(abs(v(:, j)))
         do pass = 1, 2
            do i = 1, j - 1
               factor = -dot_product(v(:, i), v(:, j))
               v(:, j) = v(:, j) + factor*v(:, i)
               call add_column(i, factor)
            end do
         end do
         done = norm2(abs(v(:, j))) > dependent*length
         if (.not. done) return
         length = norm2(abs(v(:, j)))
         v(:, j) = v(:, j)/length
         pair%x(:, j) = pair%x(:, j)/length
         pair%xi(:, j) = pair%xi(:, j)/length
         do k = 1, size(v, 2)
            pair%s(k, j) = pair%s(k, j)/length
         end do
         pair%s(j, :) = pair%s(j, :)*length
      end do

   contains

      ! Adds a multiple of column i to column j of the basis, and changes S to match.
      subroutine add_column(i, factor)
         integer, intent(in) :: i
         complex(wp), intent(in) :: factor

         pair%x(:, j) = pair%x(:, j) + factor*pair%x(:, i)
         pair%xi(:, j) = pair%xi(:, j) + factor*pair%xi(:, i)
         pair%s(:, j) = pair%s(:, j) + factor*pair%s(:, i)
         pair%s(i, :) = pair%s(i, :) - factor*pair%s(j, :)
      end subroutine add_column
   end subroutine make_orthonormal

   ! Computes a Newton correction of an invariant pair. In the basis in which S is triangular its columns follow one by one,
   !
   !     [P(t_jj) Cq^T M X (T + t_jj) + R X; Cq 0 0; V^* ...] [d x_j; d xi_j; d t_j] = -[P(X, T)_j + ...; Cq x_j; ...],
   !
   ! with terms of the columns before, and the last rows such that the correction is orthogonal to V = [X; X T/u].
   subroutine find_correction(problem, transposed, unit, pair, dx, dxi, ds, done)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: transposed
      real(wp), intent(in) :: unit
      type(invariant_pair_type), intent(in) :: pair
      complex(wp), allocatable, intent(out) :: dx(:, :), dxi(:, :), ds(:, :)
      logical, intent(out) :: done
      complex(wp), dimension(size(pair%s, 1), size(pair%s, 1)) :: t, q, square
      complex(wp) :: values(size(t, 1)), before(size(pair%x, 1), 1)
      complex(wp), dimension(size(pair%x, 1), size(pair%x, 2)) :: x, xt, mass_x, slope
      complex(wp) :: xi(size(pair%xi, 1), size(pair%xi, 2))
      complex(wp), allocatable :: a(:, :), rhs(:, :)
      type(error_type), allocatable :: error
      integer :: n, m, k, order, i, j

      n = size(x, 1)
      m = size(xi, 1)
      k = size(t, 1)
      order = n + m + k
      t = pair%s
      call schur_form(t, q, values, error)
      done = .not. allocated(error)
      if (.not. done) return
      do j = 1, k
         t(j + 1:, j) = 0
      end do
      square = matmul(t, t)
      x = matmul(pair%x, q)
      xi = matmul(pair%xi, q)
      xt = matmul(x, t)
      mass_x = 0
      call problem%mass%add_product((1.0_wp, 0.0_wp), x, mass_x)
      allocate (dx(n, k), dxi(m, k), ds(k, k), a(order, order), rhs(order, 1))
      do j = 1, k
         slope = matmul(mass_x, t) + t(j, j)*mass_x
         call problem%damping%add_product((1.0_wp, 0.0_wp), x, slope)
         a = 0
         a(:n + m, :n + m) = matrix_at(problem, t(j, j))
         a(:n, n + m + 1:) = slope
         a(n + m + 1:, :n) = conjg(transpose(x + conjg(t(j, j))/unit**2*xt))
         a(n + m + 1:, n + m + 1:) = matmul(conjg(transpose(xt)), x)/unit**2
         rhs(:n, 1) = -residual_of(problem, transposed, x, xi(:, j), t, j)
         rhs(n + 1:n + m, 1) = -violations_of(problem%constraints, x(:, j))
         rhs(n + m + 1:, 1) = 0
         if (j > 1) then
            before(:, 1) = matmul(dx(:, :j - 1), t(:j - 1, j))
            rhs(n + m + 1:, 1) = -matmul(conjg(transpose(xt)), before(:, 1))/unit**2
            call subtract_product(problem%damping, before(:, 1))
            call subtract_product(problem%mass, matmul(dx(:, :j - 1), square(:j - 1, j)))
            do i = 1, j - 1
               rhs(:n, 1) = rhs(:n, 1) - t(i, j)*matmul(mass_x, ds(:, i))
            end do
         end if
         call solve_scaled(x, xi, unit, a, rhs, done)
         if (.not. done) return
         dx(:, j) = rhs(:n, 1)
         dxi(:, j) = rhs(n + 1:n + m, 1)
         ds(:, j) = rhs(n + m + 1:, 1)
      end do
      dx = matmul(dx, conjg(transpose(q)))
      dxi = matmul(dxi, conjg(transpose(q)))
      ds = matmul(q, matmul(ds, conjg(transpose(q))))
      if (.not. pair%real_basis) return
      dx = real(dx, wp)
      dxi = real(dxi, wp)
      ds = real(ds, wp)

   contains

      subroutine subtract_product(matrix, vector)
         type(csr_matrix_type), intent(in) :: matrix
         complex(wp), intent(in) :: vector(:)
         complex(wp) :: factor(size(vector), 1), product(size(vector), 1)

         factor(:, 1) = vector
         product = 0
         call matrix%add_product((-1.0_wp, 0.0_wp), factor, product)
         rhs(:n, 1) = rhs(:n, 1) + product(:, 1)
      end subroutine subtract_product
   end subroutine find_correction

   ! [P(lambda) Cq^T; Cq 0].
   function matrix_at(problem, lambda) result(a)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda
      complex(wp) :: a(problem%unknowns() + problem%multipliers(), problem%unknowns() + problem%multipliers())
      integer :: n

      n = problem%unknowns()
      a = 0
      call add_entries(problem%mass, lambda**2, a(:n, :n))
      call add_entries(problem%damping, lambda, a(:n, :n))
      call add_entries(problem%stiffness, (1.0_wp, 0.0_wp), a(:n, :n))
      if (allocated(problem%loss)) call add_entries(problem%loss, (0.0_wp, 1.0_wp), a(:n, :n))
      call add_entries(problem%constraints, (1.0_wp, 0.0_wp), a(n + 1:, :n))
      a(:n, n + 1:) = transpose(a(n + 1:, :n))
   end function matrix_at

   ! Solves by LAPACK's zgesv, scaled such that the entries of the solution are of one size.
   subroutine solve_scaled(x, xi, unit, a, rhs, done)
      complex(wp), intent(in) :: x(:, :), xi(:, :)
      real(wp), intent(in) :: unit
      !> The matrix, destroyed, and the right-hand side, replaced by the solution.
      complex(wp), intent(inout) :: a(:, :), rhs(:, :)
      logical, intent(out) :: done
      real(wp) :: columns(size(a, 1)), rows(size(a, 1))
      integer :: pivots(size(a, 1)), order, i, info

      order = size(a, 1)
      columns = [powers_of_two(maxval(abs(x), 2)), powers_of_two(maxval(abs(xi), 2)), powers_of_two(spread(unit, 1, size(x, 2)))]
      do i = 1, order
         a(:, i) = a(:, i)*columns(i)
      end do
      rows = [(1/powers_of_two([maxval(abs(a(i, :)))]), i=1, order)]
      rhs(:, 1) = rows*rhs(:, 1)
      do i = 1, order
         a(:, i) = rows*a(:, i)
      end do
      call zgesv(order, 1, a, order, pivots, rhs, order, info)
      done = info == 0
      rhs(:, 1) = columns*rhs(:, 1)
   end subroutine solve_scaled

   ! Splits an invariant pair into eigenpairs, one of each conjugate pair of a real one.
   subroutine split_pair(pair, pairs, done)
      type(invariant_pair_type), intent(in) :: pair
      type(eigenpairs_type), intent(out) :: pairs
      logical, intent(out) :: done
      complex(wp), dimension(size(pair%s, 1), size(pair%s, 1)) :: t, q
      real(wp), dimension(size(pair%s, 1), size(pair%s, 1)) :: real_t, real_q
      complex(wp) :: values(size(pair%s, 1)), mean
      complex(wp), allocatable :: y(:, :)
      type(error_type), allocatable :: error
      integer, allocatable :: chosen(:)
      integer :: i, k
      logical :: one_value

      k = size(values)
      t = pair%s
      mean = sum([(t(i, i), i=1, k)])/k
      do i = 1, k
         t(i, i) = t(i, i) - mean
      end do
      call nilpotent_form(t, q, rounding_of_row*maxval([abs(mean), abs(t)]), one_value)
      if (one_value) then
         values = mean
         real_q = real(q, wp)
         do i = 1, k
            t(i, i) = mean
         end do
      else
         t = pair%s
      end if
      if (pair%real_basis) then
         real_t = real(t, wp)
         if (.not. one_value) call schur_form(real_t, real_q, values, error)
         chosen = pack([(i, i=1, k)], aimag(values) >= 0)
         if (.not. allocated(error)) call independent_eigenvectors(real_t, cancelled, chosen, y)
         q = real_q
      else
         if (.not. one_value) call schur_form(t, q, values, error)
         chosen = [(i, i=1, k)]
         if (.not. allocated(error)) call independent_eigenvectors(t, cancelled, chosen, y)
      end if
      done = .not. allocated(error)
      if (.not. done) return
      y = matmul(q, y)
      pairs%lambda = values(chosen)
      pairs%phi = matmul(pair%x, y)
      pairs%xi = matmul(pair%xi, y)
   end subroutine split_pair

   ! Transforms a matrix that is nilpotent but for rounding to strictly triangular form: copies of an eigenvalue, and
   ! chains of a defective one, which a Schur form splits by a root of the rounding. Null vectors come first, then those of what
   ! remains, as in a staircase (Kublanovskaya, USSR Comput. Math. Math. Phys. 6 (1966)).
   subroutine nilpotent_form(t, q, rounding, done)
      !> The matrix, replaced by Q^* T Q, strictly upper triangular.
      complex(wp), intent(inout) :: t(:, :)
      !> Unitary.
      complex(wp), intent(out) :: q(:, :)
      !> Singular values below this are zero.
      real(wp), intent(in) :: rounding
      !> False where it is not nilpotent.
      logical, intent(out) :: done
      complex(wp), allocatable :: block(:, :), v(:, :), vectors(:, :), work(:)
      complex(wp) :: no_u(1, 1)
      real(wp) :: singular(size(t, 1)), rwork(5*size(t, 1))
      integer :: k, first, order, null, info, i

      k = size(t, 1)
      q = 0
      do i = 1, k
         q(i, i) = 1
      end do
      allocate (work(10*k + 1))
      first = 1
      done = .true.
      do while (first <= k)
         order = k - first + 1
         ! OpenBLAS reads a few entries beyond the end.
         allocate (block(order, order + 1), v(order, order + 1), source=(0.0_wp, 0.0_wp))
         block(:, :order) = t(first:, first:)
         call zgesvd("N", "A", order, order, block, order, singular, no_u, 1, v, order, work, size(work), rwork, info)
         null = count(singular(:order) <= rounding)
         done = info == 0 .and. null > 0
         if (.not. done) return
         vectors = conjg(transpose(cshift(v(:, :order), -null, 1)))
         t(:, first:) = matmul(t(:, first:), vectors)
         t(first:, first:) = matmul(conjg(transpose(vectors)), t(first:, first:))
         q(:, first:) = matmul(q(:, first:), vectors)
         t(first:, first:first + null - 1) = 0
         first = first + null
         deallocate (block, v)
      end do
   end subroutine nilpotent_form

   ! Makes two real eigenvalues of each pair that rounding took off the real axis: they have one invariant subspace.
   subroutine part_pairs(pairs)
      type(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type) :: second
      integer :: j

      associate (parted => aimag(pairs%lambda) > 0 .and. aimag(pairs%lambda) <= real_tolerance*abs(pairs%lambda))
         second = chosen_pairs(pairs, parted)
         second%lambda = real(second%lambda, wp)
         second%phi = aimag(second%phi)
         second%xi = aimag(second%xi)
         do j = 1, size(parted)
            if (.not. parted(j)) cycle
            pairs%phi(:, j) = real(pairs%phi(:, j), wp)
            pairs%xi(:, j) = real(pairs%xi(:, j), wp)
         end do
         where (parted) pairs%lambda = real(pairs%lambda, wp)
      end associate
      call append_pairs(pairs, second)
      do j = 1, size(pairs%lambda)
         call normalize(pairs, j)
      end do
   end subroutine part_pairs

   ! Scale factors of nonnegative sizes: the next greater power of two of each, where sizes below epsilon times the largest are
   ! raised to that; all 1 if all sizes are zero.
   pure function powers_of_two(sizes) result(units)
      real(wp), intent(in) :: sizes(:)
      real(wp) :: units(size(sizes))

      units = 1
      if (size(sizes) == 0) return
      if (maxval(sizes) > 0) units = scale(1.0_wp, exponent(max(sizes, epsilon(1.0_wp)*maxval(sizes))))
   end function powers_of_two

   ! Adds factor times a sparse matrix to a dense one.
   pure subroutine add_entries(matrix, factor, dense)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: factor
      complex(wp), intent(inout) :: dense(:, :)
      integer :: i, k

      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (entry => dense(i, matrix%column(k)))
               entry = entry + factor*matrix%value(k)
            end associate
         end do
      end do
   end subroutine add_entries
end module kschur_cluster_refinement
