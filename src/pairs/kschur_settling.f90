!> Where the eigenvalues of eigenpairs are: at Rayleigh's functional, and on an axis where they belong there.
module kschur_settling
   use kschur_backward_error, only: backward_errors, judge, least_bound, norms_of
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: damping_none, modal_problem_type
   use kschur_products, only: multiply_pairs, pairs_at_once, products_type
   use kschur_residual_parts, only: residual_parts
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_tolerances, only: blurred_value, cancelled, correctable, dependent, real_tolerance, rounding_of_row, spurious
   implicit none
   private
   public :: settle_pairs

contains

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
      allocate (errors(k), bounds(k), uncertainty(k), source=0.0_wp)
      allocate (doubled(0))
      copies = chosen_pairs(pairs, spread(.false., 1, k))
      do first = 1, k, pairs_at_once(pairs)
         last = min(first + pairs_at_once(pairs) - 1, k)
         ! Nothing is asked of zeros that are known.
         if (all([(j > k - known .and. .not. abs(pairs%lambda(j)) > 0, j=first, last)])) cycle
         call multiply_pairs(problem, transposed, pairs, first, last, problem%symmetric, products)
         do j = first, last
            l = j - first + 1
            if (j <= k - known) then
               call settle(problem, pairs, j, products%forms(:, l))
            else if (problem%symmetric .and. is_rigid(products, l, pairs%lambda(j))) then
               ! Its stiffness is rounding.
               call correct([products%forms(:2, l), cmplx(0, kind=xp)], pairs%lambda(j))
            end if
            call settle_real(problem, pairs, j, products, l, factor)
            if (is_paired(pairs, j) .and. .not. abs(aimag(pairs%lambda(j))) > 0) then
               doubled = [doubled, j]
               call append_pairs(copies, other_copy(pairs, j))
            end if
            if (abs(factor) > 0) then
               call make_real(pairs, j, factor)
               call judge(problem%symmetric, norms, products%real_part(l, factor), 1, pairs%lambda(j), j > k - known, &
                  errors(j), bounds(j))
            else
               call judge(problem%symmetric, norms, products, l, pairs%lambda(j), j > k - known, errors(j), bounds(j))
            end if
            uncertainty(j) = bounds(j)
            if (.not. bounds(j) >= 0) uncertainty(j) = least_bound(products, l, pairs%lambda(j), errors(j), norms)
         end do
      end do
      if (size(doubled) > 0) call append_copies(problem, doubled, copies, pairs, errors, bounds)
      uncertainty = [uncertainty, uncertainty(doubled)]
   end subroutine settle_pairs

   ! Whether pair l is a rigid motion that decays by itself: damping and inertia hold each other everywhere.
   pure logical function is_rigid(products, l, lambda)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda

      associate (part => products%parts*(l - 1) + 1)
         associate (damping => products%damping(:, part), mass => products%mass(:, part))
            is_rigid = abs(lambda) > 0 .and. &
               maxval(abs(real(lambda, wp)*mass + damping)) <= dependent*maxval(abs(damping))
         end associate
      end associate
   end function is_rigid

   pure logical function is_paired(pairs, j)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j

      is_paired = .false.
      if (allocated(pairs%paired)) is_paired = pairs%paired(j)
   end function is_paired

   ! What the shapes of double real eigenvalues have beyond the first ones; of a defective eigenvalue nothing.
   subroutine append_copies(problem, doubled, copies, pairs, errors, bounds)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: doubled(:)
      type(eigenpairs_type), intent(inout) :: copies, pairs
      real(wp), allocatable, intent(inout) :: errors(:), bounds(:)
      real(wp) :: copy_errors(size(doubled))
      integer :: i

      copy_errors = backward_errors(problem, copies)
      where (residual_parts(problem, copies, copy_errors < 1) > spurious) copy_errors = 1
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
   subroutine settle(problem, pairs, j, forms)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      complex(xp), intent(in) :: forms(3)

      if (problem%symmetric) call correct(forms, pairs%lambda(j))
      if (problem%damping_kind == damping_none .and. .not. allocated(problem%loss)) call settle_undamped(problem, pairs, j)
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
      if (abs(roots(next) - lambda) <= correctable*abs(lambda)) lambda = cmplx(roots(next), kind=wp)
   end subroutine correct

   ! lambda^2 is real, most often.
   subroutine settle_undamped(problem, pairs, j)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      complex(wp) :: place

      associate (lambda => pairs%lambda(j))
         place = cmplx(0, aimag(lambda), wp)
         if (abs(aimag(lambda)) < abs(real(lambda, wp))) place = cmplx(real(lambda, wp), 0, wp)
         if (.not. abs(lambda - place) > 0 .or. abs(lambda - place) > blurred_value*abs(lambda)) return
         if (error_at(problem, pairs, j, place) <= max(cancelled, noise(error_at(problem, pairs, j, lambda)))) lambda = place
      end associate
   end subroutine settle_undamped

   ! On the real axis, where the real part of a multiple of the shape belongs there.
   subroutine settle_real(problem, pairs, j, products, l, factor)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      !> Those of pair j are at l.
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      !> Of the shape; zero where it stays as it is.
      complex(wp), intent(out) :: factor
      type(products_type) :: turned
      complex(wp) :: place, multiple
      real(wp) :: limit
      real(xp) :: forms(3), terms

      factor = 0
      associate (lambda => pairs%lambda(j))
         if (.not. abs(aimag(lambda)) > 0 .or. abs(aimag(lambda)) > blurred_value*abs(lambda)) return
         multiple = real_phase(cmplx(products%square(l), kind=wp))
         turned = products%real_part(l, multiple)
         if (.not. turned%length(1) > 0) return
         multiple = multiple/turned%length(1)
         place = cmplx(real(lambda, wp), 0, wp)
         limit = error_at(problem, pairs, j, lambda)
         if (problem%symmetric .and. is_paired(pairs, j)) then
            ! u^T P(lambda) u has real roots, or a double one for rounding.
            forms = real(turned%forms(:, 1), xp)
            terms = forms(2)**2 + 4*abs(forms(1)*forms(3))
            if (.not. (forms(2)**2 - 4*forms(1)*forms(3) >= -rounding_of_row*terms)) return
            limit = noise(sqrt(limit))
         else if (.not. is_paired(pairs, j) .and. abs(aimag(lambda)) <= real_tolerance*abs(lambda)) then
            limit = max(real_tolerance, noise(limit))
         else if (is_paired(pairs, j)) then
            ! Either way it stands for two: that what is known roughly is no pair is seen when it is polished.
            limit = noise(min(limit, cancelled))
         else
            limit = noise(limit)
         end if
         if (.not. error_at(problem, pairs, j, place, multiple) <= limit) return
         lambda = place
         factor = multiple
      end associate
   end subroutine settle_real

   ! What rounding may make of a backward error that another shape or place has.
   elemental real(wp) function noise(error)
      real(wp), intent(in) :: error

      noise = max(10*error, 16*epsilon(1.0_wp))
   end function noise

   ! The residual at another lambda, with the real part of a multiple of the shape. It does not depend on units: beside a
   ! force with a large one, imaginary parts that are none would be lost.
   real(wp) function error_at(problem, pairs, j, lambda, factor) result(error)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      complex(wp), intent(in) :: lambda
      complex(wp), optional, intent(in) :: factor
      type(eigenpairs_type) :: pair
      integer :: i

      pair = chosen_pairs(pairs, [(i == j, i=1, size(pairs%lambda))])
      pair%lambda = lambda
      if (present(factor)) call make_real(pair, 1, factor)
      error = sum(residual_parts(problem, pair, [.true.]))
   end function error_at

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
end module kschur_settling
