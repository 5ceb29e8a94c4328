!> Left eigenvectors of modes, psi^* P(lambda) + eta^* Cq = 0, Cq psi = 0, and the condition number of each eigenvalue.
!>
!> All is done with the modes of the transposed problem, chi = conj(psi): those that were found are paired with the modes; in a
!> cluster where one is missing, or where copies cannot be told apart, they are polished.
module kschur_left
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use kschur_backward_error, only: backward_errors, effect_of_constraints, level_of, norms_of
   use kschur_effort, only: effort_type, for_left
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, normalize
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_modes, only: modes_type
   use kschur_polish, only: polished_type, polisher_type
   use kschur_problem, only: modal_problem_type
   use kschur_split, only: cluster_type, split
   use kschur_tolerances, only: cancelled, rounding_of_sums, same_shape, same_value
   implicit none
   private
   public :: condition_number, find_left_pairs, merges, set_left_modes

   ! A left vector is one when its residual at the eigenvalue of the mode is not this much worse than that of the mode itself.
   real(wp), parameter :: as_good = 10

contains

   !> Eigenpairs of the transposed problem, one for each of the problem and of its eigenvalue: those found that belong to
   !> them, or polished ones. One that could not be found is NaN.
   subroutine find_left_pairs(problem, transposed, found, pairs, errors, left, effort, error, polisher)
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
      !> Of the transposed problem; absent: nothing is polished.
      type(polisher_type), optional, intent(inout) :: polisher
      type(cluster_type), allocatable :: clusters(:)
      real(wp), allocatable :: limits(:)
      logical, allocatable :: missing(:)
      logical :: coupled
      integer :: i, j

      call match(found, pairs, left)
      allocate (limits, source=max(cancelled, as_good*errors))
      allocate (missing, source=backward_errors(transposed, left) > limits)
      do j = 1, size(missing)
         if (missing(j)) call leave_out(left, j)
      end do
      call split(pairs%lambda, same_value*abs(pairs%lambda), clusters, max_members=size(missing))
      do i = 1, size(clusters)
         associate (members => clusters(i)%members)
            call decouple(problem, transposed, pairs, limits, members, left, coupled)
            if (.not. present(polisher) .or. .not. (coupled .or. any(missing(members)))) cycle
            call polish(transposed, clusters(i), limits(members), polisher, left, effort, error)
            if (allocated(error)) return
            call decouple(problem, transposed, pairs, limits, members, left, coupled)
         end associate
      end do
      if (present(polisher)) call effort%add_solves(polisher%solver)
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

   ! The left vectors of a cluster from factors beside it. What is not good enough, or cannot be factored, stays as it was.
   subroutine polish(transposed, cluster, limits, polisher, left, effort, error)
      type(modal_problem_type), intent(in) :: transposed
      type(cluster_type), intent(in) :: cluster
      !> Of the backward errors of the members.
      real(wp), intent(in) :: limits(:)
      type(polisher_type), intent(inout) :: polisher
      type(eigenpairs_type), intent(inout) :: left
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      ! Random vectors beside two for each: those of the conjugates on the real axis, or of the chains of zeros.
      integer, parameter :: guards = 4
      type(polished_type) :: polished
      type(eigenpairs_type) :: none
      complex(wp) :: shift
      integer :: j

      call polisher%factor_beside(transposed, cluster, shift, error)
      if (.not. allocated(error)) then
         call effort%add_factors(polisher%solver, for_left)
         none = chosen_pairs(left, spread(.false., 1, size(left%lambda)))
         call polisher%polish(transposed, cluster, shift, none, 0.0_wp, 2*size(limits) + guards, polished, error, &
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
   end subroutine polish

   ! Within a cluster chi_i^T ((lambda_i + lambda_j) M + R) phi_j = 0 for i /= j, as between other eigenvalues: with G of these
   ! entries, the left vectors times G^{-T}. Where that spoils them, as those of a defective eigenvalue or copies that are
   ! nearly parallel, they stay as they are.
   subroutine decouple(problem, transposed, pairs, limits, members, left, coupled)
      type(modal_problem_type), intent(in) :: problem, transposed
      class(eigenpairs_type), intent(in) :: pairs
      real(wp), intent(in) :: limits(:)
      integer, intent(in) :: members(:)
      type(eigenpairs_type), intent(inout) :: left
      !> Whether they do.
      logical, intent(out) :: coupled
      type(eigenpairs_type) :: mixed
      complex(wp), allocatable :: force(:, :), g(:, :), mixture(:, :)
      integer, allocatable :: group(:), pivots(:)
      logical :: chosen(size(limits))
      integer :: j, k, info

      chosen = .false.
      chosen(members) = [(is_number(left, members(j)), j=1, size(members))] .and. abs(left%lambda(members)) > 0
      allocate (group, source=pack([(j, j=1, size(chosen))], chosen))
      k = size(group)
      coupled = .false.
      if (k < 2) return
      mixed = chosen_pairs(left, chosen)
      allocate (force(size(mixed%phi, 1), 1), g(k, k), pivots(k))
      allocate (mixture(k, k), source=(0.0_wp, 0.0_wp))
      do j = 1, k
         force = 0
         call problem%mass%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group(j):group(j)), force)
         g(j, :) = (mixed%lambda + mixed%lambda(j))*matmul(force(:, 1), mixed%phi)
         force = 0
         call problem%damping%add_product((1.0_wp, 0.0_wp), pairs%phi(:, group(j):group(j)), force)
         g(j, :) = g(j, :) + matmul(force(:, 1), mixed%phi)
         mixture(j, j) = 1
      end do
      call zgesv(k, k, g, k, pivots, mixture, k, info)
      if (info == 0) then
         mixed%phi = matmul(mixed%phi, mixture)
         mixed%xi = matmul(mixed%xi, mixture)
         coupled = any(backward_errors(transposed, mixed) > limits(group))
      end if
      coupled = coupled .or. info /= 0
      if (coupled) return
      left%phi(:, group) = mixed%phi
      left%xi(:, group) = mixed%xi
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
            condition = condition_number(problem, lambda, left%phi(:, j), left%xi(:, j), phi, modes%xi(:, j))
            if (condition > huge(condition)) cycle
            if (merges(modes%lambda, modes%phi, j, rounding_of_sums*condition*abs(lambda))) &
               condition = ieee_value(1.0_wp, ieee_positive_inf)
            if (condition <= huge(condition) .and. .not. modes%error_bound(j) >= 0) modes%error_bound(j) = &
               condition*max(modes%backward_error(j), epsilon(1.0_wp))*abs(lambda)
         end associate
      end do
   end subroutine set_conditions

   !> Relative condition number of an eigenvalue, normwise of M, R and K and by entries of the constraints; infinite where
   !> rounding could take it anywhere.
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
