!> Counts the eigenvalues in a band of an undamped symmetric problem by inertia, and cuts the band at gaps of the spectrum, where
!> it has gaps, into parts that take about equal times.
module kschur_band_cuts
   use kschur_band_groups, only: band_groups_type
   use kschur_band_parts, only: least_to_cut, most_about_shift, most_from_zero, part_type
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_monitor, only: ask_monitor
   use kschur_text, only: text
   use kschur_tolerances, only: narrowest_interval, same_value, seems_zero
   implicit none
   private
   public :: count_parts

   ! Largest number of modes of a band.
   integer, parameter :: most_modes = 10000
   ! Where a gap is looked for: fractions of the width; in a lowest part, powers of the fraction of its upper end below which there
   ! should be as many modes as wanted.
   real(wp), parameter :: fractions(5) = [0.5_wp, 0.4_wp, 0.6_wp, 0.3_wp, 0.7_wp], powers(5) = [1.0_wp, 1.2_wp, 0.8_wp, 1.5_wp, &
      0.6_wp]

   !> The largest numbers of modes of a part, solved about a shift or from zero.
   type :: limits_type
      integer :: about_shift = most_about_shift, from_zero = most_from_zero
   end type limits_type

   !> A part that may still be cut.
   type, extends(part_type) :: piece_type
      !> Number of the fraction where a gap is looked for next; 0: whether the upper half is empty is asked first; one more than
      !> there are: it stays whole.
      integer :: trial = 0
      type(limits_type) :: limits
      !> In a lowest part, the power of omega that the number of modes below it grows with: 1/2 in beams, 1 in plates, 3 in solids;
      !> as between the ends of the part that was cut off last. First a large one, as what is above may be cut again.
      real(wp) :: growth = 2.5_wp
   contains
      procedure :: most
      procedure :: places
      procedure :: cut
   end type piece_type

contains

   !> Counts a band and cuts it into disjoint parts that together hold all its nonzero omega. Between neighbours is a gap that two
   !> equal counts prove empty, so that a multiple eigenvalue lies in one part. All pieces are cut in each round, so that groups
   !> count at the same time. Fails if the band holds more than 10,000 modes.
   subroutine count_parts(s, band, zeros, parts, counted, error, groups)
      !> Its reduced problem is symmetric with semidefinite M; its damping is ignored.
      type(solve_context_type), intent(inout) :: s
      !> The edges (rad/s); the first may be zero.
      real(wp), intent(in) :: band(2)
      !> Multiplicity of the eigenvalue omega = 0.
      integer, intent(in) :: zeros
      type(part_type), allocatable, intent(out) :: parts(:)
      !> False if the modes cannot be counted, for example because K has negative eigenvalues.
      logical, intent(out) :: counted
      type(error_type), allocatable, intent(out) :: error
      !> Groups of processes that count.
      type(band_groups_type), intent(inout) :: groups
      type(piece_type), allocatable :: pieces(:), smaller(:)
      type(part_type) :: whole
      real(wp), allocatable :: omega(:)
      integer, allocatable :: below(:)
      integer :: i, last

      allocate (parts(0))
      call s%enter_phase("count of the band", error)
      if (allocated(error)) return
      whole = part_type(band(1), band(2), zeros, 0)
      if (band(1) > 0) then
         call groups%count(s, [-min(seems_zero*band(2), band(1))**2, band(2)**2, band(1)**2], below)
         whole%below_from = below(3)
      else
         call groups%count(s, [-(seems_zero*band(2))**2, band(2)**2], below)
      end if
      whole%below_to = below(2)
      counted = below(1) == 0 .and. whole%below_from >= zeros .and. whole%below_to >= whole%below_from
      if (.not. counted) return
      if (whole%below_to - whole%below_from > most_modes) then
         call new_error(error, error_usage, "the band holds "//text(whole%below_to - whole%below_from)// &
            " modes, more than "//text(most_modes)//": ask for it in parts")
         return
      end if
      allocate (pieces(0))
      call append_piece(piece_type(part_type=whole, limits=fair_limits(whole, groups%number_of_groups())), pieces)
      do
         omega = [real(wp) ::]
         do i = 1, size(pieces)
            omega = [omega, pieces(i)%places()]
         end do
         if (size(omega) == 0) exit
         ! Other groups do not see a cancellation.
         call ask_monitor(s%monitor, error)
         if (allocated(error)) return
         call groups%count(s, omega**2, below)
         allocate (smaller(0))
         last = 0
         do i = 1, size(pieces)
            associate (number => size(pieces(i)%places()))
               call pieces(i)%cut(omega(last + 1:last + number), below(last + 1:last + number), smaller)
               last = last + number
            end associate
         end do
         call move_alloc(smaller, pieces)
      end do
      parts = pieces%part_type
   end subroutine count_parts

   ! The limits with which groups end at about the same time. The modes of a lowest part take half of the time of others: it gets
   ! two shares, each other group one; parts with fewer modes than are worth it are not cut.
   pure function fair_limits(whole, groups) result(limits)
      type(part_type), intent(in) :: whole
      integer, intent(in) :: groups
      type(limits_type) :: limits
      ! A part may exceed its share by this factor.
      real(wp), parameter :: excess = 1.25_wp
      real(wp) :: share

      if (groups == 1) return
      share = excess*real(whole%below_to - whole%below_from, wp)/merge(groups + 1, groups, whole%is_lowest())
      limits%about_shift = max(least_to_cut, min(limits%about_shift, nint(share)))
      limits%from_zero = max(least_to_cut, min(limits%from_zero, nint(2*share)))
   end function fair_limits

   ! Appends a piece, unless it is empty, with what is asked first about it.
   pure subroutine append_piece(piece, pieces)
      type(piece_type), intent(in) :: piece
      type(piece_type), allocatable, intent(inout) :: pieces(:)
      ! The middle of a part with a larger ratio of its ends may be far from its modes: an empty upper half is cut off.
      real(wp), parameter :: widest_ratio = 4
      type(piece_type) :: new

      if (piece%below_to == piece%below_from) return
      new = piece
      new%trial = 0
      if (new%is_lowest() .or. .not. new%to > widest_ratio*new%from) call next_trial(new)
      pieces = [pieces, new]
   end subroutine append_piece

   ! Goes on to the next trial, or leaves the piece whole if it is small enough, or too narrow to be cut.
   pure subroutine next_trial(piece)
      type(piece_type), intent(inout) :: piece

      piece%trial = piece%trial + 1
      if (piece%below_to - piece%below_from <= piece%most() .or. .not. piece%to - piece%from > narrowest_interval*piece%to) &
         piece%trial = size(fractions) + 1
   end subroutine next_trial

   ! The number of modes from which on the piece is cut.
   pure integer function most(self)
      class(piece_type), intent(in) :: self

      most = merge(self%limits%from_zero, self%limits%about_shift, self%is_lowest())
   end function most

   ! The omega at which to count for a piece: the two ends of a gap, its middle, or none if it stays whole.
   pure function places(self) result(omega)
      class(piece_type), intent(in) :: self
      real(wp), allocatable :: omega(:)
      ! How much of its limit a lowest part should have, as its growth is not quite known.
      real(wp), parameter :: of_limit = 0.8_wp
      real(wp) :: share

      if (self%trial == 0) then
         omega = [(self%from + self%to)/2]
      else if (self%trial > size(fractions)) then
         omega = [real(wp) ::]
      else if (self%is_lowest()) then
         share = of_limit*self%limits%from_zero/(self%below_to - self%below_from)
         omega = max(2*self%from, self%to*share**(powers(self%trial)/self%growth))*[1 - same_value, 1 + same_value]
      else
         omega = (self%from + fractions(self%trial)*(self%to - self%from))*[1 - same_value, 1 + same_value]
      end if
   end function places

   ! Appends what the counts below its places make of a piece: the two sides of a gap, the half below an empty one, or the piece
   ! again.
   pure subroutine cut(self, omega, below, pieces)
      class(piece_type), intent(in) :: self
      real(wp), intent(in) :: omega(:)
      integer, intent(in) :: below(:)
      type(piece_type), allocatable, intent(inout) :: pieces(:)
      ! The least and the largest power that is believed.
      real(wp), parameter :: powers_of_models(2) = [0.4_wp, 4.0_wp]
      type(piece_type) :: piece, lower, upper

      piece = self
      lower = self
      upper = self
      if (size(omega) == 1) then
         if (below(1) == self%below_to) then
            lower%to = omega(1)
            call append_piece(lower, pieces)
            return
         end if
      else if (size(omega) == 2) then
         if (below(1) == below(2) .and. below(1) >= self%below_from .and. below(2) <= self%below_to) then
            lower%to = omega(1)
            lower%below_to = below(1)
            upper%from = omega(2)
            upper%below_from = below(2)
            if (below(1) > self%below_from) lower%growth = min(max(powers_of_models(1), &
               log(real(self%below_to - self%below_from, wp)/(below(1) - self%below_from))/log(self%to/omega(1))), &
               powers_of_models(2))
            call append_piece(lower, pieces)
            call append_piece(upper, pieces)
            return
         end if
      end if
      if (size(omega) > 0) call next_trial(piece)
      pieces = [pieces, piece]
   end subroutine cut
end module kschur_band_cuts
