!> Computes all modes of a band of an undamped or proportionally damped symmetric problem: the eigenvalues are counted by inertia,
!> and the parts of the band are solved one by one (docs/theory.md, section 14).
module kschur_band_counted
   use kschur_band_groups, only: band_groups_type
   use kschur_band_part, only: finished_parts_type, part_modes_type, solve_part
   use kschur_band_parts, only: count_parts, part_type
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: count_eigenvalues, eigenvalue_count_type
   use kschur_error, only: error_type, take_cancelled
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: accept_pairs, mode_request_type
   use kschur_modes, only: modes_type, no_modes
   use kschur_monitor, only: ask_monitor
   use kschur_options, only: modal_options_type, formulation_proportional, formulation_symmetric
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes, reason_cancelled, reason_converged
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: empty_csr_matrix
   use kschur_spectral_map, only: spectral_map_type
   use kschur_text, only: text
   implicit none
   private
   public :: can_be_counted, solve_counted

   !> Undamped modes of a band, allocated for as many as were counted.
   type, extends(eigenpairs_type) :: oscillators_type
      !> Number of modes filled in so far.
      integer :: found = 0
      !> False if an eigenvalue omega^2 is negative, so that the count does not apply.
      logical :: counted = .true.
   end type oscillators_type

contains

   !> Whether the modes of a band may be counted by inertia: with a symmetric formulation, alpha and beta not negative, no losses,
   !> and a solver that computes inertias. The counts may still show that omega^2 is negative somewhere.
   pure logical function can_be_counted(s)
      type(solve_context_type), intent(in) :: s

      can_be_counted = any(s%formulation == [formulation_symmetric, formulation_proportional]) .and. &
         min(s%problem%alpha, s%problem%beta) >= 0 .and. allocated(s%inner%counting) .and. .not. s%is_lossy()
   end function can_be_counted

   !> Computes all modes with band(1) <= omega <= band(2) (rad/s): the undamped modes part by part, and from these the damped modes,
   !> which have the same shapes (docs/theory.md, eq. (4)).
   subroutine solve_counted(s, band, modes, counted, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      !> `found` is the number of modes in the band, listed or not.
      type(modes_type), intent(out) :: modes
      !> False if the modes turned out not to be countable: nothing is computed then.
      logical, intent(out) :: counted
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout), optional :: groups
      ! From this number on the monitor is told how many modes there are, as they take long.
      integer, parameter :: many = 1000
      type(modal_problem_type), target :: undamped
      type(modal_problem_type) :: damped
      type(modal_problem_type), pointer :: given
      type(part_type), allocatable :: parts(:)
      type(eigenpairs_type) :: rigid, pairs
      type(oscillators_type) :: oscillators
      integer :: formulation, total

      counted = .true.
      rigid = s%known%rigid
      allocate (parts(0))
      if (s%plan%unknowns_after > 0) &
         call count_parts(s, band, count(.not. abs(rigid%lambda) > 0), parts, counted, error)
      if (.not. allocated(error)) call ask_monitor(s%monitor, error)
      if (allocated(error) .or. .not. counted) return
      total = sum(parts%below_to - parts%below_from)
      if (associated(s%monitor) .and. total >= many) &
         call s%monitor%announce("the band holds "//text(total)//" oscillating modes")
      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      modes%certified = certified_yes
      allocate (oscillators%lambda(total), oscillators%real_phi(s%problem%unknowns(), total), &
         oscillators%xi(s%problem%multipliers(), total))

      given => s%problem
      undamped = given
      call exchange_damping(undamped, damped)
      formulation = s%formulation
      if (size(parts) > 0) call solve_parts(s, undamped, parts, oscillators, modes, error, groups)
      s%problem => given
      s%formulation = formulation
      s%known%rigid = rigid
      counted = oscillators%counted
      if (allocated(error) .or. .not. counted) return
      call compute_damped(oscillators, spectral_map_type(.true., 1.0_wp, given%alpha, given%beta), pairs)
      rigid = chosen_pairs(rigid, abs(rigid%lambda) >= band(1) .and. abs(rigid%lambda) <= band(2))
      total = total - oscillators%found + size(pairs%lambda) + size(rigid%lambda)
      call append_pairs(pairs, rigid)
      call accept_pairs(given, mode_request_type(target=s%options%target, max_eigenvalues=2*given%unknowns(), &
         rigid=size(rigid%lambda)), pairs, modes)
      if (size(modes%lambda) /= total .and. modes%certified == certified_yes) modes%certified = certified_no
      modes%found = total
   end subroutine solve_counted

   ! Solves the parts one by one, with the undamped problem in the place of the damped one. At the end options, reduced damping,
   ! decays and the number of eigenvalues are those of the damped problem again; the caller restores the rest.
   subroutine solve_parts(s, undamped, parts, oscillators, modes, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      !> The problem as given, without its damping.
      type(modal_problem_type), target, intent(in) :: undamped
      type(part_type), intent(in) :: parts(:)
      type(oscillators_type), intent(inout) :: oscillators
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout), optional :: groups
      type(modal_problem_type) :: damped
      type(modal_options_type) :: saved_options
      type(eigenvalue_count_type) :: saved_total
      type(part_modes_type) :: found
      type(finished_parts_type), target :: finished
      real(wp), allocatable :: saved_decay(:)
      integer :: applications, i
      logical :: cancelled

      saved_options = s%options
      if (allocated(s%matrices)) deallocate (s%matrices)
      call exchange_damping(s%work, damped)
      allocate (saved_decay, source=s%known%deflation%decay)
      saved_total = s%known%total
      s%problem => undamped
      s%formulation = formulation_symmetric
      s%known%rigid = chosen_pairs(s%known%rigid, .not. abs(s%known%rigid%lambda) > 0)
      s%known%deflation%decay = 0
      s%known%total = count_eigenvalues(s%work, s%known%deflation, s%known%redundant - s%plan%redundant, &
         size(s%known%rigid%lambda))
      applications = s%effort%operator_applications
      if (associated(s%checkpoint)) then
         allocate (finished%found(size(parts)))
         call s%checkpoint%begin_parts(finished, error)
      end if
      if (present(groups)) call groups%announce(parts)
      do i = 1, size(parts)
         if (allocated(error)) exit
         if (associated(s%monitor)) call s%monitor%counts(oscillators%found, parts(i)%below_to - parts(i)%below_from, &
            size(oscillators%lambda))
         if (i <= finished%parts) then
            found = finished%found(i)
            call s%effort%add_effort(found%effort)
         else if (present(groups)) then
            call groups%obtain(i, s, parts, found, error)
         else
            call solve_part(s, parts(i), found, error)
         end if
         call take_cancelled(error, cancelled)
         ! The parts before this one are complete.
         if (cancelled) modes%reason = reason_cancelled
         if (cancelled) modes%certified = certified_unknown
         if (allocated(error) .or. cancelled) exit
         call modes%history%append(found%history, applications)
         applications = applications + found%effort%operator_applications
         call add_part(found, oscillators, modes)
         if (.not. oscillators%counted .or. modes%reason == reason_cancelled) exit
         call keep_part(s, i, found, finished)
      end do
      ! Later steps are not saved: a resumed solve repeats them.
      nullify (s%checkpoint)
      s%options = saved_options
      if (allocated(s%matrices)) deallocate (s%matrices)
      call exchange_damping(s%work, damped)
      s%known%deflation%decay = saved_decay
      s%known%total = saved_total
   end subroutine solve_parts

   ! Adds the modes of a part to the checkpoint, if there is one.
   subroutine keep_part(s, part, found, finished)
      type(solve_context_type), intent(inout) :: s
      integer, intent(in) :: part
      type(part_modes_type), intent(in) :: found
      type(finished_parts_type), intent(inout) :: finished

      if (.not. associated(s%checkpoint) .or. part <= finished%parts) return
      finished%found(part) = found
      finished%parts = part
      call s%checkpoint%next_part()
   end subroutine keep_part

   ! Exchanges the damping of two problems. The damping matrix of the second may not be allocated: it is zero then.
   subroutine exchange_damping(first, second)
      type(modal_problem_type), intent(inout) :: first, second
      type(modal_problem_type) :: temporary

      if (.not. allocated(second%damping%value)) second%damping = empty_csr_matrix(first%unknowns(), first%unknowns())
      call copy_damping(first, temporary)
      call copy_damping(second, first)
      call copy_damping(temporary, second)
   end subroutine exchange_damping

   ! Copies the damping matrix with its kind and coefficients.
   subroutine copy_damping(from, to)
      type(modal_problem_type), intent(in) :: from
      type(modal_problem_type), intent(inout) :: to

      to%damping = from%damping
      to%damping_kind = from%damping_kind
      to%alpha = from%alpha
      to%beta = from%beta
   end subroutine copy_damping

   ! Appends the modes of a part to the oscillators, and merges its reason, verdict and locking error into those of the band.
   subroutine add_part(found, oscillators, modes)
      type(part_modes_type), intent(in) :: found
      type(oscillators_type), intent(inout) :: oscillators
      !> Reason, verdict and locking error of the band.
      type(modes_type), intent(inout) :: modes
      integer :: first, last, i

      modes%locking_error = max(modes%locking_error, found%locking_error)
      oscillators%counted = found%counted
      if (.not. oscillators%counted) return
      first = oscillators%found + 1
      last = oscillators%found + size(found%lambda)
      oscillators%lambda(first:last) = found%lambda
      if (.not. found%is_real()) call oscillators%make_complex()
      do i = first, last
         if (oscillators%is_real()) then
            oscillators%real_phi(:, i) = found%real_phi(:, i - first + 1)
         else
            oscillators%phi(:, i) = found%column(i - first + 1)
         end if
      end do
      oscillators%xi(:, first:last) = found%xi
      oscillators%found = last
      if (found%reason /= reason_converged) then
         modes%reason = found%reason
         modes%certified = certified_unknown
      else if (found%certified == certified_no .and. modes%certified == certified_yes) then
         modes%certified = certified_no
      end if
   end subroutine add_part

   ! Computes the damped modes of undamped oscillators: one of a conjugate pair, or both real roots.
   subroutine compute_damped(oscillators, map, pairs)
      type(oscillators_type), intent(in) :: oscillators
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(out) :: pairs
      complex(wp) :: lambda(2*oscillators%found), roots(2)
      integer :: oscillator(2*oscillators%found), i, k, l

      k = 0
      do i = 1, oscillators%found
         roots = map%lambdas(cmplx(aimag(oscillators%lambda(i))**2, 0, wp))
         l = merge(1, 2, abs(aimag(roots(1))) > 0)
         lambda(k + 1:k + l) = cmplx(real(roots(:l), wp), abs(aimag(roots(:l))), wp)
         oscillator(k + 1:k + l) = i
         k = k + l
      end do
      allocate (pairs%lambda(k), source=lambda(:k))
      if (oscillators%is_real()) then
         allocate (pairs%real_phi(oscillators%rows(), k), source=oscillators%real_phi(:, oscillator(:k)))
      else
         allocate (pairs%phi(oscillators%rows(), k), source=oscillators%phi(:, oscillator(:k)))
      end if
      allocate (pairs%xi(size(oscillators%xi, 1), k), source=oscillators%xi(:, oscillator(:k)))
      do i = 1, k
         pairs%xi(:, i) = map%reaction(lambda(i))*pairs%xi(:, i)
      end do
   end subroutine compute_damped
end module kschur_band_counted
