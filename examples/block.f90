!> A clamped cube of steel: its frequencies as the mesh is refined, of ten-node tetrahedra and of bricks, and how spinning
!> splits the two that are equal. The shapes of a mesh of bricks go to a file for ParaView.
!>
!>     example_block [FINEST MESH] [FILE.vtu]
program block_of_steel
   use example_support, only: argument, argument_count, draw_modes, solve_scene
   use kschur, only: modal_options_type, modal_result_type, text
   implicit none
   type(modal_result_type) :: result
   character(len=1024) :: path
   integer :: finest, k

   finest = argument_count(1, 3)
   path = argument(2, "")
   print "(a)", "# nodes of an element  cells  speed (rpm)  unknowns  four frequencies (Hz)"
   do k = 1, finest
      call show(10, k, 0)
      ! Twice as many bricks along an edge have as many nodes.
      call show(8, 2*k, 0)
   end do
   do k = 2000, 10000, 2000
      call show(8, 2*finest, k)
   end do
   if (path == "") stop
   call solve_scene("block --cells 8 --damping none", modal_options_type(modes=6), result)
   call draw_modes(result, trim(path))

contains

   subroutine show(nodes, cells, speed)
      integer, intent(in) :: nodes, cells, speed

      call solve_scene("block --damping none --element "//merge("tet10", "hex8 ", nodes == 10)//" --cells "//text(cells)// &
         " --speed "//text(speed), modal_options_type(modes=4), result)
      print "(i4, i6, i8, i9, 4f14.6)", nodes, cells, speed, result%unknowns, result%frequency_hz
   end subroutine show
end program block_of_steel
