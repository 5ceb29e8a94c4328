!> How well eigenpairs satisfy a modal problem, and where their eigenvalues are.
module kschur_backward_error
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: damping_none, modal_problem_type
   use kschur_products, only: multiply_pairs, pairs_at_once, products_type
   use kschur_residual_parts, only: residual_parts
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
   ! What is left of the terms of a residual where the pair is one for rounding.
   real(wp), parameter :: cancelled = 1.0e-6_wp

contains

   !> Backward error of each pair: the larger of the normwise residual
   !> ||P(lambda) phi + Cq^T xi|| / ((|lambda|^2 ||M|| + |lambda| ||R|| + ||K||) ||phi||)
   !> and the constraint violation ||Cq phi|| / (||Cq|| ||phi||), with
   !> 2-norms of vectors and infinity norms of the matrices as given.
   function backward_errors(problem, pairs) result(errors)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      real(wp) :: errors(size(pairs%lambda))
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      real(wp) :: norms(4)
      integer :: first, last, j

      transposed = transpose_csr(problem%constraints)
      norms = norms_of(problem)
      do first = 1, size(errors), pairs_at_once(pairs)
         last = min(first + pairs_at_once(pairs) - 1, size(errors))
         call multiply_pairs(problem, transposed, pairs, first, last, products)
         do j = first, last
            errors(j) = max(residual_of(products, j - first + 1, pairs%lambda(j), norms), &
               violation_of(products, j - first + 1, norms))
         end do
      end do
   end function backward_errors

   !> Settles where eigenvalues are: those of a symmetric problem at the value of Rayleigh's functional, wrong by the
   !> square of the error of a shape and without the rounding of the factored matrix; on an axis where a shape that
   !> belongs there has no larger a backward error than rounding makes it. A pair on the real axis whose conjugate is
   !> another one is a double real eigenvalue: the second copy is put behind all others.
   subroutine settle_pairs(problem, pairs, known, errors, bounds, uncertainty)
      type(modal_problem_type), intent(in) :: problem
      !> Of unit norm.
      type(eigenpairs_type), intent(inout) :: pairs
      !> The last so many are known exactly.
      integer, intent(in) :: known
      !> Backward errors of the pairs as they are on return.
      real(wp), allocatable, intent(out) :: errors(:)
      !> The backward error times the condition number, as an absolute bound of the error (1/s); NaN where not known.
      real(wp), allocatable, intent(out) :: bounds(:)
      !> How far eigenvalues may be off (1/s): these bounds, or where they are not known what no bound falls below.
      real(wp), allocatable, intent(out) :: uncertainty(:)
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      type(eigenpairs_type) :: copies
      complex(wp) :: factor
      real(wp) :: norms(4)
      integer, allocatable :: doubled(:)
      integer :: first, last, j, k, l

      k = size(pairs%lambda)
      transposed = transpose_csr(problem%constraints)
      norms = norms_of(problem)
      allocate (errors(k), bounds(k), uncertainty(k), doubled(0))
      copies = chosen_pairs(pairs, spread(.false., 1, k))
      do first = 1, k, pairs_at_once(pairs)
         last = min(first + pairs_at_once(pairs) - 1, k)
         call multiply_pairs(problem, transposed, pairs, first, last, products)
         do j = first, last
            l = j - first + 1
            if (j <= k - known) then
               call settle(problem, norms, products, l, pairs%lambda(j))
            else if (problem%symmetric .and. abs(pairs%lambda(j)) > 0) then
               ! A decay of a rigid motion, whose stiffness is rounding.
               call correct([products%forms(:2, l), cmplx(0, kind=xp)], pairs%lambda(j))
            end if
            call settle_real(problem%symmetric, norms, products, l, is_paired(pairs, j), pairs%lambda(j), factor)
            if (is_paired(pairs, j) .and. .not. abs(aimag(pairs%lambda(j))) > 0) then
               doubled = [doubled, j]
               call append_pairs(copies, other_copy(pairs, j))
            end if
            if (abs(factor) > 0) then
               call make_real(pairs, j, factor)
               call judge(problem%symmetric, norms, products%real_part(l, factor), 1, pairs%lambda(j), errors(j), bounds(j))
            else
               call judge(problem%symmetric, norms, products, l, pairs%lambda(j), errors(j), bounds(j))
            end if
            ! A rigid motion is taken as one: how fast it decays is known as well as M and R are, K has no part in it.
            if (j > k - known .and. bounds(j) > 0) bounds(j) = &
               bound_of(products, l, pairs%lambda(j), epsilon(1.0_wp), [norms(:2), 0.0_wp, norms(4)])
            uncertainty(j) = bounds(j)
            if (.not. bounds(j) >= 0) uncertainty(j) = least_bound(products, l, pairs%lambda(j), errors(j), norms)
         end do
      end do
      if (size(doubled) > 0) call append_copies(problem, doubled, copies, pairs, errors, bounds)
      uncertainty = [uncertainty, uncertainty(doubled)]
   end subroutine settle_pairs

   pure logical function is_paired(pairs, j)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j

      is_paired = .false.
      if (allocated(pairs%paired)) is_paired = pairs%paired(j)
   end function is_paired

   ! Puts pair j on the real axis, with the real part of a multiple of its shape.
   pure subroutine make_real(pairs, j, factor)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      complex(wp), intent(in) :: factor

      if (pairs%is_real()) then
         pairs%real_phi(:, j) = real(factor, wp)*pairs%real_phi(:, j)
      else
         pairs%phi(:, j) = real(factor*pairs%phi(:, j), wp)
      end if
      pairs%xi(:, j) = real(factor*pairs%xi(:, j), wp)
   end subroutine make_real

   subroutine judge(symmetric, norms, products, l, lambda, error, bound)
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: norms(4)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      real(wp), intent(out) :: error, bound

      error = max(residual_of(products, l, lambda, norms), violation_of(products, l, norms))
      bound = ieee_value(1.0_wp, ieee_quiet_nan)
      if (.not. abs(lambda) > 0) then
         bound = 0
      else if (symmetric) then
         bound = bound_of(products, l, lambda, error, norms)
      end if
   end subroutine judge

   ! A change of lambda by x changes the residual by no more than x ||P'(lambda) phi|| + x^2 ||M phi||.
   real(wp) function least_bound(products, l, lambda, error, norms) result(bound)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: error, norms(4)

      bound = positive_root(products%inertia(l), products%slope(l, lambda), &
         max(error, epsilon(1.0_wp))*level_of(lambda, norms)*products%length(l))
   end function least_bound

   ! The positive x with inertia x^2 + slope x = force; `huge` where there is none.
   pure real(wp) function positive_root(inertia, slope, force) result(x)
      real(wp), intent(in) :: inertia, slope, force

      x = huge(1.0_wp)
      if (slope + sqrt(inertia*force) > 0) x = 2*force/(slope + sqrt(slope**2 + 4*inertia*force))
   end function positive_root

   ! What the shapes of double real eigenvalues have beyond the first ones; of a defective eigenvalue nothing.
   subroutine append_copies(problem, doubled, copies, pairs, errors, bounds)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: doubled(:)
      type(eigenpairs_type), intent(inout) :: copies, pairs
      real(wp), allocatable, intent(inout) :: errors(:), bounds(:)
      real(wp) :: copy_errors(size(doubled))
      integer :: i

      copy_errors = backward_errors(problem, copies)
      if (allocated(pairs%weights)) copies%weights = pairs%weights
      where (residual_parts(problem, copies, copy_errors < 1) > cancelled) copy_errors = 1
      do i = 1, size(doubled)
         associate (j => doubled(i))
            if (copy_errors(i) <= max(100*errors(j), 1.0e-12_wp) .and. .not. pairs%is_real()) cycle
            ! The same shape again, if the other one is none.
            copy_errors(i) = errors(j)
            if (pairs%is_real()) then
               copies%real_phi(:, i) = pairs%real_phi(:, j)
            else
               copies%phi(:, i) = pairs%phi(:, j)
            end if
            copies%xi(:, i) = pairs%xi(:, j)
         end associate
      end do
      errors = [errors, copy_errors]
      bounds = [bounds, bounds(doubled)]
      if (allocated(pairs%again)) copies%again = pairs%again(doubled)
      call append_pairs(pairs, copies)
   end subroutine append_copies

   ! The imaginary part of a shape that is as real as can be, of unit norm; of a real one there is none.
   function other_copy(pairs, j) result(copy)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      type(eigenpairs_type) :: copy
      complex(wp) :: phase
      real(wp) :: length

      allocate (copy%lambda, source=pairs%lambda(j:j))
      allocate (copy%xi, source=pairs%xi(:, j:j))
      if (pairs%is_real()) then
         allocate (copy%real_phi, source=pairs%real_phi(:, j:j))
         return
      end if
      phase = real_phase(sum(pairs%phi(:, j)**2))
      allocate (copy%phi, source=cmplx(aimag(phase*pairs%phi(:, j:j)), kind=wp))
      length = max(norm2(real(copy%phi, wp)), tiny(1.0_wp))
      copy%phi = copy%phi/length
      copy%xi = aimag(phase*copy%xi)/length
   end function other_copy

   ! At the root of phi^T P(lambda) phi = 0 that is next to lambda, where it is near (phi^T: the left vector of a
   ! symmetric problem is the conjugate of phi); and without damping on an axis, if it is there for rounding.
   subroutine settle(problem, norms, products, l, lambda)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: norms(4)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(inout) :: lambda

      if (problem%symmetric) call correct(products%forms(:, l), lambda)
      if (problem%damping_kind == damping_none) call settle_undamped(products, l, norms, lambda)
   end subroutine settle

   pure subroutine correct(forms, lambda)
      complex(xp), intent(in) :: forms(3)
      complex(wp), intent(inout) :: lambda
      complex(xp) :: root, roots(2)
      integer :: next

      associate (k => forms(3), r => forms(2), m => forms(1))
         root = sqrt(r**2 - 4*m*k)
         if (real(root*conjg(r), xp) < 0) root = -root
         roots(1) = -(r + root)/2
         if (.not. min(abs(roots(1)), abs(m)) > 0) return
         roots = [roots(1)/m, k/roots(1)]
      end associate
      next = minloc(abs(roots - lambda), 1)
      if (abs(roots(next) - lambda) <= rounded*abs(lambda)) lambda = cmplx(roots(next), kind=wp)
   end subroutine correct

   ! lambda^2 is real, most often.
   subroutine settle_undamped(products, l, norms, lambda)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      real(wp), intent(in) :: norms(4)
      complex(wp), intent(inout) :: lambda
      complex(wp) :: place

      place = cmplx(0, aimag(lambda), wp)
      if (abs(aimag(lambda)) < abs(real(lambda, wp))) place = cmplx(real(lambda, wp), 0, wp)
      if (.not. abs(lambda - place) > 0 .or. abs(lambda - place) > near*abs(lambda)) return
      if (abs(lambda - place) <= real_tolerance*abs(lambda)) then
         lambda = place
      else if (residual_of(products, l, place, norms) <= noise(residual_of(products, l, lambda, norms))) then
         lambda = place
      end if
   end subroutine settle_undamped

   ! On the real axis, where the real part of a multiple of the shape belongs there.
   subroutine settle_real(symmetric, norms, products, l, paired, lambda, factor)
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: norms(4)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      !> Whether the conjugate is another eigenvalue, so that there are two on the axis.
      logical, intent(in) :: paired
      complex(wp), intent(inout) :: lambda
      !> Of the shape; zero where it stays as it is.
      complex(wp), intent(out) :: factor
      type(products_type) :: turned
      complex(wp) :: place, multiple
      real(wp) :: limit
      real(xp) :: forms(3), terms

      factor = 0
      if (.not. abs(aimag(lambda)) > 0 .or. abs(aimag(lambda)) > near*abs(lambda)) return
      multiple = real_phase(cmplx(products%square(l), kind=wp))
      turned = products%real_part(l, multiple)
      if (.not. turned%length(1) > 0) return
      multiple = multiple/turned%length(1)
      turned = products%real_part(l, multiple)
      place = cmplx(real(lambda, wp), 0, wp)
      limit = noise(residual_of(products, l, lambda, norms))
      if (symmetric .and. paired) then
         ! u^T P(lambda) u has real roots, or a double one for rounding.
         forms = real(turned%forms(:, 1), xp)
         terms = forms(2)**2 + 4*abs(forms(1)*forms(3))
         if (.not. (forms(2)**2 - 4*forms(1)*forms(3) >= -double_root*terms)) return
         limit = noise(sqrt(residual_of(products, l, lambda, norms)))
      else if (.not. paired .and. abs(aimag(lambda)) <= real_tolerance*abs(lambda)) then
         limit = max(loose, limit)
      end if
      if (.not. residual_of(turned, 1, place, norms) <= limit) return
      lambda = place
      factor = multiple
   end subroutine settle_real

   ! What rounding may make of a backward error that another shape or place has.
   elemental real(wp) function noise(error)
      real(wp), intent(in) :: error

      noise = max(10*error, 16*epsilon(1.0_wp))
   end function noise

   ! The factor that makes a vector x as real as can be.
   pure complex(wp) function real_phase(square) result(phase)
      !> x^T x.
      complex(wp), intent(in) :: square

      phase = sqrt(conjg(square))
      if (abs(phase) > 0) then
         phase = phase/abs(phase)
      else
         phase = 1
      end if
   end function real_phase

   ! The backward error r moves a root of phi^T P phi by about r/|slope|, at critical damping by sqrt(r/inertia).
   real(wp) function bound_of(products, l, lambda, error, norms) result(bound)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: error, norms(4)
      complex(xp) :: forms(3)
      real(wp) :: slope, inertia, force

      forms = products%forms(:, l)
      slope = abs(cmplx(2*cmplx(lambda, kind=xp)*forms(1) + forms(2), kind=wp))
      inertia = abs(cmplx(forms(1), kind=wp))
      force = max(error, epsilon(1.0_wp))*level_of(lambda, norms)*products%length(l)**2
      bound = ieee_value(1.0_wp, ieee_quiet_nan)
      if (slope + sqrt(inertia*force) > 0) bound = max(positive_root(inertia, slope, force), epsilon(1.0_wp)*abs(lambda))
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
   real(wp) function residual_of(products, l, lambda, norms) result(error)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: norms(4)
      real(wp) :: level

      level = level_of(lambda, norms)*products%length(l)
      error = products%residual(l, lambda)
      if (level > 0) error = error/level
      if (.not. error >= 0) error = huge(1.0_wp)
   end function residual_of

   pure real(wp) function violation_of(products, l, norms) result(error)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      real(wp), intent(in) :: norms(4)

      error = 0
      if (.not. norms(4) > 0) return
      error = products%violation(l)/(norms(4)*products%length(l))
      if (.not. error >= 0) error = huge(1.0_wp)
   end function violation_of
end module kschur_backward_error
