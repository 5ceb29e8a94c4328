!> A chain of springs against its closed form, omega = 2 sin(j pi/2n), in one piece and as two halves joined by a
!> constraint.
program spring_chain
   use example_support, only: solve_scene
   use kschur, only: modal_options_type, modal_result_type, wp
   implicit none
   integer, parameter :: masses = 61
   real(wp), parameter :: pi = acos(-1.0_wp)
   type(modal_result_type) :: whole, halves
   integer :: j

   call solve_scene("spring-chain --masses 61 --damping none", modal_options_type(modes=8), whole)
   call solve_scene("spring-chain --masses 61 --damping none --shape halves", modal_options_type(modes=8), halves)
   print "(a)", "# mode  omega (rad/s) of the chain  of two halves  known"
   do j = 1, 8
      print "(i6, 3f20.14)", j, aimag(whole%eigenvalues(j)), aimag(halves%eigenvalues(j)), 2*sin((j - 1)*pi/(2*masses))
   end do
end program spring_chain
