!> Backward errors of eigenpairs, and bounds of the errors of their eigenvalues.
module kschur_backward_error
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_penalties, only: damping_penalties, norm_without, row_sizes, row_sizes_type, stiffness_penalties
   use kschur_problem, only: modal_problem_type
   use kschur_products, only: multiply_pairs, pairs_at_once, pair_rows_type, products_type
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_tolerances, only: blurred_entry, rounding_of_row
   implicit none
   private
   public :: backward_errors, effect_of_constraints, judge, judge_as_given, least_bound, level_of, norms_of

contains

   !> Computes the backward error of each pair: the larger of the normwise residual
   !> ||P(lambda) phi + Cq^T xi|| / ((|lambda|^2 ||M|| + |lambda| ||R|| + ||K|| + ||H||) ||phi||) (Tisseur, Linear Algebra Appl. 309
   !> (2000)) and the constraint violation ||Cq phi|| / (||Cq|| ||phi||), with 2-norms of vectors and infinity norms of the matrices
   !> as given. Nearly dependent constraints have multipliers far larger than their sum of forces, whose rounding is no error of the
   !> pair: the denominator of the residual is at least `blurred_entry` times the norm of |xi_r| ||Cq_r||.
   function backward_errors(problem, pairs) result(errors)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      real(wp), dimension(size(pairs%lambda)) :: errors, bounds

      call judge_as_given(problem, pairs, spread(.false., 1, size(errors)), errors, bounds)
   end function backward_errors

   !> Computes the backward errors of pairs, and absolute bounds of the errors of their eigenvalues (1/s), NaN where not known.
   !> A few pairs at a time share the passes over the matrices.
   subroutine judge_as_given(problem, pairs, is_rigid, errors, bounds, rows)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      !> Which pairs are rigid motions, or their decays, from the examination.
      logical, intent(in) :: is_rigid(:)
      real(wp), intent(out) :: errors(:), bounds(:)
      !> Where the problem has the rows of this process only; absent: it has all.
      type(pair_rows_type), optional, intent(in) :: rows
      type(csr_matrix_type) :: transposed
      type(products_type) :: products
      real(wp) :: norms(4)
      integer :: first, last, j

      if (present(rows)) then
         transposed = rows%transposed
         norms = rows%norms
      else
         transposed = transpose_csr(problem%constraints)
         norms = norms_of(problem)
      end if
      do first = 1, size(errors), pairs_at_once(pairs)
         last = min(first + pairs_at_once(pairs) - 1, size(errors))
         call multiply_pairs(problem, transposed, pairs, first, last, .false., products, rows)
         do j = first, last
            call judge(problem%symmetric, norms, products, j - first + 1, pairs%lambda(j), is_rigid(j), errors(j), bounds(j))
         end do
      end do
   end subroutine judge_as_given

   !> Computes the backward error of one pair, and of a symmetric problem a bound of the error of its eigenvalue: backward error
   !> times condition number, from the products of the pair.
   subroutine judge(symmetric, norms, products, l, lambda, is_motion, error, bound)
      !> Symmetry of the problem, and its norms from `norms_of`.
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: norms(4)
      !> Products of a few pairs, and the position l of the pair among them.
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      !> Whether it is a rigid motion or its decay: the decay follows from M and R alone, so that rounding of K is no error of it.
      logical, intent(in) :: is_motion
      real(wp), intent(out) :: error
      !> An absolute bound of the error of lambda (1/s); NaN where not known.
      real(wp), intent(out) :: bound

      real(wp) :: residual, rounding, level, parts(2)

      residual = products%norm_of_forces(l, [lambda**2, lambda], 1.0_wp)
      level = max(level_of(lambda, norms)*products%length(l), blurred_entry*products%reaction(l))
      ! Without stiffness the level of a zero eigenvalue is 0.
      parts = [residual/merge(level, 1.0_wp, level > 0), 0.0_wp]
      if (norms(4) > 0) parts(2) = products%violation(l)/(norms(4)*products%length(l))
      error = huge(1.0_wp)
      if (all(parts >= 0)) error = maxval(parts)
      bound = ieee_value(1.0_wp, ieee_quiet_nan)
      if (.not. abs(lambda) > 0) then
         bound = 0
      else if (symmetric) then
         ! A decay has the errors of the null vector, too, and with constraints those of the reactions.
         rounding = epsilon(1.0_wp)
         if (is_motion) rounding = merge(2, 1, norms(4) > 0)*rounding_of_row
         rounding = rounding*products%length(l)*level_of(lambda, [norms(:2), merge(0.0_wp, norms(3), is_motion)])
         ! With constraints the reactions take part in the balance of M and R, so that its residual says nothing.
         if (is_motion) residual = merge(0.0_wp, products%norm_of_forces(l, [lambda**2, lambda], 0.0_wp), norms(4) > 0)
         bound = bound_of(max(residual, rounding)*products%length(l) + products%effect(l), rounding*products%length(l))
      end if

   contains

      ! Bounds the distance (1/s) of lambda from a root of phi^T P(lambda) phi, a quadratic with an error of at most `force`: about
      ! force/|slope|, up to twice that where both roots move towards each other, and sqrt(force/inertia) where they may have met,
      ! as at critical damping, where the rounding of the residual counts, too. NaN if there is no bound.
      real(wp) function bound_of(force, of_rounding) result(bound)
         real(wp), intent(in) :: force, of_rounding
         complex(xp) :: forms(3)
         real(wp) :: slope, inertia, gap

         forms = products%forms(:, l)
         slope = abs(cmplx(2*cmplx(lambda, kind=xp)*forms(1) + forms(2), kind=wp))
         inertia = abs(cmplx(forms(1), kind=wp))
         bound = ieee_value(1.0_wp, ieee_quiet_nan)
         if (.not. slope + sqrt(inertia*force) > 0) return
         gap = slope**2 - 4*inertia*(force + of_rounding)
         if (gap > 0) then
            bound = 2*force/(slope + sqrt(gap))
         else
            bound = sqrt((force + of_rounding)/inertia)
         end if
         bound = max(bound, epsilon(1.0_wp)*abs(lambda))
      end function bound_of
   end subroutine judge

   !> A lower limit (1/s) of any bound of the error of lambda: the smallest change x that explains the residual, as x changes it by
   !> at most x ||P'(lambda) phi|| + x^2 ||M phi||.
   real(wp) function least_bound(products, l, lambda, error, norms) result(bound)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: error, norms(4)
      complex(wp), parameter :: none = 0, one = 1

      bound = huge(1.0_wp)
      associate (inertia => products%norm_of_forces(l, [one, none], 0.0_wp), &
         slope => products%norm_of_forces(l, [2*lambda, one], 0.0_wp), &
         force => max(error, epsilon(1.0_wp))*level_of(lambda, norms)*products%length(l))
         if (slope + sqrt(inertia*force) > 0) bound = 2*force/(slope + sqrt(slope**2 + 4*inertia*force))
      end associate
   end function least_bound

   !> Sensitivity of an eigenvalue to relative changes of the entries of the constraints, times chi^T P'(lambda) phi: the sum of
   !> |Cq_rk| |xi_r chi_k + eta_r phi_k|.
   pure real(wp) function effect_of_constraints(constraints, phi, xi, chi, eta) result(effect)
      !> Cq
      type(csr_matrix_type), intent(in) :: constraints
      !> Shape and multipliers of a pair, and of that of the transposed problem.
      complex(wp), intent(in) :: phi(:), xi(:), chi(:), eta(:)
      integer :: k, r

      effect = 0
      do r = 1, constraints%rows
         do k = constraints%row_start(r), constraints%row_start(r + 1) - 1
            associate (column => constraints%column(k))
               effect = effect + abs(constraints%value(k))*abs(xi(r)*chi(column) + eta(r)*phi(column))
            end associate
         end do
      end do
   end function effect_of_constraints

   !> The infinity norms of M, R, K and Cq; those of R and K without rows of penalties; that of H is added to that of K.
   pure function norms_of(problem) result(norms)
      type(modal_problem_type), intent(in) :: problem
      real(wp) :: norms(4)
      type(row_sizes_type) :: mass, damping, stiffness
      logical, allocatable :: penalties(:)

      mass = row_sizes(problem%mass)
      damping = row_sizes(problem%damping)
      stiffness = row_sizes(problem%stiffness)
      allocate (penalties, source=stiffness_penalties(stiffness, mass))
      norms = [maxval([0.0_wp, mass%total]), norm_without(damping, damping_penalties(damping, stiffness, mass)), &
         norm_without(stiffness, penalties), problem%constraints%infinity_norm()]
      if (allocated(problem%loss)) norms(3) = norms(3) + norm_without(row_sizes(problem%loss), penalties)
   end function norms_of

   !> |lambda|^2 ||M|| + |lambda| ||R|| + ||K||, the denominator of normwise backward errors.
   pure real(wp) function level_of(lambda, norms) result(level)
      complex(wp), intent(in) :: lambda
      !> Norms of M, R and K.
      real(wp), intent(in) :: norms(:)

      level = abs(lambda)**2*norms(1) + abs(lambda)*norms(2) + norms(3)
   end function level_of
end module kschur_backward_error
