!> Bodies that nothing holds: six exact zeros each, then the modes of one as often as there are bodies (section 6.3 of
!> the paper).
program free_free
   use example_support, only: solve_scene
   use kschur, only: kind_rigid, modal_options_type, modal_result_type, text
   implicit none
   type(modal_result_type) :: result
   integer :: bodies

   print "(a)", "# bodies  rigid modes  next frequencies (Hz)  worst backward error"
   do bodies = 1, 5
      call solve_scene("free-free --damping none --bodies "//text(bodies), modal_options_type(modes=7*bodies), result)
      print "(i6, i10, 6x, 2f16.10, es12.1)", bodies, count(result%kind == kind_rigid), &
         minval(result%frequency_hz, result%kind /= kind_rigid), maxval(result%frequency_hz), maxval(result%backward_error)
   end do
end program free_free
