!> Matches modes between consecutive points of a sweep, with intermediate points if a match is ambiguous, and finds onsets of
!> instability.
module kschur_linking
   use kschur_error, only: error_cancelled, error_type, error_usage, new_error
   use kschur_following, only: follow_modes, is_ambiguous, place_type, settle_spaces, swapping_pair
   use kschur_kinds, only: wp
   use kschur_modal_solver, only: modal_solver_type, new_modal_solver
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type
   use kschur_problem_family, only: interpolate, problem_family_type
   use kschur_result, only: reason_cancelled
   use kschur_symmetric_storage, only: symmetric_no
   use kschur_tolerances, only: onset_width, twelve_digits
   implicit none
   private
   public :: linker_type, is_unstable

   !> Largest number of bisections; each costs a solve.
   integer, parameter :: most_halvings = 8

   !> Solver of points and intermediate points.
   type :: linker_type
      type(modal_options_type) :: options
      !> Monitor of intermediate solves, and source of their problems. Not associated: none; matrices are interpolated.
      class(monitor_type), pointer :: monitor => null()
      class(problem_family_type), pointer :: family => null()
      !> Whether a match remained ambiguous.
      logical :: unsure = .false.
      type(modal_solver_type), private :: solver
      logical, private :: has_solved = .false.
   contains
      !> Solves at a point.
      procedure :: solve
      !> Matches modes of two points.
      procedure :: link
      !> Finds where a mode changes stability.
      procedure :: find_onset
      procedure, private :: place_between
      procedure, private :: link_by_halves
   end type linker_type

contains

   !> Solves at a point. The result has the mesh of the point's problem, as it may change with the parameter. Fails if the numbers
   !> of unknowns or constraints changed, or there is a loss matrix.
   subroutine solve(self, place, error, monitor)
      class(linker_type), intent(inout) :: self
      !> Its value and problem are set.
      type(place_type), intent(inout) :: place
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor

      associate (problem => place%problem)
         if (self%has_solved) then
            call self%solver%update_values(problem%mass, problem%stiffness, error, problem%damping, problem%constraints, &
               symmetric_no, problem%loss, problem%mesh)
         else
            call new_modal_solver(self%solver, problem)
         end if
      end associate
      if (.not. allocated(error)) call self%solver%solve(self%options, place%result, error, monitor)
      if (allocated(place%result%mesh) .and. .not. allocated(place%problem%mesh)) deallocate (place%result%mesh)
      self%has_solved = self%has_solved .or. .not. allocated(error)
   end subroutine solve

   ! Solves at an intermediate value; an error if the monitor cancels.
   subroutine place_between(self, value, before, after, place, error)
      class(linker_type), intent(inout) :: self
      real(wp), intent(in) :: value
      type(place_type), intent(in) :: before, after
      type(place_type), intent(out) :: place
      type(error_type), allocatable, intent(out) :: error

      place%value = value
      if (associated(self%family)) then
         call self%family%at(value, place%problem, error)
      else
         call interpolate(before%problem, after%problem, (value - before%value)/(after%value - before%value), place%problem)
      end if
      if (.not. allocated(error)) call self%solve(place, error, self%monitor)
      if (allocated(error)) return
      if (place%result%reason == reason_cancelled) then
         call new_error(error, error_cancelled, "the sweep was ended by who watches it")
      else
         call settle_spaces(place)
      end if
   end subroutine place_between

   !> Finds for each mode at one point its match at another, and rotates shapes of equal eigenvalues to those before. Bisects if
   !> matches are ambiguous or modes cross.
   subroutine link(self, before, after, match, error, shares)
      class(linker_type), intent(inout) :: self
      !> After `settle_spaces`.
      type(place_type), intent(in) :: before
      type(place_type), intent(inout) :: after
      !> 0: no match.
      integer, allocatable, intent(out) :: match(:)
      type(error_type), allocatable, intent(out) :: error
      !> Share of each mode before, i, in each one after, j.
      real(wp), allocatable, intent(out), optional :: shares(:, :)

      if (present(shares)) call follow_modes(before, after, match, shares)
      call self%link_by_halves(before, after, most_halvings, match, error)
   end subroutine link

   ! Matches modes of two points. If the match is ambiguous or modes cross, links by an intermediate point, recursively, at most
   ! `halvings` times.
   recursive subroutine link_by_halves(self, before, after, halvings, match, error)
      class(linker_type), intent(inout) :: self
      type(place_type), intent(in) :: before
      type(place_type), intent(inout) :: after
      integer, intent(in) :: halvings
      integer, allocatable, intent(out) :: match(:)
      type(error_type), allocatable, intent(out) :: error
      type(place_type) :: middle
      integer, allocatable :: first(:), second(:)
      real(wp) :: part
      integer :: pair(2)
      logical :: clear

      call follow_and_check(before, after, match, clear)
      call swapping_pair(before%result%eigenvalues, after%result%eigenvalues, match, pair, part)
      if (.not. clear) then
         part = 0.5_wp
      else if (pair(1) == 0) then
         return
      end if
      if (halvings == 0) then
         self%unsure = self%unsure .or. .not. clear
         return
      end if
      part = min(max(part, 0.02_wp), 0.98_wp)
      call self%place_between(before%value + part*(after%value - before%value), before, after, middle, error)
      if (allocated(error)) return
      ! At a crossing shapes are preserved, or the eigenvalues are equal.
      if (clear) then
         call follow_and_check(before, middle, first, clear)
         if (clear) call follow_and_check(middle, after, second, clear)
         if (clear) then
            first = composed(first, second)
            clear = same_spaces(after%space, first, match)
            match = first
            if (clear) return
         end if
      end if
      call self%link_by_halves(before, middle, halvings - 1, first, error)
      if (.not. allocated(error)) call self%link_by_halves(middle, after, halvings - 1, second, error)
      if (.not. allocated(error)) match = composed(first, second)
   end subroutine link_by_halves

   ! Matches modes, and tests whether the match is unambiguous.
   subroutine follow_and_check(before, after, match, clear)
      type(place_type), intent(in) :: before
      type(place_type), intent(inout) :: after
      integer, allocatable, intent(out) :: match(:)
      logical, intent(out) :: clear
      real(wp), allocatable :: shares(:, :)

      call follow_modes(before, after, match, shares)
      clear = .not. is_ambiguous(shares, match, before%result%eigenvalues, after%result%eigenvalues)
   end subroutine follow_and_check

   ! The match over two steps; 0 if a mode is lost in one of them.
   pure function composed(first, second)
      integer, intent(in) :: first(:), second(:)
      integer :: composed(size(first))
      integer :: i

      composed = 0
      do i = 1, size(first)
         if (first(i) > 0) composed(i) = second(first(i))
      end do
   end function composed

   ! Whether two matches lead to the same spaces, mode by mode.
   pure logical function same_spaces(space, first, second)
      integer, intent(in) :: space(:), first(:), second(:)
      integer :: i

      same_spaces = all((first > 0) .eqv. (second > 0))
      if (same_spaces) same_spaces = all([(space(max(first(i), 1)) == space(max(second(i), 1)), i=1, size(first))])
   end function same_spaces

   !> Whether the real part is positive beyond rounding.
   elemental logical function is_unstable(lambda)
      !> 1/s.
      complex(wp), intent(in) :: lambda

      is_unstable = real(lambda, wp) > twelve_digits*abs(lambda)
   end function is_unstable

   !> Finds the value at which a mode changes stability between two points, by interpolation in a bracket, to a relative width
   !> of a thousandth.
   subroutine find_onset(self, before, after, mode_before, mode_after, value, within, error)
      class(linker_type), intent(inout) :: self
      !> Settled.
      type(place_type), intent(in) :: before, after
      integer, intent(in) :: mode_before, mode_after
      !> The value, and the width of its bracket: wider than a thousandth if the mode was lost in between, or no intermediate
      !> problem exists.
      real(wp), intent(out) :: value, within
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_steps = 40
      type(place_type), allocatable :: near, far, middle
      integer, allocatable :: match(:)
      integer :: mode_near, mode_far, mode, step
      real(wp) :: tolerance

      allocate (near, source=before)
      allocate (far, source=after)
      mode_near = mode_before
      mode_far = mode_after
      do step = 1, most_steps
         tolerance = onset_width*max(abs(near%value), abs(far%value))
         within = abs(far%value - near%value)
         value = interpolated(near, mode_near, far, mode_far)
         if (within <= tolerance) exit
         allocate (middle)
         call self%place_between(next_value(near%value, far%value, value, tolerance, step), near, far, middle, error)
         if (allocated(error)) then
            ! For example, the parameter is an integer.
            if (error%code /= error_usage) return
            deallocate (error)
            exit
         end if
         call self%link(near, middle, match, error)
         if (allocated(error)) return
         mode = match(mode_near)
         if (mode == 0) then
            call self%link(far, middle, match, error)
            if (allocated(error)) return
            mode = match(mode_far)
         end if
         if (mode == 0) exit
         if (is_unstable(middle%result%eigenvalues(mode)) .eqv. is_unstable(near%result%eigenvalues(mode_near))) then
            call move_alloc(middle, near)
            mode_near = mode
         else
            call move_alloc(middle, far)
            mode_far = mode
         end if
      end do
   end subroutine find_onset

   ! Zero of the linear interpolant of the growth rates; the midpoint if an undamped mode starts to grow.
   pure real(wp) function interpolated(near, mode_near, far, mode_far) result(value)
      type(place_type), intent(in) :: near, far
      integer, intent(in) :: mode_near, mode_far
      real(wp) :: part

      associate (first => near%result%eigenvalues(mode_near), last => far%result%eigenvalues(mode_far))
         part = 0.5_wp
         if (min(abs(real(first, wp)) - twelve_digits*abs(first), abs(real(last, wp)) - twelve_digits*abs(last)) > 0) &
            part = real(first, wp)/real(first - last, wp)
      end associate
      value = near%value + part*(far%value - near%value)
   end function interpolated

   ! Next point of the bracketing: slightly beyond the interpolated zero as seen from the nearer end, so that the farther end is
   ! replaced; the midpoint at every third step, for strongly nonlinear growth.
   pure real(wp) function next_value(near, far, interpolated, tolerance, step) result(value)
      real(wp), intent(in) :: near, far, interpolated, tolerance
      integer, intent(in) :: step
      real(wp) :: further

      value = (near + far)/2
      if (mod(step, 3) == 0) return
      further = merge(near, far, abs(interpolated - near) > abs(interpolated - far))
      value = interpolated + sign(min(0.4_wp*tolerance, abs(further - interpolated)/2), further - interpolated)
   end function next_value
end module kschur_linking
