!> A cantilever under ever heavier bodies: the backward error stays where it is, and the frequency tends to that of a
!> massless beam (section 6.1 of the paper).
program cantilever
   use example_support, only: solve_scene
   use kschur, only: modal_options_type, modal_result_type, wp
   implicit none
   character(len=*), parameter :: masses(7) = [character(len=4) :: "4e3", "4e4", "4e5", "1e6", "1e7", "1e8", "1e9"]
   real(wp), parameter :: pi = acos(-1.0_wp), stiffness = 100.0e6_wp*0.3_wp*0.05_wp**3/12, length = 6, arm = 0.5_wp
   type(modal_result_type) :: result
   character(len=4) :: word
   real(wp) :: mass
   integer :: k

   print "(a)", "# tip mass (kg)  first frequency (Hz)  of a massless beam  worst backward error of 12"
   do k = 1, size(masses)
      word = masses(k)
      read (word, *) mass
      call solve_scene("cantilever --tip-mass "//masses(k), modal_options_type(modes=12), result)
      print "(es12.1, 2es22.12, es12.1)", mass, result%frequency_hz(1), massless(mass)/(2*pi), maxval(result%backward_error)
   end do

contains

   ! det(K - omega^2 M) = 0 for K = EI/L^3 [12, -6L; -6L, 4L^2], M = [m, md; md, J + md^2], d the arm to the centre.
   pure real(wp) function massless(m) result(omega)
      real(wp), intent(in) :: m
      real(wp) :: k, inertia, a, b, c

      k = stiffness/length**3
      inertia = m*(1 + 4)/12
      a = m*inertia
      b = 12*k*(inertia + m*arm**2) + 4*k*length**2*m + 12*k*length*m*arm
      c = 12*(k*length)**2
      omega = sqrt(2*c/(b + sqrt(b**2 - 4*a*c)))
   end function massless
end program cantilever
