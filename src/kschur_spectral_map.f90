!> How the eigenvalue theta of a formulation and the lambda of the modal
!> problem belong together.
module kschur_spectral_map
   use kschur_kinds, only: wp
   implicit none
   private
   public :: spectral_map_type

   !> Either theta = lambda, or theta = sign omega^2 with the two roots of
   !> lambda^2 + (alpha + beta omega^2) lambda + omega^2 = 0.
   type :: spectral_map_type
      !> Whether theta stands for an oscillator, so that it has two roots.
      logical :: oscillator = .false.
      !> 1 or -1: theta = sign omega^2.
      real(wp) :: sign = 1
      !> Proportional damping R = alpha M + beta K (1/s, s); zero for none.
      real(wp) :: alpha = 0, beta = 0
   contains
      !> theta of a lambda.
      procedure :: theta
      !> The two lambdas of a theta; twice the same where there is one.
      procedure :: lambdas
      !> Factor that takes the multipliers of the undamped problem to those at lambda.
      procedure :: reaction
   end type spectral_map_type

contains

   pure complex(wp) function theta(self, lambda)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      theta = lambda
      if (self%oscillator) theta = -self%sign*lambda*(lambda + self%alpha)/(1 + self%beta*lambda)
   end function theta

   !> 1 + beta lambda, because P(lambda) phi = (1 + beta lambda) (K - omega^2 M) phi.
   pure complex(wp) function reaction(self, lambda)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      reaction = 1 + self%beta*lambda
   end function reaction

   !> Without cancellation: the larger root first, the other one from their
   !> product. Real theta gives an exact conjugate pair or two real roots.
   pure function lambdas(self, theta) result(roots)
      class(spectral_map_type), intent(in) :: self
      complex(wp), intent(in) :: theta
      complex(wp) :: roots(2)
      complex(wp) :: product, half_sum, root

      roots = theta
      if (.not. self%oscillator) return
      product = self%sign*theta
      half_sum = -(self%alpha + self%beta*product)/2
      root = sqrt(half_sum**2 - product)
      if (real(root*conjg(half_sum), wp) < 0) root = -root
      if (.not. abs(aimag(theta)) > 0 .and. abs(aimag(root)) > 0) then
         roots = [half_sum + root, conjg(half_sum + root)]
      else
         roots(1) = half_sum + root
         roots(2) = -roots(1)
         if (abs(half_sum) > 0 .and. abs(roots(1)) > 0) roots(2) = product/roots(1)
      end if
   end function lambdas
end module kschur_spectral_map
