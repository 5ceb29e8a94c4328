!> Progress of a long run: one line on standard error, written over and over.
module cli_progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use cli_numbers, only: rounded
   use cli_system, only: standard_error_is_terminal
   use kschur, only: monitor_type, text, wp
   implicit none
   private
   public :: new_progress, progress_type

   !> Shows what is going on to whoever watches the terminal.
   type, extends(monitor_type) :: progress_type
      private
      logical :: shown = .false.
      integer :: width = 0
   contains
      !> Puts a line in the place of the one before.
      procedure :: show
      procedure :: report
      procedure :: announce
   end type progress_type

contains

   !> Progress that is shown on a terminal only, and not if `quiet`.
   function new_progress(quiet) result(progress)
      logical, intent(in) :: quiet
      type(progress_type) :: progress

      progress%shown = standard_error_is_terminal()
      if (quiet) progress%shown = .false.
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

      if (proceed) call self%show(text(restart)//" restarts: "//text(converged)//" of "//text(wanted)// &
         " converged, largest residual "//rounded(residual))
   end subroutine report

   ! A line that stays.
   subroutine announce(self, sentence)
      class(progress_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      if (.not. self%shown) return
      call self%show("")
      write (error_unit, "(a)") sentence
   end subroutine announce
end module cli_progress
