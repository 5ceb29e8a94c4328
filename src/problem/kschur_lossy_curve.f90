!> How near the modes of a symmetric problem with H = g K and R = alpha M + beta K come to a target: they lie on the curve of the
!> roots above the real axis of lambda^2 + (alpha + beta theta) lambda + theta (1 + i g) = 0, theta real.
!>
!> With S the difference of the two roots, S^2 = (alpha + beta theta)^2 - 4 theta c, c = 1 + i g, and
!>
!>     lambda' = -(beta lambda + c)/S,  lambda'' = 2 c (alpha beta - c)/S^3.
!>
!> So each piece of the curve is near its tangent, by a bound, and pieces are halved until no bound is below the nearest point.
module kschur_lossy_curve
   use kschur_kinds, only: wp
   use kschur_tolerances, only: twelve_digits
   implicit none
   private
   public :: distance_to_lossy

   real(wp), parameter :: infinity = huge(1.0_wp)
   !> Where a distance has not been found with so many pieces it is said to be nought; a hundred are usual.
   integer, parameter :: most_pieces = 20000

   !> Theta of one sign, and the target mirrored into the upper half-plane.
   type :: branch_type
      real(wp) :: alpha, beta
      complex(wp) :: factor
      complex(wp) :: target
      real(wp) :: side
      !> The nearest point so far.
      real(wp) :: nearest = infinity
      integer :: pieces = 0
   contains
      procedure :: discriminant
      procedure :: upper
      procedure :: visit
      procedure :: of_piece
      procedure :: of_rest
      procedure :: by_tangent
      procedure :: by_residual
      procedure :: beyond
   end type branch_type

contains

   !> No more than the distance of `target` from the curve for theta in [first, last], and less only by rounding or by
   !> `twelve_digits` of it; `huge` is infinite.
   real(wp) function distance_to_lossy(alpha, beta, loss, first, last, target) result(distance)
      real(wp), intent(in) :: alpha, beta, loss, first, last
      complex(wp), intent(in) :: target
      type(branch_type) :: branch

      distance = infinity
      associate (mirrored => cmplx(real(target, wp), abs(aimag(target)), wp), factor => cmplx(1, loss, wp))
         if (last > 0) then
            branch = branch_type(alpha, beta, factor, mirrored, 1.0_wp)
            distance = of_branch(branch, max(first, 0.0_wp), last)
         end if
         if (first < 0) then
            branch = branch_type(alpha, beta, factor, mirrored, -1.0_wp)
            distance = min(distance, of_branch(branch, max(-last, 0.0_wp), -first))
         end if
      end associate
   end function distance_to_lossy

   ! Of |theta| from `least` to `most`.
   real(wp) function of_branch(branch, least, most) result(distance)
      type(branch_type), intent(inout) :: branch
      real(wp), intent(in) :: least, most
      real(wp) :: start

      call branch%visit(least)
      if (most < infinity) then
         call branch%visit(most)
         distance = branch%of_piece(least, most)
      else
         start = max(2*least, abs(branch%target)**2, branch%alpha**2, tiny(1.0_wp))
         ! Where it goes to, if not to infinity.
         if (branch%beta*aimag(branch%factor) < 0) &
            branch%nearest = min(branch%nearest, abs(branch%target + branch%factor/branch%beta))
         call branch%visit(start)
         distance = branch%of_piece(least, start)
         distance = min(distance, branch%of_rest(start))
      end if
      distance = min(distance, branch%nearest)
   end function of_branch

   ! S^2 and its derivative.
   pure function discriminant(self, size) result(values)
      class(branch_type), intent(in) :: self
      real(wp), intent(in) :: size
      complex(wp) :: values(2)

      associate (theta => self%side*size, sum => self%alpha + self%beta*self%side*size)
         values(1) = sum**2 - 4*theta*self%factor
         values(2) = 2*self%beta*sum - 4*self%factor
      end associate
   end function discriminant

   ! The root above the axis, and S. The larger root first, the other one from their product.
   pure function upper(self, size) result(values)
      class(branch_type), intent(in) :: self
      real(wp), intent(in) :: size
      complex(wp) :: values(2)
      complex(wp) :: difference(2)
      real(wp) :: minus_sum

      difference = self%discriminant(size)
      difference(1) = sqrt(difference(1))
      ! Of what is real at theta = 0 the sign is that next to it.
      if (self%side*aimag(self%factor) > 0) difference(1) = -difference(1)
      minus_sum = -(self%alpha + self%beta*self%side*size)
      values(2) = difference(1)
      if (minus_sum*real(difference(1), wp) >= 0) then
         values(1) = (minus_sum + difference(1))/2
      else
         values(1) = self%side*size*self%factor/((minus_sum - difference(1))/2)
      end if
   end function upper

   pure subroutine visit(self, size)
      class(branch_type), intent(inout) :: self
      real(wp), intent(in) :: size
      complex(wp) :: values(2)

      values = self%upper(size)
      self%nearest = min(self%nearest, abs(values(1) - self%target))
   end subroutine visit

   recursive real(wp) function of_piece(self, least, most) result(distance)
      class(branch_type), intent(inout) :: self
      real(wp), intent(in) :: least, most
      real(wp) :: middle

      middle = least + (most - least)/2
      call self%visit(middle)
      self%pieces = self%pieces + 1
      distance = max(self%by_tangent(middle, middle - least), self%by_residual(middle, middle - least), 0.0_wp)
      if (distance >= (1 - twelve_digits)*self%nearest .or. self%pieces > most_pieces) return
      distance = self%of_piece(least, middle)
      distance = min(distance, self%of_piece(middle, most))
   end function of_piece

   recursive real(wp) function of_rest(self, least) result(distance)
      class(branch_type), intent(inout) :: self
      real(wp), intent(in) :: least

      self%pieces = self%pieces + 1
      distance = max(self%beyond(least), 0.0_wp)
      if (distance >= (1 - twelve_digits)*self%nearest .or. self%pieces > most_pieces) return
      call self%visit(2*least)
      distance = self%of_piece(least, 2*least)
      distance = min(distance, self%of_rest(2*least))
   end function of_rest

   ! The distance from the tangent in the middle of a piece, less what the curve may leave it by; negative where nothing is known.
   pure real(wp) function by_tangent(self, middle, half) result(distance)
      class(branch_type), intent(in) :: self
      real(wp), intent(in) :: middle, half
      complex(wp) :: values(2), discriminants(2), tangent, gap
      real(wp) :: least, along

      distance = -1
      discriminants = self%discriminant(middle)
      least = abs(discriminants(1)) - half*abs(discriminants(2)) - (half*self%beta)**2
      if (.not. least > 0) return
      values = self%upper(middle)
      tangent = -self%side*half*(self%beta*values(1) + self%factor)/values(2)
      gap = self%target - values(1)
      along = 0
      if (abs(tangent) > 0) along = min(max(real(gap*conjg(tangent), wp)/abs(tangent)**2, -1.0_wp), 1.0_wp)
      distance = abs(gap - along*tangent) - &
         (half/least)*(half/sqrt(least))*abs(self%factor*(self%alpha*self%beta - self%factor))
   end function by_tangent

   ! What is a root anywhere in a piece has a residual in its middle: (d_1 - r) (d_2 - r) <= half |beta lambda + c| for one that is
   ! within r of the target, where the roots of the middle are d_1 and d_2 from it.
   pure real(wp) function by_residual(self, middle, half) result(distance)
      class(branch_type), intent(in) :: self
      real(wp), intent(in) :: middle, half
      complex(wp) :: values(2)
      real(wp) :: d(2), sum, rest

      values = self%upper(middle)
      d = abs(self%target - [values(1), values(1) - values(2)])
      rest = d(1)*d(2) - half*abs(self%beta*self%target + self%factor)
      sum = d(1) + d(2) + half*abs(self%beta)
      distance = -1
      ! The smaller root of r^2 - sum r + rest.
      if (rest > 0) distance = 2*rest/(sum + sqrt(max(sum**2 - 4*rest, 0.0_wp)))
   end function by_residual

   ! Beyond |theta| = `least` no root is nearer: |theta| |beta lambda + c| > |lambda (lambda + alpha)| there. Where the upper root
   ! is the larger of the two it is at least half their sum.
   pure real(wp) function beyond(self, least) result(distance)
      class(branch_type), intent(in) :: self
      real(wp), intent(in) :: least
      real(wp) :: t(2), sum, rest

      t = abs(self%target + [0.0_wp, self%alpha])
      rest = least*abs(self%beta*self%target + self%factor) - t(1)*t(2)
      sum = t(1) + t(2) + least*abs(self%beta)
      distance = -1
      if (rest > 0) distance = 2*rest/(sum + sqrt(sum**2 + 4*rest))
      if (aimag(self%factor)*self%beta > 0) distance = max(distance, (least*abs(self%beta) - abs(self%alpha))/2 - t(1))
   end function beyond
end module kschur_lossy_curve
