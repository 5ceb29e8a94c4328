!> The lowest modes of a grid of beams (section 6.5 of the paper); their shapes go to a file for ParaView.
!>
!>     example_grid [CELLS] [FILE.vtu]
program grid
   use example_support, only: argument, solve_scene, stop_on
   use kschur, only: certified_names, error_type, modal_options_type, modal_result_type
   use scene_geometry, only: geometry_type
   use scene_vtu, only: write_vtu
   implicit none
   type(modal_result_type) :: result
   type(geometry_type) :: geometry
   type(error_type), allocatable :: error
   character(len=1024) :: path
   integer :: k

   call solve_scene("grid --cells "//trim(argument(1, "6x4")), modal_options_type(modes=20), result, geometry)
   path = argument(2, "")
   print "(a, i0, a, i0, 2a)", "# ", result%unknowns, " unknowns, ", result%constraints, " constraints; certified: ", &
      trim(certified_names(result%certified))
   print "(a)", "# mode  frequency (Hz)  damping ratio  backward error"
   do k = 1, size(result%eigenvalues)
      print "(i6, 2f16.10, es12.1)", k, result%frequency_hz(k), result%damping_ratio(k), result%backward_error(k)
   end do
   if (path == "") stop
   call write_vtu(geometry, result, trim(path), error)
   call stop_on(error)
end program grid
