!> Boundary of the region nearer to a target than a radius.
module kschur_closed_curve
   use kschur_kinds, only: wp
   implicit none
   private
   public :: closed_curve_type, new_closed_curve

   real(wp), parameter :: pi = acos(-1.0_wp)

   !> The boundary as a path. A conjugate pair has the distance of its nearer member: the region is the union of two discs about the
   !> target and its conjugate. If they reach the real axis, they form one symmetric region, and half of its boundary suffices;
   !> otherwise one disc does.
   type :: closed_curve_type
      !> The target, Im >= 0, and the distance (1/s).
      complex(wp) :: center = (0.0_wp, 0.0_wp)
      real(wp) :: radius = 0
      !> Whether the path ends where it begins, in the upper half plane; else it is the half of a curve symmetric about the
      !> real axis, from the right end on that axis to the left one.
      logical :: closed = .false.
      ! Whether it is that half and the way back along the real axis.
      logical, private :: returns = .false.
      ! Angle of the right end, negative.
      real(wp), private :: start = 0
   contains
      !> Point at parameter 0 ... 1, counterclockwise.
      procedure :: point
      !> Scaled variable of power series about the centre, of modulus about one.
      procedure :: variable
   end type closed_curve_type

contains

   !> Creates the boundary for a target and a radius (1/s).
   pure function new_closed_curve(target, radius, upper) result(curve)
      complex(wp), intent(in) :: target
      real(wp), intent(in) :: radius
      !> Whether to enclose only the part of the region above the real axis, because eigenvalues below are no conjugates of those
      !> above. Absent: no.
      logical, optional, intent(in) :: upper
      type(closed_curve_type) :: curve

      curve%center = cmplx(real(target, wp), abs(aimag(target)), wp)
      curve%radius = radius
      curve%closed = aimag(curve%center) > radius
      if (curve%closed) return
      curve%start = -asin(aimag(curve%center)/radius)
      if (.not. present(upper)) return
      curve%closed = upper
      curve%returns = upper
   end function new_closed_curve

   elemental complex(wp) function point(self, part)
      class(closed_curve_type), intent(in) :: self
      real(wp), intent(in) :: part
      ! Fraction of the parameter that belongs to the arc, if the path returns along the axis.
      real(wp), parameter :: arc = 0.6_wp
      real(wp) :: angle, along

      along = part
      if (self%returns) along = part/arc
      if (along > 1) then
         along = 2*(part - arc)/(1 - arc) - 1
         point = cmplx(real(self%center, wp) + along*self%radius*cos(self%start), 0, wp)
         return
      end if
      if (self%closed .and. .not. self%returns) then
         angle = 2*pi*along
      else
         angle = self%start + (pi - 2*self%start)*along
      end if
      point = self%center + self%radius*cmplx(cos(angle), sin(angle), wp)
      if (.not. self%closed .and. (along <= 0 .or. along >= 1)) point = real(point, wp)
   end function point

   elemental complex(wp) function variable(self, lambda)
      class(closed_curve_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      if (self%closed .and. .not. self%returns) then
         variable = (lambda - self%center)/self%radius
      else
         variable = (lambda - real(self%center, wp))/(aimag(self%center) + self%radius)
      end if
   end function variable
end module kschur_closed_curve
