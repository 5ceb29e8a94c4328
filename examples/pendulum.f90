!> Pendulums swing by K_c, the stiffness of their hinges' reactions, alone.
program pendulum
   use example_support, only: solve_scene
   use kschur, only: modal_options_type, modal_result_type, wp
   implicit none
   real(wp), parameter :: g = 9.81_wp, length = 4
   type(modal_result_type) :: result

   print "(a)", "# pendulums of 4 m: omega in rad/s, computed and known"
   call solve_scene("pendulum", modal_options_type(modes=1), result)
   print "(a20, *(f12.8))", "with K_c", aimag(result%eigenvalues), sqrt(g/length)
   call solve_scene("pendulum --reactions off", modal_options_type(modes=1), result)
   print "(a20, *(f12.8))", "without K_c", aimag(result%eigenvalues), 0.0_wp
   call solve_scene("pendulum --bars 2", modal_options_type(modes=2), result)
   print "(a20, *(f12.8))", "double pendulum", aimag(result%eigenvalues), sqrt(g/length*(2 + [-1, 1]*sqrt(2.0_wp)))
end program pendulum
