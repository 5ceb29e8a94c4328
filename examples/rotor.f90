!> Whirl of a rotor over its speed: the modes split by gyroscopic forces, and one becomes unstable.
program rotor
   use example_support, only: solve_scene
   use kschur, only: kind_unstable, modal_options_type, modal_result_type
   implicit none
   type(modal_result_type) :: result
   character(len=4) :: speed
   integer :: k

   print "(a)", "# speed (rpm)  damped frequencies of 5 modes (Hz)  their damping ratios  unstable modes"
   do k = 0, 6000, 500
      write (speed, "(i4)") k
      call solve_scene("rotor --speed "//speed, modal_options_type(modes=5), result)
      print "(i6, 5f12.6, 5f12.7, i4)", k, result%damped_frequency_hz, result%damping_ratio, count(result%kind == kind_unstable)
   end do
end program rotor
