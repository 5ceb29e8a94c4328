!> All modes of a band of natural frequencies.
module kschur_band
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_band_parts, only: count_parts, half_gap, part_type
   use kschur_clock, only: clock, seconds_since
   use kschur_deflation, only: deflation_type
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_error, only: error_type, new_error, error_singular, error_usage
   use kschur_formulation, only: choose_formulation
   use kschur_inner_solvers, only: choose_inner_solvers, inner_solvers_type
   use kschur_kinds, only: wp, long
   use kschur_balance, only: balance
   use kschur_method, only: check_options
   use kschur_modes, only: orthonormalize_zeros, select_modes, sort_by_distance
   use kschur_left, only: set_left_modes
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_proportional, formulation_symmetric, &
      method_krylov_schur
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type, damping_none
   use kschur_result, only: modal_result_type, certified_no, certified_unknown, certified_yes, kind_rigid, &
      kind_undamped, reason_cancelled, reason_converged, reason_fewer_modes
   use kschur_rigid_modes, only: find_rigid
   use kschur_solver, only: modes_of, solve_modes, undo_presolve
   use kschur_sparse, only: empty_csr_matrix
   use kschur_spectral_map, only: spectral_map_type
   use kschur_text, only: text
   implicit none
   private
   public :: solve_band

   ! The edges of a band are moved outwards by this, relative to them.
   real(wp), parameter :: edge = 1.0e-6_wp
   ! Where nothing can be counted, no more modes than this are computed.
   integer, parameter :: most_uncounted = 2000
   real(wp), parameter :: pi = acos(-1.0_wp)

   !> Undamped modes, with room for more.
   type :: oscillators_type
      integer :: found = 0
      real(wp), allocatable :: omega(:)
      complex(wp), allocatable :: phi(:, :), xi(:, :)
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
      type(modal_problem_type), intent(in) :: problem
      !> The edges (Hz), 0 <= first < last.
      real(wp), intent(in) :: first, last
      !> The number of modes, target and shift are not looked at.
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Watches the iterations and may end them.
      class(monitor_type), intent(inout), optional :: monitor
      !> Linear solvers of the caller's own; `options%inner` is `inner_auto` then.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(inner_solvers_type) :: inner
      type(modal_options_type) :: own
      real(wp) :: band(2)
      logical :: counted
      integer(long) :: started

      started = clock()
      if (.not. (first >= 0 .and. last > first .and. ieee_is_finite(last))) then
         call new_error(error, error_usage, "a band wants two frequencies, the first at least 0, the second above the first")
         return
      end if
      own = options
      own%modes = 1
      own%target = cmplx(0, 2*pi*first, wp)
      if (allocated(own%shift)) deallocate (own%shift)
      call check_options(own, error)
      if (.not. allocated(error)) call choose_inner_solvers(own, inner, error, solvers)
      if (allocated(error)) return
      if (own%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the modes of a band are found by krylov-schur only")
      else if (options%certify) then
         call new_error(error, error_usage, "certify counts about a target, and a band has none")
      end if
      if (allocated(error)) return
      band = 2*pi*[(1 - edge)*first, (1 + edge)*last]
      call choose_formulation(problem, own%formulation, result%formulation, result%decision, error, inner)
      if (allocated(error)) return
      counted = any(result%formulation == [formulation_symmetric, formulation_proportional]) .and. &
         min(problem%alpha, problem%beta) >= 0 .and. allocated(inner%counting)
      if (counted) call solve_counted(problem, band, own, inner, counted, result, error, monitor, solvers)
      if (.not. allocated(error) .and. .not. counted) call solve_disc(problem, band, own, result, error, monitor, solvers)
      if (allocated(error)) return
      result%options = own
      result%options%modes = result%modes_asked
      result%target = own%target
      allocate (result%band(2), source=[first, last])
      call result%set_total(seconds_since(started))
   end subroutine solve_band

   ! The undamped modes of each part, from which the damped ones follow.
   subroutine solve_counted(problem, band, options, inner, counted, result, error, monitor, solvers)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: band(2)
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      !> False where it turned out that the modes cannot be counted.
      logical, intent(inout) :: counted
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      ! So many that it takes a while.
      integer, parameter :: many = 1000
      type(modal_problem_type) :: undamped
      type(part_type), allocatable :: parts(:)
      type(eigenpairs_type) :: rigid, pairs
      type(oscillators_type) :: oscillators
      integer :: total, i

      call describe_problem(problem, result)
      call find_parts(problem, band, options, inner, rigid, parts, counted, result, error)
      if (allocated(error) .or. .not. counted) return
      undamped = problem
      undamped%damping = empty_csr_matrix(problem%unknowns(), problem%unknowns())
      undamped%damping_kind = damping_none
      undamped%alpha = 0
      undamped%beta = 0
      total = sum(parts%below_to - parts%below_from)
      if (present(monitor) .and. total >= many) &
         call monitor%announce("the band holds "//text(total)//" oscillating modes")
      allocate (oscillators%omega(total), oscillators%phi(problem%unknowns(), total), &
         oscillators%xi(problem%multipliers(), total))
      result%reason = reason_converged
      result%certified = certified_yes
      do i = 1, size(parts)
         call solve_part(undamped, parts(i), options, oscillators, counted, result, error, monitor, solvers)
         if (allocated(error) .or. .not. counted) return
         if (result%reason == reason_cancelled) exit
      end do
      call damp(oscillators, spectral_map_type(.true., 1.0_wp, problem%alpha, problem%beta), pairs)
      call keep_pairs(rigid, pack([(i, i=1, size(rigid%lambda))], &
         abs(rigid%lambda) >= band(1) .and. abs(rigid%lambda) <= band(2)))
      total = total - oscillators%found + size(pairs%lambda) + size(rigid%lambda)
      call select_all(problem, options, pairs, rigid, result)
      if (size(result%eigenvalues) /= total .and. result%certified == certified_yes) result%certified = certified_no
      result%modes_asked = total
      if (options%left) call set_left_modes(problem, problem, modes_of(result), .false., inner, result, error)
   end subroutine solve_counted

   ! Zeros and what decays without stiffness, all of them, and the parts with all else of the band.
   subroutine find_parts(problem, band, options, inner, rigid, parts, counted, result, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: band(2)
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      type(eigenpairs_type), intent(out) :: rigid
      type(part_type), allocatable, intent(out) :: parts(:)
      logical, intent(out) :: counted
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: work
      type(presolve_type) :: plan
      type(deflation_type) :: deflation

      counted = .true.
      call presolve(problem, work, plan, error, eliminating=options%presolve)
      if (plan%unknowns_after == 0) then
         ! The constraints leave no motion.
         if (allocated(error)) deallocate (error)
         allocate (parts(0))
         rigid = no_pairs(problem)
         return
      end if
      if (allocated(error)) return
      call balance(work, plan)
      call find_rigid(work, formulation_symmetric, .true., 0, inner, deflation, rigid, result%effort_type, error)
      if (allocated(error)) return
      call count_parts(work, band, count(.not. abs(rigid%lambda) > 0), inner%counting, parts, counted, &
         result, error)
      if (allocated(error) .or. .not. counted) return
      call undo_presolve(problem, plan, rigid)
      call orthonormalize_zeros(rigid)
   end subroutine find_parts

   ! Adds the modes of a part to the oscillators.
   subroutine solve_part(undamped, part, options, oscillators, counted, result, error, monitor, solvers)
      type(modal_problem_type), intent(in) :: undamped
      type(part_type), intent(in) :: part
      type(modal_options_type), intent(in) :: options
      type(oscillators_type), intent(inout) :: oscillators
      logical, intent(out) :: counted
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      ! A shift is an eigenvalue once at most.
      real(wp), parameter :: offsets(3) = [0.0_wp, 1.0e-3_wp, -2.0e-3_wp]
      type(modal_options_type) :: own
      type(modal_result_type) :: found
      integer, allocatable :: inside(:)
      integer :: expected, first, last, attempt, i

      own = options
      own%formulation = formulation_symmetric
      own%left = .false.
      expected = part%below_to - part%below_from
      if (part%is_lowest()) then
         own%modes = part%below_to
         own%target = 0
         call solve_modes(undamped, own, found, error, monitor, solvers)
      else
         own%modes = expected
         own%target = cmplx(0, (part%from + part%to)/2, wp)
         do attempt = 1, size(offsets)
            own%shift = (1 + offsets(attempt))*own%target
            call solve_modes(undamped, own, found, error, monitor, solvers)
            if (.not. allocated(error)) exit
            if (error%code /= error_singular) return
         end do
      end if
      if (allocated(error)) return
      call add_run(found, result)
      counted = all(found%kind == kind_rigid .or. found%kind == kind_undamped)
      if (.not. counted) return
      allocate (inside, source=pack([(i, i=1, size(found%kind))], found%kind == kind_undamped .and. &
         aimag(found%eigenvalues) > (1 - half_gap)*part%from .and. aimag(found%eigenvalues) < (1 + half_gap)*part%to))
      if (size(inside) > expected) inside = inside(:expected)
      first = oscillators%found + 1
      last = oscillators%found + size(inside)
      oscillators%omega(first:last) = aimag(found%eigenvalues(inside))
      oscillators%phi(:, first:last) = found%eigenvectors(:, inside)
      oscillators%xi(:, first:last) = found%multipliers(:, inside)
      oscillators%found = last
      if (found%reason /= reason_converged) then
         result%reason = found%reason
         result%certified = certified_unknown
      else if (size(inside) < expected .and. result%certified == certified_yes) then
         result%certified = certified_no
      end if
   end subroutine solve_part

   ! Both roots of each oscillator, of a conjugate pair one.
   subroutine damp(oscillators, map, pairs)
      type(oscillators_type), intent(in) :: oscillators
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(out) :: pairs
      complex(wp) :: lambda(2*oscillators%found), roots(2)
      integer :: of(2*oscillators%found), i, k, l

      k = 0
      do i = 1, oscillators%found
         roots = map%lambdas(cmplx(oscillators%omega(i)**2, 0, wp))
         l = merge(1, 2, abs(aimag(roots(1))) > 0)
         lambda(k + 1:k + l) = cmplx(real(roots(:l), wp), abs(aimag(roots(:l))), wp)
         of(k + 1:k + l) = i
         k = k + l
      end do
      allocate (pairs%lambda(k), source=lambda(:k))
      allocate (pairs%phi(size(oscillators%phi, 1), k), source=oscillators%phi(:, of(:k)))
      allocate (pairs%xi(size(oscillators%xi, 1), k), source=oscillators%xi(:, of(:k)))
      do i = 1, k
         pairs%xi(:, i) = map%reaction(lambda(i))*pairs%xi(:, i)
      end do
   end subroutine damp

   ! Modes nearest to zero, more and more of them until they reach beyond the band.
   subroutine solve_disc(problem, band, options, result, error, monitor, solvers)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: band(2)
      type(modal_options_type), intent(in) :: options
      !> What was done before is kept in its counts.
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(inner_solvers_type), intent(in), optional :: solvers
      integer, parameter :: at_first = 20
      type(modal_options_type) :: own
      type(modal_result_type) :: found
      integer, allocatable :: order(:)
      real(wp) :: reach
      integer :: i

      own = options
      own%target = 0
      own%modes = at_first
      do
         call solve_modes(problem, own, found, error, monitor, solvers)
         if (allocated(error)) return
         call add_run(found, result)
         reach = 0
         if (size(found%eigenvalues) > 0) reach = maxval(abs(found%eigenvalues))
         if (found%reason /= reason_converged .or. reach > band(2)) exit
         if (own%modes == most_uncounted) then
            call new_error(error, error_usage, "more than "//text(most_uncounted)//" modes lie below the end of the band, "// &
               "and they cannot be counted: end it lower, or ask for modes near a target")
            return
         end if
         own%modes = min(most_uncounted, larger(own%modes, reach))
      end do
      call describe_problem(problem, result)
      result%formulation = found%formulation
      result%decision = found%decision
      result%reason = found%reason
      if (found%reason == reason_fewer_modes) result%reason = reason_converged
      result%certified = certified_unknown
      allocate (order, source=pack([(i, i=1, size(found%eigenvalues))], abs(found%eigenvalues) <= band(2) .and. &
         2*pi*found%frequency_hz >= band(1) .and. 2*pi*found%frequency_hz <= band(2)))
      call sort_by_distance(found%eigenvalues, options%target, order)
      result%eigenvalues = found%eigenvalues(order)
      result%eigenvectors = found%eigenvectors(:, order)
      result%multipliers = found%multipliers(:, order)
      result%frequency_hz = found%frequency_hz(order)
      result%damped_frequency_hz = found%damped_frequency_hz(order)
      result%damping_ratio = found%damping_ratio(order)
      result%backward_error = found%backward_error(order)
      result%error_bound = found%error_bound(order)
      result%kind = found%kind(order)
      result%modes_asked = size(order)
      if (.not. options%left) return
      result%left_eigenvectors = found%left_eigenvectors(:, order)
      result%left_multipliers = found%left_multipliers(:, order)
      result%condition = found%condition(order)

   contains

      ! As many as there would be if their number grew with the square of |lambda|.
      integer function larger(modes, reach)
         integer, intent(in) :: modes
         real(wp), intent(in) :: reach
         real(wp), parameter :: least = 1.25_wp, most = 4

         larger = ceiling(modes*min(most, max(least, (1.1_wp*band(2)/max(reach, tiny(1.0_wp)))**2)))
      end function larger
   end subroutine solve_disc

   ! Modes of pairs and of rigid motions, all that there are.
   subroutine select_all(problem, options, pairs, rigid, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type), intent(in) :: rigid
      type(modal_result_type), intent(inout) :: result
      type(modal_options_type) :: own

      own = options
      own%modes = huge(1)
      call append_pairs(pairs, rigid)
      call select_modes(problem, own, 2*problem%unknowns(), pairs, size(rigid%lambda), 0.0_wp, huge(1.0_wp), result)
   end subroutine select_all

   subroutine keep_pairs(pairs, kept)
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: kept(:)

      pairs%lambda = pairs%lambda(kept)
      pairs%phi = pairs%phi(:, kept)
      pairs%xi = pairs%xi(:, kept)
   end subroutine keep_pairs

   function no_pairs(problem) result(pairs)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type) :: pairs

      allocate (pairs%lambda(0), pairs%phi(problem%unknowns(), 0), pairs%xi(problem%multipliers(), 0))
   end function no_pairs

   ! What a result says of its problem, and a history without looks.
   subroutine describe_problem(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result

      result%method = "krylov-schur"
      result%unknowns = problem%unknowns()
      result%constraints = problem%multipliers()
      result%damping_kind = problem%damping_kind
      result%symmetric = problem%symmetric
      if (.not. allocated(result%inner)) result%inner = "none: nothing was solved"
      if (.not. allocated(result%history%converged)) allocate (result%history%converged(0), &
         result%history%operator_applications(0), result%history%residual(0))
   end subroutine describe_problem

   ! Adds what a run took; of the last one the shift and what was factored.
   subroutine add_run(run, result)
      type(modal_result_type), intent(in) :: run
      type(modal_result_type), intent(inout) :: result

      if (.not. allocated(result%history%converged)) then
         result%history = run%history
      else
         result%history%converged = [result%history%converged, run%history%converged]
         result%history%operator_applications = [result%history%operator_applications, &
            result%operator_applications + run%history%operator_applications]
         result%history%residual = [result%history%residual, run%history%residual]
      end if
      result%shift = run%shift
      result%inner = run%inner
      result%factored_order = run%factored_order
      result%factor_entries = run%factor_entries
      call result%add_effort(run)
      result%locking_error = max(result%locking_error, run%locking_error)
   end subroutine add_run
end module kschur_band
