!> All modes of a band of natural frequencies.
module kschur_band
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_band_groups, only: band_groups_type
   use kschur_band_part, only: part_modes_type, solve_part
   use kschur_band_parts, only: count_parts, part_type
   use kschur_clock, only: clock, seconds_since
   use kschur_context, only: begin, solve_context_type
   use kschur_description, only: describe
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: count_eigenvalues, eigenvalue_count_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_help, only: help
   use kschur_kinds, only: wp, long
   use kschur_left_run, only: find_left_modes
   use kschur_mode_selection, only: accept_pairs, nearest_first, wanted_type
   use kschur_modes, only: modes_type, no_modes
   use kschur_monitor, only: monitor_type
   use kschur_low_rank_choice, only: leave_low_rank
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, formulation_low_rank, &
      formulation_proportional, &
      formulation_symmetric, method_krylov_schur
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes, history_type, reason_cancelled, &
      reason_converged, reason_fewer_modes
   use kschur_preparation, only: examine, reduce
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: join_processes, processes_type
   use kschur_report, only: report
   use kschur_result, only: modal_result_type, note_length
   use kschur_search, only: find_modes, take_rigid
   use kschur_shift, only: place_shift
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: empty_csr_matrix
   use kschur_spectral_map, only: spectral_map_type
   use kschur_text, only: text
   use kschur_threads, only: enter_solve, leave_solve
   implicit none
   private
   public :: band_options, prepare_band, solve_band, solve_band_prepared

   ! The edges of a band are moved outwards by this, relative to them.
   real(wp), parameter :: edge = 1.0e-6_wp
   ! Where nothing can be counted, no more modes than this are computed.
   integer, parameter :: most_uncounted = 2000
   real(wp), parameter :: pi = acos(-1.0_wp)

   !> Undamped modes, with room for more.
   type, extends(eigenpairs_type) :: oscillators_type
      integer :: found = 0
   end type oscillators_type

contains

   !> Computes all modes with first <= frequency_hz <= last, where `frequency_hz` is
   !> that of `modal_result_type`: of both roots of an overdamped oscillator its undamped
   !> one. Either edge takes in what is within 1e-6 of it, relative to it. The result has
   !> the target i 2 pi first, so that the modes come in the order of their frequencies
   !> where damping is light. No mode in the band is a success with no modes.
   !>
   !> Undamped and proportionally damped symmetric problems with nothing unstable are
   !> counted, cut into parts at gaps of the spectrum and solved part by part:
   !> `certified` says whether what was found is what was counted. Of other problems all
   !> modes with |lambda| <= 2 pi last are computed, nearest to zero first, and those in
   !> the band kept: what is below the band costs as much as what is in it, the faster root
   !> of an overdamped oscillator may be outside, and `certified` is unknown.
   !> The shift, the solver and its factors are those of the last part or attempt.
   !>
   !> Fails as `solve_modes` does, and where there are more than 10,000 modes in the
   !> band, or 2,000 below its end where they cannot be counted.
   subroutine solve_band(problem, first, last, options, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      !> The edges (Hz), 0 <= first < last.
      real(wp), intent(in) :: first, last
      !> The number of modes, target and shift are not looked at.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iterations and may end them.
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Linear solvers of the caller's own; `options%inner` is `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(processes_type), target :: processes
      type(band_groups_type) :: groups
      integer :: threads_before

      call join_processes(options%communicator, options%distribute, processes, error)
      if (allocated(error)) return
      call enter_solve(processes%threads(options%threads), problem%unknowns(), threads_before, error)
      if (processes%rank > 0) then
         call help(processes)
      else if (.not. allocated(error)) then
         call solve(problem, [first, last], options, processes, groups, result, error, monitor, solvers)
         call groups%disband(processes)
      end if
      call processes%leave(error)
      call leave_solve(threads_before)
   end subroutine solve_band

   subroutine solve(problem, edges, options, processes, groups, result, error, monitor, solvers)
      type(modal_problem_type), target, intent(in) :: problem
      real(wp), intent(in) :: edges(2)
      type(modal_options_type), intent(in) :: options
      type(processes_type), target, intent(inout) :: processes
      type(band_groups_type), intent(inout) :: groups
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      type(solve_context_type), target :: s
      type(modal_options_type) :: own
      integer(long) :: started

      started = clock()
      call band_options(edges(1), edges(2), options, own, error)
      if (.not. allocated(error)) call begin(s, problem, own, error, monitor, solvers, processes)
      if (allocated(error)) return
      ! A caller's own solvers are in this process only.
      if (can_be_counted(s) .and. .not. present(solvers)) call groups%begin(problem, s%options, processes)
      call prepare_band(s, error)
      if (.not. allocated(error)) call solve_band_prepared(s, edges(1), edges(2), own, result, error, groups)
      call groups%finish()
      call result%set_total(seconds_since(started))
   end subroutine solve

   !> The options of a caller as a band solves with them. Fails where they do not fit one.
   subroutine band_options(first, last, options, own, error)
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(modal_options_type), intent(out) :: own
      type(error_type), allocatable, intent(out) :: error

      own = options
      own%modes = 1
      own%target = cmplx(0, 2*pi*first, wp)
      if (allocated(own%shift)) deallocate (own%shift)
      call check_band(first, last, own, error)
   end subroutine band_options

   !> What is done before the modes of a band are looked for, and holds for other bands as well.
   subroutine prepare_band(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error

      s%may_be_dense = .false.
      if (s%options%formulation == formulation_auto .and. s%formulation == formulation_low_rank) &
         call leave_low_rank(s, "the damping is not a combination of mass and stiffness")
      call reduce(s, error)
      if (.not. allocated(error)) call examine(s, error)
   end subroutine prepare_band

   !> The modes of a band of a problem that is prepared. The context stays so, without factors.
   subroutine solve_band_prepared(s, first, last, options, result, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: first, last
      !> As `band_options` made them.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Who finds the modes of its parts; absent: this process.
      type(band_groups_type), intent(inout), optional :: groups
      type(modal_options_type) :: own
      type(modes_type) :: modes
      real(wp) :: band(2)
      logical :: counted

      own = options
      band = 2*pi*[(1 - edge)*first, (1 + edge)*last]
      counted = can_be_counted(s)
      if (counted) call solve_counted(s, band, modes, counted, error, groups)
      if (.not. allocated(error) .and. .not. counted) call solve_disc(s, band, modes, error)
      if (.not. allocated(error) .and. own%left) call find_left_modes(s, modes, error)
      if (allocated(error)) return
      own%modes = size(modes%lambda)
      if (counted) own%modes = modes%found
      call report(s, own, modes, result, error)
      allocate (result%band(2), source=[first, last])
   end subroutine solve_band_prepared

   ! Whether its modes are counted, unless it turns out that they cannot be.
   pure logical function can_be_counted(s)
      type(solve_context_type), intent(in) :: s

      can_be_counted = any(s%formulation == [formulation_symmetric, formulation_proportional]) .and. &
         min(s%problem%alpha, s%problem%beta) >= 0 .and. allocated(s%inner%counting)
   end function can_be_counted

   subroutine check_band(first, last, options, error)
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (.not. (first >= 0 .and. last > first .and. ieee_is_finite(last))) then
         call new_error(error, error_usage, "a band wants two frequencies, the first at least 0, the second above the first")
      else if (options%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the modes of a band are found by krylov-schur only")
      else if (options%formulation == formulation_dense) then
         call new_error(error, error_usage, "the modes of a band are found by an iteration, not by the formulation dense")
      else if (options%certify) then
         call new_error(error, error_usage, "certify counts about a target, and a band has none")
      end if
   end subroutine check_band

   ! The undamped modes of each part, from which the damped ones follow.
   subroutine solve_counted(s, band, modes, counted, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      !> `found` is how many the band holds, listed or not.
      type(modes_type), intent(out) :: modes
      !> False where it turned out that the modes cannot be counted.
      logical, intent(out) :: counted
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout), optional :: groups
      ! So many that it takes a while.
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
      if (size(parts) > 0) call solve_parts(s, undamped, parts, oscillators, modes, counted, error, groups)
      s%problem => given
      s%formulation = formulation
      s%known%rigid = rigid
      if (allocated(error) .or. .not. counted) return
      call damp(oscillators, spectral_map_type(.true., 1.0_wp, given%alpha, given%beta), pairs)
      rigid = chosen_pairs(rigid, abs(rigid%lambda) >= band(1) .and. abs(rigid%lambda) <= band(2))
      total = total - oscillators%found + size(pairs%lambda) + size(rigid%lambda)
      call append_pairs(pairs, rigid)
      call accept_pairs(given, wanted_type(target=s%options%target, most=2*given%unknowns(), &
         rigid=size(rigid%lambda)), pairs, modes)
      if (size(modes%lambda) /= total .and. modes%certified == certified_yes) modes%certified = certified_no
      modes%found = total
   end subroutine solve_counted

   ! Without its damping the problem is iterated part by part.
   subroutine solve_parts(s, undamped, parts, oscillators, modes, counted, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      !> The problem as given, without its damping.
      type(modal_problem_type), target, intent(in) :: undamped
      type(part_type), intent(in) :: parts(:)
      type(oscillators_type), intent(inout) :: oscillators
      type(modes_type), intent(inout) :: modes
      logical, intent(inout) :: counted
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout), optional :: groups
      type(modal_problem_type) :: damped
      type(modal_options_type) :: asked
      type(eigenvalue_count_type) :: total
      type(part_modes_type) :: found
      real(wp), allocatable :: decay(:)
      integer :: before, i

      asked = s%options
      call exchange_damping(s%work, damped)
      allocate (decay, source=s%known%deflation%decay)
      total = s%known%total
      s%problem => undamped
      s%formulation = formulation_symmetric
      s%known%rigid = chosen_pairs(s%known%rigid, .not. abs(s%known%rigid%lambda) > 0)
      s%known%deflation%decay = 0
      s%known%total = count_eigenvalues(s%work, s%known%deflation, s%known%redundant - s%plan%redundant, &
         size(s%known%rigid%lambda))
      before = s%effort%operator_applications
      if (present(groups)) call groups%announce(parts)
      do i = 1, size(parts)
         if (present(groups)) then
            call groups%obtain(i, s, parts, found, error)
         else
            call solve_part(s, parts(i), found, error)
         end if
         if (allocated(error)) exit
         call add_history(modes%history, found%history, before)
         before = before + found%effort%operator_applications
         call add_part(found, oscillators, counted, modes)
         if (.not. counted .or. modes%reason == reason_cancelled) exit
      end do
      s%options = asked
      call exchange_damping(s%work, damped)
      s%known%deflation%decay = decay
      s%known%total = total
   end subroutine solve_parts

   ! Two problems give each other their damping: at first the second one has none, in no matrix at all.
   subroutine exchange_damping(first, second)
      type(modal_problem_type), intent(inout) :: first, second
      type(modal_problem_type) :: third

      if (.not. allocated(second%damping%value)) second%damping = empty_csr_matrix(first%unknowns(), first%unknowns())
      call give_damping(first, third)
      call give_damping(second, first)
      call give_damping(third, second)
   end subroutine exchange_damping

   subroutine give_damping(from, to)
      type(modal_problem_type), intent(in) :: from
      type(modal_problem_type), intent(inout) :: to

      to%damping = from%damping
      to%damping_kind = from%damping_kind
      to%alpha = from%alpha
      to%beta = from%beta
   end subroutine give_damping

   ! Adds the modes of a part to the oscillators.
   subroutine add_part(found, oscillators, counted, modes)
      type(part_modes_type), intent(in) :: found
      type(oscillators_type), intent(inout) :: oscillators
      logical, intent(out) :: counted
      !> Gathers how it went.
      type(modes_type), intent(inout) :: modes
      integer :: first, last, i

      modes%locking_error = max(modes%locking_error, found%locking_error)
      counted = found%counted
      if (.not. counted) return
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

   subroutine add_history(history, more, before)
      type(history_type), intent(inout) :: history
      type(history_type), intent(in) :: more
      !> Applications before it began.
      integer, intent(in) :: before

      history%converged = [history%converged, more%converged]
      history%operator_applications = [history%operator_applications, before + more%operator_applications]
      history%residual = [history%residual, more%residual]
   end subroutine add_history

   ! Both roots of each oscillator, of a conjugate pair one.
   subroutine damp(oscillators, map, pairs)
      type(oscillators_type), intent(in) :: oscillators
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(out) :: pairs
      complex(wp) :: lambda(2*oscillators%found), roots(2)
      integer :: of(2*oscillators%found), i, k, l

      k = 0
      do i = 1, oscillators%found
         roots = map%lambdas(cmplx(aimag(oscillators%lambda(i))**2, 0, wp))
         l = merge(1, 2, abs(aimag(roots(1))) > 0)
         lambda(k + 1:k + l) = cmplx(real(roots(:l), wp), abs(aimag(roots(:l))), wp)
         of(k + 1:k + l) = i
         k = k + l
      end do
      allocate (pairs%lambda(k), source=lambda(:k))
      if (oscillators%is_real()) then
         allocate (pairs%real_phi(oscillators%rows(), k), source=oscillators%real_phi(:, of(:k)))
      else
         allocate (pairs%phi(oscillators%rows(), k), source=oscillators%phi(:, of(:k)))
      end if
      allocate (pairs%xi(size(oscillators%xi, 1), k), source=oscillators%xi(:, of(:k)))
      do i = 1, k
         pairs%xi(:, i) = map%reaction(lambda(i))*pairs%xi(:, i)
      end do
   end subroutine damp

   ! Modes nearest to zero, more and more of them until they reach beyond the band.
   subroutine solve_disc(s, band, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: at_first = 20
      type(modal_options_type) :: asked
      type(history_type) :: history
      integer, allocatable :: order(:)
      real(wp), allocatable :: omega(:)
      integer :: before, i

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      history = modes%history
      asked = s%options
      s%options%target = 0
      s%options%modes = at_first
      do
         before = s%effort%operator_applications
         if (s%only_rigid()) then
            call take_rigid(s, modes)
            exit
         end if
         call place_shift(s, error)
         if (.not. allocated(error)) call find_modes(s, modes, error)
         if (allocated(error)) return
         call add_history(history, modes%history, before)
         if (modes%reason /= reason_converged .or. maxval([0.0_wp, abs(modes%lambda)]) > band(2)) exit
         if (s%options%modes == most_uncounted) then
            call new_error(error, error_usage, "more than "//text(most_uncounted)//" modes lie below the end of the band, "// &
               "and they cannot be counted: end it lower, or ask for modes near a target")
            return
         end if
         s%options%modes = min(most_uncounted, larger(s%options%modes, maxval([0.0_wp, abs(modes%lambda)])/band(2)))
      end do
      s%options%target = asked%target
      modes%history = history
      if (modes%reason == reason_fewer_modes) modes%reason = reason_converged
      modes%certified = certified_unknown
      call tell_frequencies(s, modes, omega)
      order = pack([(i, i=1, size(omega))], abs(modes%lambda) <= band(2) .and. omega >= band(1) .and. omega <= band(2))
      order = order(nearest_first(modes%lambda(order), asked%target))
      call modes%take(order)
   end subroutine solve_disc

   ! As many as there would be if their number grew with the square of |lambda|.
   integer function larger(modes, reach)
      integer, intent(in) :: modes
      !> Part of the band that they cover.
      real(wp), intent(in) :: reach
      real(wp), parameter :: least = 1.25_wp, most = 4

      larger = ceiling(modes*min(most, max(least, (1.1_wp/max(reach, tiny(1.0_wp)))**2)))
   end function larger

   ! The undamped frequencies (rad/s) that a result tells.
   subroutine tell_frequencies(s, modes, omega)
      type(solve_context_type), intent(in) :: s
      !> As it was, on return.
      type(modes_type), intent(inout) :: modes
      real(wp), allocatable, intent(out) :: omega(:)
      type(modal_result_type) :: told
      real(wp), allocatable :: rigid(:, :)

      call modes%make_complex()
      call move_alloc(modes%lambda, told%eigenvalues)
      call move_alloc(modes%phi, told%eigenvectors)
      call s%known%rigid_motions(rigid)
      call describe(s%problem, rigid, told)
      call move_alloc(told%eigenvalues, modes%lambda)
      call move_alloc(told%eigenvectors, modes%phi)
      allocate (omega, source=2*pi*told%frequency_hz)
   end subroutine tell_frequencies
end module kschur_band
