!> Computes the modes of a band that inertia cannot count: all modes up to its end, nearest to zero first.
module kschur_band_disc
   use kschur_context, only: solve_context_type
   use kschur_description, only: describe
   use kschur_error, only: error_type, new_error, error_usage, take_cancelled
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type, no_modes
   use kschur_options, only: modal_options_type
   use kschur_outcome, only: certified_unknown, history_type, reason_cancelled, reason_converged, reason_fewer_modes
   use kschur_result, only: modal_result_type
   use kschur_search, only: find_modes, take_rigid
   use kschur_shift, only: place_shift
   use kschur_text, only: text
   implicit none
   private
   public :: solve_disc

   ! Largest number of modes that are computed.
   integer, parameter :: most_uncounted = 2000
   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> Computes the modes nearest to zero, more in each round until the furthest lies beyond the end of the band (rad/s), and keeps
   !> those whose undamped frequency is in the band. Fails if more than 2,000 modes lie below its end.
   subroutine solve_disc(s, band, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: initial_modes = 20
      type(modal_options_type) :: saved_options
      type(history_type) :: history
      integer, allocatable :: order(:)
      real(wp), allocatable :: omega(:)
      integer :: i
      logical :: cancelled

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      history = modes%history
      saved_options = s%options
      s%options%target = 0
      s%options%modes = initial_modes
      do
         if (s%only_rigid()) then
            call take_rigid(s, modes)
            exit
         end if
         if (associated(s%monitor)) call s%monitor%counts(0, s%options%modes, 0)
         call place_shift(s, error)
         call take_cancelled(error, cancelled)
         ! The modes of the round before are complete as far as they reach.
         if (cancelled) modes%reason = reason_cancelled
         if (cancelled) exit
         if (.not. allocated(error)) call find_modes(s, modes, error)
         if (allocated(error)) return
         call history%append(modes%history, 0)
         if (modes%reason /= reason_converged .or. maxval([0.0_wp, abs(modes%lambda)]) > band(2)) exit
         if (s%options%modes == most_uncounted) then
            call new_error(error, error_usage, "more than "//text(most_uncounted)//" modes lie below the end of the band, "// &
               "and they cannot be counted: end it lower, or ask for modes near a target")
            return
         end if
         s%options%modes = min(most_uncounted, next_number(s%options%modes, maxval([0.0_wp, abs(modes%lambda)])/band(2)))
      end do
      s%options%target = saved_options%target
      modes%history = history
      if (modes%reason == reason_fewer_modes) modes%reason = reason_converged
      ! The faster root of an overdamped oscillator may lie outside of the disc, but with losses no oscillator is overdamped. A list
      ! that ended early is not all of the band.
      if (.not. s%is_lossy() .or. modes%reason /= reason_converged) modes%certified = certified_unknown
      call find_frequencies(s, modes, omega)
      order = pack([(i, i=1, size(omega))], abs(modes%lambda) <= band(2) .and. omega >= band(1) .and. omega <= band(2))
      call modes%take(order)
   end subroutine solve_disc

   ! The number of modes of the next round: what the band would hold if their number grew with the square of |lambda|, between 1.25
   ! and 4 times the present number.
   integer function next_number(modes, covered)
      integer, intent(in) :: modes
      !> Largest |lambda| of the present modes, relative to the end of the band.
      real(wp), intent(in) :: covered
      real(wp), parameter :: least = 1.25_wp, most = 4

      next_number = ceiling(modes*min(most, max(least, (1.1_wp/max(covered, tiny(1.0_wp)))**2)))
   end function next_number

   ! Computes undamped frequencies (rad/s) of modes as a result reports them: of an overdamped oscillator this is not |lambda|.
   subroutine find_frequencies(s, modes, omega)
      type(solve_context_type), intent(in) :: s
      !> Unchanged on return, but for complex shapes.
      type(modes_type), intent(inout) :: modes
      real(wp), allocatable, intent(out) :: omega(:)
      type(modal_result_type) :: described
      real(wp), allocatable :: rigid(:, :)

      call modes%make_complex()
      call move_alloc(modes%lambda, described%eigenvalues)
      call move_alloc(modes%phi, described%eigenvectors)
      call s%known%rigid_motions(rigid)
      call describe(s%problem, rigid, described)
      call move_alloc(described%eigenvalues, modes%lambda)
      call move_alloc(described%eigenvectors, modes%phi)
      allocate (omega, source=2*pi*described%frequency_hz)
   end subroutine find_frequencies
end module kschur_band_disc
