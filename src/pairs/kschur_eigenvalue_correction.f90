!> Correction of computed eigenvalues: by Rayleigh's functional, and to the real or imaginary axis where only rounding moved them
!> off it.
module kschur_eigenvalue_correction
   use kschur_backward_error, only: backward_errors, judge, least_bound, norms_of
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize, replace_pair
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: damping_none, modal_problem_type
   use kschur_products, only: multiply_pairs, pairs_at_once, products_type
   use kschur_residual_parts, only: residual_part, residual_parts
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_tolerances, only: accepted_backward_error, blurred_value, cancelled, correctable, real_tolerance, rounding_of_row, &
      spurious
   implicit none
   private
   public :: correct_eigenvalues

contains

   !> Corrects the eigenvalues of pairs, and computes their backward errors and bounds. Those of a symmetric problem become roots of
   !> Rayleigh's functional, whose error is the square of that of the shape and free of the rounding of the factored matrix. An
   !> eigenvalue is moved to an axis if the backward error there, with a real shape on the real axis, is no larger than rounding
   !> allows. A pair on the real axis that stands for itself and its conjugate is a double real eigenvalue, as at critical
   !> damping: its second copy is appended behind all others, as a list of pairs would have fewer modes than exist.
   subroutine correct_eigenvalues(problem, pairs, rigid, refined, errors, bounds, uncertainty)
      type(modal_problem_type), intent(in) :: problem
      !> Pairs of unit norm.
      type(eigenpairs_type), intent(inout) :: pairs
      !> Number of rigid motions and their decays, the last pairs: their eigenvalues are known and stay.
      integer, intent(in) :: rigid
      !> Whether eigenvalues are refined: they stay as they are, but for rounding off the real axis.
      logical, intent(in) :: refined
      !> Backward errors of the corrected pairs.
      real(wp), allocatable, intent(out) :: errors(:)
      !> The backward error times the condition number, as an absolute bound of the error (1/s); NaN where not known.
      real(wp), allocatable, intent(out) :: bounds(:)
      !> Estimates of the errors of the eigenvalues (1/s): these bounds, or where not known the lower limit of any bound.
      real(wp), allocatable, intent(out) :: uncertainty(:)
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      type(eigenpairs_type) :: copies, on_axis
      real(wp) :: norms(4)
      integer, allocatable :: double_real(:)
      integer :: first, last, j, k, l
      logical :: moved, multiplied

      k = size(pairs%lambda)
      transposed = transpose_csr(problem%constraints)
      norms = norms_of(problem)
      allocate (errors(k), bounds(k), uncertainty(k), source=0.0_wp)
      allocate (double_real(0))
      copies = chosen_pairs(pairs, spread(.false., 1, k))
      do first = 1, k, pairs_at_once(pairs)
         last = min(first + pairs_at_once(pairs) - 1, k)
         ! Exact zeros need no products.
         if (all([(j > k - rigid .and. .not. abs(pairs%lambda(j)) > 0, j=first, last)])) cycle
         call multiply_pairs(problem, transposed, pairs, first, last, problem%symmetric, products)
         multiplied = .true.
         do j = first, last
            l = j - first + 1
            moved = .false.
            if (j <= k - rigid .and. .not. refined) then
               ! The left vector is the conjugate of phi.
               if (problem%symmetric) call move_to_root(products%forms(:, l), pairs%lambda(j))
               if (problem%damping_kind == damping_none .and. .not. allocated(problem%loss)) &
                  call move_eigenvalue(problem, pairs, j, nearer_axis(pairs%lambda(j)), blurred_value)
               call move_to_real_axis(j)
            else if (j <= k - rigid .and. allocated(problem%loss)) then
               ! Rounding alone may put a real one below the axis, where it would be none.
               call move_eigenvalue(problem, pairs, j, cmplx(real(pairs%lambda(j), wp), 0, wp), rounding_of_row)
            end if
            if (pairs%paired(j) .and. .not. abs(aimag(pairs%lambda(j))) > 0) then
               double_real = [double_real, j]
               call append_pairs(copies, part_on_axis(pairs, j, imaginary=.true.))
            end if
            if (moved) call replace_pair(pairs, j, on_axis, 1)
            if (moved) call normalize(pairs, j)
            multiplied = multiplied .and. .not. moved
         end do
         if (.not. multiplied) call multiply_pairs(problem, transposed, pairs, first, last, problem%symmetric, products)
         do j = first, last
            l = j - first + 1
            call judge(problem%symmetric, norms, products, l, pairs%lambda(j), j > k - rigid, errors(j), bounds(j))
            uncertainty(j) = bounds(j)
            if (.not. bounds(j) >= 0) uncertainty(j) = least_bound(products, l, pairs%lambda(j), errors(j), norms)
         end do
      end do
      if (size(double_real) > 0) call append_copies()
      uncertainty = [uncertainty, uncertainty(double_real)]

   contains

      ! Moves the eigenvalue of pair j to the real axis if it is near, and if the real part of the shape, rotated to be as real as
      ! possible, has a residual there that is no larger than rounding allows. With losses the shape stays as it is.
      subroutine move_to_real_axis(j)
         integer, intent(in) :: j
         real(wp) :: limit

         associate (lambda => pairs%lambda(j))
            if (.not. abs(aimag(lambda)) > 0 .or. abs(aimag(lambda)) > blurred_value*abs(lambda)) return
            if (allocated(problem%loss)) then
               ! Losses take eigenvalues off the axis, and shapes of real ones need not be real.
               call move_eigenvalue(problem, pairs, j, cmplx(real(lambda, wp), 0, wp), real_tolerance)
               return
            end if
            on_axis = part_on_axis(pairs, j, imaginary=.false.)
            if (.not. norm2(on_axis%real_phi) > 0) return
            ! It is not normwise: a large force in one unit would hide imaginary parts in others.
            limit = residual_part(problem, pairs, j)
            ! A pair counts as two eigenvalues either way: an inaccurate one is left for polishing to decide.
            if (pairs%paired(j)) limit = min(limit, cancelled)
            moved = residual_part(problem, on_axis, 1) <= allowed_residual(limit)
            if (moved) lambda = on_axis%lambda(1)
         end associate
      end subroutine move_to_real_axis

      ! Appends the second copies of double real eigenvalues. Their shapes are the imaginary parts of the first ones or, if these
      ! are no eigenvectors, as of a defective eigenvalue, the first shapes again.
      subroutine append_copies()
         real(wp) :: copy_errors(size(double_real))
         integer :: i

         copy_errors = huge(1.0_wp)
         ! A real shape has no imaginary part.
         if (.not. pairs%is_real()) then
            copy_errors = backward_errors(problem, copies)
            where (residual_parts(problem, copies, copy_errors < 1) > spurious) copy_errors = 1
         end if
         do i = 1, size(double_real)
            associate (j => double_real(i))
               if (copy_errors(i) <= max(100*errors(j), accepted_backward_error)) cycle
               ! The imaginary part is no eigenvector: repeats the first shape.
               copy_errors(i) = errors(j)
               call replace_pair(copies, i, pairs, j)
            end associate
         end do
         errors = [errors, copy_errors]
         bounds = [bounds, bounds(double_real)]
         call append_pairs(pairs, copies)
      end subroutine append_copies
   end subroutine correct_eigenvalues

   ! Moves lambda to the nearest root of forms(1) lambda^2 + forms(2) lambda + forms(3), if that is a relative change of at most
   ! `correctable`.
   pure subroutine move_to_root(forms, lambda)
      complex(xp), intent(in) :: forms(3)
      complex(wp), intent(inout) :: lambda
      complex(xp) :: root, roots(2)
      integer :: nearest

      associate (k => forms(3), r => forms(2), m => forms(1))
         root = sqrt(r**2 - 4*m*k)
         if (real(root*conjg(r), xp) < 0) root = -root
         roots(1) = -(r + root)/2
         if (.not. min(abs(roots(1)), abs(m)) > 0) return
         roots = [roots(1)/m, k/roots(1)]
      end associate
      nearest = minloc(abs(roots - lambda), 1)
      if (abs(roots(nearest) - lambda) <= correctable*abs(lambda)) lambda = cmplx(roots(nearest), kind=wp)
   end subroutine move_to_root

   ! The nearest point of the two axes. The eigenvalues of an undamped symmetric problem lie there, as lambda^2 is real.
   pure complex(wp) function nearer_axis(lambda)
      complex(wp), intent(in) :: lambda

      nearer_axis = cmplx(0, aimag(lambda), wp)
      if (abs(aimag(lambda)) < abs(real(lambda, wp))) nearer_axis = cmplx(real(lambda, wp), 0, wp)
   end function nearer_axis

   ! Moves the eigenvalue of pair j, but not its shape, by a relative distance, if the residual there is no larger than rounding
   ! allows.
   subroutine move_eigenvalue(problem, pairs, j, lambda, distance)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: distance
      complex(wp) :: given
      real(wp) :: limit

      given = pairs%lambda(j)
      if (.not. abs(given - lambda) > 0 .or. abs(given - lambda) > distance*abs(given)) return
      limit = max(cancelled, allowed_residual(residual_part(problem, pairs, j)))
      pairs%lambda(j) = lambda
      if (.not. residual_part(problem, pairs, j) <= limit) pairs%lambda(j) = given
   end subroutine move_eigenvalue

   ! Pair j on the real axis: the real or the imaginary part, of unit norm, of its shape rotated to be as real as possible.
   function part_on_axis(pairs, j, imaginary) result(pair)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      logical, intent(in) :: imaginary
      type(eigenpairs_type) :: pair
      complex(wp) :: phi(pairs%rows()), phase
      real(wp) :: length

      phi = pairs%column(j)
      phase = sqrt(conjg(sum(phi**2)))
      phase = merge(phase/max(abs(phase), tiny(1.0_wp)), (1.0_wp, 0.0_wp), abs(phase) > 0)
      if (imaginary) phase = cmplx(aimag(phase), -real(phase, wp), wp)
      length = max(norm2(real(phase*phi, wp)), tiny(1.0_wp))
      allocate (pair%lambda(1), source=cmplx(real(pairs%lambda(j), wp), 0, wp))
      allocate (pair%real_phi, source=reshape(real(phase*phi, wp)/length, [size(phi), 1]))
      allocate (pair%xi, source=cmplx(real(phase*pairs%xi(:, j:j), wp)/length, 0, wp))
   end function part_on_axis

   ! The largest residual that counts as equal to a given one: rounding may increase it tenfold, or to 16 epsilon.
   elemental real(wp) function allowed_residual(error)
      real(wp), intent(in) :: error

      allowed_residual = max(10*error, 16*epsilon(1.0_wp))
   end function allowed_residual
end module kschur_eigenvalue_correction
