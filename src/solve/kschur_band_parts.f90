!> Counts the eigenvalues in a band of an undamped symmetric problem by inertia, and cuts the band at gaps of the spectrum into
!> parts of at most a hundred modes, where it has gaps.
module kschur_band_parts
   use kschur_context, only: solve_context_type
   use kschur_effort, only: for_count
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_inertia, only: count_below
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_text, only: text
   use kschur_tolerances, only: narrowest_interval, same_value, seems_zero
   implicit none
   private
   public :: count_at, part_type, count_parts

   !> Largest number of modes of a band.
   integer, parameter :: most_modes = 10000
   ! A part with more modes than this is cut.
   integer, parameter :: largest_part = 100

   !> A part of a band: the modes with from < omega < to (rad/s).
   type :: part_type
      real(wp) :: from = 0, to = 0
      !> Number of omega below either end, zeros included.
      integer :: below_from = 0, below_to = 0
   contains
      !> Whether the part is better solved from near zero, with all modes below it, than from its middle: from there zeros would
      !> be as far as its ends.
      procedure :: is_lowest
   end type part_type

contains

   !> Counts a band and cuts it into disjoint parts that together hold all its nonzero omega. Between neighbours is a gap that two
   !> equal counts prove empty, so that a multiple eigenvalue lies in one part. Fails if the band holds more than 10,000 modes.
   subroutine count_parts(s, band, zeros, parts, counted, error)
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
      type(part_type) :: whole
      real(wp) :: unstable
      integer :: negative

      allocate (parts(0))
      call s%enter_phase("count of the band", error)
      if (allocated(error)) return
      whole = part_type(band(1), band(2), zeros, 0)
      call count_at(s, band(2)**2, whole%below_to)
      unstable = seems_zero*band(2)
      if (band(1) > 0) then
         call count_at(s, band(1)**2, whole%below_from)
         unstable = min(unstable, band(1))
      end if
      call count_at(s, -unstable**2, negative)
      counted = negative == 0 .and. whole%below_from >= zeros .and. whole%below_to >= whole%below_from
      if (.not. counted) return
      if (whole%below_to - whole%below_from > most_modes) then
         call new_error(error, error_usage, "the band holds "//text(whole%below_to - whole%below_from)// &
            " modes, more than "//text(most_modes)//": ask for it in parts")
      else
         call cut(s, whole, parts)
      end if
   end subroutine count_parts

   ! Cuts a part of more than `largest_part` modes recursively at gaps that two equal counts prove empty, and the empty upper half
   ! off a wide part. Appends the pieces that hold modes to `parts`.
   recursive subroutine cut(s, part, parts)
      type(solve_context_type), intent(inout) :: s
      type(part_type), intent(in) :: part
      type(part_type), allocatable, intent(inout) :: parts(:)
      ! Where a gap is looked for, as fractions of the width.
      real(wp), parameter :: fractions(5) = [0.5_wp, 0.4_wp, 0.6_wp, 0.3_wp, 0.7_wp]
      ! The middle of a part with a larger ratio of its ends may be far from its modes: an empty upper half is cut off.
      real(wp), parameter :: widest_ratio = 4
      real(wp) :: omega
      integer :: i, below_gap, below_next

      if (part%below_to == part%below_from) return
      if (.not. part%is_lowest() .and. part%to > widest_ratio*part%from) then
         omega = (part%from + part%to)/2
         call count_at(s, omega**2, below_gap)
         if (below_gap == part%below_to) then
            call cut(s, part_type(part%from, omega, part%below_from, below_gap), parts)
            return
         end if
      end if
      if (part%below_to - part%below_from > largest_part .and. part%to - part%from > narrowest_interval*part%to) then
         do i = 1, size(fractions)
            omega = part%from + fractions(i)*(part%to - part%from)
            call count_at(s, ((1 - same_value)*omega)**2, below_gap)
            call count_at(s, ((1 + same_value)*omega)**2, below_next)
            if (below_gap /= below_next .or. below_gap < part%below_from .or. below_next > part%below_to) cycle
            call cut(s, part_type(part%from, (1 - same_value)*omega, part%below_from, below_gap), parts)
            call cut(s, part_type((1 + same_value)*omega, part%to, below_next, part%below_to), parts)
            return
         end do
      end if
      parts = [parts, part]
   end subroutine cut

   pure logical function is_lowest(self)
      class(part_type), intent(in) :: self
      real(wp), parameter :: near_zero = 0.01_wp

      is_lowest = self%from <= near_zero*self%to .and. self%below_from <= largest_part
   end function is_lowest

   !> Counts the eigenvalues omega^2 < theta ((rad/s)^2) by inertia, zeros included; -1 if that fails.
   subroutine count_at(s, theta, below)
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(in) :: theta
      integer, intent(out) :: below
      class(real_linear_solver_type), allocatable :: solver

      allocate (solver, source=s%inner%counting)
      call count_below(s%work, theta, 0, solver, below)
      call s%effort%add_factors(solver, for_count)
   end subroutine count_at
end module kschur_band_parts
