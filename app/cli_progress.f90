!> Progress of a long run: one line on standard error, overwritten repeatedly.
module cli_progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use cli_interrupt, only: is_interrupted
   use cli_system, only: standard_error_is_terminal
   use kschur, only: long, monitor_type, text, wp
   implicit none
   private
   public :: new_progress, progress_type

   !> Monitor that shows the current step on a terminal: "12 s, point 3 of 9, iteration, 7 of 20 modes". A signal cancels the
   !> computation.
   type, extends(monitor_type) :: progress_type
      private
      logical :: shown = .false.
      ! Line on the terminal, and its length.
      character(len=:), allocatable :: line
      integer :: width = 0
      ! Title of the current solve, and its step.
      character(len=:), allocatable :: title, step
      ! Modes of earlier parts, of this part, of all (0: unknown), and largest number so far.
      integer :: found = 0, part = 0, asked = 0, seen = 0
      ! Ticks of the clock: where the program began, where what is estimated began, where `reached` of it was done.
      integer(long) :: started = 0, since = 0, reached_at = 0
      real(wp) :: reached = 0
   contains
      !> Shows a step.
      procedure :: show
      !> Sets the title of the next solve.
      procedure :: name_solve
      !> Wipes the line.
      procedure :: finish
      procedure :: report
      procedure :: stops
      procedure :: announce
      procedure :: begins => show
      procedure :: counts
   end type progress_type

contains

   !> Creates a monitor that prints to a terminal only, and not if `quiet`.
   function new_progress(quiet) result(progress)
      logical, intent(in) :: quiet
      type(progress_type) :: progress

      progress%shown = standard_error_is_terminal()
      if (quiet) progress%shown = .false.
      progress%line = ""
      progress%title = ""
      progress%step = ""
      call system_clock(progress%started)
      progress%since = progress%started
   end function new_progress

   subroutine show(self, step)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: step

      self%step = step
      call refresh(self)
   end subroutine show

   subroutine name_solve(self, title)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: title

      self%title = title//", "
      call self%counts(0, 0, 0)
   end subroutine name_solve

   subroutine finish(self)
      class(progress_type), intent(inout) :: self

      call put(self, "")
   end subroutine finish

   subroutine counts(self, found, part, asked)
      class(progress_type), intent(inout) :: self
      integer, intent(in) :: found, part, asked

      ! New solve: within one, restarted iterations never show fewer modes than before.
      if (found == 0 .and. asked /= self%asked) self%seen = 0
      if (found == 0 .and. share_of(self%title) < 0) call begin_estimate(self)
      self%found = found
      self%part = part
      self%asked = asked
      call refresh(self)
   end subroutine counts

   subroutine report(self, restart, converged, wanted, residual, proceed)
      class(progress_type), intent(inout) :: self
      integer, intent(in) :: restart
      integer, intent(in) :: converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed

      ! An iteration may seek modes of other parts.
      self%seen = max(self%seen, self%found + int(real(self%part, wp)*min(converged, wanted)/max(wanted, 1)))
      if (proceed) call refresh(self)
      associate (unused => residual, neither => restart)
      end associate
   end subroutine report

   logical function stops(self)
      class(progress_type), intent(inout) :: self

      stops = is_interrupted()
      if (stops) self%step = "interrupted"
      call refresh(self)
   end function stops

   ! Prints a permanent line.
   subroutine announce(self, sentence)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      if (.not. self%shown) return
      call put(self, "")
      write (error_unit, "(a)") sentence
      call refresh(self)
   end subroutine announce

   ! Shows the line again, with the present time, step and number of modes.
   subroutine refresh(self)
      class(progress_type), intent(inout) :: self
      integer(long) :: now, rate
      character(len=:), allocatable :: modes

      if (.not. self%shown) return
      call system_clock(now, rate)
      modes = ""
      if (self%asked > 0) modes = ", "//text(min(self%seen, self%asked))//" of "//text(self%asked)//" modes"
      if (self%asked == 0 .and. self%seen > 0) modes = ", "//text(self%seen)//" modes"
      call put(self, text((now - self%started)/rate)//" s, "//self%title//self%step//modes//time_left(self, now, rate))
   end subroutine refresh

   ! Begins the estimate of the time left anew.
   subroutine begin_estimate(self)
      type(progress_type), intent(inout) :: self

      call system_clock(self%since)
      self%reached = 0
   end subroutine begin_estimate

   ! Estimates the time left by the share done so far, of points, of frequencies or of modes, at the mean speed so far; unknown if
   ! nothing is done yet, or the estimate has run out. Empty in the first seconds.
   function time_left(self, now, rate) result(words)
      class(progress_type), intent(inout) :: self
      integer(long), intent(in) :: now, rate
      character(len=:), allocatable :: words
      integer, parameter :: patience = 10, minute = 60
      real(wp) :: done, left

      words = ""
      done = share_of(self%title)
      if (done < 0) done = share_of(self%step)
      if (done < 0 .and. self%asked > 0) done = real(min(self%seen, self%asked), wp)/self%asked
      if (done < self%reached) self%reached = 0
      if (done > self%reached) then
         self%reached = done
         self%reached_at = now
      end if
      if (now - self%started < patience*rate) return
      left = 0
      if (self%reached > 0) left = (real(self%reached_at - self%since, wp)*(1 - self%reached)/self%reached &
         - real(now - self%reached_at, wp))/real(rate, wp)
      if (left < 1) then
         words = ", time left unknown"
      else if (left < 2*minute) then
         words = ", about "//text(nint(left))//" s left"
      else
         words = ", about "//text(nint(left/minute))//" min left"
      end if
   end function time_left

   ! Share done, (I - 1)/N, if words say "I of N", as I begins then; negative if they do not.
   pure real(wp) function share_of(words)
      character(len=*), intent(in) :: words
      character(len=*), parameter :: digits = "0123456789"
      integer :: at, first, last, i, n

      share_of = -1
      at = index(words, " of ")
      if (at < 2) return
      first = verify(words(:at - 1), digits, back=.true.) + 1
      last = at + 2 + verify(words(at + 4:)//" ", digits)
      if (first >= at .or. last < at + 4 .or. at - first > 8 .or. last - at > 11) return
      read (words(first:at - 1), *) i
      read (words(at + 4:last), *) n
      if (n > 0) share_of = real(i - 1, wp)/n
   end function share_of

   ! Replaces the current line; an empty one clears it.
   subroutine put(self, line)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: line
      character(len=1), parameter :: carriage_return = achar(13)

      if (.not. self%shown .or. line == self%line) return
      write (error_unit, "(5a)", advance="no") carriage_return, line, repeat(" ", max(0, self%width - len(line)))
      if (line == "") write (error_unit, "(a)", advance="no") carriage_return
      flush (error_unit)
      self%line = line
      self%width = len(line)
   end subroutine put
end module cli_progress
