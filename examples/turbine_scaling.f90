!> What a scaling of the constraints does to the paper's pencil (33) of the badly scaled turbine, over its operating
!> points (its figure 4): the Krylov-Schur iteration alone at the paper's shift, without the refinement of
!> `solve_modes`. Beside it `solve_modes` itself.
!>
!>     example_turbine_scaling [NUMBER OF SPEEDS]
program turbine_scaling
   use example_support, only: argument_count, stop_on
   use kschur, only: complex_linear_solver_type, error_type, formulation_damped_constrained, krylov_options_type, &
      krylov_schur, krylov_statistics_type, largest_magnitude, modal_options_type, modal_problem_type, modal_result_type, &
      mumps_complex_type, named_selection_type, new_pencil, new_shift_invert, pencil_type, shift_invert_type, solve_modes, wp
   use kschur_scenes, only: build_scene
   implicit none
   real(wp), parameter :: rated = 12.1_wp
   integer, parameter :: values = 40
   type(modal_problem_type) :: problem
   type(modal_result_type) :: result
   type(error_type), allocatable :: error
   character(len=8) :: speed
   integer :: speeds, k

   speeds = argument_count(1, 2)
   print "(a)", "# speed (rpm)  constraints as they are: worst residual and violation of 40; scaled; backward error of solve_modes"
   do k = 0, speeds - 1
      write (speed, "(f8.4)") k*rated/max(1, speeds - 1)
      call build_scene("turbine", [character(len=8) :: "--speed", adjustl(speed)], problem, error)
      call stop_on(error)
      call solve_modes(problem, modal_options_type(modes=20), result, error)
      call stop_on(error)
      print "(a, 5es12.2)", speed, worst_errors(1.0_wp), &
         worst_errors(mean(problem%stiffness%value)/mean(problem%constraints%value)), maxval(result%backward_error)
   end do

contains

   ! Of the eigenvalues nearest to the paper's shift: ||P(lambda) phi + Cq^T xi|| relative to the sizes of its parts, and
   ! the violation ||Cq phi|| of the constraints.
   function worst_errors(factor) result(worst)
      !> Factor of all constraints.
      real(wp), intent(in) :: factor
      real(wp) :: worst(2)
      complex(wp), parameter :: shift = (1.0e-3_wp, 0.0_wp), one = (1.0_wp, 0.0_wp)
      real(wp), parameter :: unit = 1
      type(pencil_type) :: pencil
      type(shift_invert_type) :: operator
      class(complex_linear_solver_type), allocatable :: solver
      type(krylov_statistics_type) :: statistics
      complex(wp), allocatable :: mu(:), lambda(:), x(:, :), phi(:, :), xi(:, :), r(:, :), c(:, :)
      real(wp) :: level
      integer :: j

      allocate (mumps_complex_type :: solver)
      call new_pencil(pencil, problem, formulation_damped_constrained, spread(factor, 1, problem%multipliers()), unit, error)
      call stop_on(error)
      call new_shift_invert(operator, pencil, shift, solver, error)
      call stop_on(error)
      operator%with_multipliers = .true.
      call krylov_schur(operator, named_selection_type(values, largest_magnitude), krylov_options_type(subspace=3*values), &
         mu, x, statistics, error)
      call stop_on(error)
      lambda = shift + 1/mu
      call pencil%split(x, lambda, lambda, phi, xi)
      worst = 0
      do j = 1, size(lambda)
         allocate (r(problem%unknowns(), 1), c(problem%multipliers(), 1), source=(0.0_wp, 0.0_wp))
         call problem%mass%add_product(lambda(j)**2, phi(:, j:j), r)
         call problem%damping%add_product(lambda(j), phi(:, j:j), r)
         call problem%stiffness%add_product(one, phi(:, j:j), r)
         call problem%constraints%add_transposed_product(one, xi(:, j:j), r)
         call problem%constraints%add_product(one, phi(:, j:j), c)
         level = abs(lambda(j))**2*problem%mass%infinity_norm() + abs(lambda(j))*problem%damping%infinity_norm() &
            + problem%stiffness%infinity_norm()
         worst = max(worst, [norm2(abs(r))/level, norm2(abs(c))/problem%constraints%infinity_norm()]/norm2(abs(phi(:, j))))
         deallocate (r, c)
      end do
   end function worst_errors

   pure real(wp) function mean(entries)
      real(wp), intent(in) :: entries(:)

      mean = sum(abs(entries))/size(entries)
   end function mean
end program turbine_scaling
