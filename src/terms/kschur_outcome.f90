!> How an iteration went and why it ended.
module kschur_outcome
   use kschur_kinds, only: wp
   use kschur_tolerances, only: inaccurate_above
   implicit none
   private
   public :: history_type, inaccurate_above

   !> All the modes that were asked for have converged.
   integer, parameter, public :: reason_converged = 0
   !> The restarts ran out first.
   integer, parameter, public :: reason_max_restarts = 1
   !> The problem has fewer modes than were asked for; all of them are here.
   integer, parameter, public :: reason_fewer_modes = 2
   !> The monitor asked to stop.
   integer, parameter, public :: reason_cancelled = 3
   !> A mode has a backward error above `inaccurate_above` or no left vector that was asked for, or what was found is too
   !> inaccurate to be listed.
   integer, parameter, public :: reason_inaccurate = 4
   !> A signal ended the program's wait for more modes; the library itself says `reason_cancelled`.
   integer, parameter, public :: reason_interrupted = 5
   !> The names of the reasons, in this order from `reason_converged` on.
   character(len=*), parameter, public :: reason_names(0:5) = [character(len=12) :: &
      "converged", "max_restarts", "fewer_modes", "cancelled", "inaccurate", "interrupted"]

   !> Whether a count of eigenvalues proves that no mode is missing: nothing was
   !> counted, it does, the count and the modes differ.
   integer, parameter, public :: certified_unknown = 0, certified_yes = 1, certified_no = 2
   !> Their names.
   character(len=*), parameter, public :: certified_names(0:2) = [character(len=7) :: "unknown", "true", "false"]

   !> One entry each time that convergence was looked at.
   type :: history_type
      !> Number of converged Ritz values among the wanted ones.
      integer, allocatable :: converged(:)
      !> Operator applications so far.
      integer, allocatable :: operator_applications(:)
      !> Largest relative residual among the wanted Ritz values.
      real(wp), allocatable :: residual(:)
      !> Whether it is of several iterations, each of which looked for modes of its own.
      logical :: of_parts = .false.
   contains
      !> Begins without an entry.
      procedure :: begin
      !> Adds an entry.
      procedure :: add_check
      !> Adds what came after it.
      procedure :: append
      !> How many applications it took until all that was wanted had converged.
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
      !> Applications before it began.
      integer, intent(in) :: before

      self%converged = [self%converged, more%converged]
      self%operator_applications = [self%operator_applications, before + more%operator_applications]
      self%residual = [self%residual, more%residual]
      self%of_parts = .true.
   end subroutine append

   !> The operator applications at the first look that found as many converged as any did; 0 where not all that was wanted
   !> converged, or it was found in parts.
   pure integer function wanted_after(self, tolerance)
      class(history_type), intent(in) :: self
      !> What residuals are to be below.
      real(wp), intent(in) :: tolerance
      integer :: i

      wanted_after = 0
      if (.not. allocated(self%residual) .or. self%of_parts) return
      i = findloc(self%converged == maxval(self%converged) .and. self%residual <= tolerance, .true., 1)
      if (i > 0) wanted_after = self%operator_applications(i)
   end function wanted_after
end module kschur_outcome
