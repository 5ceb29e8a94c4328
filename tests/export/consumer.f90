!> One mass on a spring: prints its frequency in Hz, sqrt(400/4)/(2 pi) = 1.591549.
program consumer
   use kschur, only: csr_matrix_type, error_type, modal_options_type, modal_problem_type, modal_result_type, &
      new_csr_from_triplets, new_modal_problem, solve_modes, wp
   implicit none
   type(csr_matrix_type) :: mass, stiffness
   type(modal_problem_type) :: problem
   type(modal_result_type) :: result
   type(error_type), allocatable :: error

   call new_csr_from_triplets(mass, 1, 1, [1], [1], [4.0_wp], error)
   call new_csr_from_triplets(stiffness, 1, 1, [1], [1], [400.0_wp], error)
   call new_modal_problem(problem, mass, stiffness, error)
   call solve_modes(problem, modal_options_type(modes=1), result, error)
   if (allocated(error)) error stop 1
   print "(f9.6)", result%frequency_hz(1)
end program consumer
