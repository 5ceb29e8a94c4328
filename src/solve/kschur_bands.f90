!> All modes of each of several bands: bands that overlap or touch are found as one.
module kschur_bands
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_modal_solver, only: modal_solver_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type
   use kschur_outcome, only: certified_no, certified_unknown, reason_converged
   use kschur_result, only: modal_result_type
   use kschur_sorting, only: ascending_order
   use kschur_tolerances, only: same_frequency
   implicit none
   private
   public :: solve_bands

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> For each band what `solver%solve_band` gives for it. Those that overlap or touch are cut out of the one that they make
   !> together, and so are all that are left where modes cannot be counted, as each would be cut out of all modes below its
   !> end. Where not all of that band was found, or one of its modes is noted for something, each is solved by itself. The
   !> effort stands with the first result of those that share one. Fails as `solve_band`.
   subroutine solve_bands(solver, bands, options, results, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      !> First and last frequency of each (Hz), 2 x bands.
      real(wp), intent(in) :: bands(:, :)
      type(modal_options_type), intent(in) :: options
      !> One a band.
      type(modal_result_type), allocatable, intent(out) :: results(:)
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_result_type) :: found
      integer, allocatable :: waiting(:), own(:)
      ! Whether all that are left are tried as one band; whether none are, as that failed.
      logical :: at_once, alone
      integer :: i

      if (size(bands, 1) /= 2 .or. any(bands(1, :) >= bands(2, :))) then
         call new_error(error, error_usage, "bands want two frequencies each, the second above the first")
         return
      end if
      allocate (results(size(bands, 2)))
      waiting = ascending_order(-bands(2, :))
      at_once = .false.
      alone = .false.
      do while (size(waiting) > 0)
         own = waiting(:merge(size(waiting), joined(bands(:, waiting)), at_once))
         if (size(own) > 1 .and. .not. alone) then
            call solver%solve_band(minval(bands(1, own)), maxval(bands(2, own)), options, found, error, monitor)
            if (allocated(error)) return
            alone = .not. is_whole(found)
         end if
         if (size(own) == 1 .or. alone) then
            own = waiting(:1)
            call solver%solve_band(bands(1, own(1)), bands(2, own(1)), options, results(own(1)), error, monitor)
            if (allocated(error)) return
         else
            do i = 1, size(own)
               results(own(i)) = part_of(found, bands(:, own(i)))
               found%effort_type = effort_type()
            end do
         end if
         at_once = results(own(1))%certified == certified_unknown
         waiting = waiting(size(own) + 1:)
      end do
   end subroutine solve_bands

   ! How many of the first ones overlap or touch.
   pure integer function joined(bands)
      real(wp), intent(in) :: bands(:, :)

      do joined = 1, size(bands, 2) - 1
         if (bands(2, joined + 1) < minval(bands(1, :joined))) return
      end do
   end function joined

   pure logical function is_whole(found)
      type(modal_result_type), intent(in) :: found
      integer :: i

      is_whole = found%reason == reason_converged .and. found%certified /= certified_no
      if (.not. allocated(found%notes)) return
      do i = 1, size(found%notes)
         is_whole = is_whole .and. index(found%notes(i), "mode") /= 1
      end do
   end function is_whole

   ! The modes of a band, in the order of its own solve.
   function part_of(found, band) result(part)
      type(modal_result_type), intent(in) :: found
      real(wp), intent(in) :: band(2)
      type(modal_result_type) :: part
      integer :: i

      part = found
      part%target = cmplx(0, 2*pi*band(1), wp)
      part%options%target = part%target
      part%band = band
      call part%take(pack([(i, i=1, size(found%eigenvalues))], &
         found%frequency_hz >= (1 - same_frequency)*band(1) .and. found%frequency_hz <= (1 + same_frequency)*band(2)))
      part%modes_asked = size(part%eigenvalues)
      part%options%modes = part%modes_asked
   end function part_of
end module kschur_bands
