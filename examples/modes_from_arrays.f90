!> The shortest way from arrays to modes: two masses between walls, tied
!> together by a constraint, with a dashpot on the first.
!>
!> Closed form: the pair moves as one mass of 2 kg on a spring of 200 N/m with a
!> dashpot of 4 N s/m: omega = 10 rad/s, damping ratio 4/(2 2 10) = 0.1.
program modes_from_arrays
   use kschur, only: csr_matrix_type, error_type, modal_options_type, modal_problem_type, modal_result_type, &
      new_csr_from_triplets, new_modal_problem, solve_modes, wp
   implicit none
   type(csr_matrix_type) :: mass, damping, stiffness, constraints
   type(modal_problem_type) :: problem
   type(modal_result_type) :: result
   type(error_type), allocatable :: error

   call new_csr_from_triplets(mass, 2, 2, [1, 2], [1, 2], [1.0_wp, 1.0_wp], error)
   call new_csr_from_triplets(damping, 2, 2, [1], [1], [4.0_wp], error)
   call new_csr_from_triplets(stiffness, 2, 2, [1, 2], [1, 2], [100.0_wp, 100.0_wp], error)
   call new_csr_from_triplets(constraints, 1, 2, [1, 1], [1, 2], [1.0_wp, -1.0_wp], error)
   call new_modal_problem(problem, mass, stiffness, error, damping, constraints)
   if (.not. allocated(error)) call solve_modes(problem, modal_options_type(modes=1), result, error)
   if (allocated(error)) then
      print "(a)", error%message
      error stop
   end if
   print "(a, f9.6, a, f9.6)", "frequency ", result%frequency_hz(1), " Hz, damping ratio ", result%damping_ratio(1)
end program modes_from_arrays
