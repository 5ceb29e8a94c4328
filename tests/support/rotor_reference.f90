!> The modes of the scene `rotor` with a massless shaft in rigid bearings, in closed form, quadruple precision.
module rotor_reference
   use, intrinsic :: iso_fortran_env, only: real128
   use kschur, only: wp
   implicit none
   private
   public :: critical_speed, rotor_eigenvalues

   real(real128), parameter :: pi = acos(-1.0_real128), length = 1, diameter = 0.04_real128, youngs_modulus = 2.1e11_real128, &
      shear_modulus = 8.1e10_real128, mass = 40, radius = 0.25_real128
   real(real128), parameter :: moment = pi*diameter**4/64, across = 48*youngs_modulus*moment/length**3, &
      tilt = 12*youngs_modulus*moment/length, polar = mass*radius**2/2, diametral = polar/2

contains

   !> The speed (rad/s) where the rotor loses its stability.
   pure real(wp) function critical_speed(rotating, resting)
      !> Damping of the shaft by its stiffness (s), of the disc (N s/m).
      real(wp), intent(in) :: rotating, resting

      critical_speed = real(sqrt(across/mass)*(1 + resting/(rotating*across)), wp)
   end function critical_speed

   !> The six modes of the disc (1/s), Im >= 0: two of translation across the shaft, two of tilt, one along the shaft,
   !> one about it.
   pure function rotor_eigenvalues(speed, rotating, resting) result(lambda)
      !> rad/s, s, N s/m.
      real(wp), intent(in) :: speed, rotating, resting
      complex(wp) :: lambda(6)
      complex(real128) :: turning

      ! 1 - i beta Omega: what the shaft's damping adds by the position.
      turning = cmplx(1, -real(rotating, real128)*speed, real128)
      lambda(1:2) = roots(mass, cmplx(resting + rotating*across, 0, real128), turning*across)
      lambda(3:4) = roots(diametral, cmplx(rotating*tilt, -polar*speed, real128), turning*tilt)
      associate (along => 2*youngs_modulus*pi*diameter**2/4/length, about => 2*shear_modulus*2*moment/length)
         lambda(5:6) = [first(mass, along), first(polar, about)]
      end associate

   contains

      pure complex(wp) function first(m, k)
         real(real128), intent(in) :: m, k
         complex(wp) :: pair(2)

         pair = roots(m, cmplx(rotating*k, 0, real128), cmplx(k, 0, real128))
         first = pair(1)
      end function first
   end function rotor_eigenvalues

   ! Of m lambda^2 + c lambda + k = 0 and of its conjugate those with Im >= 0.
   pure function roots(m, c, k) result(lambda)
      real(real128), intent(in) :: m
      complex(real128), intent(in) :: c, k
      complex(wp) :: lambda(2)
      complex(real128) :: half, root

      half = -c/(2*m)
      root = sqrt(half**2 - k/m)
      lambda = cmplx([half + root, half - root], kind=wp)
      where (aimag(lambda) < 0) lambda = conjg(lambda)
   end function roots
end module rotor_reference
