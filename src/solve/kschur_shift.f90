!> Where a formulation is factored: at the shift that was given, next to a target, or at the scale of the wanted modes.
!>
!> Each place has candidates, and the first that is no eigenvalue is factored. A scale is what was observed: by a few
!> steps on the stiffness, by a few at the shift, by the modes that were found from there.
module kschur_shift
   use kschur_block_choice, only: chosen_block
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_error, only: error_type, new_error, error_convergence, error_singular
   use kschur_factoring, only: factor_at
   use kschur_formulation, only: is_structured
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_lowest, only: find_lowest_frequencies
   use kschur_modal_selection, only: modal_selection_type
   use kschur_mode_selection, only: largest_rate
   use kschur_monitor, only: stopper_type
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_options, only: formulation_low_rank, formulation_proportional, formulation_quadratic, formulation_symmetric, &
      inner_auto
   use kschur_scaled_solver, only: scaled_real_type
   use kschur_scaling, only: first_scale, typical_rate
   use kschur_text, only: magnitude
   use kschur_tolerances, only: above_the_typical, nearly_zero, too_far
   implicit none
   private
   public :: factor_beside, move_to_modes, place_shift, scale_of

   ! A shift within this factor of that place is left where it is.
   real(wp), parameter :: close_enough = 4
   integer, parameter :: shift_attempts = 5
   ! A few steps tell a scale to this part of it.
   real(wp), parameter :: roughly = 0.1_wp
   ! From zero, eigenvalues so many times the lowest are told as well as from among them.
   real(wp), parameter :: seen_from_zero = 30
   ! Where to, by what factors, should it be an eigenvalue.
   real(wp), parameter :: moved(3) = [1.0_wp, 1.1_wp, 1.3_wp]
   ! To the right of a target a stable system has no eigenvalue.
   real(wp), parameter :: off_axis(3) = [0.01_wp, 0.03_wp, 0.1_wp]

contains

   !> Factors at the shift that was given, next to a target, or, where that is
   !> small, at the scale of the lowest modes. Sets s%transform and s%shift.
   subroutine place_shift(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: scale, suggested
      integer :: search
      logical :: placed

      call s%enter_phase("factorisation", error, whole_iterated)
      if (allocated(error)) return
      suggested = first_scale(s%work)
      scale = s%scale
      if (.not. scale > 0) scale = max(suggested, s%known%deflation%zero_noise)
      if (.not. (allocated(s%options%shift) .or. serves_all(s)) .and. abs(s%options%target) <= suggested) then
         if (may_stay_at_zero(s)) then
            call try_zero(s, scale, placed, error)
            if (allocated(error) .or. placed) return
         else
            call observe_stiffness(s, scale, error)
         end if
      end if
      call s%drop_stiffness()
      if (allocated(error)) return
      if (allocated(s%options%shift)) then
         call factor_first(s, s%formulation, beside(s, s%options%shift), error, s%options%shift)
         return
      end if
      if (abs(s%options%target) <= suggested) then
         ! A pencil has infinite eigenvalues and costs more: the structured form tells the scale.
         search = merge(s%formulation, formulation_quadratic, is_structured(s%formulation))
         if (allocated(s%last)) then
            call factor_first(s, search, moved*scale*direction_of(s), error)
         else
            call factor_at_scale(s, search, scale, error)
         end if
         if (allocated(error)) return
         s%scale = scale
         if (abs(s%options%target) <= scale .and. search == s%formulation) return
         call s%drop_transform()
      else
         scale = 0
      end if
      if (abs(s%options%target) <= scale) then
         call factor_first(s, s%formulation, moved*scale*direction_of(s), error)
      else if (s%dense) then
         call factor_first(s, s%formulation, moved*min(abs(s%options%target), largest_rate(s%work))*direction_of(s), error)
      else
         call factor_first(s, s%formulation, s%options%target + off_axis*abs(s%options%target), error)
      end if
   end subroutine place_shift

   ! In which direction from zero the shift lies: where both of a conjugate pair are eigenvalues on the real axis, with losses among
   ! those above it, and to the right of where a stable system has them.
   pure complex(wp) function direction_of(s) result(direction)
      type(solve_context_type), intent(in) :: s
      complex(wp), parameter :: above = (0.28_wp, 0.96_wp)

      direction = merge(above, (1.0_wp, 0.0_wp), s%is_lossy() .and. s%formulation == formulation_quadratic)
   end function direction_of

   ! Whether the factors of the stiffness serve the iteration: what is zero is then not in it.
   pure logical function may_stay_at_zero(s)
      type(solve_context_type), intent(in) :: s

      may_stay_at_zero = allocated(s%known%stiffness) .and. s%work%symmetric .and. s%known%deflation%not_deflated == 0 .and. &
         s%options%inner == inner_auto .and. .not. (s%dense .or. allocated(s%last)) .and. any(s%formulation == &
         [formulation_symmetric, formulation_proportional, formulation_quadratic, formulation_low_rank]) .and. &
         .not. (s%is_lossy() .and. s%formulation == formulation_quadratic)
      if (may_stay_at_zero) may_stay_at_zero = s%known%stiffness%exact
   end function may_stay_at_zero

   ! Iterates at the shift zero, on the factors of the stiffness, a few steps, which tell the scale (1/s). It stays there
   ! unless what is wanted spreads too far: from zero the highest would have fewer digits.
   subroutine try_zero(s, scale, placed, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(inout) :: scale
      logical, intent(out) :: placed
      type(error_type), allocatable, intent(out) :: error
      type(scaled_real_type), allocatable :: scaled
      class(real_linear_solver_type), allocatable :: solver
      real(wp) :: observed, spread

      placed = .false.
      allocate (scaled)
      call s%effort%add_solves(s%known%stiffness%solver)
      s%known%stiffness%solver%solve_seconds = 0
      call move_alloc(s%known%stiffness%solver, scaled%factors)
      call move_alloc(s%known%stiffness%scaling, scaled%scaling)
      deallocate (s%known%stiffness)
      call move_alloc(scaled, solver)
      s%scale = scale
      call factor_at(s, s%formulation, (0.0_wp, 0.0_wp), error, solver)
      if (.not. allocated(error)) call observe_here(s, observed, error, spread)
      if (allocated(error)) then
         if (all(error%code /= [error_convergence, error_singular])) return
         deallocate (error)
         return
      end if
      if (observed > 0) scale = observed
      s%scale = scale
      placed = spread <= seen_from_zero
   end subroutine try_zero

   !> Factors at a shift, or beside it if it is an eigenvalue.
   subroutine factor_beside(s, shift, error)
      type(solve_context_type), target, intent(inout) :: s
      complex(wp), intent(in) :: shift
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(moved)
         call factor_at(s, s%formulation, moved(i)*shift, error)
         if (.not. allocated(error)) return
         if (error%code /= error_singular) return
      end do
   end subroutine factor_beside

   !> Goes to the scale of eigenvalues that were found, where from target and shift most of them look alike; back to where it was
   !> if nothing can be factored there.
   subroutine move_to_modes(s, lambda, has_moved, error)
      type(solve_context_type), target, intent(inout) :: s
      complex(wp), intent(in) :: lambda(:)
      logical, intent(out) :: has_moved
      type(error_type), allocatable, intent(out) :: error
      ! Wanted eigenvalues of this part of the shift all look alike from there.
      real(wp), parameter :: much_smaller = 1.0e-2_wp, above_them = 2
      complex(wp) :: before
      real(wp) :: limit

      limit = much_smaller*min(abs(s%options%target), abs(s%shift))
      has_moved = .not. (s%dense .or. allocated(s%options%shift)) .and. 2*count(abs(lambda) < limit) > size(lambda) .and. &
         maxval(abs(lambda), abs(lambda) < limit) > 0
      if (.not. has_moved) return
      before = s%shift
      associate (target => s%options%target)
         call factor_beside(s, above_them*maxval(abs(lambda), abs(lambda) < limit)*target/abs(target), error)
      end associate
      if (.not. allocated(error)) return
      if (error%code /= error_singular) return
      ! Rounding of rigid motions drowns all else there.
      has_moved = .false.
      call factor_at(s, s%formulation, before, error)
   end subroutine move_to_modes

   ! The shift of a user and, should it be an eigenvalue, others next to it. Zeros are double: next
   ! to zero it is the square of a shift that rounding must leave visible.
   function beside(s, shift) result(shifts)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: shift
      complex(wp), allocatable :: shifts(:)
      real(wp), parameter :: steps(5) = [1.0e-8_wp, 1.0e-7_wp, 1.0e-6_wp, 1.0e-5_wp, 1.0e-4_wp], &
         above_zero(5) = [1, 2, 5, 10, 20]
      real(wp) :: visible
      logical :: hidden

      ! Whether rounding does not tell it from the eigenvalue zero.
      hidden = size(s%known%rigid%lambda) > 0 .and. .not. abs(shift) > 0
      if (is_structured(s%formulation)) hidden = hidden .or. abs(shift) < s%known%deflation%zero_noise
      visible = max(0.01_wp*first_scale(s%work), s%known%deflation%zero_noise)
      allocate (shifts(6))
      shifts(1) = shift
      shifts(2:) = shift*(1 + steps)
      if (abs(shift) < visible) shifts(2:) = above_zero*visible
      if (hidden) shifts = shifts(2:)
   end function beside

   ! At the first of some shifts that is neither an eigenvalue nor so near to one that
   ! it blurs the others.
   subroutine factor_first(s, formulation, shifts, error, given)
      type(solve_context_type), target, intent(inout) :: s
      integer, intent(in) :: formulation
      complex(wp), intent(in) :: shifts(:)
      type(error_type), allocatable, intent(out) :: error
      !> Where it should be; absent: at the first.
      complex(wp), optional, intent(in) :: given
      complex(wp) :: wanted
      integer :: i

      wanted = shifts(1)
      if (present(given)) wanted = given
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

   ! At the scale of the lowest modes, found by trial.
   subroutine factor_at_scale(s, formulation, scale, error)
      type(solve_context_type), target, intent(inout) :: s
      integer, intent(in) :: formulation
      !> The shift (1/s): the first one to be tried, and the one that was taken.
      real(wp), intent(inout) :: scale
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: decades = 100, enough_below = 1.0e-2_wp
      real(wp) :: previous, observed
      integer :: attempt
      logical :: placed

      previous = scale
      placed = .false.
      do attempt = 1, shift_attempts
         call factor_first(s, formulation, moved*scale*direction_of(s), error)
         scale = abs(s%shift)
         observed = 0
         placed = placed .or. .not. allocated(error)
         ! Nobody waits for a better one.
         if (.not. allocated(error)) then
            if (s%is_stopped()) return
         end if
         if (.not. allocated(error) .and. attempt < shift_attempts) call observe_here(s, observed, error)
         if (allocated(error)) then
            if (error%code == error_singular .and. .not. placed .and. attempt < shift_attempts) then
               ! At a low shift rounding may drown all but the rigid motions.
               scale = decades*scale
               previous = scale
               cycle
            end if
            if (all(error%code /= [error_singular, error_convergence]) .or. attempt == 1) return
            scale = previous
            call factor_at(s, formulation, scale*direction_of(s), error)
            return
         end if
         if (.not. observed > 0) return
         observed = max(observed, s%known%deflation%zero_noise)
         if (observed >= scale/close_enough .and. observed <= scale*close_enough) return
         if (serves_all(s) .and. observed >= enough_below*scale) return
         previous = scale
         scale = observed
      end do
   end subroutine factor_at_scale

   ! Whether any shift that is low serves all eigenvalues, as their matrix is balanced; rigid motions would drown others.
   pure logical function serves_all(s)
      type(solve_context_type), intent(in) :: s

      serves_all = s%dense .and. size(s%known%rigid%lambda) == 0
   end function serves_all

   ! The scale of the lowest undamped frequencies in place of the one that is given; damping may put the eigenvalues
   ! elsewhere.
   subroutine observe_stiffness(s, scale, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(inout) :: scale
      type(error_type), allocatable, intent(out) :: error
      ! One that is far below all others hides them.
      integer, parameter :: enough = 4
      real(wp), allocatable :: frequencies(:)
      integer :: movable

      if (.not. allocated(s%known%stiffness)) return
      ! Rigid motions that stay in the iteration are all that it would see.
      if (s%known%deflation%not_deflated == 0) then
         call find_lowest_frequencies(s%work, s%known, s%options%modes, s%options%seed, s%processes, frequencies, s%effort, &
            error)
         if (allocated(error)) then
            ! The stiffness may be nearer to singular than the problem is at any shift.
            if (all(error%code /= [error_convergence, error_singular])) return
            deallocate (error)
         else
            movable = s%work%unknowns() - s%work%multipliers() - size(s%known%deflation%decay)
            call observe(frequencies, 0.0_wp, min(too_far*minval([huge(1.0_wp), frequencies]), &
               above_the_typical*typical_rate(s%work)), &
               max(1, min(enough, s%options%modes - size(s%known%deflation%eigenvalues()), movable)), scale)
         end if
      end if
   end subroutine observe_stiffness

   ! The scale of what a few steps at the shift tell; zero where they do not tell.
   subroutine observe_here(s, scale, error, spread)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(out) :: scale
      type(error_type), allocatable, intent(out) :: error
      !> The ratio of the highest to the lowest of them.
      real(wp), optional, intent(out) :: spread
      type(modal_selection_type) :: selection
      type(ritz_pairs_type) :: ritz
      type(stopper_type) :: stopper
      complex(wp) :: lambdas(2)
      real(wp), allocatable :: magnitudes(:)
      logical, allocatable :: real_ones(:)
      real(wp) :: furthest
      ! A polynomial of lower degree tells nothing.
      integer, parameter :: steps = 6
      integer :: subspace, block, i

      scale = 0
      if (present(spread)) spread = 1
      block = 1
      if (s%formulation /= formulation_low_rank) block = chosen_block(s, merge(1, 2, s%transform%map%oscillator)*s%options%modes)
      selection = modal_selection_type(s%options%modes, s%transform%map, s%transform%shift, s%options%target, &
         s%known%deflation%eigenvalues(), s%is_lossy())
      ! A mode is one value of an oscillator, and two otherwise.
      subspace = max(merge(20, 30, s%transform%map%oscillator), steps*block)
      stopper%of => s%monitor
      ! The search goes on from there, if it may have a space as large.
      call s%transform%iterate(selection, krylov_options_type(subspace=subspace, tolerance=roughly, max_restarts=1, &
         seed=s%options%seed, block=block, verify=.false., observes=.true., processes=s%processes, &
         keep=s%options%subspace == 0 .or. s%options%subspace >= subspace), ritz, error, stopper)
      if (allocated(error)) return
      s%effort%operator_applications = s%effort%operator_applications + ritz%statistics%operator_applications
      s%effort%seconds%orthogonalize = s%effort%seconds%orthogonalize + ritz%statistics%orthogonalize_seconds
      allocate (magnitudes(size(ritz%mu)), real_ones(size(ritz%mu)))
      do i = 1, size(ritz%mu)
         lambdas = s%transform%map%lambdas(s%transform%theta(ritz%mu(i)))
         magnitudes(i) = maxval(abs(lambdas))
         real_ones(i) = .not. any(abs(aimag(lambdas)) > 0)
      end do
      if (size(magnitudes) == 0) return
      furthest = too_far*merge(abs(s%shift), minval(magnitudes), abs(s%shift) > 0)
      call observe(but_lowest(magnitudes, real_ones, slow_decays(s)), nearly_zero*abs(s%shift), &
         min(furthest, above_the_typical*typical_rate(s%work)), 1, scale, spread)
   end subroutine observe_here

   ! How many eigenvalues rigid motions have beside the zeros, where damping keeps them in the iteration. Like those zeros
   ! they tell no scale: the frequencies may lie decades above them.
   integer function slow_decays(s)
      type(solve_context_type), intent(in) :: s

      associate (deflation => s%known%deflation)
         slow_decays = max(2*deflation%not_deflated - deflation%zero%states(), 0)
      end associate
   end function slow_decays

   ! Without the lowest of those that count, so many at most; with them where nothing else is there.
   pure function but_lowest(magnitudes, counts, most) result(left)
      real(wp), intent(in) :: magnitudes(:)
      logical, intent(in) :: counts(:)
      integer, intent(in) :: most
      real(wp), allocatable :: left(:)
      logical :: stays(size(magnitudes))
      integer :: i

      stays = .true.
      do i = 1, min(most, count(counts))
         stays(minloc(magnitudes, 1, counts .and. stays)) = .false.
      end do
      if (.not. any(stays)) stays = .true.
      allocate (left, source=pack(magnitudes, stays))
   end function but_lowest

   !> The scale of modes that were found (1/s); as it was where they do not tell.
   real(wp) function scale_of(lambda, before) result(scale)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: before

      scale = before
      call observe(abs(lambda), tiny(1.0_wp), huge(1.0_wp), 1, scale)
   end function scale_of

   ! The middle, by ratio, of those of some |lambda| that lie between two bounds, if they are enough: from there both ends
   ! are found with the same digits.
   subroutine observe(magnitudes, least, most, enough, scale, spread)
      real(wp), intent(in) :: magnitudes(:), least, most
      integer, intent(in) :: enough
      real(wp), intent(inout) :: scale
      !> Of the highest to the lowest of them; as it was where they are too few.
      real(wp), optional, intent(inout) :: spread
      ! What is far below the shift looks alike, and is lower than it looks; what is far beyond is lost.
      real(wp), parameter :: above_the_smallest = 10, below_the_largest = 1.0e-2_wp
      real(wp) :: smallest, largest
      logical :: seen(size(magnitudes))

      seen = magnitudes >= least .and. magnitudes <= most
      if (count(seen) < enough) return
      smallest = minval(magnitudes, seen)
      largest = maxval(magnitudes, seen)
      scale = max(min(sqrt(smallest*largest), above_the_smallest*smallest), below_the_largest*largest)
      if (present(spread)) spread = largest/smallest
   end subroutine observe
end module kschur_shift
