!> Where a formulation is factored: at the shift that was given, or at one
!> chosen at the scale of the wanted modes.
module kschur_shift
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_convergence, error_singular, error_usage
   use kschur_formulation, only: is_structured
   use kschur_inner_solvers, only: inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_linear_solver, only: complex_linear_solver_type, real_linear_solver_type
   use kschur_lowest, only: find_lowest_frequencies
   use kschur_modal_selection, only: modal_selection_type
   use kschur_options, only: modal_options_type, formulation_names, formulation_proportional, formulation_quadratic, &
      formulation_symmetric, inner_ldl
   use kschur_pencil_transform, only: pencil_transform_type, new_pencil_transform
   use kschur_problem, only: modal_problem_type
   use kschur_quadratic_transform_complex, only: complex_quadratic_type => quadratic_transform_type, &
      new_complex_quadratic => new_quadratic_transform
   use kschur_quadratic_transform_real, only: real_quadratic_type => quadratic_transform_type, &
      new_real_quadratic => new_quadratic_transform
   use kschur_result, only: modal_result_type
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   use kschur_scaling, only: constraint_factors, typical_rate
   use kschur_symmetric_transform, only: symmetric_transform_type, new_symmetric_transform
   use kschur_text, only: magnitude
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: factor_beside, place_shift

   ! A shift within this factor of that place is left where it is.
   real(wp), parameter :: close_enough = 4
   integer, parameter :: shift_attempts = 5
   ! Beyond this, relative to the shift or to the lowest, an eigenvalue may be an infinite one that rounding
   ! blurred; that is far above a rate typical of the matrices.
   real(wp), parameter :: too_far = 1.0e5_wp, above_the_typical = 100
   ! Where to, by what factors, should it be an eigenvalue.
   real(wp), parameter :: moved(3) = [1.0_wp, 1.1_wp, 1.3_wp]

contains

   !> Factors at the shift that was given, next to a target, or, where that is
   !> small, at the scale of the lowest modes. Sets result%shift.
   subroutine place_shift(problem, stiffness, free, deflation, options, inner, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      !> Factored, as far as it is known. Gone on return.
      type(scaled_stiffness_type), allocatable, intent(inout) :: stiffness
      !> Whether zero is an eigenvalue.
      logical, intent(in) :: free
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: scale
      integer :: search
      logical :: at_scale
      ! Whether the shift is one that rounding does not tell from the eigenvalue zero.
      logical :: hidden

      at_scale = .not. allocated(options%shift) .and. abs(options%target) <= first_scale(problem)
      scale = max(first_scale(problem), deflation%blur)
      if (at_scale .and. allocated(stiffness)) call estimate_scale(problem, stiffness, deflation, options, scale, result, error)
      if (allocated(stiffness)) deallocate (stiffness)
      if (allocated(error)) return

      if (options%inner == inner_ldl .and. .not. is_structured(result%formulation)) then
         call refuse_complex(result%formulation, error)
      else if (allocated(options%shift)) then
         hidden = free .and. .not. abs(options%shift) > 0
         if (is_structured(result%formulation)) hidden = hidden .or. abs(options%shift) < deflation%blur
         call factor_at_first(problem, deflation, options, inner, result%formulation, &
            beside(problem, deflation, options%shift), transform, result, error, known=hidden)
      else if (.not. at_scale) then
         call factor_near_target(problem, deflation, options, inner, transform, result, error)
      else
         ! A pencil has infinite eigenvalues and costs more: the structured form tells the scale.
         search = merge(result%formulation, formulation_quadratic, is_structured(result%formulation))
         call factor_at_scale(problem, deflation, options, inner, search, transform, scale, result, error)
         if (allocated(error) .or. (abs(options%target) <= scale .and. search == result%formulation)) return
         call result%add_solver(transform%linear_solver())
         if (abs(options%target) <= scale) then
            call factor_at_first(problem, deflation, options, inner, result%formulation, cmplx(moved*scale, 0, wp), transform, &
               result, error)
         else
            call factor_near_target(problem, deflation, options, inner, transform, result, error)
         end if
      end if
   end subroutine place_shift

   ! To the right of the target, where a stable system has no eigenvalue.
   subroutine factor_near_target(problem, deflation, options, inner, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: off_axis(3) = [0.01_wp, 0.03_wp, 0.1_wp]

      call factor_at_first(problem, deflation, options, inner, result%formulation, &
         options%target + off_axis*abs(options%target), transform, result, error)
   end subroutine factor_near_target

   ! The shift of a user and, should it be an eigenvalue, others next to it. Zeros are double: next
   ! to zero it is the square of a shift that rounding must leave visible.
   function beside(problem, deflation, shift) result(shifts)
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), intent(in) :: deflation
      complex(wp), intent(in) :: shift
      complex(wp) :: shifts(6)
      real(wp), parameter :: steps(5) = [1.0e-8_wp, 1.0e-7_wp, 1.0e-6_wp, 1.0e-5_wp, 1.0e-4_wp], &
         above_zero(5) = [1, 2, 5, 10, 20]
      real(wp) :: visible

      visible = max(0.01_wp*first_scale(problem), deflation%blur)
      shifts(1) = shift
      shifts(2:) = shift*(1 + steps)
      if (abs(shift) < visible) shifts(2:) = above_zero*visible
   end function beside

   ! At the first of some shifts that is neither an eigenvalue nor so near to one that
   ! it blurs the others.
   subroutine factor_at_first(problem, deflation, options, inner, formulation, shifts, transform, result, error, known)
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: formulation
      complex(wp), intent(in) :: shifts(:)
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      ! Whether it is known that the first one is an eigenvalue.
      logical, optional, intent(in) :: known
      integer :: i, first

      first = 1
      if (present(known)) first = merge(2, 1, known)
      do i = first, size(shifts)
         call factor_at(problem, deflation, options, inner, formulation, shifts(i), transform, result, error)
         if (.not. allocated(error)) exit
         if (error%code /= error_singular) return
      end do
      if (allocated(error)) then
         call new_error(error, error_singular, "the problem is singular for every lambda, "// &
            "as it seems: it is at each shift that was tried")
      else if (i > 1) then
         call result%add_note("the shift is an eigenvalue, or next to one: it was moved by "// &
            magnitude(abs(shifts(i) - shifts(1)))//" 1/s")
      end if
   end subroutine factor_at_first

   ! At the scale of the lowest modes, found by trial.
   subroutine factor_at_scale(problem, deflation, options, inner, formulation, transform, scale, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: formulation
      class(transform_type), allocatable, intent(out) :: transform
      !> The shift (1/s): the first one to be tried, and the one that was taken.
      real(wp), intent(inout) :: scale
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: decades = 100
      real(wp) :: previous, proposed
      integer :: attempt
      logical :: placed

      previous = scale
      placed = .false.
      do attempt = 1, shift_attempts
         call factor_at_first(problem, deflation, options, inner, formulation, cmplx(moved*scale, 0, wp), transform, result, error)
         scale = real(result%shift, wp)
         proposed = 0
         placed = placed .or. .not. allocated(error)
         if (.not. allocated(error) .and. attempt < shift_attempts) &
            call propose_scale(transform, deflation, options, typical_rate(problem), result, proposed, error)
         if (allocated(error)) then
            if (error%code == error_singular .and. .not. placed .and. attempt < shift_attempts) then
               ! At a low shift rounding may drown all but the rigid motions.
               scale = decades*scale
               previous = scale
               cycle
            end if
            if (all(error%code /= [error_singular, error_convergence]) .or. attempt == 1) return
            scale = previous
            call factor_at(problem, deflation, options, inner, formulation, cmplx(scale, 0, wp), transform, result, error)
            return
         end if
         if (.not. proposed > 0) return
         proposed = max(proposed, deflation%blur)
         if (proposed >= scale/close_enough .and. proposed <= scale*close_enough) return
         call result%add_solver(transform%linear_solver())
         previous = scale
         scale = proposed
      end do
   end subroutine factor_at_scale

   ! The scale of the lowest undamped frequencies in place of the one that is given; damping
   ! may put the eigenvalues elsewhere.
   subroutine estimate_scale(problem, stiffness, deflation, options, scale, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(scaled_stiffness_type), target, intent(inout) :: stiffness
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      real(wp), intent(inout) :: scale
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      ! One that is far below all others hides them.
      integer, parameter :: enough = 4
      real(wp), allocatable :: frequencies(:)
      real(wp) :: before
      integer :: applications, movable

      ! Rigid motions that stay in the iteration are all that it would see.
      if (deflation%others > 0) return
      before = stiffness%solver%solve_seconds
      call find_lowest_frequencies(problem, stiffness, deflation, options%modes, options%seed, frequencies, applications, error)
      if (allocated(error)) then
         ! The stiffness may be nearer to singular than the problem is at any shift.
         if (any(error%code == [error_convergence, error_singular])) deallocate (error)
         return
      end if
      result%operator_applications = result%operator_applications + applications
      result%seconds%solve = result%seconds%solve + (stiffness%solver%solve_seconds - before)
      if (size(frequencies) > 0) frequencies = pack(frequencies, &
         frequencies <= min(too_far*minval(frequencies), above_the_typical*typical_rate(problem)))
      movable = problem%unknowns() - problem%multipliers() - size(deflation%decay)
      if (size(frequencies) >= max(1, min(enough, options%modes - size(deflation%eigenvalues()), movable))) &
         scale = middle(frequencies)
   end subroutine estimate_scale

   ! In the middle of the wanted |lambda|, by ratio, both ends are found with the same digits.
   real(wp) function middle(magnitudes)
      real(wp), intent(in) :: magnitudes(:)
      ! What is far below the shift looks alike, and is lower than it looks; what is far beyond is lost.
      real(wp), parameter :: above_the_smallest = 10, below_the_largest = 1.0e-2_wp

      associate (smallest => minval(magnitudes), largest => maxval(magnitudes))
         middle = max(min(sqrt(smallest*largest), above_the_smallest*smallest), below_the_largest*largest)
      end associate
   end function middle

   ! A frequency that the matrices suggest (1/s): far above the lowest modes of a fine mesh, but of
   ! their units. Low where there are heavy parts: from below, low modes are told apart.
   real(wp) function first_scale(problem)
      type(modal_problem_type), intent(in) :: problem
      real(wp), parameter :: below_the_highest = 1.0e-3_wp, heaviest = 1.0e-2_wp
      real(wp) :: typical, of_norms

      typical = typical_rate(problem)
      of_norms = typical
      if (.not. problem%mass%is_zero()) then
         of_norms = sqrt(problem%stiffness%infinity_norm()/problem%mass%infinity_norm())
         if (.not. of_norms > 0) of_norms = problem%damping%infinity_norm()/problem%mass%infinity_norm()
      end if
      first_scale = below_the_highest*min(typical, max(of_norms, heaviest*typical))
   end function first_scale

   !> At a shift, or beside it if it is an eigenvalue.
   subroutine factor_beside(problem, deflation, options, inner, shift, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      complex(wp), intent(in) :: shift
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(moved)
         call factor_at(problem, deflation, options, inner, result%formulation, moved(i)*shift, transform, result, error)
         if (.not. allocated(error)) return
         if (error%code /= error_singular) return
      end do
   end subroutine factor_beside

   ! Factors at a shift, and nowhere else. Fails where it is an eigenvalue.
   subroutine factor_at(problem, deflation, options, inner, formulation, shift, transform, result, error)
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: formulation
      complex(wp), intent(in) :: shift
      class(transform_type), allocatable, intent(out) :: transform
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      class(real_linear_solver_type), allocatable :: real_solver, counting_solver
      type(pencil_transform_type), allocatable :: pencil
      type(complex_quadratic_type), allocatable :: quadratic
      type(real_quadratic_type), allocatable :: real_quadratic
      type(symmetric_transform_type), allocatable :: symmetric
      ! What is deflated cannot be seen in the factors.
      real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
      real(wp) :: factors(problem%multipliers()), unit

      result%shift = shift
      if (any(abs(deflation%eigenvalues() - shift) <= rounding*abs(shift))) then
         call new_error(error, error_singular, "the shift is the eigenvalue of a rigid motion; move it a little")
         return
      end if
      factors = constraint_factors(problem, options%constraint_scaling, shift)
      unit = scale(1.0_wp, exponent(max(abs(shift), first_scale(problem))))
      if (options%is_plain()) unit = 1
      allocate (solver, source=inner%complex)
      allocate (real_solver, source=inner%real)
      if (allocated(inner%counting)) allocate (counting_solver, source=inner%counting)
      if (any(formulation == [formulation_symmetric, formulation_proportional])) then
         allocate (symmetric)
         call new_symmetric_transform(symmetric, problem, deflation, factors, shift, real_solver, error, counting_solver)
         call move_alloc(symmetric, transform)
      else if (formulation == formulation_quadratic .and. .not. abs(aimag(shift)) > 0) then
         allocate (real_quadratic)
         call new_real_quadratic(real_quadratic, problem, deflation, factors, unit, real(shift, wp), real_solver, error)
         call move_alloc(real_quadratic, transform)
      else if (options%inner == inner_ldl) then
         call refuse_complex(formulation, error)
      else if (formulation == formulation_quadratic) then
         allocate (quadratic)
         call new_complex_quadratic(quadratic, problem, deflation, factors, unit, shift, solver, error)
         call move_alloc(quadratic, transform)
      else
         allocate (pencil)
         call new_pencil_transform(pencil, problem, deflation, formulation, factors, unit, shift, solver, error, &
            options%is_plain())
         call move_alloc(pencil, transform)
      end if
      if (allocated(error)) return
      result%factorizations = result%factorizations + 1
   end subroutine factor_at

   subroutine refuse_complex(formulation, error)
      integer, intent(in) :: formulation
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_usage, "the inner solver ldl does not fit: the formulation "// &
         trim(formulation_names(formulation))//" factors a complex matrix here")
   end subroutine refuse_complex

   ! Where the shift had better be, from a few steps at the shift that is; zero where
   ! they do not tell.
   subroutine propose_scale(transform, deflation, options, typical, result, proposed, error)
      class(transform_type), target, intent(inout) :: transform
      type(deflation_type), intent(in) :: deflation
      type(modal_options_type), intent(in) :: options
      !> A rate typical of the matrices (1/s).
      real(wp), intent(in) :: typical
      type(modal_result_type), intent(inout) :: result
      real(wp), intent(out) :: proposed
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: roughly = 0.1_wp
      ! So far below the shift a zero may be blurred by rounding.
      real(wp), parameter :: too_near = 1.0e-4_wp
      type(modal_selection_type) :: selection
      type(krylov_statistics_type) :: statistics
      complex(wp), allocatable :: mu(:), vectors(:, :)
      real(wp), allocatable :: magnitudes(:)
      real(wp) :: furthest
      integer :: i

      proposed = 0
      selection = modal_selection_type(options%modes, transform%map, transform%shift, options%target, deflation%eigenvalues())
      ! A mode is one value of an oscillator, and two otherwise.
      call transform%iterate(selection, krylov_options_type(subspace=merge(20, 30, transform%map%oscillator), &
         tolerance=roughly, max_restarts=1, seed=options%seed, verify=.false.), mu, vectors, statistics, error)
      if (allocated(error)) return
      result%operator_applications = result%operator_applications + statistics%operator_applications
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
      furthest = min(too_far*abs(result%shift), above_the_typical*typical)
      allocate (magnitudes, source=[(maxval(abs(transform%map%lambdas(transform%theta(mu(i))))), i=1, size(mu))])
      magnitudes = pack(magnitudes, magnitudes >= too_near*abs(result%shift) .and. magnitudes <= furthest)
      if (size(magnitudes) > 0) proposed = middle(magnitudes)
   end subroutine propose_scale
end module kschur_shift
