!> Modes that rounding of the stiffness hides: what is known of them, and what is not.
module kschur_hidden
   use kschur_context, only: solve_context_type, whole_both, whole_given
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: add_magnitudes
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_unknown, certified_yes, reason_converged, reason_fewer_modes, reason_inaccurate
   use kschur_problem, only: modal_problem_type
   use kschur_text, only: magnitude
   use kschur_tolerances, only: cancelled, root_epsilon, rounding_of_sums, same_value
   implicit none
   private
   public :: are_known, feel_inertia, tell_hidden

contains

   !> Ends a solve as inaccurate, with a note, where a mode of the list lies below what rounding of the stiffness hides, or where
   !> what is listed as rigid may be a mode. Of symmetric problems, whose error bounds are known.
   subroutine tell_hidden(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      !> As given.
      type(modes_type), intent(inout) :: modes
      !> Where there is no memory for the matrices.
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: limits(size(modes%lambda))
      logical :: hidden(size(modes%lambda))

      if (.not. s%problem%symmetric .or. size(modes%lambda) == 0) return
      call s%hold(whole_given, error)
      if (allocated(error)) return
      limits = modes%uncertainty
      where (modes%error_bound >= 0) limits = min(limits, modes%error_bound)
      limits = max(limit_of_zeros(s%problem, modes), limit_of(modes%lambda, limits))
      hidden = abs(modes%lambda) > 0 .and. limits >= abs(modes%lambda) .and. .not. are_known(s, modes%lambda)
      ! The units as given may hide more than those that balance has found.
      if (any(hidden)) call s%hold(whole_both, error)
      if (allocated(error)) return
      if (any(hidden)) hidden = unpack(.not. feel_inertia(s%work, s%contract(chosen_pairs(modes, hidden))), hidden, .false.)
      if (any(hidden)) then
         call s%add_note("rounding of the stiffness hides the lowest modes: nothing is known of what lies below "// &
            magnitude(maxval(limits, hidden))//" 1/s")
      else if (s%known%doubtful .and. any(.not. abs(modes%lambda) > 0)) then
         call s%add_note("rounding of the stiffness hides the lowest modes: a motion that is listed as rigid may be one")
      else
         return
      end if
      if (any(modes%reason == [reason_converged, reason_fewer_modes])) modes%reason = reason_inaccurate
      if (modes%certified /= certified_yes) return
      modes%certified = certified_unknown
      modes%missing = -1
   end subroutine tell_hidden

   ! Below this (1/s) a mode cannot be told from a zero: |lambda|^2 times the inertia of its shape is rounding of the energy.
   real(wp) function limit_of_zeros(problem, pairs) result(limit)
      type(modal_problem_type), intent(in) :: problem
      class(eigenpairs_type), intent(in) :: pairs
      complex(wp), dimension(pairs%rows(), 1) :: phi, forces
      real(wp) :: terms(pairs%rows(), 1), inertia
      integer :: j

      limit = 0
      do j = 1, size(pairs%lambda)
         if (abs(pairs%lambda(j)) > 0) cycle
         phi(:, 1) = pairs%column(j)
         forces = 0
         terms = 0
         call problem%mass%add_product((1.0_wp, 0.0_wp), phi, forces)
         call add_magnitudes(problem%stiffness, abs(phi), terms)
         inertia = abs(dot_product(phi(:, 1), forces(:, 1)))
         if (inertia > cancelled*dot_product(abs(phi(:, 1)), abs(forces(:, 1)))) &
            limit = max(limit, sqrt(rounding_of_sums*dot_product(abs(phi(:, 1)), terms(:, 1))/inertia))
      end do
   end function limit_of_zeros

   ! A root x of m x^2 + 2 |lambda| m x = f is the bound of an error, where f is rounding: sqrt(f/m).
   elemental real(wp) function limit_of(lambda, bound) result(limit)
      complex(wp), intent(in) :: lambda
      real(wp), intent(in) :: bound

      limit = sqrt(bound)*sqrt(bound + 2*abs(lambda))
   end function limit_of

   !> Whether inertia and damping are a part of the forces on a shape that rounding of the stiffness does not hide. Where they
   !> are not, as of the lowest modes of a fine mesh, an eigenvalue has a wide bound, but is none that is infinite.
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
         feel(j) = norm2(abs(force)) > root_epsilon*problem%stiffness%infinity_norm()*norm2(abs(phi))
      end do
   end function feel_inertia

   !> Which eigenvalues are those of rigid motions and their decays.
   function are_known(s, lambda)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: lambda(:)
      logical :: are_known(size(lambda))
      complex(wp), allocatable :: known(:)
      integer :: i

      allocate (known, source=s%known%deflation%eigenvalues())
      are_known = .false.
      do i = 1, size(known)
         are_known = are_known .or. abs(lambda - known(i)) <= same_value*abs(known(i))
      end do
   end function are_known
end module kschur_hidden
