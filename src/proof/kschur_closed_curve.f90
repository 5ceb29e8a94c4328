!> Boundary of the region nearer to a target than a radius.
module kschur_closed_curve
   use kschur_kinds, only: wp
   implicit none
   private
   public :: closed_curve_type, new_closed_curve

   real(wp), parameter :: pi = acos(-1.0_wp)

   !> Conjugate pairs have the distance of the nearer member: the region is the union of two discs about the target and its
   !> conjugate. If they reach the real axis, they form one symmetric region, and half of its boundary suffices; otherwise one
   !> disc does.
   type :: closed_curve_type
      !> The target, Im >= 0, and the distance (1/s).
      complex(wp) :: center = (0.0_wp, 0.0_wp)
      real(wp) :: radius = 0
      !> Whether the path is a circle in the upper half plane; else it is half of a curve symmetric about the real axis, from
      !> its right to its left end on that axis.
      logical :: circle = .false.
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
   pure function new_closed_curve(target, radius) result(curve)
      complex(wp), intent(in) :: target
      real(wp), intent(in) :: radius
      type(closed_curve_type) :: curve

      curve%center = cmplx(real(target, wp), abs(aimag(target)), wp)
      curve%radius = radius
      curve%circle = aimag(curve%center) > radius
      if (.not. curve%circle) curve%start = -asin(aimag(curve%center)/radius)
   end function new_closed_curve

   elemental complex(wp) function point(self, part)
      class(closed_curve_type), intent(in) :: self
      real(wp), intent(in) :: part
      real(wp) :: angle

      if (self%circle) then
         angle = 2*pi*part
      else
         angle = self%start + (pi - 2*self%start)*part
      end if
      point = self%center + self%radius*cmplx(cos(angle), sin(angle), wp)
      if (.not. self%circle .and. (part <= 0 .or. part >= 1)) point = real(point, wp)
   end function point

   elemental complex(wp) function variable(self, lambda)
      class(closed_curve_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      if (self%circle) then
         variable = (lambda - self%center)/self%radius
      else
         variable = (lambda - real(self%center, wp))/(aimag(self%center) + self%radius)
      end if
   end function variable
end module kschur_closed_curve
