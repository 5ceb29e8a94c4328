!> Modes over a parameter, followed from point to point.
module kschur_sweep
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_error, only: error_cancelled, error_type, new_error, take_cancelled
   use kschur_following, only: are_equal, is_ambiguous, match_modes, mode_shares, swapping_pair
   use kschur_kinds, only: wp
   use kschur_modal_solver, only: modal_solver_type, new_modal_solver
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type
   use kschur_problem, only: modal_problem_type, refuse_loss
   use kschur_result, only: modal_result_type, reason_cancelled
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_symmetric_storage, only: symmetric_no
   use kschur_tolerances, only: equal_value
   implicit none
   private
   public :: sweep_type, sweep_event_type, new_sweep, event_names, event_crossing, event_veering, event_unsure

   !> Two branches cross, with the shapes that they have; they come near each other and exchange their shapes; or
   !> it is not clear which is which from here on.
   integer, parameter :: event_crossing = 0, event_veering = 1, event_unsure = 2
   !> Their names.
   character(len=*), parameter :: event_names(0:2) = [character(len=8) :: "crossing", "veering", "unsure"]

   !> What happens to two branches near a value of the parameter.
   type :: sweep_event_type
      !> One of `event_*`.
      integer :: kind = event_crossing
      !> The branches, and where.
      integer :: first = 0, second = 0
      real(wp) :: value = 0
   end type sweep_event_type

   ! One point: the branch of each mode, and what of each branch was in each other one at the point before.
   type :: point_type
      complex(wp), allocatable :: lambda(:)
      real(wp), allocatable :: frequency_hz(:), damping_ratio(:)
      integer, allocatable :: branch(:)
      real(wp), allocatable :: shares(:, :)
      logical :: unsure = .false.
   end type point_type

   ! A problem and its modes.
   type :: place_type
      type(modal_problem_type) :: problem
      type(modal_result_type) :: result
   end type place_type

   !> Made by `new_sweep`, filled by `add`, point after point, and by `finish`.
   type :: sweep_type
      !> Values of the parameter, one a point, in their order.
      real(wp), allocatable :: values(:)
      !> Branches x points, after `finish`: eigenvalues (1/s), natural frequencies (Hz), damping ratios, the number of the
      !> mode in the result of its point, and the share that is left of the mode at the point before. NaN and 0 where a
      !> branch is not.
      complex(wp), allocatable :: eigenvalues(:, :)
      real(wp), allocatable :: frequency_hz(:, :), damping_ratio(:, :), share(:, :)
      integer, allocatable :: mode(:, :)
      type(sweep_event_type), allocatable :: events(:)
      ! How it is solved, and the last point.
      type(modal_options_type), private :: options
      type(modal_solver_type), private :: solver
      type(place_type), allocatable, private :: last
      ! Who watches the point that is added.
      class(monitor_type), pointer, private :: monitor => null()
      type(point_type), allocatable, private :: points(:)
      logical, private :: unsure = .false.
      integer, private :: branches = 0
   contains
      !> The modes at the next point.
      procedure :: add
      !> Sets what is known after the last point.
      procedure :: finish
   end type sweep_type

contains

   !> A sweep without points.
   subroutine new_sweep(sweep, options)
      type(sweep_type), intent(out) :: sweep
      !> Modes nearest to one target at all points. With left vectors modes of unsymmetric problems are followed by them.
      type(modal_options_type), intent(in) :: options

      sweep%options = options
      allocate (sweep%values(0), sweep%points(0), sweep%events(0))
   end subroutine new_sweep

   !> Solves at the next point and finds out which mode is which. Where that is not clear, and where two cross, the
   !> matrices between the two points are looked at, as if they were linear in the parameter. A point that the monitor ends
   !> is not added: the reason of its result is `reason_cancelled`. Fails as `solve_modes`.
   subroutine add(self, value, problem, error, result, monitor)
      class(sweep_type), target, intent(inout) :: self
      !> Of the parameter: above that of the point before, or below it all the way.
      real(wp), intent(in) :: value
      !> With the same numbers of unknowns and constraints at all points.
      type(modal_problem_type), intent(in) :: problem
      type(error_type), allocatable, intent(out) :: error
      !> That of this point.
      type(modal_result_type), intent(out), optional :: result
      class(monitor_type), target, intent(inout), optional :: monitor
      ! Between two points each halving is a solve more.
      integer, parameter :: halvings = 8
      type(place_type), allocatable :: here
      type(point_type) :: point
      integer, allocatable :: match(:)
      integer :: i
      logical :: cancelled

      call refuse_loss(problem, "a sweep", error)
      if (allocated(error)) return
      if (allocated(self%last)) then
         call update(self%solver, problem, error)
      else
         call new_modal_solver(self%solver, problem)
      end if
      if (allocated(error)) return
      allocate (here)
      call self%solver%solve(self%options, here%result, error, monitor)
      if (allocated(error)) return
      here%problem = problem
      allocate (match(0))
      if (allocated(self%last) .and. here%result%reason /= reason_cancelled) then
         point%shares = shares_between(self%last, here)
         if (present(monitor)) self%monitor => monitor
         self%unsure = .false.
         call link(self, self%last, here, point%shares, halvings, match, error)
         nullify (self%monitor)
         call take_cancelled(error, cancelled)
         if (cancelled) here%result%reason = reason_cancelled
      end if
      if (present(result)) result = here%result
      if (allocated(error) .or. here%result%reason == reason_cancelled) return
      point%lambda = here%result%eigenvalues
      point%frequency_hz = here%result%frequency_hz
      point%damping_ratio = here%result%damping_ratio
      allocate (point%branch(size(point%lambda)), source=0)
      if (allocated(self%last)) then
         point%unsure = self%unsure
         associate (before => self%points(size(self%points)))
            do i = 1, size(match)
               if (match(i) > 0) point%branch(match(i)) = before%branch(i)
            end do
         end associate
      end if
      do i = 1, size(point%branch)
         if (point%branch(i) > 0) cycle
         self%branches = self%branches + 1
         point%branch(i) = self%branches
      end do
      self%values = [self%values, value]
      self%points = [self%points, point]
      call move_alloc(here, self%last)
   end subroutine add

   subroutine update(solver, problem, error)
      type(modal_solver_type), intent(inout) :: solver
      type(modal_problem_type), intent(in) :: problem
      type(error_type), allocatable, intent(out) :: error

      call solver%update_values(problem%mass, problem%stiffness, error, problem%damping, problem%constraints, symmetric_no)
   end subroutine update

   ! For each mode at a place that at another one, by places between where that is needed.
   recursive subroutine link(self, before, after, shares, halvings, match, error)
      class(sweep_type), target, intent(inout) :: self
      type(place_type), intent(in) :: before, after
      !> Between them.
      real(wp), intent(in) :: shares(:, :)
      integer, intent(in) :: halvings
      integer, allocatable, intent(out) :: match(:)
      type(error_type), allocatable, intent(out) :: error
      type(place_type) :: middle
      real(wp), allocatable :: shares_first(:, :), shares_second(:, :)
      integer, allocatable :: first(:), second(:)
      real(wp) :: part
      integer :: pair(2), i
      logical :: clear

      call match_clearly(shares, before, after, match, clear)
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
      call interpolate(before%problem, after%problem, part, middle%problem)
      call update(self%solver, middle%problem, error)
      if (.not. allocated(error)) call self%solver%solve(self%options, middle%result, error, self%monitor)
      if (.not. allocated(error) .and. middle%result%reason == reason_cancelled) &
         call new_error(error, error_cancelled, "the sweep was ended by who watches it")
      if (allocated(error)) return
      shares_first = shares_between(before, middle)
      shares_second = shares_between(middle, after)
      ! Where two cross their shapes are as they were, or their eigenvalues are the same.
      if (clear) then
         call match_clearly(shares_first, before, middle, first, clear)
         if (clear) call match_clearly(shares_second, middle, after, second, clear)
         if (clear) then
            if (all([(chained(first, second, i) == match(i), i=1, size(match))])) return
         end if
      end if
      call link(self, before, middle, shares_first, halvings - 1, first, error)
      if (.not. allocated(error)) call link(self, middle, after, shares_second, halvings - 1, second, error)
      if (.not. allocated(error)) match = [(chained(first, second, i), i=1, size(match))]
   end subroutine link

   function shares_between(before, after) result(shares)
      type(place_type), intent(in) :: before, after
      real(wp) :: shares(size(before%result%eigenvalues), size(after%result%eigenvalues))

      shares = mode_shares(before%problem, before%result, after%result)
   end function shares_between

   ! Matches modes, and says whether there is no doubt about it.
   subroutine match_clearly(shares, before, after, match, clear)
      real(wp), intent(in) :: shares(:, :)
      type(place_type), intent(in) :: before, after
      integer, allocatable, intent(out) :: match(:)
      logical, intent(out) :: clear

      allocate (match, source=match_modes(shares))
      clear = .not. is_ambiguous(shares, match, before%result%eigenvalues, after%result%eigenvalues)
   end subroutine match_clearly

   pure integer function chained(first, second, i)
      integer, intent(in) :: first(:), second(:), i

      chained = 0
      if (first(i) > 0) chained = second(first(i))
   end function chained

   ! The matrices a part of the way from one problem to another.
   pure subroutine interpolate(from, to, part, problem)
      type(modal_problem_type), intent(in) :: from, to
      real(wp), intent(in) :: part
      type(modal_problem_type), intent(out) :: problem

      problem%symmetric = from%symmetric .and. to%symmetric
      problem%mass = between(from%mass, to%mass, part)
      problem%damping = between(from%damping, to%damping, part)
      problem%stiffness = between(from%stiffness, to%stiffness, part)
      problem%constraints = between(from%constraints, to%constraints, part)
   end subroutine interpolate

   ! What does not change stays as it is, to the last digit.
   pure function between(from, to, part) result(matrix)
      type(csr_matrix_type), intent(in) :: from, to
      real(wp), intent(in) :: part
      type(csr_matrix_type) :: matrix

      matrix = linear_combination(1.0_wp, from, part, linear_combination(1.0_wp, to, -1.0_wp, from))
   end function between

   !> Puts the branches together, those of the first point first, and looks for crossings and veerings.
   subroutine finish(self)
      class(sweep_type), intent(inout) :: self
      integer :: p, i, b

      b = self%branches
      p = size(self%values)
      if (allocated(self%mode)) deallocate (self%eigenvalues, self%frequency_hz, self%damping_ratio, self%share, self%mode)
      allocate (self%eigenvalues(b, p), self%frequency_hz(b, p), self%damping_ratio(b, p), self%share(b, p))
      allocate (self%mode(b, p), source=0)
      self%eigenvalues = cmplx(ieee_value(1.0_wp, ieee_quiet_nan), ieee_value(1.0_wp, ieee_quiet_nan), wp)
      self%frequency_hz = ieee_value(1.0_wp, ieee_quiet_nan)
      self%damping_ratio = ieee_value(1.0_wp, ieee_quiet_nan)
      self%share = ieee_value(1.0_wp, ieee_quiet_nan)
      do p = 1, size(self%points)
         associate (point => self%points(p))
            self%eigenvalues(point%branch, p) = point%lambda
            self%frequency_hz(point%branch, p) = point%frequency_hz
            self%damping_ratio(point%branch, p) = point%damping_ratio
            self%mode(point%branch, p) = [(i, i=1, size(point%branch))]
         end associate
      end do
      do p = 2, size(self%points)
         do b = 1, self%branches
            if (min(self%mode(b, p - 1), self%mode(b, p)) > 0) self%share(b, p) = share_of(self, b, b, p)
         end do
      end do
      deallocate (self%events)
      allocate (self%events(0))
      do p = 2, size(self%points)
         if (self%points(p)%unsure) self%events = [self%events, sweep_event_type(event_unsure, 0, 0, self%values(p))]
      end do
      do b = 1, self%branches
         do i = b + 1, self%branches
            call find_events(self, b, i)
         end do
      end do
   end subroutine finish

   ! What of a branch at the point before p is in another one at p.
   pure real(wp) function share_of(self, first, second, p)
      class(sweep_type), intent(in) :: self
      integer, intent(in) :: first, second, p

      share_of = self%points(p)%shares(self%mode(first, p - 1), self%mode(second, p))
   end function share_of

   ! Of two branches: their damped frequencies change order, or come near while the shapes turn into each other.
   subroutine find_events(self, first, second)
      class(sweep_type), intent(inout) :: self
      integer, intent(in) :: first, second
      ! A veering turns shapes by a right angle, most of it where the gap is below so many times the smallest.
      real(wp), parameter :: turned = 0.6_wp, near = 6
      real(wp) :: order(size(self%values)), gap(size(self%values)), angle
      logical :: both(size(self%values))
      integer :: p, before, lowest

      ! Where they are equal their shapes are any, and tell nothing.
      both = self%mode(first, :) > 0 .and. self%mode(second, :) > 0 .and. &
         .not. are_equal(self%eigenvalues(first, :), self%eigenvalues(second, :))
      if (count(both) < 2) return
      order = aimag(self%eigenvalues(first, :) - self%eigenvalues(second, :))
      ! Damped frequencies that differ by less are in no order: those of both whirls of a damped rotor are the same, and
      ! rounding would make them cross.
      where (abs(order) <= equal_value*abs(self%eigenvalues(first, :))) order = 0
      gap = abs(self%eigenvalues(first, :) - self%eigenvalues(second, :))
      before = 0
      do p = 1, size(order)
         if (min(self%mode(first, p), self%mode(second, p)) == 0) before = 0
         if (.not. both(p) .or. .not. abs(order(p)) > 0) cycle
         if (before > 0) then
            if (order(before)*order(p) < 0) self%events = [self%events, sweep_event_type(event_crossing, first, second, &
               self%values(before) + (self%values(p) - self%values(before))*order(before)/(order(before) - order(p)))]
         end if
         before = p
      end do
      lowest = minloc(gap, 1, both)
      if (any(order*order(lowest) < 0 .and. both)) return
      angle = 0
      do p = 2, size(order)
         if (.not. (both(p - 1) .and. both(p))) cycle
         if (min(gap(p - 1), gap(p)) > near*gap(lowest)) cycle
         angle = angle + asin(min(1.0_wp, (share_of(self, first, second, p) + share_of(self, second, first, p))/2))
      end do
      if (angle > turned) self%events = [self%events, sweep_event_type(event_veering, first, second, self%values(lowest))]
   end subroutine find_events
end module kschur_sweep
