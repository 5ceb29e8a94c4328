!> History of an iteration, and reasons of its end.
module kschur_outcome
   use kschur_kinds, only: wp
   use kschur_tolerances, only: inaccurate_above
   implicit none
   private
   public :: history_type, inaccurate_above

   !> All requested modes have converged.
   integer, parameter, public :: reason_converged = 0
   !> The restart limit was reached.
   integer, parameter, public :: reason_max_restarts = 1
   !> The problem has fewer modes than requested; all of them were found.
   integer, parameter, public :: reason_fewer_modes = 2
   !> The monitor cancelled.
   integer, parameter, public :: reason_cancelled = 3
   !> A mode has a backward error above `inaccurate_above`, or lacks a left vector that was requested or would bound its error, or
   !> modes were discarded as too inaccurate.
   integer, parameter, public :: reason_inaccurate = 4
   !> A signal interrupted the program; the library itself reports `reason_cancelled`.
   integer, parameter, public :: reason_interrupted = 5
   !> Names of the reasons, from `reason_converged` on.
   character(len=*), parameter, public :: reason_names(0:5) = [character(len=12) :: &
      "converged", "max_restarts", "fewer_modes", "cancelled", "inaccurate", "interrupted"]

   !> Whether a count of eigenvalues proves that no mode is missing: not counted, proved, count and modes differ.
   integer, parameter, public :: certified_unknown = 0, certified_yes = 1, certified_no = 2
   !> Names of the verdicts.
   character(len=*), parameter, public :: certified_names(0:2) = [character(len=7) :: "unknown", "true", "false"]

   !> One entry for each convergence test.
   type :: history_type
      !> Number of converged Ritz values among the wanted ones.
      integer, allocatable :: converged(:)
      !> Operator applications so far.
      integer, allocatable :: operator_applications(:)
      !> Largest relative residual among the wanted Ritz values.
      real(wp), allocatable :: residual(:)
      !> Whether it joins several iterations for different modes.
      logical :: of_parts = .false.
   contains
      !> Allocates an empty history.
      procedure :: begin
      !> Adds an entry.
      procedure :: add_check
      !> Appends the history of a later iteration.
      procedure :: append
      !> Number of applications until all wanted modes had converged.
      procedure :: wanted_after
   end type history_type

contains

   subroutine begin(self)
      class(history_type), intent(out) :: self

      allocate (self%converged(0), self%operator_applications(0), self%residual(0))
   end subroutine begin

   subroutine add_check(self, converged, operator_applications, residual)
      class(history_type), intent(inout) :: self
      integer, intent(in) :: converged, operator_applications
      real(wp), intent(in) :: residual

      self%converged = [self%converged, converged]
      self%operator_applications = [self%operator_applications, operator_applications]
      self%residual = [self%residual, residual]
   end subroutine add_check

   subroutine append(self, more, before)
      class(history_type), intent(inout) :: self
      type(history_type), intent(in) :: more
      !> Number of operator applications before that iteration.
      integer, intent(in) :: before

      self%converged = [self%converged, more%converged]
      self%operator_applications = [self%operator_applications, before + more%operator_applications]
      self%residual = [self%residual, more%residual]
      self%of_parts = .true.
   end subroutine append

   !> Operator applications at the first test with the final number of converged values; 0 if not all wanted values converged,
   !> or the history joins several iterations.
   pure integer function wanted_after(self, tolerance)
      class(history_type), intent(in) :: self
      !> Tolerance of residuals.
      real(wp), intent(in) :: tolerance
      integer :: i

      wanted_after = 0
      if (.not. allocated(self%residual) .or. self%of_parts) return
      i = findloc(self%converged == maxval(self%converged) .and. self%residual <= tolerance, .true., 1)
      if (i > 0) wanted_after = self%operator_applications(i)
   end function wanted_after
end module kschur_outcome
