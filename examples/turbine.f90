!> A wind turbine: its frequencies at standstill beside those of its report, then frequencies and damping over the speed
!> of the rotor (section 6.4 of the paper), and what becomes of them when the damping by the air is reversed.
!>
!>     example_turbine [NUMBER OF SPEEDS] [FILE.vtu]
program turbine
   use example_support, only: argument, argument_count, draw_modes, solve_scene
   use kschur, only: kind_unstable, modal_options_type, modal_result_type, wp
   implicit none
   ! NREL/TP-500-38060, table 9-1, Hz.
   real(wp), parameter :: fast(8) = [0.3120_wp, 0.3240_wp, 0.6205_wp, 0.6664_wp, 0.6675_wp, 0.6993_wp, 1.0793_wp, 1.0898_wp]
   real(wp), parameter :: adams(8) = [0.3164_wp, 0.3195_wp, 0.6094_wp, 0.6296_wp, 0.6686_wp, 0.7019_wp, 1.0740_wp, 1.0877_wp]
   real(wp), parameter :: rated = 12.1_wp
   integer, parameter :: modes = 11
   type(modal_result_type) :: result
   character(len=1024) :: path
   character(len=7) :: speed
   integer :: speeds, k

   speeds = argument_count(1, 3)
   path = argument(2, "")
   call solve_scene("turbine", modal_options_type(modes=modes), result)
   print "(a)", "# standstill, Hz: computed, FAST, ADAMS"
   do k = 1, size(fast)
      print "(a, 3f10.4)", "#", result%frequency_hz(k), fast(k), adams(k)
   end do
   if (path /= "") call draw_modes(result, trim(path))
   print "(a)", "# speed (rpm)  11 damped frequencies (Hz)  their damping ratios  unstable modes"
   do k = 0, speeds - 1
      write (speed, "(f7.4)") k*rated/max(1, speeds - 1)
      call solve_scene("turbine --speed "//speed, modal_options_type(modes=modes), result)
      print "(a8, 11f9.5, 11f10.6, i4)", speed, result%damped_frequency_hz, result%damping_ratio, &
         count(result%kind == kind_unstable)
   end do
   call solve_scene("turbine --speed 12.1 --aerodynamic -1", modal_options_type(modes=modes), result)
   print "(a, i0, a)", "# damping by the air reversed: ", count(result%kind == kind_unstable), " unstable modes"
end program turbine
