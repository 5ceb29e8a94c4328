!> A square plate on hinged edges against Mindlin's closed form as its mesh is refined; two meshes give one that errs by the
!> fourth power of the size of the elements. The shapes of a curved panel go to a file for ParaView.
!>
!>     example_shell [FILE.vtu]
program shell
   use example_support, only: argument, draw_modes, solve_scene
   use kschur, only: modal_options_type, modal_result_type, text, wp
   implicit none
   type(modal_result_type) :: result
   character(len=1024) :: path
   real(wp) :: frequency, coarser
   integer :: cells

   path = argument(1, "")
   print "(a, f12.6, a)", "# by Mindlin", mindlin(), " Hz"
   print "(a)", "# cells along an edge  unknowns  lowest frequency (Hz)  of this mesh and the one before (Hz)"
   frequency = 0
   cells = 5
   do while (cells <= 40)
      coarser = frequency
      call solve_scene("shell --damping none --cells "//text(cells)//"x"//text(cells), modal_options_type(modes=1), result)
      frequency = result%frequency_hz(1)
      print "(i6, i10, 2f16.6)", cells, result%unknowns, frequency, frequency + merge(frequency - coarser, 0.0_wp, cells > 5)/3
      cells = 2*cells
   end do
   if (path == "") stop
   call solve_scene("shell --angle 90 --damping none --cells 24x24", modal_options_type(modes=6), result)
   call draw_modes(result, trim(path))

contains

   ! The lowest frequency of the plate of the scene, Hz: 1 m square, 1 cm of steel.
   pure real(wp) function mindlin()
      real(wp), parameter :: pi = acos(-1.0_wp), t = 0.01_wp, young = 2.1e11_wp, poisson = 0.3_wp, density = 7850, &
         bending = young*t**3/(12*(1 - poisson**2)), shear = 5*young*t/(12*(1 + poisson)), k_squared = 2*pi**2, &
         a = (density*t)**2*t**2/12, b = density*t*(shear*k_squared*t**2/12 + bending*k_squared + shear), &
         c = shear*bending*k_squared**2

      mindlin = sqrt(2*c/(b + sqrt(b**2 - 4*a*c)))/(2*pi)
   end function mindlin
end program shell
