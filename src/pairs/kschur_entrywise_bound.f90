!> Bounds of errors of eigenvalues, entry by entry.
module kschur_entrywise_bound
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_backward_error, only: effect_of_constraints
   use kschur_extended_residual, only: residual_of, violations_of
   use kschur_kinds, only: wp, xp
   use kschur_magnitudes, only: add_magnitudes, terms_of
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: entrywise_bound

contains

   !> Bounds the error of lambda (1/s) to first order: the residual, weighed by the left vector entry by entry, that of the left
   !> vector, weighed by the shape, and rounding of each entry of the matrices. Units of rows and columns do not change it; norms of
   !> unevenly scaled matrices say little (Higham, Higham, SIAM J. Matrix Anal. Appl. 20 (1998)). NaN where |chi^T P'(lambda) phi|
   !> is rounding.
   subroutine entrywise_bound(problem, transposed, lambda, chi, eta, phi, xi, bound, change)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      complex(wp), intent(in) :: lambda
      !> Shape and multipliers of the transposed problem, and of the problem itself.
      complex(wp), intent(in) :: chi(:), eta(:), phi(:), xi(:)
      real(wp), intent(out) :: bound
      !> The error of lambda for the matrices as they are, estimated to first order.
      real(wp), intent(out) :: change
      complex(wp), dimension(size(phi), 1) :: shape, slope
      real(wp), dimension(size(phi), 1) :: inertia, damping, stiffness
      complex(wp) :: forces(size(phi)), violations(size(eta))
      complex(xp) :: motion(size(phi)), factor
      real(wp) :: sensitivity, rounding

      shape(:, 1) = phi
      slope = 0
      call problem%mass%add_product(2*lambda, shape, slope)
      call problem%damping%add_product((1.0_wp, 0.0_wp), shape, slope)
      sensitivity = abs(sum(chi*slope(:, 1)))
      inertia = terms_of(problem%mass, abs(shape))
      damping = terms_of(problem%damping, abs(shape))
      stiffness = terms_of(problem%stiffness, abs(shape))
      if (allocated(problem%loss)) call add_magnitudes(problem%loss, abs(shape), stiffness)
      bound = ieee_value(1.0_wp, ieee_quiet_nan)
      change = bound
      if (.not. sensitivity > rounding_of_sums*sum(abs(chi)*(2*abs(lambda)*inertia(:, 1) + damping(:, 1)))) return
      motion = phi
      factor = lambda
      forces = residual_of(problem, transposed, motion, factor*motion, factor**2*motion, xi)
      violations = violations_of(problem%constraints, phi)
      rounding = sum(abs(chi)*(abs(lambda)**2*inertia(:, 1) + abs(lambda)*damping(:, 1) + stiffness(:, 1))) + &
         effect_of_constraints(problem%constraints, phi, xi, chi, eta)
      change = abs(sum(chi*forces) + sum(eta*violations))/sensitivity
      bound = (sum(abs(chi)*abs(forces)) + sum(abs(eta)*abs(violations)) + epsilon(1.0_wp)*rounding)/sensitivity + &
         epsilon(1.0_wp)*abs(lambda)
      if (.not. problem%symmetric) then
         bound = bound + effect_of_left_residual()/sensitivity
         return
      end if
      ! Next to critical damping the two roots of the form meet: the first order does not hold.
      slope = 0
      call problem%mass%add_product((1.0_wp, 0.0_wp), shape, slope)
      if (4*abs(sum(chi*slope(:, 1)))*bound > sensitivity) bound = ieee_value(1.0_wp, ieee_quiet_nan)

   contains

      ! The residual of the left vector, weighed by the shape: large where it is that of another eigenvalue, as in chains.
      real(wp) function effect_of_left_residual() result(effect)
         complex(wp), dimension(size(chi), 1) :: left, forces

         left(:, 1) = chi
         forces = 0
         call problem%mass%add_transposed_product(lambda**2, left, forces)
         call problem%damping%add_transposed_product(lambda, left, forces)
         call problem%stiffness%add_transposed_product((1.0_wp, 0.0_wp), left, forces)
         if (allocated(problem%loss)) call problem%loss%add_transposed_product((0.0_wp, 1.0_wp), left, forces)
         call problem%constraints%add_transposed_product((1.0_wp, 0.0_wp), reshape(eta, [size(eta), 1]), forces)
         effect = sum(abs(forces(:, 1))*abs(phi)) + sum(abs(violations_of(problem%constraints, chi))*abs(xi))
      end function effect_of_left_residual
   end subroutine entrywise_bound
end module kschur_entrywise_bound
