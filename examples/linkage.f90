!> A linkage of hinged rods: in space, where some constraints follow from others, it has the frequencies of its plane.
program linkage
   use example_support, only: solve_scene
   use kschur, only: modal_options_type, modal_result_type, text
   implicit none
   type(modal_result_type) :: space, plane
   integer :: loops

   print "(a)", "# loops  unknowns  constraints  redundant  two frequencies (Hz) in space, in the plane"
   do loops = 1, 5
      associate (line => "linkage --cells-per-loop 4 --loops "//text(loops))
         call solve_scene(line, modal_options_type(modes=2), space)
         call solve_scene(line//" --dimensions 2", modal_options_type(modes=2), plane)
      end associate
      print "(i5, i11, i12, i11, 2(2x, 2f13.9))", loops, space%unknowns, size(space%multipliers, 1), &
         space%redundant_constraints, space%frequency_hz, plane%frequency_hz
   end do
end program linkage
