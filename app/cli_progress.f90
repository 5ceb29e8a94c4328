!> Progress of a long run: one line on standard error, written over and over.
module cli_progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use cli_interrupt, only: is_interrupted
   use cli_system, only: standard_error_is_terminal
   use kschur, only: long, monitor_type, text, wp
   implicit none
   private
   public :: new_progress, progress_type

   !> Shows what is going on to whoever watches the terminal.
   type, extends(monitor_type) :: progress_type
      private
      logical :: shown = .false.
      integer :: width = 0
      ! How many modes are wanted (0: it is not known), how many of them there were at most, and since when.
      integer :: asked = 0, seen = 0
      integer(long) :: started = 0
   contains
      !> Puts a line in the place of the one before.
      procedure :: show
      procedure :: report
      procedure :: stops
      procedure :: announce
   end type progress_type

contains

   !> Progress that is shown on a terminal only, and not if `quiet`. A signal ends what it watches.
   function new_progress(quiet, asked) result(progress)
      logical, intent(in) :: quiet
      !> How many modes are wanted; 0: it is not known.
      integer, optional, intent(in) :: asked
      type(progress_type) :: progress

      progress%shown = standard_error_is_terminal()
      if (quiet) progress%shown = .false.
      if (present(asked)) progress%asked = asked
      call system_clock(progress%started)
   end function new_progress

   subroutine show(self, line)
      class(progress_type), intent(inout) :: self
      !> The new line; an empty one wipes what was there.
      character(len=*), intent(in) :: line
      character(len=1), parameter :: carriage_return = achar(13)

      if (.not. self%shown) return
      write (error_unit, "(5a)", advance="no") carriage_return, line, repeat(" ", max(0, self%width - len(line)))
      if (line == "") write (error_unit, "(a)", advance="no") carriage_return
      flush (error_unit)
      self%width = len(line)
   end subroutine show

   subroutine report(self, restart, converged, wanted, residual, proceed)
      class(progress_type), intent(inout) :: self
      integer, intent(in) :: restart
      integer, intent(in) :: converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed

      integer :: asked
      integer(long) :: now, rate

      call system_clock(now, rate)
      ! An iteration may want others than the modes, and begin again: of what was asked for there are never less than before.
      asked = merge(self%asked, wanted, self%asked > 0)
      self%seen = max(self%seen, int(real(asked, wp)*min(converged, wanted)/max(wanted, 1)))
      if (proceed) call self%show(text((now - self%started)/rate)//" s, iteration, "//text(restart)//" restarts: "// &
         text(min(self%seen, asked))//" of "//text(asked)//" modes")
      associate (unused => residual)
      end associate
   end subroutine report

   logical function stops(self)
      class(progress_type), intent(inout) :: self

      stops = is_interrupted()
      if (stops) call self%show("interrupted")
   end function stops

   ! A line that stays.
   subroutine announce(self, sentence)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      if (.not. self%shown) return
      call self%show("")
      write (error_unit, "(a)") sentence
   end subroutine announce
end module cli_progress
