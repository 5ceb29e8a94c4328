!> Computes all modes of each of several bands; bands that overlap or touch are solved as one.
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

   !> Returns for each band what `solver%solve_band` gives for it. Bands that overlap or touch are solved as one band, of which each
   !> takes its modes. So are all remaining bands if modes cannot be counted, as each would need all modes below its end. If the
   !> joint band is incomplete, or a note is about one of its modes, each band is solved separately. The effort is reported with
   !> the first of the results that share it. Fails as `solve_band`.
   subroutine solve_bands(solver, bands, options, results, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      !> Edges of each band (Hz), 2 x number of bands.
      real(wp), intent(in) :: bands(:, :)
      type(modal_options_type), intent(in) :: options
      !> One for each band.
      type(modal_result_type), allocatable, intent(out) :: results(:)
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_result_type) :: found
      integer, allocatable :: waiting(:), group(:)
      ! Whether all remaining bands are joined, as their modes cannot be counted; whether none are, as a joint band was incomplete.
      logical :: join_all, join_none
      integer :: i

      if (size(bands, 1) /= 2 .or. any(bands(1, :) >= bands(2, :))) then
         call new_error(error, error_usage, "bands want two frequencies each, the second above the first")
         return
      end if
      allocate (results(size(bands, 2)))
      waiting = ascending_order(-bands(2, :))
      join_all = .false.
      join_none = .false.
      do while (size(waiting) > 0)
         group = waiting(:merge(size(waiting), number_joined(bands(:, waiting)), join_all))
         if (size(group) > 1 .and. .not. join_none) then
            call solver%solve_band(minval(bands(1, group)), maxval(bands(2, group)), options, found, error, monitor)
            if (allocated(error)) return
            join_none = .not. is_complete(found)
         end if
         if (size(group) == 1 .or. join_none) then
            group = waiting(:1)
            call solver%solve_band(bands(1, group(1)), bands(2, group(1)), options, results(group(1)), error, monitor)
            if (allocated(error)) return
         else
            do i = 1, size(group)
               results(group(i)) = cut_out(found, bands(:, group(i)))
               found%effort_type = effort_type()
            end do
         end if
         join_all = results(group(1))%certified == certified_unknown
         waiting = waiting(size(group) + 1:)
      end do
   end subroutine solve_bands

   ! Number of leading bands that overlap or touch; the bands are sorted by descending upper edge.
   pure integer function number_joined(bands)
      real(wp), intent(in) :: bands(:, :)

      do number_joined = 1, size(bands, 2) - 1
         if (bands(2, number_joined + 1) < minval(bands(1, :number_joined))) return
      end do
   end function number_joined

   ! Whether all modes were found, and no note is about one of them (such notes begin with "mode").
   pure logical function is_complete(found)
      type(modal_result_type), intent(in) :: found
      integer :: i

      is_complete = found%reason == reason_converged .and. found%certified /= certified_no
      if (.not. allocated(found%notes)) return
      do i = 1, size(found%notes)
         is_complete = is_complete .and. index(found%notes(i), "mode") /= 1
      end do
   end function is_complete

   ! The result for one band, cut out of that for a joint band.
   function cut_out(found, band) result(part)
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
   end function cut_out
end module kschur_bands
