!> Frequencies of a crank as its mesh is refined; the shapes of the last mesh go to a file for ParaView.
!>
!>     example_crank [FINEST MESH] [FILE.vtu] [OPTION VALUE of the scene ...]
program crank
   use example_support, only: argument, argument_count, arguments_from, solve_scene, stop_on
   use kschur, only: error_type, kind_rigid, modal_options_type, modal_result_type, text
   use scene_geometry, only: geometry_type
   use scene_vtu, only: write_vtu
   implicit none
   type(modal_result_type) :: result
   type(geometry_type) :: geometry
   type(error_type), allocatable :: error
   character(len=1024) :: path
   integer :: finest, k

   finest = argument_count(1, 3)
   path = argument(2, "")
   print "(a)", "# cells across  unknowns  rigid modes  the next four frequencies (Hz)"
   do k = 1, finest
      call solve_scene("crank --damping none --density "//text(k)//" "//arguments_from(3), modal_options_type(modes=8), &
         result, geometry)
      print "(i8, i14, i8, 4x, 4f14.6)", k, result%unknowns, count(result%kind == kind_rigid), result%frequency_hz(2:5)
   end do
   if (path == "") stop
   call write_vtu(geometry, result, trim(path), error)
   call stop_on(error)
end program crank
