!> Frequencies of a crank as its mesh is refined; the shapes of the last mesh go to a file for ParaView.
!>
!>     example_crank [FINEST MESH] [FILE.vtu]
program crank
   use example_support, only: argument, argument_count, draw_modes, solve_scene
   use kschur, only: kind_rigid, modal_options_type, modal_result_type, text
   implicit none
   type(modal_result_type) :: result
   character(len=1024) :: path
   integer :: finest, k

   finest = argument_count(1, 3)
   path = argument(2, "")
   print "(a)", "# cells across  unknowns  rigid modes  the next four frequencies (Hz)"
   do k = 1, finest
      call solve_scene("crank --damping none --density "//text(k), modal_options_type(modes=5), result)
      print "(i8, i14, i8, 4x, 4f14.6)", k, result%unknowns, count(result%kind == kind_rigid), result%frequency_hz(2:)
   end do
   if (path == "") stop
   call draw_modes(result, trim(path))
end program crank
