!> A band of frequencies of an undamped symmetric problem, counted and cut into
!> parts that hold a few modes each.
module kschur_band_parts
   use kschur_context, only: solve_context_type
   use kschur_effort, only: for_count
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_inertia, only: count_below
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_text, only: text
   use kschur_tolerances, only: same_value, seems_zero
   implicit none
   private
   public :: count_at, part_type, count_parts

   !> No more modes than this are computed at once.
   integer, parameter :: most_modes = 10000
   ! A part with more modes than this is cut.
   integer, parameter :: enough = 100
   ! A part narrower than this, relative to its place, is not cut.
   real(wp), parameter :: narrow = 1.0e-3_wp

   !> The modes with from < omega < to (rad/s).
   type :: part_type
      real(wp) :: from = 0, to = 0
      !> How many omega are below either end, zeros included.
      integer :: below_from = 0, below_to = 0
   contains
      !> Whether the part is best found with all that is below it. From its middle, zeros
      !> would be as far as its ends.
      procedure :: is_lowest
   end type part_type

contains

   !> Parts that do not overlap and together hold every nonzero omega of a band. Two
   !> neighbours leave a gap between them, in which nothing was counted: each multiple
   !> eigenvalue is in one part. Fails where there are too many.
   subroutine count_parts(s, band, zeros, parts, counted, error)
      !> Its work is symmetric, with a semidefinite M; its damping does not matter.
      type(solve_context_type), intent(inout) :: s
      !> Two omega (rad/s), the first one may be zero.
      real(wp), intent(in) :: band(2)
      !> How often omega = 0 is an eigenvalue.
      integer, intent(in) :: zeros
      type(part_type), allocatable, intent(out) :: parts(:)
      !> False where the modes cannot be counted, as where K has negative eigenvalues.
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

   ! Adds a part to the others, or what it is cut into; nothing where it holds no modes.
   recursive subroutine cut(s, part, parts)
      type(solve_context_type), intent(inout) :: s
      type(part_type), intent(in) :: part
      type(part_type), allocatable, intent(inout) :: parts(:)
      real(wp), parameter :: places(5) = [0.5_wp, 0.4_wp, 0.6_wp, 0.3_wp, 0.7_wp]
      ! The middle of a part wider than this may be far from its modes.
      real(wp), parameter :: wide = 4
      real(wp) :: middle
      integer :: i, left, right

      if (part%below_to == part%below_from) return
      if (.not. part%is_lowest() .and. part%to > wide*part%from) then
         middle = (part%from + part%to)/2
         call count_at(s, middle**2, left)
         if (left == part%below_to) then
            call cut(s, part_type(part%from, middle, part%below_from, left), parts)
            return
         end if
      end if
      if (part%below_to - part%below_from > enough .and. part%to - part%from > narrow*part%to) then
         do i = 1, size(places)
            middle = part%from + places(i)*(part%to - part%from)
            call count_at(s, ((1 - same_value)*middle)**2, left)
            call count_at(s, ((1 + same_value)*middle)**2, right)
            if (left /= right .or. left < part%below_from .or. right > part%below_to) cycle
            call cut(s, part_type(part%from, (1 - same_value)*middle, part%below_from, left), parts)
            call cut(s, part_type((1 + same_value)*middle, part%to, right, part%below_to), parts)
            return
         end do
      end if
      parts = [parts, part]
   end subroutine cut

   pure logical function is_lowest(self)
      class(part_type), intent(in) :: self
      real(wp), parameter :: near_zero = 0.01_wp

      is_lowest = self%from <= near_zero*self%to .and. self%below_from <= enough
   end function is_lowest

   !> How many omega^2 are below theta ((rad/s)^2), zeros included.
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
