!> Left eigenvectors of modes, psi^* P(lambda) + eta^* Cq = 0, Cq psi = 0:
!> found ones are paired with the modes, missing ones computed by inverse
!> iteration; and the condition number of each eigenvalue.
!>
!> All is done with the modes of the transposed problem, chi = conj(psi).
module kschur_left
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use kschur_backward_error, only: backward_errors
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: eigenpairs_type, near, normalize
   use kschur_error, only: error_type, take_cancelled
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: zgesvd
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_modes, only: modes_type
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_saddle, only: saddle_blocks, saddle_structure
   use kschur_sparse, only: complex_combination, csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: cancelled, rounding_of_sums, same_shape, same_value
   implicit none
   private
   public :: condition_number, find_left_pairs, inverse_iteration_type, merges, set_left_modes

   ! A left vector is one when its residual at the eigenvalue of the mode is not this much worse than that of the mode itself.
   real(wp), parameter :: as_good = 10

   !> How left vectors are computed that were not found: a factorisation for each.
   type :: inverse_iteration_type
      !> A prototype, copies of which are used.
      class(complex_linear_solver_type), allocatable :: solver
      !> Factor of each constraint.
      real(wp), allocatable :: factors(:)
      !> A size of lambda (1/s), as the shift.
      real(wp) :: reference = 0
   end type inverse_iteration_type

contains

   !> Eigenpairs of the transposed problem, one for each of the problem and of its eigenvalue: those found that belong to
   !> them, or what inverse iteration makes. One that could not be found is NaN.
   subroutine find_left_pairs(problem, transposed, found, pairs, errors, left, effort, error, inverse)
      type(modal_problem_type), intent(in) :: problem
      !> The transposed problem; the problem itself if it is symmetric.
      type(modal_problem_type), intent(in) :: transposed
      !> Eigenpairs of the transposed problem, Im lambda >= 0.
      class(eigenpairs_type), intent(in) :: found
      !> Eigenpairs of the problem, complex.
      class(eigenpairs_type), intent(in) :: pairs
      !> Their backward errors.
      real(wp), intent(in) :: errors(:)
      type(eigenpairs_type), intent(out) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      !> With it what is not among them is computed.
      type(inverse_iteration_type), optional, intent(in) :: inverse
      type(eigenpairs_type) :: before
      real(wp), allocatable :: limits(:)
      logical, allocatable :: missing(:), coupled(:)
      integer :: j, k

      call match(found, pairs, left)
      k = size(left%lambda)
      allocate (limits(k), source=max(cancelled, as_good*errors))
      allocate (missing(k), source=backward_errors(transposed, left) > limits)
      if (present(inverse)) call compute(transposed, missing, inverse, left, effort, error)
      if (allocated(error)) return
      missing = backward_errors(transposed, left) > limits
      do j = 1, k
         if (missing(j)) call leave_out(left, j)
      end do
      allocate (coupled(k))
      call biorthogonalize(problem, transposed, pairs, limits, left, coupled)
      ! Copies that were found may be so nearly parallel that they cannot be told apart without loss.
      if (present(inverse) .and. any(coupled)) then
         before = left
         call compute(transposed, coupled, inverse, left, effort, error)
         if (allocated(error)) return
         missing = backward_errors(transposed, left) > limits
         do j = 1, k
            if (.not. (coupled(j) .and. missing(j))) cycle
            left%phi(:, j) = before%phi(:, j)
            left%xi(:, j) = before%xi(:, j)
         end do
         call biorthogonalize(problem, transposed, pairs, limits, left, coupled)
      end if
   end subroutine find_left_pairs

   !> Sets the left vectors and condition numbers of modes. A mode without a left vector has NaN.
   subroutine set_left_modes(problem, left, modes)
      type(modal_problem_type), intent(in) :: problem
      !> Of the transposed problem, one for each mode.
      type(eigenpairs_type), intent(inout) :: left
      class(modes_type), intent(inout) :: modes
      integer :: j

      call modes%make_complex()
      do j = 1, size(left%lambda)
         if (is_number(left, j)) then
            call normalize(left, j)
         else
            call leave_out(left, j)
         end if
      end do
      call set_conditions(problem, left, modes)
      modes%left_phi = conjg(left%phi)
      modes%left_xi = conjg(left%xi)
   end subroutine set_left_modes

   ! Left vectors of some modes by inverse iteration, those of equal eigenvalues together.
   subroutine compute(problem, chosen, inverse, left, effort, error)
      !> The transposed one.
      type(modal_problem_type), intent(in) :: problem
      logical, intent(in) :: chosen(:)
      type(inverse_iteration_type), intent(in) :: inverse
      type(eigenpairs_type), intent(inout) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      logical :: pending(size(chosen)), cancelled
      integer, allocatable :: group(:)
      integer :: i, j

      pending = chosen
      do j = 1, size(chosen)
         if (.not. pending(j)) cycle
         group = pack([(i, i=1, size(chosen))], pending .and. near(left%lambda, j, rounding_of_sums))
         call iterate_inversely(problem, group, inverse, left, effort, error)
         call take_cancelled(error, cancelled)
         if (allocated(error) .or. cancelled) return
         pending(group) = .false.
      end do
   end subroutine compute

   ! For each mode the nearest eigenpair that no other mode has taken, or NaN.
   subroutine match(found, pairs, left)
      class(eigenpairs_type), intent(in) :: found, pairs
      type(eigenpairs_type), intent(out) :: left
      logical :: free(size(found%lambda))
      real(wp) :: distance(size(found%lambda))
      integer :: j, nearest

      free = .true.
      allocate (left%lambda, source=pairs%lambda)
      allocate (left%phi(found%rows(), size(left%lambda)), left%xi(size(found%xi, 1), size(left%lambda)))
      left%phi = ieee_value(1.0_wp, ieee_quiet_nan)
      left%xi = ieee_value(1.0_wp, ieee_quiet_nan)
      do j = 1, size(left%lambda)
         if (.not. any(free)) return
         distance = abs(found%lambda - left%lambda(j))
         nearest = minloc(distance, 1, free)
         if (distance(nearest) > same_value*abs(left%lambda(j))) cycle
         left%phi(:, j) = found%column(nearest)
         left%xi(:, j) = found%xi(:, nearest)
         free(nearest) = .false.
      end do
   end subroutine match

   ! Inverse iteration for the null vectors of P at an eigenvalue that a group
   ! of modes shares: those of P chi = theta E chi with theta = 0, E a tiny
   ! random diagonal. Even a defective lambda makes a simple theta. Each random
   ! start gives another vector of a multiple eigenvalue.
   subroutine iterate_inversely(problem, group, inverse, left, effort, error)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: group(:)
      type(inverse_iteration_type), intent(in) :: inverse
      type(eigenpairs_type), intent(inout) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 5
      ! Part of the level of P: pivots must not count as zero.
      real(wp), parameter :: tiny_part = 1.0e-13_wp
      class(complex_linear_solver_type), allocatable :: solver
      type(csr_matrix_type) :: blocks(4)
      complex(wp), allocatable :: x(:, :)
      real(wp), allocatable :: random(:), e(:), factors(:)
      integer(long) :: state
      complex(wp) :: lambda
      real(wp) :: strength
      integer :: i, n, step

      n = problem%unknowns()
      lambda = left%lambda(group(1))
      allocate (factors, source=inverse%factors)
      allocate (random(n), e(n), x(n + size(factors), size(group)))
      state = 1
      call random_vector(state, e)
      strength = level(problem, lambda)
      if (.not. strength > 0) strength = level(problem, cmplx(inverse%reference, kind=wp))
      e = tiny_part*strength*sign(1 + abs(e), e)
      call saddle_blocks(problem, factors, blocks(:3), error)
      if (.not. allocated(error)) call new_csr_from_triplets(blocks(4), size(x, 1), size(x, 1), [(i, i=1, n)], &
         [(i, i=1, n)], e, error)
      if (allocated(error)) return
      allocate (solver, source=inverse%solver)
      call solver%factorize(complex_combination([lambda**2, lambda, (1.0_wp, 0.0_wp), (1.0_wp, 0.0_wp)], blocks), &
         saddle_structure(problem), error)
      if (allocated(error)) return

      do i = 1, size(group)
         call random_vector(state, random)
         x(:n, i) = random
      end do
      do step = 1, steps
         do i = 1, size(group)
            x(:n, i) = e*x(:n, i)/norm2(abs(x(:n, i)))
         end do
         x(n + 1:, :) = 0
         call solver%solve(x, error)
         if (allocated(error)) return
      end do
      do i = 1, size(group)
         left%phi(:, group(i)) = x(:n, i)/norm2(abs(x(:n, i)))
         left%xi(:, group(i)) = factors*x(n + 1:, i)/norm2(abs(x(:n, i)))
      end do
      call effort%add_factors(solver)
      call effort%add_solves(solver)
      effort%operator_applications = effort%operator_applications + steps*size(group)
   end subroutine iterate_inversely

   ! Within equal eigenvalues chi_i^T ((lambda_i + lambda_j) M + R) phi_j = 0 for
   ! i /= j, as between different ones; unit norm, the largest entry real and
   ! positive. Where that spoils the left vectors, as of a defective eigenvalue,
   ! they stay as they are.
   subroutine biorthogonalize(problem, transposed, pairs, limits, left, coupled)
      type(modal_problem_type), intent(in) :: problem, transposed
      class(eigenpairs_type), intent(in) :: pairs
      real(wp), intent(in) :: limits(:)
      type(eigenpairs_type), intent(inout) :: left
      !> Which stay as they are although they share an eigenvalue with others.
      logical, intent(out) :: coupled(:)
      type(eigenpairs_type) :: mixed
      logical :: pending(size(limits))
      complex(wp), allocatable :: mixture(:, :)
      integer, allocatable :: group(:)
      integer :: i, j

      coupled = .false.
      pending = abs(pairs%lambda) > 0 .and. [(is_number(left, j), j=1, size(limits))]
      do i = 1, size(limits)
         if (.not. pending(i)) cycle
         group = pack([(j, j=1, size(limits))], pending .and. near(left%lambda, i, same_value))
         pending(group) = .false.
         if (size(group) == 1) cycle
         call decouple(problem, pairs, left, group, mixture)
         if (.not. allocated(mixture)) cycle
         allocate (mixed%lambda(size(group)), source=left%lambda(group))
         allocate (mixed%phi(size(left%phi, 1), size(group)), source=matmul(left%phi(:, group), mixture))
         allocate (mixed%xi(size(left%xi, 1), size(group)), source=matmul(left%xi(:, group), mixture))
         if (all(backward_errors(transposed, mixed) <= limits(group))) then
            left%phi(:, group) = mixed%phi
            left%xi(:, group) = mixed%xi
         else
            coupled(group) = .true.
         end if
         deallocate (mixed%lambda, mixed%phi, mixed%xi)
      end do
      do j = 1, size(limits)
         if (is_number(left, j)) call normalize(left, j)
      end do
   end subroutine biorthogonalize

   ! The mixture of the left vectors of a group that makes
   ! G = chi_i^T ((lambda_i + lambda_j) M + R) phi_j the unit matrix: G^{-T}.
   ! Not allocated where G is singular.
   subroutine decouple(problem, pairs, left, group, mixture)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      type(eigenpairs_type), intent(in) :: left
      integer, intent(in) :: group(:)
      complex(wp), allocatable, intent(out) :: mixture(:, :)
      complex(wp) :: g(size(group), size(group)), u(size(group), size(group)), vt(size(group), size(group)), &
         work(8*size(group))
      real(wp) :: singular(size(group)), rwork(5*size(group))
      complex(wp), allocatable :: mass_phi(:, :), damping_phi(:, :)
      integer :: i, j, k, info

      k = size(group)
      allocate (mass_phi(size(left%phi, 1), k), damping_phi(size(left%phi, 1), k), source=(0.0_wp, 0.0_wp))
      call problem%mass%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group), mass_phi)
      call problem%damping%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group), damping_phi)
      do j = 1, k
         do i = 1, k
            g(i, j) = sum(left%phi(:, group(i))* &
               ((left%lambda(group(i)) + left%lambda(group(j)))*mass_phi(:, j) + damping_phi(:, j)))
         end do
      end do
      call zgesvd("A", "A", k, k, g, k, singular, u, k, vt, k, work, size(work), rwork, info)
      if (info /= 0) return
      if (.not. singular(k) > epsilon(1.0_wp)*singular(1)) return
      do j = 1, k
         u(:, j) = u(:, j)/singular(j)
      end do
      allocate (mixture, source=matmul(conjg(u), conjg(vt)))
   end subroutine decouple

   ! Normwise relative condition numbers (Tisseur 2000): infinite for a zero
   ! eigenvalue, for one that rounding could take anywhere, and for a defective
   ! one, that is where rounding could merge it with a neighbour of the same shape.
   subroutine set_conditions(problem, left, modes)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: left
      class(modes_type), intent(inout) :: modes
      integer :: j

      allocate (modes%condition(size(left%lambda)), source=ieee_value(1.0_wp, ieee_positive_inf))
      do j = 1, size(left%lambda)
         associate (lambda => left%lambda(j), phi => modes%phi(:, j), condition => modes%condition(j))
            if (.not. is_number(left, j)) condition = ieee_value(1.0_wp, ieee_quiet_nan)
            if (.not. (is_number(left, j) .and. abs(lambda) > 0)) cycle
            condition = condition_number(problem, lambda, left%phi(:, j), phi)
            if (condition > huge(condition)) cycle
            if (merges(modes%lambda, modes%phi, j, rounding_of_sums*condition*abs(lambda))) &
               condition = ieee_value(1.0_wp, ieee_positive_inf)
            if (condition <= huge(condition) .and. .not. modes%error_bound(j) >= 0) modes%error_bound(j) = &
               condition*max(modes%backward_error(j), epsilon(1.0_wp))*abs(lambda)
         end associate
      end do
   end subroutine set_conditions

   !> Normwise relative condition number of an eigenvalue; infinite where rounding could take it anywhere.
   function condition_number(problem, lambda, chi, phi) result(condition)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda
      !> Shapes of unit norm, of the transposed problem and of the problem itself.
      complex(wp), intent(in) :: chi(:), phi(:)
      real(wp) :: condition
      complex(wp) :: shape(size(phi), 1), derivative(size(phi), 1)
      real(wp) :: sensitivity

      shape(:, 1) = phi
      derivative = 0
      call problem%mass%add_product(2*lambda, shape, derivative)
      call problem%damping%add_product((1.0_wp, 0.0_wp), shape, derivative)
      sensitivity = abs(lambda)*abs(sum(chi*derivative(:, 1)))
      condition = ieee_value(1.0_wp, ieee_positive_inf)
      if (sensitivity > epsilon(1.0_wp)*level(problem, lambda)) condition = level(problem, lambda)/sensitivity
   end function condition_number

   !> Whether an eigenvalue within a distance of that of mode j has its shape.
   pure logical function merges(lambda, phi, j, distance)
      !> Eigenvalues and their shapes, of unit norm.
      complex(wp), intent(in) :: lambda(:), phi(:, :)
      integer, intent(in) :: j
      real(wp), intent(in) :: distance
      integer :: i

      merges = .true.
      do i = 1, size(lambda)
         if (i /= j .and. abs(lambda(i) - lambda(j)) <= distance) then
            if (1 - abs(dot_product(phi(:, i), phi(:, j)))**2 <= same_shape**2) return
         end if
      end do
      if (abs(aimag(lambda(j))) > 0 .and. 2*abs(aimag(lambda(j))) <= distance) then
         if (1 - abs(sum(phi(:, j)**2))**2 <= same_shape**2) return
      end if
      merges = .false.
   end function merges

   ! |lambda|^2 ||M|| + |lambda| ||R|| + ||K||, the measure of backward errors.
   pure real(wp) function level(problem, lambda)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda

      level = abs(lambda)**2*problem%mass%infinity_norm() + abs(lambda)*problem%damping%infinity_norm() &
         + problem%stiffness%infinity_norm()
   end function level

   pure logical function is_number(left, j)
      type(eigenpairs_type), intent(in) :: left
      integer, intent(in) :: j

      is_number = sum(abs(left%phi(:, j))) >= 0
   end function is_number

   pure subroutine leave_out(left, j)
      type(eigenpairs_type), intent(inout) :: left
      integer, intent(in) :: j

      left%phi(:, j) = ieee_value(1.0_wp, ieee_quiet_nan)
      left%xi(:, j) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine leave_out
end module kschur_left
