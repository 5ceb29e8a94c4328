!> Recognises and reports modes so low that rounding of the stiffness hides them (docs/theory.md, section 11).
module kschur_hidden
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_context, only: solve_context_type, whole_both, whole_given
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: add_magnitudes
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_unknown, certified_yes, reason_converged, reason_fewer_modes, reason_inaccurate
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude
   use kschur_tolerances, only: cancelled, no_correct_digits, root_epsilon, rounding_of_sums, same_value
   implicit none
   private
   public :: are_known, may_be_infinite, tell_hidden

contains

   !> Makes the result inaccurate and adds a note, if a listed mode lies below the limit under which rounding of the stiffness hides
   !> modes (of symmetric problems, as others may have no error bounds), or if a motion listed as rigid may be such a mode. The zero
   !> of an unsymmetric problem gets an error bound then.
   subroutine tell_hidden(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      !> Of the problem as given.
      type(modes_type), intent(inout) :: modes
      !> Set if memory for the matrices is short.
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: hidden_below(size(modes%lambda)), unknown
      logical, dimension(size(modes%lambda)) :: is_hidden, is_zero

      if (size(modes%lambda) == 0) return
      is_hidden = .false.
      if (s%problem%symmetric) then
         call s%hold(whole_given, error)
         if (allocated(error)) return
         hidden_below = modes%uncertainty
         where (modes%error_bound >= 0) hidden_below = min(hidden_below, modes%error_bound)
         hidden_below = max(limit_of_rigid_motions(s%problem, modes), limit_of_mode(modes%lambda, hidden_below))
         is_hidden = abs(modes%lambda) > 0 .and. hidden_below >= abs(modes%lambda) .and. .not. are_known(s, modes%lambda)
      end if
      ! Rounding may hide less in balanced units than in those as given.
      if (any(is_hidden)) call s%hold(whole_both, error)
      if (allocated(error)) return
      if (any(is_hidden)) is_hidden = unpack(.not. feel_inertia(s%work, s%contract(chosen_pairs(modes, is_hidden))), is_hidden, &
         .false.)
      is_zero = .not. abs(modes%lambda) > 0
      unknown = ieee_value(unknown, ieee_quiet_nan)
      associate (radius => s%known%radius_of_zeros)
         if (any(is_hidden)) then
            call s%add_note("rounding of the stiffness hides the lowest modes: nothing is known of what lies below "// &
               magnitude(maxval(hidden_below, is_hidden))//" 1/s")
         else if (any(is_zero) .and. zero_may_be_mode(s, modes%lambda)) then
            call s%add_note("rounding of the stiffness hides the lowest modes: a motion that is listed as rigid may be one")
            where (is_zero .and. radius > 0) modes%error_bound = merge(radius, unknown, radius < sqrt(huge(radius)))
         else
            return
         end if
      end associate
      if (any(modes%reason == [reason_converged, reason_fewer_modes])) modes%reason = reason_inaccurate
      if (modes%certified /= certified_yes) return
      modes%certified = certified_unknown
      modes%missing = -1
   end subroutine tell_hidden

   ! Whether a zero may be a mode. The scale of modes is that of the shift and of those that oscillate: decays of rigid motions may
   ! be as slow as they like.
   logical function zero_may_be_mode(s, lambda)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: lambda(:)

      zero_may_be_mode = s%known%doubtful
      if (zero_may_be_mode .or. .not. s%known%radius_of_zeros > 0) return
      zero_may_be_mode = s%known%radius_of_zeros > &
         no_correct_digits*min(s%reference(), minval(abs(lambda), abs(aimag(lambda)) > 0))
   end function zero_may_be_mode

   ! |lambda| (1/s) below which a mode is indistinguishable from the rigid motions among the pairs: the inertia and damping of such
   ! a motion, |lambda|^2 m + |lambda| r with m = phi^* M phi and r = |phi^* R phi|, are then below the rounding f of the strain
   ! energy phi^* K phi.
   real(wp) function limit_of_rigid_motions(problem, pairs) result(limit)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      complex(wp), dimension(pairs%rows(), 1) :: phi
      real(wp) :: terms(pairs%rows(), 1), inertia, damping, rounding
      integer :: j

      limit = 0
      do j = 1, size(pairs%lambda)
         if (abs(pairs%lambda(j)) > 0) cycle
         phi(:, 1) = pairs%column(j)
         terms = 0
         call add_magnitudes(problem%stiffness, abs(phi), terms)
         rounding = rounding_of_sums*dot_product(abs(phi(:, 1)), terms(:, 1))
         inertia = energy(problem%mass)
         damping = energy(problem%damping)
         if (inertia > 0 .or. damping > 0) &
            limit = max(limit, 2*rounding/(damping + sqrt(damping**2 + 4*inertia*rounding)))
      end do

   contains

      ! |phi^* A phi|; zero if that is a rounding error.
      real(wp) function energy(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         complex(wp) :: forces(size(phi, 1), 1)

         forces = 0
         call matrix%add_product((1.0_wp, 0.0_wp), phi, forces)
         energy = abs(dot_product(phi(:, 1), forces(:, 1)))
         if (energy <= cancelled*dot_product(abs(phi(:, 1)), abs(forces(:, 1)))) energy = 0
      end function energy
   end function limit_of_rigid_motions

   ! |lambda| (1/s) below which rounding f hides a mode with the inertia m of this one, sqrt(f/m). f/m follows from the error bound
   ! x of lambda, the root of m x^2 + 2 |lambda| m x = f.
   elemental real(wp) function limit_of_mode(lambda, bound) result(limit)
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: bound

      limit = sqrt(bound)*sqrt(bound + 2*abs(lambda))
   end function limit_of_mode

   !> Whether the forces of inertia and damping on each shape exceed the rounding of the stiffness forces. If not, as for the lowest
   !> modes of a fine mesh, the eigenvalue has a large error bound, but is not a perturbed infinite one.
   function feel_inertia(problem, pairs) result(feel)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      logical :: feel(size(pairs%lambda))
      complex(wp), dimension(pairs%rows(), 1) :: phi, force
      integer :: j

      do j = 1, size(feel)
         phi(:, 1) = pairs%column(j)
         force = 0
         call problem%mass%add_product(pairs%lambda(j)**2, phi, force)
         call problem%damping%add_product(pairs%lambda(j), phi, force)
         feel(j) = exceeds_rounding(problem, phi, force)
      end do
   end function feel_inertia

   !> Whether pairs with large error bounds may be perturbed infinite ones: they feel inertia, or stiffness that inertia does not
   !> balance.
   function may_be_infinite(problem, pairs) result(may_be)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      logical :: may_be(size(pairs%lambda))
      complex(wp), dimension(pairs%rows(), 1) :: phi, force
      integer :: j

      may_be = feel_inertia(problem, pairs)
      do j = 1, size(may_be)
         phi(:, 1) = pairs%column(j)
         force = 0
         call problem%stiffness%add_product((1.0_wp, 0.0_wp), phi, force)
         call problem%constraints%add_transposed_product((1.0_wp, 0.0_wp), pairs%xi(:, j:j), force)
         may_be(j) = may_be(j) .or. exceeds_rounding(problem, phi, force)
      end do
   end function may_be_infinite

   ! Whether a force on a shape exceeds the rounding of the stiffness forces.
   logical function exceeds_rounding(problem, phi, force)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: phi(:, :), force(:, :)

      exceeds_rounding = norm2(abs(force)) > root_epsilon*problem%stiffness%infinity_norm()*norm2(abs(phi))
   end function exceeds_rounding

   !> Whether each eigenvalue is that of a rigid motion or of its decay, as the examination found them.
   function are_known(s, lambda)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: lambda(:)
      logical :: are_known(size(lambda))
      complex(wp), allocatable :: rigid_eigenvalues(:)
      integer :: i

      allocate (rigid_eigenvalues, source=s%known%deflation%eigenvalues())
      are_known = .false.
      do i = 1, size(rigid_eigenvalues)
         are_known = are_known .or. abs(lambda - rigid_eigenvalues(i)) <= same_value*abs(rigid_eigenvalues(i))
      end do
   end function are_known
end module kschur_hidden
