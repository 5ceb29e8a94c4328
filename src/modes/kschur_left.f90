!> Left eigenvectors of modes, psi^* P(lambda) + eta^* Cq = 0, Cq psi = 0, and the condition number of each eigenvalue.
!>
!> They are computed as the modes of the transposed problem, chi = conj(psi): eigenpairs of that are matched with the modes, and
!> polished in clusters where one is missing, or where copies of a multiple eigenvalue cannot be made biorthogonal.
module kschur_left
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use kschur_backward_error, only: backward_errors, effect_of_constraints, level_of, norms_of
   use kschur_effort, only: effort_type, for_left
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, normalize
   use kschur_entrywise_bound, only: entrywise_bound
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_modes, only: modes_type
   use kschur_polish, only: polished_type, polisher_type
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: above_all_rounding, blurred_value, rounding_of_sums, same_shape, same_value, split_by_rounding
   implicit none
   private
   public :: condition_number, find_left_pairs, is_nearly_defective, set_left_modes

   ! A left vector is accepted if its backward error at the eigenvalue of the mode is at most this multiple of that of the mode.
   real(wp), parameter :: accepted_ratio = 10

contains

   !> Finds for each eigenpair of the problem one of the transposed problem with the same eigenvalue: the nearest of the given ones
   !> or, if that is missing, inaccurate or not biorthogonal to the others of its cluster, a polished one. Missing ones are NaN.
   subroutine find_left_pairs(problem, transposed, found, pairs, errors, left, effort, error, polisher, complete)
      type(modal_problem_type), intent(in) :: problem
      !> The transposed problem; the problem itself if it is symmetric.
      type(modal_problem_type), intent(in) :: transposed
      !> Eigenpairs of the transposed problem, Im lambda >= 0.
      class(eigenpairs_type), intent(in) :: found
      !> Eigenpairs of the problem, complex.
      class(eigenpairs_type), intent(in) :: pairs
      !> Their backward errors.
      real(wp), intent(in) :: errors(:)
      !> The eigenpairs found, in the order of `pairs`.
      type(eigenpairs_type), intent(out) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      !> Polisher of the transposed problem. Absent: nothing is polished.
      type(polisher_type), optional, intent(inout) :: polisher
      !> Whether none is missing, and all clusters are biorthogonal.
      logical, optional, intent(out) :: complete
      type(cluster_type), allocatable :: clusters(:)
      real(wp), allocatable :: limits(:)
      logical, allocatable :: missing(:)
      logical :: coupled, all_found
      integer :: i, j

      call match_pairs(found, pairs, left)
      allocate (limits, source=max(above_all_rounding, accepted_ratio*errors))
      allocate (missing, source=backward_errors(transposed, left) > limits)
      do j = 1, size(missing)
         if (missing(j)) call set_missing(left, j)
      end do
      call split(pairs%lambda, same_value*abs(pairs%lambda), clusters, max_members=size(missing), &
         lossy=allocated(problem%loss))
      all_found = .true.
      do i = 1, size(clusters)
         associate (members => clusters(i)%members)
            call biorthogonalize(problem, transposed, pairs, limits, members, left, coupled)
            all_found = all_found .and. .not. (coupled .or. any(missing(members)))
            if (.not. present(polisher) .or. .not. (coupled .or. any(missing(members)))) cycle
            call polish_cluster(transposed, clusters(i), limits(members), polisher, left, effort, error)
            if (allocated(error)) return
            call biorthogonalize(problem, transposed, pairs, limits, members, left, coupled)
         end associate
      end do
      if (present(polisher)) call effort%add_solves(polisher%solver)
      if (present(complete)) complete = all_found
   end subroutine find_left_pairs

   !> Sets the left vectors, multipliers and condition numbers of modes, NaN for a mode without a left vector, and error bounds
   !> where there are none yet, or none that leaves a usable number.
   subroutine set_left_modes(problem, left, modes)
      type(modal_problem_type), intent(in) :: problem
      !> Eigenpairs of the transposed problem, one for each mode; normalized on return.
      type(eigenpairs_type), intent(inout) :: left
      class(modes_type), intent(inout) :: modes
      integer :: j

      call modes%make_complex()
      do j = 1, size(left%lambda)
         if (is_found(left, j)) then
            call normalize(left, j)
         else
            call set_missing(left, j)
         end if
      end do
      call set_conditions(problem, left, modes)
      modes%left_phi = conjg(left%phi)
      modes%left_xi = conjg(left%xi)
   end subroutine set_left_modes

   ! Matches each eigenpair with the nearest of the transposed problem that is not taken, within `same_value`; sets NaN if there is
   ! none.
   subroutine match_pairs(found, pairs, left)
      class(eigenpairs_type), intent(in) :: found, pairs
      type(eigenpairs_type), intent(out) :: left
      logical :: is_free(size(found%lambda))
      real(wp) :: distance(size(found%lambda))
      integer :: j, nearest

      is_free = .true.
      allocate (left%lambda, source=pairs%lambda)
      allocate (left%phi(found%rows(), size(left%lambda)), left%xi(size(found%xi, 1), size(left%lambda)))
      left%phi = ieee_value(1.0_wp, ieee_quiet_nan)
      left%xi = ieee_value(1.0_wp, ieee_quiet_nan)
      do j = 1, size(left%lambda)
         if (.not. any(is_free)) return
         distance = abs(found%lambda - left%lambda(j))
         nearest = minloc(distance, 1, is_free)
         if (distance(nearest) > same_value*abs(left%lambda(j))) cycle
         left%phi(:, j) = found%column(nearest)
         left%xi(:, j) = found%xi(:, nearest)
         is_free(nearest) = .false.
      end do
   end subroutine match_pairs

   ! Polishes the left vectors of a cluster. Those that do not reach their limit stay as they were, and all if the matrix is
   ! singular, the iteration does not converge, or the monitor cancels.
   subroutine polish_cluster(transposed, cluster, limits, polisher, left, effort, error)
      type(modal_problem_type), intent(in) :: transposed
      type(cluster_type), intent(in) :: cluster
      !> Limits of the backward errors of the members.
      real(wp), intent(in) :: limits(:)
      type(polisher_type), intent(inout) :: polisher
      type(eigenpairs_type), intent(inout) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      ! Random vectors beyond two for each member: these serve conjugates on the real axis, or Jordan chains.
      integer, parameter :: more_random = 4
      type(polished_type) :: polished
      type(eigenpairs_type) :: no_members
      complex(wp) :: shift
      integer :: j

      call polisher%factor_beside(transposed, cluster, shift, error)
      if (.not. allocated(error)) then
         call effort%add_factors(polisher%solver, for_left)
         no_members = chosen_pairs(left, spread(.false., 1, size(left%lambda)))
         call polisher%polish(transposed, cluster, shift, no_members, 0.0_wp, 2*size(limits) + more_random, polished, error, &
            left%lambda(cluster%members))
      end if
      if (allocated(error)) then
         if (any(error%code == [error_singular, error_convergence, error_cancelled])) deallocate (error)
         return
      end if
      do j = 1, size(polished%errors)
         if (polished%errors(j) > limits(j) .or. .not. any(abs(polished%pairs%phi(:, j)) > 0)) cycle
         left%phi(:, cluster%members(j)) = polished%pairs%phi(:, j)
         left%xi(:, cluster%members(j)) = polished%pairs%xi(:, j)
      end do
   end subroutine polish_cluster

   ! Makes the left vectors of a cluster biorthogonal to its modes, chi_i^T ((lambda_i + lambda_j) M + R) phi_j = 0 for i /= j,
   ! which holds by itself between different eigenvalues: multiplies them by G^{-T}, G with these entries. Leaves them if that makes
   ! them inaccurate, as for a defective eigenvalue or nearly parallel copies.
   subroutine biorthogonalize(problem, transposed, pairs, limits, members, left, coupled)
      type(modal_problem_type), intent(in) :: problem, transposed
      class(eigenpairs_type), intent(in) :: pairs
      real(wp), intent(in) :: limits(:)
      integer, intent(in) :: members(:)
      type(eigenpairs_type), intent(inout) :: left
      !> Whether they stay coupled.
      logical, intent(out) :: coupled
      type(eigenpairs_type) :: mixed
      complex(wp), allocatable :: product(:, :), gram(:, :), mixture(:, :)
      integer, allocatable :: group(:), pivots(:)
      logical :: chosen(size(limits))
      integer :: j, k, info

      chosen = .false.
      chosen(members) = [(is_found(left, members(j)), j=1, size(members))] .and. abs(left%lambda(members)) > 0
      allocate (group, source=pack([(j, j=1, size(chosen))], chosen))
      k = size(group)
      coupled = .false.
      if (k < 2) return
      mixed = chosen_pairs(left, chosen)
      allocate (product(size(mixed%phi, 1), 1), gram(k, k), pivots(k))
      allocate (mixture(k, k), source=(0.0_wp, 0.0_wp))
      do j = 1, k
         product = 0
         call problem%mass%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group(j):group(j)), product)
         gram(j, :) = (mixed%lambda + mixed%lambda(j))*matmul(product(:, 1), mixed%phi)
         product = 0
         call problem%damping%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group(j):group(j)), product)
         gram(j, :) = gram(j, :) + matmul(product(:, 1), mixed%phi)
         mixture(j, j) = 1
      end do
      call zgesv(k, k, gram, k, pivots, mixture, k, info)
      if (info == 0) then
         mixed%phi = matmul(mixed%phi, mixture)
         mixed%xi = matmul(mixed%xi, mixture)
         coupled = any(backward_errors(transposed, mixed) > limits(group))
      end if
      coupled = coupled .or. info /= 0
      if (coupled) return
      left%phi(:, group) = mixed%phi
      left%xi(:, group) = mixed%xi
   end subroutine biorthogonalize

   ! Sets the normwise relative condition numbers (Tisseur, Linear Algebra Appl. 309 (2000)), and error bounds where there are none
   ! yet, or none that leaves a usable number. A condition number is infinite for a zero eigenvalue, where it exceeds 1/epsilon, and
   ! for a numerically defective one, which rounding could merge with a neighbour of the same shape.
   subroutine set_conditions(problem, left, modes)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: left
      class(modes_type), intent(inout) :: modes
      type(csr_matrix_type) :: transposed
      integer :: j

      transposed = transpose_csr(problem%constraints)
      allocate (modes%condition(size(left%lambda)), source=ieee_value(1.0_wp, ieee_positive_inf))
      do j = 1, size(left%lambda)
         associate (lambda => left%lambda(j), phi => modes%phi(:, j), condition => modes%condition(j))
            if (.not. is_found(left, j)) condition = ieee_value(1.0_wp, ieee_quiet_nan)
            if (.not. (is_found(left, j) .and. abs(lambda) > 0)) cycle
            condition = condition_number(problem, lambda, left%phi(:, j), left%xi(:, j), phi, modes%xi(:, j))
            if (condition <= huge(condition)) then
               if (is_nearly_defective(modes%lambda, modes%phi, j, rounding_of_sums*condition*abs(lambda))) &
                  condition = ieee_value(1.0_wp, ieee_positive_inf)
            end if
            if (.not. modes%error_bound(j) < blurred_value*abs(lambda)) call set_bound(problem, transposed, left, modes, j)
         end associate
      end do
   end subroutine set_conditions

   ! Sets the smallest of three error bounds (1/s), that of the mode, backward error times condition number and that by entries, NaN
   ! where none holds; and as uncertainty the change that the residual asks for.
   subroutine set_bound(problem, transposed, left, modes, j)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      type(eigenpairs_type), intent(in) :: left
      class(modes_type), intent(inout) :: modes
      integer, intent(in) :: j
      real(wp) :: given, normwise, change

      given = modes%error_bound(j)
      associate (bound => modes%error_bound(j), lambda => left%lambda(j))
         call entrywise_bound(problem, transposed, lambda, left%phi(:, j), left%xi(:, j), modes%phi(:, j), modes%xi(:, j), &
            bound, change)
         if (bound >= 0) then
            if (is_nearly_defective(modes%lambda, modes%phi, j, rounding_of_sums/epsilon(1.0_wp)*bound)) &
               bound = ieee_value(1.0_wp, ieee_quiet_nan)
            ! What refinement led elsewhere stays unknown, unless the bound shows it.
            if (bound < abs(lambda) .or. modes%uncertainty(j) < huge(1.0_wp)) modes%uncertainty(j) = change
         end if
         if (modes%condition(j) <= huge(1.0_wp)) then
            normwise = modes%condition(j)*max(modes%backward_error(j), epsilon(1.0_wp))*abs(lambda)
            if (.not. bound <= normwise) bound = normwise
         end if
         ! A defective eigenvalue that rounding has split lies in the middle of as many as its chain is long, so many times further
         ! than the slope at one says.
         if (bound >= 0) bound = length_of_chain(bound/(epsilon(1.0_wp)*abs(lambda)))*bound
         if (given >= 0 .and. .not. bound <= given) bound = given
      end associate
   end subroutine set_bound

   ! Length k of the chain, if there is one, of an eigenvalue that rounding may change by this many epsilon, about
   ! epsilon^(1/k - 1); longer ones than the longest leave no digits.
   elemental real(wp) function length_of_chain(condition) result(length)
      real(wp), intent(in) :: condition
      real(wp), parameter :: longest = 10

      length = 1
      if (condition > split_by_rounding) &
         length = 1/(1 + log(min(condition, epsilon(1.0_wp)**(1/longest - 1)))/log(epsilon(1.0_wp)))
      length = min(real(ceiling(length), wp), longest)
   end function length_of_chain

   !> The relative condition number of an eigenvalue, normwise for M, R and K and entrywise for the constraints; infinite above
   !> 1/epsilon.
   function condition_number(problem, lambda, chi, eta, phi, xi) result(condition)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda
      !> Shapes of unit norm and their multipliers, of the transposed problem and of the problem itself.
      complex(wp), intent(in) :: chi(:), eta(:), phi(:), xi(:)
      real(wp) :: condition
      complex(wp) :: shape(size(phi), 1), derivative(size(phi), 1)
      real(wp) :: sensitivity, level

      shape(:, 1) = phi
      derivative = 0
      call problem%mass%add_product(2*lambda, shape, derivative)
      call problem%damping%add_product((1.0_wp, 0.0_wp), shape, derivative)
      sensitivity = abs(lambda)*abs(sum(chi*derivative(:, 1)))
      level = level_of(lambda, norms_of(problem)) + effect_of_constraints(problem%constraints, phi, xi, chi, eta)
      condition = ieee_value(1.0_wp, ieee_positive_inf)
      if (sensitivity > epsilon(1.0_wp)*level) condition = level/sensitivity
   end function condition_number

   !> Whether mode j is nearly defective: another eigenvalue, or its own conjugate, lies within a distance and has the same shape.
   pure logical function is_nearly_defective(lambda, phi, j, distance)
      !> Eigenvalues and their shapes, of unit norm.
      complex(wp), intent(in) :: lambda(:), phi(:, :)
      integer, intent(in) :: j
      !> Distance of eigenvalues (1/s).
      real(wp), intent(in) :: distance
      integer :: i

      is_nearly_defective = .true.
      do i = 1, size(lambda)
         if (i /= j .and. abs(lambda(i) - lambda(j)) <= distance) then
            if (1 - abs(dot_product(phi(:, i), phi(:, j)))**2 <= same_shape**2) return
         end if
      end do
      if (abs(aimag(lambda(j))) > 0 .and. 2*abs(aimag(lambda(j))) <= distance) then
         if (1 - abs(sum(phi(:, j)**2))**2 <= same_shape**2) return
      end if
      is_nearly_defective = .false.
   end function is_nearly_defective

   ! Whether the left vector j was found: it is not NaN.
   pure logical function is_found(left, j)
      type(eigenpairs_type), intent(in) :: left
      integer, intent(in) :: j

      is_found = sum(abs(left%phi(:, j))) >= 0
   end function is_found

   ! Marks the left vector j as missing, by NaN.
   pure subroutine set_missing(left, j)
      type(eigenpairs_type), intent(inout) :: left
      integer, intent(in) :: j

      left%phi(:, j) = ieee_value(1.0_wp, ieee_quiet_nan)
      left%xi(:, j) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine set_missing
end module kschur_left
