!> What a solver that remembers saves: seconds of the processor of separate solves, and of the same by one solver.
!>
!>     benchmark_remember speeds|targets [ROUNDS [SCENE]]
program benchmark_remember
   use kschur, only: error_type, modal_options_type, modal_problem_type, modal_result_type, modal_solver_type, &
      new_modal_problem, new_modal_solver, solve_modes, solve_targets, wp
   use kschur_scenes, only: build_scene
   implicit none

   integer, parameter :: speeds = 25, targets = 10, modes = 10
   real(wp), parameter :: rated = 12.1_wp
   character(len=200) :: what, rounds_text, scene
   real :: separate, together
   integer :: rounds, round, status

   call get_command_argument(1, what)
   call get_command_argument(2, rounds_text)
   call get_command_argument(3, scene)
   if (scene == "") scene = "turbine"
   rounds = 3
   read (rounds_text, *, iostat=status) rounds
   separate = huge(1.0)
   together = huge(1.0)
   do round = 1, rounds
      if (what == "speeds") then
         call measure_speeds(separate, together)
      else
         call measure_targets(trim(scene), separate, together)
      end if
   end do
   print "(a, 2f9.3, a, f6.3)", "separate and together, s", separate, together, "; ratio", together/separate

contains

   subroutine measure_speeds(separate, together)
      real, intent(inout) :: separate, together
      type(modal_problem_type) :: given(speeds)
      type(modal_problem_type) :: problem
      type(modal_solver_type) :: solver
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      complex(wp) :: lambda(modes, speeds)
      character(len=8) :: speed
      real :: from, to, largest
      integer :: i

      do i = 1, speeds
         write (speed, "(f8.4)") i*rated/speeds
         call build_scene("turbine", [character(len=8) :: "--speed", adjustl(speed)], given(i), error)
      end do
      call cpu_time(from)
      do i = 1, speeds
         associate (p => given(i))
            call new_modal_problem(problem, p%mass, p%stiffness, error, p%damping, p%constraints)
         end associate
         call solve_modes(problem, modal_options_type(modes=modes, threads=1), result, error)
         lambda(:, i) = result%eigenvalues
      end do
      call cpu_time(to)
      separate = min(separate, to - from)
      largest = 0
      call cpu_time(from)
      do i = 1, speeds
         associate (p => given(i))
            if (i == 1) then
               call new_modal_problem(problem, p%mass, p%stiffness, error, p%damping, p%constraints)
               call new_modal_solver(solver, problem)
            else
               call solver%update_values(p%mass, p%stiffness, error, p%damping, p%constraints)
            end if
         end associate
         call solver%solve(modal_options_type(modes=modes, threads=1), result, error)
         largest = max(largest, real(maxval(abs(result%eigenvalues - lambda(:, i))/abs(lambda(:, i)))))
      end do
      call cpu_time(to)
      together = min(together, to - from)
      print "(a, es9.1)", "largest difference", largest
   end subroutine measure_speeds

   subroutine measure_targets(scene, separate, together)
      character(len=*), intent(in) :: scene
      real, intent(inout) :: separate, together
      type(modal_problem_type) :: problem
      type(modal_solver_type) :: solver
      type(modal_result_type) :: result
      type(modal_result_type), allocatable :: results(:)
      type(error_type), allocatable :: error
      type(modal_options_type) :: options
      complex(wp) :: lambda(modes, targets), at(targets)
      real :: from, to, largest
      integer :: i

      call build_scene(scene, [character(len=8) ::], problem, error)
      if (allocated(error)) then
         print "(a)", error%message
         stop 1
      end if
      options%modes = modes
      options%threads = 1
      call solve_modes(problem, options, result, error)
      at = cmplx(0, [(i, i=1, targets)]*abs(result%eigenvalues(modes)), wp)
      call cpu_time(from)
      do i = 1, targets
         options%target = at(i)
         call solve_modes(problem, options, result, error)
         lambda(:, i) = result%eigenvalues
      end do
      call cpu_time(to)
      separate = min(separate, to - from)
      largest = 0
      call cpu_time(from)
      call new_modal_solver(solver, problem)
      call solve_targets(solver, at, options, results, error)
      call cpu_time(to)
      do i = 1, targets
         largest = max(largest, real(maxval(abs(results(i)%eigenvalues - lambda(:, i)))/abs(at(i))))
      end do
      print "(a, i3)", "factorizations", sum(results%factorizations)
      together = min(together, to - from)
      print "(a, es9.1)", "largest difference", largest
   end subroutine measure_targets
end program benchmark_remember
