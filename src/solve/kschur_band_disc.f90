!> The modes of a band that cannot be counted.
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

   ! No more modes than this are computed.
   integer, parameter :: most_uncounted = 2000
   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> Modes nearest to zero, more and more of them until they reach beyond the band.
   subroutine solve_disc(s, band, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      type(modes_type), intent(out) :: modes
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: at_first = 20
      type(modal_options_type) :: asked
      type(history_type) :: history
      integer, allocatable :: order(:)
      real(wp), allocatable :: omega(:)
      integer :: i
      logical :: cancelled

      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      history = modes%history
      asked = s%options
      s%options%target = 0
      s%options%modes = at_first
      do
         if (s%only_rigid()) then
            call take_rigid(s, modes)
            exit
         end if
         if (associated(s%monitor)) call s%monitor%counts(0, s%options%modes, 0)
         call place_shift(s, error)
         call take_cancelled(error, cancelled)
         ! Those nearest to zero are whole.
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
         s%options%modes = min(most_uncounted, larger(s%options%modes, maxval([0.0_wp, abs(modes%lambda)])/band(2)))
      end do
      s%options%target = asked%target
      modes%history = history
      if (modes%reason == reason_fewer_modes) modes%reason = reason_converged
      ! Nothing is overdamped with losses. A list that ended early is not all of the band.
      if (.not. s%is_lossy() .or. modes%reason /= reason_converged) modes%certified = certified_unknown
      call tell_frequencies(s, modes, omega)
      order = pack([(i, i=1, size(omega))], abs(modes%lambda) <= band(2) .and. omega >= band(1) .and. omega <= band(2))
      call modes%take(order)
   end subroutine solve_disc

   ! As many as there would be if their number grew with the square of |lambda|.
   integer function larger(modes, reach)
      integer, intent(in) :: modes
      !> Part of the band that they cover.
      real(wp), intent(in) :: reach
      real(wp), parameter :: least = 1.25_wp, most = 4

      larger = ceiling(modes*min(most, max(least, (1.1_wp/max(reach, tiny(1.0_wp)))**2)))
   end function larger

   ! The undamped frequencies (rad/s) that a result tells.
   subroutine tell_frequencies(s, modes, omega)
      type(solve_context_type), intent(in) :: s
      !> As it was, on return.
      type(modes_type), intent(inout) :: modes
      real(wp), allocatable, intent(out) :: omega(:)
      type(modal_result_type) :: told
      real(wp), allocatable :: rigid(:, :)

      call modes%make_complex()
      call move_alloc(modes%lambda, told%eigenvalues)
      call move_alloc(modes%phi, told%eigenvectors)
      call s%known%rigid_motions(rigid)
      call describe(s%problem, rigid, told)
      call move_alloc(told%eigenvalues, modes%lambda)
      call move_alloc(told%eigenvectors, modes%phi)
      allocate (omega, source=2*pi*told%frequency_hz)
   end subroutine tell_frequencies
end module kschur_band_disc
