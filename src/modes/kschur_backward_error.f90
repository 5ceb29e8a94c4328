!> How well eigenpairs satisfy a modal problem. Residuals are summed in more than the working
!> precision: of a low mode of a stiff structure that leaves nothing but rounding.
module kschur_backward_error
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_tolerances, only: real_tolerance
   implicit none
   private
   public :: backward_errors, settle_pairs

   ! Rounding of the factored matrix moves eigenvalues by less than this, relative to their size.
   real(wp), parameter :: rounded = 1.0e-3_wp
   ! Further from an axis than this, relative to its size, an eigenvalue is not looked at.
   real(wp), parameter :: near = 1.0e-4_wp
   ! A discriminant below this, relative to its terms, is none.
   real(wp), parameter :: double_root = 8*epsilon(1.0_wp)
   ! The real part of a shape that was found roughly is polished afterwards.
   real(wp), parameter :: loose = 1.0e-8_wp

   ! M phi, R phi, K phi + Cq^T xi of a pair.
   type :: products_type
      complex(xp), allocatable :: mass(:), damping(:), rest(:)
      real(wp) :: size_of_phi = 0
   end type products_type

contains

   !> Backward error of each pair: the larger of the normwise residual
   !> ||P(lambda) phi + Cq^T xi|| / ((|lambda|^2 ||M|| + |lambda| ||R|| + ||K||) ||phi||)
   !> and the constraint violation ||Cq phi|| / (||Cq|| ||phi||), with
   !> 2-norms of vectors and infinity norms of the matrices as given.
   function backward_errors(problem, pairs) result(errors)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      real(wp) :: errors(size(pairs%lambda))
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      real(wp) :: norms(4)
      integer :: j

      transposed = transpose_csr(problem%constraints)
      norms = norms_of(problem)
      do j = 1, size(errors)
         call multiply_all(problem, transposed, pairs%phi(:, j), pairs%xi(:, j), products)
         errors(j) = max(residual_of(products, pairs%lambda(j), norms), violation_of(problem, pairs%phi(:, j), norms(4)))
      end do
   end function backward_errors

   !> Settles where eigenvalues are: those of a symmetric problem at the value of Rayleigh's functional, wrong by the
   !> square of the error of a shape and without the rounding of the factored matrix; on an axis where a shape that
   !> belongs there has no larger a backward error than rounding makes it. A pair on the real axis whose conjugate is
   !> another one is a double real eigenvalue: the second copy is put behind all others.
   subroutine settle_pairs(problem, pairs, known, errors, bounds)
      type(modal_problem_type), intent(in) :: problem
      !> Of unit norm.
      type(eigenpairs_type), intent(inout) :: pairs
      !> The last so many are known exactly.
      integer, intent(in) :: known
      !> Backward errors of the pairs as they are on return.
      real(wp), allocatable, intent(out) :: errors(:)
      !> The backward error times the condition number, as an absolute bound of the error (1/s); NaN where not known.
      real(wp), allocatable, intent(out) :: bounds(:)
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      type(eigenpairs_type) :: second
      complex(wp), allocatable :: shape(:), reaction(:)
      real(wp) :: norms(4), copy_error
      integer, allocatable :: doubled(:)
      logical :: undamped, copied
      integer :: j, n, m, k

      n = problem%unknowns()
      m = problem%multipliers()
      k = size(pairs%lambda)
      undamped = problem%damping%is_zero()
      transposed = transpose_csr(problem%constraints)
      norms = norms_of(problem)
      allocate (errors(k), bounds(k), doubled(0), shape(n), reaction(m))
      allocate (second%phi(n, 0), second%xi(m, 0), second%lambda(0))
      do j = 1, k
         associate (lambda => pairs%lambda(j), phi => pairs%phi(:, j), xi => pairs%xi(:, j))
            call multiply_all(problem, transposed, phi, xi, products)
            copied = .false.
            if (allocated(pairs%paired)) copied = pairs%paired(j)
            if (j <= k - known) then
               if (problem%symmetric) call correct(products, phi, lambda)
               if (undamped) call settle_undamped(products, norms, lambda)
            end if
            if (copied) shape = phi
            if (copied) reaction = xi
            if (abs(aimag(lambda)) > 0) call settle_real(problem%symmetric, norms, lambda, phi, xi, products, copied)
            copied = copied .and. .not. abs(aimag(lambda)) > 0
            errors(j) = max(residual_of(products, lambda, norms), violation_of(problem, phi, norms(4)))
            bounds(j) = ieee_value(1.0_wp, ieee_quiet_nan)
            if (.not. abs(lambda) > 0) then
               bounds(j) = 0
            else if (problem%symmetric) then
               bounds(j) = bound_of(products, phi, lambda, errors(j), norms)
            end if
            if (copied) then
               ! What the shape has beyond the first one; of a defective eigenvalue nothing.
               doubled = [doubled, j]
               call append_pairs(second, other_copy(lambda, shape, reaction))
            end if
         end associate
      end do
      if (size(doubled) == 0) return
      do j = 1, size(doubled)
         copy_error = maxval(backward_errors(problem, one_of(second, j)))
         ! The same shape again, if the other one is none.
         if (.not. copy_error <= max(100*errors(doubled(j)), 1.0e-12_wp)) then
            second%phi(:, j) = pairs%phi(:, doubled(j))
            second%xi(:, j) = pairs%xi(:, doubled(j))
            copy_error = errors(doubled(j))
         end if
         errors = [errors, copy_error]
         bounds = [bounds, bounds(doubled(j))]
      end do
      if (allocated(pairs%again)) second%again = pairs%again(doubled)
      call append_pairs(pairs, second)
   end subroutine settle_pairs

   function one_of(pairs, j) result(one)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      type(eigenpairs_type) :: one

      allocate (one%lambda, source=pairs%lambda(j:j))
      allocate (one%phi, source=pairs%phi(:, j:j))
      allocate (one%xi, source=pairs%xi(:, j:j))
   end function one_of

   ! The imaginary part of a shape that is as real as can be, of unit norm.
   function other_copy(lambda, shape, reaction) result(copy)
      complex(wp), intent(in) :: lambda, shape(:), reaction(:)
      type(eigenpairs_type) :: copy
      complex(wp) :: phase
      real(wp) :: length

      phase = real_phase(shape)
      length = max(norm2(aimag(phase*shape)), tiny(1.0_wp))
      allocate (copy%lambda(1), source=lambda)
      allocate (copy%phi(size(shape), 1), copy%xi(size(reaction), 1))
      copy%phi(:, 1) = aimag(phase*shape)/length
      copy%xi(:, 1) = aimag(phase*reaction)/length
   end function other_copy

   ! The root of phi^T P(lambda) phi = 0 that is next to lambda, where it is near. (phi^T: the left vector of a symmetric
   ! problem is the conjugate of phi.)
   pure subroutine correct(products, phi, lambda)
      type(products_type), intent(in) :: products
      complex(wp), intent(in) :: phi(:)
      complex(wp), intent(inout) :: lambda
      complex(xp) :: m, r, k, root, roots(2)
      integer :: next

      m = sum(phi*products%mass)
      r = sum(phi*products%damping)
      k = sum(phi*products%rest)
      root = sqrt(r**2 - 4*m*k)
      if (real(root*conjg(r), xp) < 0) root = -root
      roots(1) = -(r + root)/2
      if (.not. min(abs(roots(1)), abs(m)) > 0) return
      roots = [roots(1)/m, k/roots(1)]
      next = minloc(abs(roots - lambda), 1)
      if (abs(roots(next) - lambda) <= rounded*abs(lambda)) lambda = cmplx(roots(next), kind=wp)
   end subroutine correct

   ! lambda^2 is real, most often: on an axis, if it is there for rounding.
   subroutine settle_undamped(products, norms, lambda)
      type(products_type), intent(in) :: products
      real(wp), intent(in) :: norms(4)
      complex(wp), intent(inout) :: lambda
      complex(wp) :: place

      place = cmplx(0, aimag(lambda), wp)
      if (abs(aimag(lambda)) < abs(real(lambda, wp))) place = cmplx(real(lambda, wp), 0, wp)
      if (abs(lambda - place) > near*abs(lambda)) return
      if (abs(lambda - place) <= real_tolerance*abs(lambda) .or. &
         residual_of(products, place, norms) <= noise(residual_of(products, lambda, norms))) lambda = place
   end subroutine settle_undamped

   ! The real part of a shape, at the real part of its eigenvalue.
   subroutine settle_real(symmetric, norms, lambda, phi, xi, products, copied)
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: norms(4)
      complex(wp), intent(inout) :: lambda, phi(:), xi(:)
      type(products_type), intent(inout) :: products
      !> Whether the conjugate is another eigenvalue, so that there are two on the axis.
      logical, intent(in) :: copied
      type(products_type) :: turned
      complex(wp) :: phase, place
      real(wp) :: length, before
      real(xp) :: m, r, k, terms

      if (abs(aimag(lambda)) > near*abs(lambda)) return
      phase = real_phase(phi)
      length = norm2(real(phase*phi, wp))
      if (.not. length > 0) return
      turned%mass = cmplx(real(phase*products%mass, xp)/length, kind=xp)
      turned%damping = cmplx(real(phase*products%damping, xp)/length, kind=xp)
      turned%rest = cmplx(real(phase*products%rest, xp)/length, kind=xp)
      turned%size_of_phi = 1
      place = cmplx(real(lambda, wp), 0, wp)
      before = residual_of(products, lambda, norms)
      if (symmetric .and. copied) then
         ! u^T P(lambda) u has real roots, or a double one for rounding.
         m = sum(real(phase*phi, wp)/length*real(turned%mass, xp))
         r = sum(real(phase*phi, wp)/length*real(turned%damping, xp))
         k = sum(real(phase*phi, wp)/length*real(turned%rest, xp))
         terms = r**2 + 4*abs(m*k)
         if (.not. (r**2 - 4*m*k >= -double_root*terms)) return
         if (.not. residual_of(turned, place, norms) <= noise(sqrt(before))) return
      else if (copied .or. abs(aimag(lambda)) > real_tolerance*abs(lambda)) then
         if (.not. residual_of(turned, place, norms) <= noise(before)) return
      else
         if (.not. residual_of(turned, place, norms) <= max(loose, noise(before))) return
      end if
      lambda = place
      phi = real(phase*phi, wp)/length
      xi = real(phase*xi, wp)/length
      products = turned
   end subroutine settle_real

   ! What rounding may make of a backward error that another shape or place has.
   elemental real(wp) function noise(error)
      real(wp), intent(in) :: error

      noise = max(10*error, 16*epsilon(1.0_wp))
   end function noise

   ! The factor that makes a vector as real as can be.
   pure complex(wp) function real_phase(x) result(phase)
      complex(wp), intent(in) :: x(:)

      phase = sqrt(conjg(sum(x**2)))
      if (abs(phase) > 0) then
         phase = phase/abs(phase)
      else
         phase = 1
      end if
   end function real_phase

   ! The backward error r moves a root of phi^T P phi by about r/|slope|, at critical damping by sqrt(r/inertia).
   real(wp) function bound_of(products, phi, lambda, error, norms) result(bound)
      type(products_type), intent(in) :: products
      complex(wp), intent(in) :: phi(:), lambda
      real(wp), intent(in) :: error, norms(4)
      real(wp) :: slope, inertia, force

      slope = abs(cmplx(sum(phi*(2*cmplx(lambda, kind=xp)*products%mass + products%damping)), kind=wp))
      inertia = abs(cmplx(sum(phi*products%mass), kind=wp))
      force = max(error, epsilon(1.0_wp))*level_of(lambda, norms)*products%size_of_phi**2
      bound = ieee_value(1.0_wp, ieee_quiet_nan)
      if (slope + sqrt(inertia*force) > 0) bound = max(2*force/(slope + sqrt(slope**2 + 4*inertia*force)), &
         epsilon(1.0_wp)*abs(lambda))
   end function bound_of

   ! ||M||, ||R||, ||K||, ||Cq||.
   pure function norms_of(problem) result(norms)
      type(modal_problem_type), intent(in) :: problem
      real(wp) :: norms(4)

      norms = [problem%mass%infinity_norm(), problem%damping%infinity_norm(), problem%stiffness%infinity_norm(), &
         problem%constraints%infinity_norm()]
   end function norms_of

   pure real(wp) function level_of(lambda, norms) result(level)
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: norms(4)

      level = abs(lambda)**2*norms(1) + abs(lambda)*norms(2) + norms(3)
   end function level_of

   ! Without stiffness a zero eigenvalue has no level: its residual is exact or it is none.
   pure real(wp) function residual_of(products, lambda, norms) result(error)
      type(products_type), intent(in) :: products
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: norms(4)
      complex(xp) :: s
      real(wp) :: level
      integer :: i
      complex(wp) :: residual(size(products%mass))

      s = lambda
      do i = 1, size(residual)
         residual(i) = cmplx(s*(s*products%mass(i) + products%damping(i)) + products%rest(i), kind=wp)
      end do
      level = level_of(lambda, norms)*products%size_of_phi
      error = norm2([norm2(real(residual, wp)), norm2(aimag(residual))])
      if (level > 0) error = error/level
      if (.not. error >= 0) error = huge(1.0_wp)
   end function residual_of

   real(wp) function violation_of(problem, phi, norm) result(error)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: phi(:)
      real(wp), intent(in) :: norm
      complex(wp) :: violation(problem%multipliers())

      error = 0
      if (size(violation) == 0) return
      call multiply(problem%constraints, phi, violation)
      error = norm2(abs(violation))/(norm*norm2(abs(phi)))
      if (.not. error >= 0) error = huge(1.0_wp)
   end function violation_of

   pure subroutine multiply_all(problem, transposed, phi, xi, products)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      complex(wp), intent(in) :: phi(:), xi(:)
      type(products_type), intent(inout) :: products
      logical :: is_real
      integer :: i, n

      n = size(phi)
      if (.not. allocated(products%mass)) allocate (products%mass(n), products%damping(n), products%rest(n))
      is_real = all(.not. abs(aimag(phi)) > 0)
      do i = 1, n
         products%mass(i) = row_product(problem%mass, i, phi, is_real)
         products%damping(i) = row_product(problem%damping, i, phi, is_real)
         products%rest(i) = row_product(problem%stiffness, i, phi, is_real) + row_product(transposed, i, xi, .false.)
      end do
      products%size_of_phi = norm2([norm2(real(phi, wp)), norm2(aimag(phi))])
   end subroutine multiply_all

   pure subroutine multiply(matrix, x, y)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: x(:)
      complex(wp), intent(out) :: y(:)
      integer :: i

      do i = 1, size(y)
         y(i) = cmplx(row_product(matrix, i, x, .false.), kind=wp)
      end do
   end subroutine multiply

   ! Entry i of A x.
   pure complex(xp) function row_product(matrix, i, x, is_real) result(total)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i
      complex(wp), intent(in) :: x(:)
      !> Whether x has no imaginary part: that saves half of the work.
      logical, intent(in) :: is_real
      real(xp) :: re, im, entry
      integer :: k

      re = 0
      im = 0
      if (is_real) then
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            re = re + real(matrix%value(k), xp)*real(x(matrix%column(k)), wp)
         end do
         total = cmplx(re, im, xp)
         return
      end if
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
         entry = matrix%value(k)
         re = re + entry*real(x(matrix%column(k)), wp)
         im = im + entry*aimag(x(matrix%column(k)))
      end do
      total = cmplx(re, im, xp)
   end function row_product
end module kschur_backward_error
