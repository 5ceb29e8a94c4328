!> Chooses the shift and factors there: at the shift of the options, next to the target, or at the scale of the wanted modes.
!>
!> Each of these has candidates, of which the first that is no eigenvalue is factored. The scale is observed, by a few steps of an
!> iteration on the factored stiffness, by a few at the shift, or by the modes found from there (docs/theory.md, section 10).
module kschur_shift
   use kschur_block_choice, only: chosen_block
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_error, only: error_type, new_error, error_convergence, error_singular
   use kschur_factoring, only: factor_at
   use kschur_formulation, only: is_structured
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_lowest, only: estimate_lowest_frequency, find_lowest_frequencies
   use kschur_modal_selection, only: modal_selection_type
   use kschur_mode_selection, only: largest_rate
   use kschur_monitor, only: stopper_type
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_options, only: formulation_low_rank, formulation_proportional, formulation_quadratic, formulation_symmetric, &
      inner_auto, inner_iterative
   use kschur_scaled_solver, only: scaled_real_type
   use kschur_scaling, only: constraint_factors, first_scale, typical_rate
   use kschur_text, only: magnitude
   use kschur_tolerances, only: above_the_typical, nearly_zero, root_epsilon, too_far
   implicit none
   private
   public :: factor_beside, move_to_modes, place_shift, scale_of

   ! A shift within this factor of the observed scale is kept.
   real(wp), parameter :: close_enough = 4
   ! Largest number of shifts that are tried for a scale.
   integer, parameter :: shift_attempts = 5
   ! Tolerance of the few steps that observe a scale.
   real(wp), parameter :: rough_tolerance = 0.1_wp
   ! Largest ratio of wanted eigenvalues that the shift zero serves as well as a shift among them: in symmetric problems, where
   ! Rayleigh's functional makes those far from the shift accurate, and in others.
   real(wp), parameter :: seen_from_zero = 30, seen_without_functional = 10
   ! Factors that move a shift, in turn, if it is an eigenvalue.
   real(wp), parameter :: moving_factors(3) = [1.0_wp, 1.1_wp, 1.3_wp]
   ! Distances of the shift to the right of a target, relative to it, in turn: a stable system has no eigenvalue there.
   real(wp), parameter :: off_axis(3) = [0.01_wp, 0.03_wp, 0.1_wp]

contains

   !> Chooses the shift and factors there: at the shift of the options, next to the target, or if the target is near zero at the
   !> scale of the lowest modes. Sets s%transform and s%shift. Fails with `error_singular` if each candidate is an eigenvalue.
   subroutine place_shift(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: scale, estimated_scale
      integer :: scale_formulation
      logical :: placed

      call s%enter_phase("factorisation", error, whole_iterated)
      if (allocated(error)) return
      estimated_scale = first_scale(s%work)
      scale = s%scale
      if (.not. scale > 0) scale = max(estimated_scale, s%known%deflation%zero_noise)
      if (.not. (allocated(s%options%shift) .or. any_low_shift_serves(s)) .and. abs(s%options%target) <= estimated_scale) then
         if (zero_may_serve(s)) then
            call try_zero(s, scale, placed, error)
            if (allocated(error) .or. placed) return
         else
            call observe_stiffness(s, scale, error)
         end if
      end if
      call s%drop_stiffness()
      if (allocated(error)) return
      if (allocated(s%options%shift)) then
         call factor_first(s, s%formulation, candidates_beside(s, s%options%shift), error, s%options%shift)
         return
      end if
      if (abs(s%options%target) <= estimated_scale) then
         ! A pencil has more infinite eigenvalues and costs more: the quadratic form observes the scale in its place.
         scale_formulation = merge(s%formulation, formulation_quadratic, is_structured(s%formulation))
         if (allocated(s%last)) then
            call factor_first(s, scale_formulation, moving_factors*scale*shift_direction(s), error)
         else
            call factor_at_scale(s, scale_formulation, scale, error)
         end if
         if (allocated(error)) return
         s%scale = scale
         if (abs(s%options%target) <= scale .and. scale_formulation == s%formulation) return
         call s%drop_transform()
      else
         scale = 0
      end if
      if (abs(s%options%target) <= scale) then
         call factor_first(s, s%formulation, moving_factors*scale*shift_direction(s), error)
      else if (s%dense) then
         call factor_first(s, s%formulation, moving_factors* &
            min(abs(s%options%target), largest_rate(s%work))*shift_direction(s), error)
      else
         call factor_first(s, s%formulation, s%options%target + off_axis*abs(s%options%target), error)
         if (.not. allocated(error)) return
         ! Copies that are known badly make all shifts next to them singular to rounding.
         if (error%code == error_singular) &
            call factor_first(s, s%formulation, moving_factors*abs(s%options%target)*shift_direction(s), error)
      end if
   end subroutine place_shift

   ! Direction of the shift from zero, to the right of the eigenvalues of a stable system: on the real axis, as near to both of a
   ! conjugate pair; with losses above it, as only the eigenvalues there are modes.
   pure complex(wp) function shift_direction(s) result(direction)
      type(solve_context_type), intent(in) :: s
      complex(wp), parameter :: above = (0.28_wp, 0.96_wp)

      direction = merge(above, (1.0_wp, 0.0_wp), iterates_complex(s))
   end function shift_direction

   ! Whether complex matrices are factored because of losses.
   pure logical function iterates_complex(s)
      type(solve_context_type), intent(in) :: s

      iterates_complex = s%is_lossy() .and. all(s%formulation /= [formulation_proportional, formulation_low_rank])
   end function iterates_complex

   ! Whether the factors of the stiffness can serve an iteration at the shift zero: they are exact, not perturbed, and all rigid
   ! motions are deflated. With constraints only for symmetric operators: the others recover multipliers from solutions in which
   ! reactions to what null pivots leave are large. Not for a dense solve, nor if the options name a direct solver, nor if earlier
   ! modes give the scale.
   pure logical function zero_may_serve(s)
      type(solve_context_type), intent(in) :: s

      zero_may_serve = allocated(s%known%stiffness) .and. s%known%deflation%not_deflated == 0 .and. &
         any(s%options%inner == [inner_auto, inner_iterative]) .and. .not. (s%dense .or. allocated(s%last)) .and. &
         any(s%formulation == [formulation_symmetric, formulation_proportional, formulation_quadratic, formulation_low_rank]) &
         .and. .not. iterates_complex(s)
      if (s%work%multipliers() > 0) zero_may_serve = zero_may_serve .and. &
         any(s%formulation == [formulation_symmetric, formulation_proportional])
      if (zero_may_serve) zero_may_serve = s%known%stiffness%exact
   end function zero_may_serve

   ! Takes over the factors of the stiffness for the shift zero, and observes the scale (1/s) by a few steps there. The shift stays
   ! at zero (`placed`) unless the wanted eigenvalues spread so far that the highest would lose digits, or the steps fail.
   subroutine try_zero(s, scale, placed, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(inout) :: scale
      logical, intent(out) :: placed
      type(error_type), allocatable, intent(out) :: error
      type(scaled_real_type), allocatable :: scaled
      class(real_linear_solver_type), allocatable :: solver
      real(wp) :: observed, spread

      placed = .false.
      s%scale = scale
      ! The unit of velocities, where the shift is none. With one far below the frequencies the numerical range of the operator has
      ! real values, up to half of its inverse, among those of the wanted modes: false Ritz values.
      if (s%formulation == formulation_quadratic) &
         call estimate_lowest_frequency(s%work, s%known, s%options%seed, s%scale, s%effort, error)
      if (allocated(error)) then
         if (all(error%code /= [error_convergence, error_singular])) return
         deallocate (error)
      end if
      call s%effort%add_solves(s%known%stiffness%solver)
      s%known%stiffness%solver%solve_seconds = 0
      allocate (scaled)
      ! The matrix of an iteration has factors of its constraints.
      associate (n => s%work%unknowns(), scaling => s%known%stiffness%row_scaling)
         scaling(n + 1:) = scaling(n + 1:)/constraint_factors(s%work, s%options%constraint_scaling, (0.0_wp, 0.0_wp))
      end associate
      call scaled%take(s%known%stiffness%solver, s%known%stiffness%row_scaling)
      deallocate (s%known%stiffness)
      call move_alloc(scaled, solver)
      call factor_at(s, s%formulation, (0.0_wp, 0.0_wp), error, solver)
      if (.not. allocated(error)) call observe_here(s, observed, error, spread)
      if (allocated(error)) then
         if (all(error%code /= [error_convergence, error_singular])) return
         deallocate (error)
         return
      end if
      if (observed > 0) scale = observed
      s%scale = scale
      placed = spread <= merge(seen_from_zero, seen_without_functional, s%work%symmetric)
   end subroutine try_zero

   !> Factors at a shift, moved a little if it is an eigenvalue.
   subroutine factor_beside(s, shift, error)
      type(solve_context_type), target, intent(inout) :: s
      complex(wp), intent(in) :: shift
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(moving_factors)
         call factor_at(s, s%formulation, moving_factors(i)*shift, error)
         if (.not. allocated(error)) return
         if (error%code /= error_singular) return
      end do
   end subroutine factor_beside

   !> Moves the shift to the scale of the eigenvalues found, if most of them are so far below target and shift that they look alike
   !> from there, or between the smallest and the largest that is not infinite, if the smallest has lost half of its digits to the
   !> shift; factors at the former shift again if each shift at that scale is singular.
   subroutine move_to_modes(s, lambda, has_moved, error)
      type(solve_context_type), target, intent(inout) :: s
      complex(wp), intent(in) :: lambda(:)
      logical, intent(out) :: has_moved
      type(error_type), allocatable, intent(out) :: error
      ! Eigenvalues below this fraction of the shift look alike from there; the new shift is this multiple of the largest of them.
      real(wp), parameter :: much_smaller = 1.0e-2_wp, above_them = 2
      complex(wp) :: former_shift, moved
      real(wp) :: sizes(size(lambda)), limit
      logical :: are_alike, is_wide

      has_moved = .false.
      if (s%dense .or. allocated(s%options%shift) .or. size(lambda) == 0) return
      ! Zeros that are not locked are found again, split by rounding: no scale.
      if (s%known%deflation%not_deflated > 0 .and. s%known%deflation%zero%states() == 0) return
      sizes = abs(lambda)
      limit = much_smaller*min(abs(s%options%target), abs(s%shift))
      are_alike = 2*count(sizes < limit) > size(lambda) .and. maxval(sizes, sizes < limit) > s%known%deflation%zero_noise
      ! Plain ARPACK finds zeros, split by rounding.
      is_wide = minval(sizes) < root_epsilon*abs(s%shift) .and. minval(sizes) > s%known%deflation%zero_noise .and. &
         abs(s%options%target) < minval(sizes) .and. .not. s%options%is_plain()
      if (.not. (are_alike .or. is_wide)) return
      former_shift = s%shift
      if (are_alike) then
         moved = above_them*maxval(sizes, sizes < limit)*s%options%target/abs(s%options%target)
      else
         moved = sqrt(minval(sizes))*sqrt(maxval(sizes, sizes < too_far*abs(s%shift)))*shift_direction(s)
      end if
      do
         call factor_beside(s, moved, error)
         has_moved = .not. allocated(error)
         if (has_moved) return
         if (error%code /= error_singular) return
         ! Rounding along rigid motions exceeds all else at such a low shift.
         moved = sqrt(abs(moved))*sqrt(abs(former_shift))*shift_direction(s)
         if (are_alike .or. abs(moved) >= much_smaller*abs(former_shift)) exit
      end do
      call factor_at(s, s%formulation, former_shift, error)
   end subroutine move_to_modes

   ! Candidates for the shift of the options: itself unless it is a known zero, and others next to it. Zeros are double: so near
   ! zero, the square of a shift must exceed rounding.
   function candidates_beside(s, shift) result(shifts)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: shift
      complex(wp), allocatable :: shifts(:)
      real(wp), parameter :: steps(5) = [1.0e-8_wp, 1.0e-7_wp, 1.0e-6_wp, 1.0e-5_wp, 1.0e-4_wp], &
         above_zero(5) = [1, 2, 5, 10, 20]
      real(wp) :: least_shift
      logical :: is_zero

      ! Whether the shift is the eigenvalue zero, to rounding.
      is_zero = size(s%known%rigid%lambda) > 0 .and. .not. abs(shift) > 0
      if (is_structured(s%formulation)) is_zero = is_zero .or. abs(shift) < s%known%deflation%zero_noise
      least_shift = max(0.01_wp*first_scale(s%work), s%known%deflation%zero_noise)
      allocate (shifts(6))
      shifts(1) = shift
      shifts(2:) = shift*(1 + steps)
      if (abs(shift) < least_shift) shifts(2:) = above_zero*least_shift
      if (is_zero) shifts = shifts(2:)
   end function candidates_beside

   ! Factors at the first candidate that is neither an eigenvalue nor so near to one that rounding errors along its eigenvector
   ! spoil the others. A note says if that is not the wanted shift.
   subroutine factor_first(s, formulation, shifts, error, desired)
      type(solve_context_type), target, intent(inout) :: s
      integer, intent(in) :: formulation
      complex(wp), intent(in) :: shifts(:)
      type(error_type), allocatable, intent(out) :: error
      !> The wanted shift; absent: the first candidate.
      complex(wp), optional, intent(in) :: desired
      complex(wp) :: wanted
      integer :: i

      wanted = shifts(1)
      if (present(desired)) wanted = desired
      do i = 1, size(shifts)
         call factor_at(s, formulation, shifts(i), error)
         if (.not. allocated(error)) exit
         if (error%code /= error_singular) return
      end do
      if (allocated(error)) then
         call new_error(error, error_singular, "the problem is singular for every lambda, "// &
            "as it seems: it is at each shift that was tried")
      else if (abs(s%shift - wanted) > 0) then
         call s%add_note("the shift is an eigenvalue, or next to one: it was moved by "// &
            magnitude(abs(s%shift - wanted))//" 1/s")
      end if
   end subroutine factor_first

   ! Factors at the scale of the lowest modes: observes the scale at the shift, and moves there until it stays within a factor of 4.
   subroutine factor_at_scale(s, formulation, scale, error)
      type(solve_context_type), target, intent(inout) :: s
      integer, intent(in) :: formulation
      !> First shift to be tried, and the final one (1/s).
      real(wp), intent(inout) :: scale
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: decades = 100, enough_below = 1.0e-2_wp
      real(wp) :: previous, observed
      integer :: attempt
      logical :: placed

      previous = scale
      placed = .false.
      do attempt = 1, shift_attempts
         call factor_first(s, formulation, moving_factors*scale*shift_direction(s), error)
         scale = abs(s%shift)
         observed = 0
         placed = placed .or. .not. allocated(error)
         ! A cancelled solve needs no better shift.
         if (.not. allocated(error)) then
            if (s%is_stopped()) return
         end if
         if (.not. allocated(error) .and. attempt < shift_attempts) call observe_here(s, observed, error)
         if (allocated(error)) then
            if (error%code == error_singular .and. .not. placed .and. attempt < shift_attempts) then
               ! At a low shift rounding along rigid motions may exceed all else.
               scale = decades*scale
               previous = scale
               cycle
            end if
            if (all(error%code /= [error_singular, error_convergence]) .or. attempt == 1) return
            scale = previous
            call factor_at(s, formulation, scale*shift_direction(s), error)
            return
         end if
         if (.not. observed > 0) return
         observed = max(observed, s%known%deflation%zero_noise)
         if (observed >= scale/close_enough .and. observed <= scale*close_enough) return
         if (any_low_shift_serves(s) .and. observed >= enough_below*scale) return
         previous = scale
         scale = observed
      end do
   end subroutine factor_at_scale

   ! Whether any low shift serves: for a dense solve, whose matrix is balanced, without rigid motions, along which rounding would
   ! exceed all else.
   pure logical function any_low_shift_serves(s)
      type(solve_context_type), intent(in) :: s

      any_low_shift_serves = s%dense .and. size(s%known%rigid%lambda) == 0
   end function any_low_shift_serves

   ! Replaces the scale by that of the lowest undamped frequencies, which a few steps on the factored stiffness give, if enough are
   ! seen. With damping the eigenvalues may have another scale.
   subroutine observe_stiffness(s, scale, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(inout) :: scale
      type(error_type), allocatable, intent(out) :: error
      ! Least number of frequencies: a single one far below all others would tell nothing about them.
      integer, parameter :: least_number = 4
      real(wp), allocatable :: frequencies(:)
      integer :: movable

      if (.not. allocated(s%known%stiffness)) return
      ! If rigid motions were not deflated, the iteration would find nothing else.
      if (s%known%deflation%not_deflated == 0) then
         call find_lowest_frequencies(s%work, s%known, s%options%modes, s%options%seed, s%processes, frequencies, s%effort, &
            error)
         if (allocated(error)) then
            ! The stiffness may be nearer to singular than the problem is at any shift.
            if (all(error%code /= [error_convergence, error_singular])) return
            deallocate (error)
         else
            movable = s%work%unknowns() - s%work%multipliers() - size(s%known%deflation%decay)
            call set_scale(frequencies, 0.0_wp, min(too_far*minval([huge(1.0_wp), frequencies]), &
               above_the_typical*typical_rate(s%work)), &
               max(1, min(least_number, s%options%modes - size(s%known%deflation%eigenvalues()), movable)), scale)
         end if
      end if
   end subroutine observe_stiffness

   ! Observes the scale by a few steps of an iteration at the current shift; zero if they show too few eigenvalues.
   subroutine observe_here(s, scale, error, spread)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(out) :: scale
      type(error_type), allocatable, intent(out) :: error
      !> Ratio of the largest to the smallest eigenvalue seen.
      real(wp), optional, intent(out) :: spread
      type(modal_selection_type) :: selection
      type(ritz_pairs_type) :: ritz
      type(stopper_type) :: stopper
      complex(wp) :: lambdas(2)
      real(wp), allocatable :: magnitudes(:)
      logical, allocatable :: is_real_eigenvalue(:)
      real(wp) :: furthest
      ! Least number of steps: a polynomial of lower degree shows no scale.
      integer, parameter :: steps = 6
      integer :: subspace, block, i

      scale = 0
      if (present(spread)) spread = 1
      block = chosen_block(s, merge(1, 2, s%transform%map%oscillator)*s%options%modes)
      selection = modal_selection_type(s%options%modes, s%transform%map, s%transform%shift, s%options%target, &
         s%known%deflation%eigenvalues(), s%is_lossy())
      ! A mode is one eigenvalue omega^2, or two lambda.
      subspace = max(merge(20, 30, s%transform%map%oscillator), steps*block)
      stopper%of => s%monitor
      ! The search continues with this Krylov space, unless the options limit it to a smaller one.
      call s%transform%iterate(selection, krylov_options_type(subspace=subspace, tolerance=rough_tolerance, max_restarts=1, &
         seed=s%options%seed, block=block, verify=.false., observes=.true., processes=s%processes, &
         keep=s%options%subspace == 0 .or. s%options%subspace >= subspace), ritz, error, stopper)
      if (allocated(error)) return
      s%effort%operator_applications = s%effort%operator_applications + ritz%statistics%operator_applications
      s%effort%seconds%orthogonalize = s%effort%seconds%orthogonalize + ritz%statistics%orthogonalize_seconds
      allocate (magnitudes(size(ritz%mu)), is_real_eigenvalue(size(ritz%mu)))
      do i = 1, size(ritz%mu)
         lambdas = s%transform%map%lambdas(s%transform%theta(ritz%mu(i)))
         magnitudes(i) = maxval(abs(lambdas))
         is_real_eigenvalue(i) = .not. any(abs(aimag(lambdas)) > 0)
      end do
      if (size(magnitudes) == 0) return
      furthest = too_far*merge(abs(s%shift), minval(magnitudes), abs(s%shift) > 0)
      call set_scale(without_lowest(magnitudes, is_real_eigenvalue, count_slow_decays(s)), nearly_zero*abs(s%shift), &
         min(furthest, above_the_typical*typical_rate(s%work)), 1, scale, spread)
   end subroutine observe_here

   ! Number of nonzero eigenvalues (slow decays) of rigid motions that damping keeps from being deflated. Like zeros they tell
   ! nothing about the scale of the frequencies, which may lie decades above them.
   integer function count_slow_decays(s)
      type(solve_context_type), intent(in) :: s

      associate (deflation => s%known%deflation)
         count_slow_decays = max(2*deflation%not_deflated - deflation%zero%states(), 0)
      end associate
   end function count_slow_decays

   ! Leaves out the lowest of the magnitudes marked in `may_go`, at most `most` of them; none if nothing else would be left.
   pure function without_lowest(magnitudes, may_go, most) result(remaining)
      real(wp), intent(in) :: magnitudes(:)
      logical, intent(in) :: may_go(:)
      integer, intent(in) :: most
      real(wp), allocatable :: remaining(:)
      logical :: stays(size(magnitudes))
      integer :: i

      stays = .true.
      do i = 1, min(most, count(may_go))
         stays(minloc(magnitudes, 1, may_go .and. stays)) = .false.
      end do
      if (.not. any(stays)) stays = .true.
      allocate (remaining, source=pack(magnitudes, stays))
   end function without_lowest

   !> Scale of the modes found (1/s); the scale before if all are zero.
   real(wp) function scale_of(lambda, before) result(scale)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: before

      scale = before
      call set_scale(abs(lambda), tiny(1.0_wp), huge(1.0_wp), 1, scale)
   end function scale_of

   ! Sets the scale to the geometric mean of the smallest and largest |lambda| between two bounds, from where both lose equally many
   ! digits; at most ten times the smallest, and at least a hundredth of the largest; less where both lie close together. Leaves it
   ! if there are too few.
   subroutine set_scale(magnitudes, least, most, enough, scale, spread)
      real(wp), intent(in) :: magnitudes(:), least, most
      integer, intent(in) :: enough
      real(wp), intent(inout) :: scale
      !> Ratio of the largest to the smallest; unchanged if there are too few.
      real(wp), optional, intent(inout) :: spread
      ! Limits of the scale: eigenvalues far below a shift look alike, and are lower than they look; those far above are lost.
      real(wp), parameter :: above_the_smallest = 10, below_the_largest = 1.0e-2_wp
      ! As near to zero as the largest keeps all digits: measured.
      real(wp), parameter :: next_to_zero = 0.5_wp, keeps_the_largest = 0.2_wp
      real(wp) :: smallest, largest
      logical :: seen(size(magnitudes))

      seen = magnitudes >= least .and. magnitudes <= most
      if (count(seen) < enough) return
      smallest = minval(magnitudes, seen)
      largest = maxval(magnitudes, seen)
      scale = max(min(sqrt(smallest*largest), above_the_smallest*smallest), below_the_largest*largest)
      ! Where zero would serve as well: nearer to it, from where distances differ more.
      if (largest <= seen_without_functional*smallest) scale = max(next_to_zero*smallest, keeps_the_largest*largest)
      if (present(spread)) spread = largest/smallest
   end subroutine set_scale
end module kschur_shift
