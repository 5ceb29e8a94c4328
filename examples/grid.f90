!> The lowest modes of a grid of beams (section 6.5 of the paper); their shapes go to a file for ParaView.
!>
!>     example_grid [CELLS] [FILE.vtu]
program grid
   use example_support, only: argument, draw_modes, solve_scene
   use kschur, only: certified_names, modal_options_type, modal_result_type
   implicit none
   type(modal_result_type) :: result
   character(len=1024) :: path
   integer :: k

   call solve_scene("grid --cells "//trim(argument(1, "6x4")), modal_options_type(modes=20), result)
   path = argument(2, "")
   print "(a, i0, a, i0, 2a)", "# ", result%unknowns, " unknowns, ", result%constraints, " constraints; certified: ", &
      trim(certified_names(result%certified))
   print "(a)", "# mode  frequency (Hz)  damping ratio  backward error"
   do k = 1, size(result%eigenvalues)
      print "(i6, 2f16.10, es12.1)", k, result%frequency_hz(k), result%damping_ratio(k), result%backward_error(k)
   end do
   if (path == "") stop
   call draw_modes(result, trim(path))
end program grid
