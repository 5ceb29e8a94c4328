!> Map between the eigenvalue theta of a formulation and lambda of the modal problem.
module kschur_spectral_map
   use kschur_kinds, only: wp
   use kschur_lossy_curve, only: distance_to_lossy
   use kschur_tolerances, only: real_tolerance
   implicit none
   private
   public :: spectral_map_type

   !> Either theta = lambda, or theta = sign omega^2 with the two roots of lambda^2 + (alpha + beta omega^2) lambda + omega^2 (1
   !> + i g) = 0.
   type :: spectral_map_type
      !> Whether theta belongs to an oscillator with two roots.
      logical :: oscillator = .false.
      !> 1 or -1: theta = sign omega^2.
      real(wp) :: sign = 1
      !> Proportional damping R = alpha M + beta K (1/s, s); zero for none.
      real(wp) :: alpha = 0, beta = 0
      !> The loss factor g of H = g K; zero for none.
      real(wp) :: loss = 0
      !> Whether only roots above or on the real axis count, as with a loss matrix H.
      logical :: upper = .false.
   contains
      !> theta of a lambda.
      procedure :: theta
      !> The two lambdas of a theta; equal if there is one, or only one counts.
      procedure :: lambdas
      !> Smallest distance of the lambdas of an interval of theta from a target.
      procedure :: distance_to
      !> Factor from multipliers of the undamped problem to those at lambda.
      procedure :: reaction
   end type spectral_map_type

contains

   pure complex(wp) function theta(self, lambda)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      theta = lambda
      if (self%oscillator) theta = -self%sign*lambda*(lambda + self%alpha)/self%reaction(lambda)
   end function theta

   !> 1 + beta lambda + i g, because P(lambda) phi = (1 + beta lambda + i g) (K - omega^2 M) phi.
   pure complex(wp) function reaction(self, lambda)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      reaction = 1 + self%beta*lambda
      if (abs(self%loss) > 0) reaction = reaction + cmplx(0, self%loss, wp)
   end function reaction

   !> Computed without cancellation: the larger root first, the other from their product. Real theta gives an exact conjugate
   !> pair or two real roots.
   pure function lambdas(self, theta) result(roots)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: theta
      complex(wp) :: roots(2)
      complex(wp) :: product, half_sum, root

      roots = theta
      if (.not. self%oscillator) return
      product = self%sign*theta
      half_sum = -(self%alpha + self%beta*product)/2
      if (abs(self%loss) > 0) product = product*cmplx(1, self%loss, wp)
      root = sqrt(half_sum**2 - product)
      if (real(root*conjg(half_sum), wp) < 0) root = -root
      if (.not. (abs(aimag(theta)) > 0 .or. self%upper) .and. abs(aimag(root)) > 0) then
         roots = [half_sum + root, conjg(half_sum + root)]
      else
         roots(1) = half_sum + root
         roots(2) = -roots(1)
         if (abs(half_sum) > 0 .and. abs(roots(1)) > 0) roots(2) = product/roots(1)
      end if
      if (self%upper .and. any(abs(aimag(roots)) > real_tolerance*abs(roots))) &
         roots = merge(roots(1), roots(2), aimag(roots(1)) >= aimag(roots(2)))
   end function lambdas

   !> Smallest distance of `target` from the lambdas of all real theta in [first,
   !> last], `huge` being infinite; of oscillators with theta = omega^2. With losses
   !> that of kschur_lossy_curve; without:
   !>
   !> The lambdas are real or lie on a circle about -1/beta, for beta = 0 on a
   !> line. The nearest ones on either are the projection of the target, if it is
   !> in the interval, or an end: of the interval, or where circle and axis meet.
   real(wp) function distance_to(self, first, last, target)
      class(spectral_map_type), intent(in) :: self
      real(wp), intent(in) :: first, last
      complex(wp), intent(in) :: target
      complex(wp) :: direction, projection
      real(wp) :: discriminant, root, meeting

      if (abs(self%loss) > 0) then
         distance_to = distance_to_lossy(self%alpha, self%beta, self%loss, first, last, target)
         return
      end if
      distance_to = huge(1.0_wp)
      if (first > -huge(1.0_wp)) call consider(distance_to, self%lambdas(cmplx(first, 0, wp)))
      if (last < huge(1.0_wp)) call consider(distance_to, self%lambdas(cmplx(last, 0, wp)))
      if (max(-first, last) >= huge(1.0_wp) .and. abs(self%beta) > 0) &
         call consider(distance_to, spread(cmplx(-1/self%beta, 0, wp), 1, 2))
      associate (x => real(target, wp))
         if (abs(1 + self%beta*x) > 0) &
            call consider_if_inside(distance_to, cmplx(x, 0, wp), -x*(x + self%alpha)/(1 + self%beta*x))
      end associate
      discriminant = 1 - self%alpha*self%beta
      if (discriminant < 0) return
      root = sqrt(discriminant)
      meeting = -self%alpha/(1 + root)
      call consider_if_inside(distance_to, cmplx(meeting, 0, wp), meeting**2)
      if (abs(self%beta) > 0) then
         meeting = -(1 + root)/self%beta
         call consider_if_inside(distance_to, cmplx(meeting, 0, wp), meeting**2)
      end if
      direction = 1 + self%beta*target
      if (.not. abs(direction) > 0) return
      projection = target - direction/abs(direction)* &
         (self%alpha + self%beta*abs(target)**2 + 2*real(target, wp))/(root + abs(direction))
      call consider_if_inside(distance_to, projection, abs(projection)**2)

   contains

      ! Updates the distance by that of candidate points.
      pure subroutine consider(distance, candidates)
         real(wp), intent(inout) :: distance
         complex(wp), intent(in) :: candidates(2)

         distance = min(distance, minval(abs(candidates - target)))
      end subroutine consider

      ! The same for a point and its conjugate, if their theta is in the interval.
      pure subroutine consider_if_inside(distance, lambda, theta)
         real(wp), intent(inout) :: distance
         complex(wp), intent(in) :: lambda
         real(wp), intent(in) :: theta

         if (theta >= first .and. theta <= last) call consider(distance, [lambda, conjg(lambda)])
      end subroutine consider_if_inside
   end function distance_to

end module kschur_spectral_map
