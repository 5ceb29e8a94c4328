!> Modes as functions of a parameter (branches), tracked from point to point.
module kschur_sweep
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_error, only: error_type, take_cancelled
   use kschur_following, only: are_equal, place_type, settle_spaces
   use kschur_kinds, only: wp
   use kschur_linking, only: is_unstable, linker_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type
   use kschur_problem, only: modal_problem_type
   use kschur_problem_family, only: problem_family_type
   use kschur_result, only: modal_result_type, reason_cancelled
   use kschur_tolerances, only: equal_value
   implicit none
   private
   public :: sweep_type, sweep_event_type, sweep_onset_type, new_sweep, event_names, event_crossing, event_veering, event_unsure

   !> Two branches cross and keep their shapes; approach each other and exchange shapes; or the match is ambiguous from here on.
   integer, parameter :: event_crossing = 0, event_veering = 1, event_unsure = 2
   !> Names of the events.
   character(len=*), parameter :: event_names(0:2) = [character(len=8) :: "crossing", "veering", "unsure"]

   !> An event of two branches near a value of the parameter.
   type :: sweep_event_type
      !> One of `event_*`.
      integer :: kind = event_crossing
      !> The branches, and the value of the parameter.
      integer :: first = 0, second = 0
      real(wp) :: value = 0
   end type sweep_event_type

   !> A change of stability of a branch between two points.
   type :: sweep_onset_type
      !> Number of the branch, from 1.
      integer :: branch = 0
      !> Whether it becomes unstable; else stable.
      logical :: unstable = .true.
      !> Value of the parameter, and width of the bracket: a thousandth of the value, or more if the mode was lost in between.
      real(wp) :: value = 0, within = 0
   end type sweep_onset_type

   ! One point: branch of each mode, and share of each branch in each other one at the point before.
   type :: point_type
      complex(wp), allocatable :: lambda(:)
      real(wp), allocatable :: frequency_hz(:), damping_ratio(:)
      integer, allocatable :: branch(:)
      real(wp), allocatable :: shares(:, :)
      logical :: unsure = .false.
   end type point_type

   !> Created by `new_sweep`; `add` adds points, `finish` completes it.
   type :: sweep_type
      !> Value of the parameter at each point.
      real(wp), allocatable :: values(:)
      !> After `finish`, branches x points: eigenvalues (1/s), natural frequencies (Hz), damping ratios, position of the mode in
      !> the result of its point, and share of the mode at the point before. NaN and 0 if the branch does not exist there.
      complex(wp), allocatable :: eigenvalues(:, :)
      real(wp), allocatable :: frequency_hz(:, :), damping_ratio(:, :), share(:, :)
      integer, allocatable :: mode(:, :)
      type(sweep_event_type), allocatable :: events(:)
      !> In the order of the points.
      type(sweep_onset_type), allocatable :: onsets(:)
      ! Linker, and the last point.
      type(linker_type), private :: linker
      type(place_type), allocatable, private :: last
      type(point_type), allocatable, private :: points(:)
      integer, private :: branches = 0
   contains
      !> Adds a point.
      procedure :: add
      !> Completes the branches after the last point.
      procedure :: finish
      !> Whether a branch is unstable at a point.
      procedure :: is_unstable => branch_is_unstable
   end type sweep_type

contains

   !> Creates a sweep without points.
   subroutine new_sweep(sweep, options)
      type(sweep_type), intent(out) :: sweep
      !> The same target at all points. With left vectors, modes of unsymmetric problems are matched by them.
      type(modal_options_type), intent(in) :: options

      sweep%linker%options = options
      allocate (sweep%values(0), sweep%points(0), sweep%events(0), sweep%onsets(0))
   end subroutine new_sweep

   !> Solves at the next point and matches its modes. If a match is ambiguous, modes cross, or one changes stability, solves
   !> intermediate problems. A point that the monitor cancels is not added: the reason of its result is `reason_cancelled`.
   !> Fails as `solve_modes`.
   subroutine add(self, value, problem, error, result, monitor, family)
      class(sweep_type), target, intent(inout) :: self
      !> Value of the parameter; values are monotonic.
      real(wp), intent(in) :: value
      !> Same numbers of unknowns and constraints at all points.
      type(modal_problem_type), intent(in) :: problem
      type(error_type), allocatable, intent(out) :: error
      !> Result of this point.
      type(modal_result_type), intent(out), optional :: result
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Source of intermediate problems. Absent: matrices are interpolated linearly.
      class(problem_family_type), target, intent(inout), optional :: family
      type(place_type), allocatable :: here
      type(point_type) :: point
      type(sweep_onset_type), allocatable :: onsets(:)
      logical :: cancelled

      allocate (here)
      here%value = value
      here%problem = problem
      call self%linker%solve(here, error, monitor)
      if (allocated(error)) return
      if (present(result)) result = here%result
      if (here%result%reason == reason_cancelled) return
      call settle_spaces(here)
      if (present(monitor)) self%linker%monitor => monitor
      if (present(family)) self%linker%family => family
      call follow(self, here, point, onsets, error)
      nullify (self%linker%monitor, self%linker%family)
      call take_cancelled(error, cancelled)
      if (cancelled .and. present(result)) result%reason = reason_cancelled
      if (allocated(error) .or. cancelled) return
      self%branches = max(self%branches, maxval([0, point%branch]))
      self%values = [self%values, value]
      self%points = [self%points, point]
      self%onsets = [self%onsets, onsets]
      call move_alloc(here, self%last)
   end subroutine add

   ! Matches the modes of a point with those of the last one: continues their branches or begins new ones, and finds changes of
   ! stability in between.
   subroutine follow(self, here, point, onsets, error)
      class(sweep_type), intent(inout) :: self
      type(place_type), intent(inout) :: here
      type(point_type), intent(out) :: point
      type(sweep_onset_type), allocatable, intent(out) :: onsets(:)
      type(error_type), allocatable, intent(out) :: error
      type(sweep_onset_type) :: onset
      integer, allocatable :: match(:)
      integer :: i, next

      allocate (onsets(0), match(0))
      allocate (point%branch(size(here%space)), source=0)
      if (allocated(self%last)) then
         self%linker%unsure = .false.
         call self%linker%link(self%last, here, match, error, point%shares)
         point%unsure = self%linker%unsure
      end if
      if (allocated(error)) return
      point%lambda = here%result%eigenvalues
      point%frequency_hz = here%result%frequency_hz
      point%damping_ratio = here%result%damping_ratio
      do i = 1, size(match)
         if (match(i) == 0) cycle
         onset%branch = self%points(size(self%points))%branch(i)
         point%branch(match(i)) = onset%branch
         onset%unstable = is_unstable(point%lambda(match(i)))
         if (onset%unstable .eqv. is_unstable(self%last%result%eigenvalues(i))) cycle
         call self%linker%find_onset(self%last, here, i, match(i), onset%value, onset%within, error)
         if (allocated(error)) return
         onsets = [onsets, onset]
      end do
      next = self%branches
      do i = 1, size(point%branch)
         if (point%branch(i) > 0) cycle
         next = next + 1
         point%branch(i) = next
      end do
   end subroutine follow

   !> Assembles the branches, those of the first point first, and finds crossings and veerings.
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

   !> Whether a branch is unstable at a point, beyond rounding; false if it does not exist there. After `finish`.
   pure logical function branch_is_unstable(self, branch, point)
      class(sweep_type), intent(in) :: self
      !> From 1 on.
      integer, intent(in) :: branch, point

      branch_is_unstable = is_unstable(self%eigenvalues(branch, point))
   end function branch_is_unstable

   ! Share of the mode of one branch at the point before p in that of another branch at p.
   pure real(wp) function share_of(self, first, second, p)
      class(sweep_type), intent(in) :: self
      integer, intent(in) :: first, second, p

      share_of = self%points(p)%shares(self%mode(first, p - 1), self%mode(second, p))
   end function share_of

   ! Finds events of two branches: their damped frequencies change order, or approach while the shapes are exchanged.
   subroutine find_events(self, first, second)
      class(sweep_type), intent(inout) :: self
      integer, intent(in) :: first, second
      ! A veering rotates shapes by a right angle, most of it while the gap is below `near` times the smallest gap.
      real(wp), parameter :: turned = 0.6_wp, near = 6
      real(wp) :: order(size(self%values)), gap(size(self%values)), angle
      logical :: both(size(self%values))
      integer :: p, before, lowest

      ! At equal eigenvalues shapes are arbitrary.
      both = self%mode(first, :) > 0 .and. self%mode(second, :) > 0 .and. &
         .not. are_equal(self%eigenvalues(first, :), self%eigenvalues(second, :))
      if (count(both) < 2) return
      order = aimag(self%eigenvalues(first, :) - self%eigenvalues(second, :))
      ! Smaller differences of damped frequencies are rounding: both whirls of a damped rotor have equal ones, and would seem to
      ! cross.
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
