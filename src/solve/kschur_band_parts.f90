!> A band of frequencies of an undamped symmetric problem, counted and cut into
!> parts that hold a few modes each.
module kschur_band_parts
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_inertia, only: count_below
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_text, only: text
   implicit none
   private
   public :: part_type, count_parts

   !> Half of the width of the gaps where a band is cut, relative to their place.
   real(wp), parameter, public :: half_gap = 1.0e-5_wp
   !> No more modes than this are computed at once.
   integer, parameter, public :: most_modes = 10000
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
   subroutine count_parts(problem, band, zeros, prototype, parts, counted, result, error)
      !> Symmetric, with a semidefinite M; its damping does not matter.
      type(modal_problem_type), intent(in) :: problem
      !> Two omega (rad/s), the first one may be zero.
      real(wp), intent(in) :: band(2)
      !> How often omega = 0 is an eigenvalue.
      integer, intent(in) :: zeros
      !> A solver that tells the inertia of indefinite matrices; copies of it are used.
      class(real_linear_solver_type), intent(in) :: prototype
      type(part_type), allocatable, intent(out) :: parts(:)
      !> False where the modes cannot be counted, as where K has negative eigenvalues.
      logical, intent(out) :: counted
      !> What it takes is added here.
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      ! Zeros are known no better than this, relative to the band.
      real(wp), parameter :: nearly_zero = 1.0e-3_wp
      type(part_type) :: whole
      real(wp) :: unstable
      integer :: negative

      allocate (parts(0))
      whole = part_type(band(1), band(2), zeros, 0)
      call count_at(problem, prototype, band(2)**2, whole%below_to, result)
      unstable = nearly_zero*band(2)
      if (band(1) > 0) then
         call count_at(problem, prototype, band(1)**2, whole%below_from, result)
         unstable = min(unstable, band(1))
      end if
      call count_at(problem, prototype, -unstable**2, negative, result)
      counted = negative == 0 .and. whole%below_from >= zeros .and. whole%below_to >= whole%below_from
      if (.not. counted) return
      if (whole%below_to - whole%below_from > most_modes) then
         call new_error(error, error_usage, "the band holds "//text(whole%below_to - whole%below_from)// &
            " modes, more than "//text(most_modes)//": ask for it in parts")
      else
         call cut(problem, prototype, whole, parts, result)
      end if
   end subroutine count_parts

   ! Adds a part to the others, or what it is cut into; nothing where it holds no modes.
   recursive subroutine cut(problem, prototype, part, parts, result)
      type(modal_problem_type), intent(in) :: problem
      class(real_linear_solver_type), intent(in) :: prototype
      type(part_type), intent(in) :: part
      type(part_type), allocatable, intent(inout) :: parts(:)
      type(modal_result_type), intent(inout) :: result
      real(wp), parameter :: places(5) = [0.5_wp, 0.4_wp, 0.6_wp, 0.3_wp, 0.7_wp]
      ! The middle of a part wider than this may be far from its modes.
      real(wp), parameter :: wide = 4
      real(wp) :: middle
      integer :: i, left, right

      if (part%below_to == part%below_from) return
      if (.not. part%is_lowest() .and. part%to > wide*part%from) then
         middle = (part%from + part%to)/2
         call count_at(problem, prototype, middle**2, left, result)
         if (left == part%below_to) then
            call cut(problem, prototype, part_type(part%from, middle, part%below_from, left), parts, result)
            return
         end if
      end if
      if (part%below_to - part%below_from > enough .and. part%to - part%from > narrow*part%to) then
         do i = 1, size(places)
            middle = part%from + places(i)*(part%to - part%from)
            call count_at(problem, prototype, ((1 - half_gap)*middle)**2, left, result)
            call count_at(problem, prototype, ((1 + half_gap)*middle)**2, right, result)
            if (left /= right .or. left < part%below_from .or. right > part%below_to) cycle
            call cut(problem, prototype, part_type(part%from, (1 - half_gap)*middle, part%below_from, left), parts, result)
            call cut(problem, prototype, part_type((1 + half_gap)*middle, part%to, right, part%below_to), parts, result)
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

   subroutine count_at(problem, prototype, theta, below, result)
      type(modal_problem_type), intent(in) :: problem
      class(real_linear_solver_type), intent(in) :: prototype
      real(wp), intent(in) :: theta
      integer, intent(out) :: below
      type(modal_result_type), intent(inout) :: result
      class(real_linear_solver_type), allocatable :: solver

      allocate (solver, source=prototype)
      call count_below(problem, theta, solver, below)
      call result%add_solver(solver)
      result%factorizations = result%factorizations + 1
   end subroutine count_at
end module kschur_band_parts
