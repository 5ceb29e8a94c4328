!> Flutter of a brake: two frequencies meet as friction grows, and one mode turns unstable.
program brake
   use example_support, only: solve_scene
   use kschur, only: kind_unstable, modal_options_type, modal_result_type, wp
   implicit none
   type(modal_result_type) :: result
   character(len=5) :: friction
   integer :: k

   print "(a)", "# friction  eigenvalues (1/s): real and imaginary part of two  unstable modes"
   do k = 0, 20
      write (friction, "(f5.3)") 0.02_wp*k
      call solve_scene("brake --friction "//friction, modal_options_type(modes=2), result)
      print "(a8, 4f14.6, i4)", friction, result%eigenvalues, count(result%kind == kind_unstable)
   end do
end program brake
