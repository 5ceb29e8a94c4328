!> The problem on which the paper's reference implementation tests its solver.
program beam_body
   use example_support, only: solve_scene
   use kschur, only: modal_options_type, modal_result_type, wp
   implicit none
   ! MATLAB's, of BeamFixBody in Project Chrono.
   real(wp), parameter :: chrono(6) = [0.03186203916787638_wp, 1.147033410628716_wp, 3.208029301486185_wp, &
      4.20968757982959_wp, 27.08121339975415_wp, 96.16794832572644_wp]
   type(modal_result_type) :: result
   integer :: k

   call solve_scene("beam-body", modal_options_type(modes=size(chrono)), result)
   print "(a)", "# mode  omega^2 (1/s^2)  of Chrono's reference"
   do k = 1, size(chrono)
      print "(i6, 2f20.12)", k, aimag(result%eigenvalues(k))**2, chrono(k)
   end do
end program beam_body
