!> A program that has MPI already asks for modes on all of its processes: a chain of unit masses and springs between walls,
!> whose frequencies are 2 sin(i pi/(2 n + 2)) rad/s, of which the first process has the matrices.
!>
!>     mpirun -np 4 modes_on_processes
program modes_on_processes
   use kschur, only: csr_matrix_type, error_type, modal_options_type, modal_problem_type, modal_result_type, &
      new_csr_from_triplets, new_modal_problem, solve_modes, wp
   use mpi_f08, only: MPI_Comm_rank, MPI_COMM_WORLD, MPI_Finalize, MPI_Init
   implicit none
   integer, parameter :: n = 1000
   real(wp), parameter :: pi = acos(-1.0_wp)
   type(csr_matrix_type) :: mass, stiffness
   type(modal_problem_type) :: problem
   type(modal_options_type) :: options
   type(modal_result_type) :: result
   type(error_type), allocatable :: error
   integer :: rank, i

   call MPI_Init()
   call MPI_Comm_rank(MPI_COMM_WORLD, rank)
   if (rank == 0) then
      call new_csr_from_triplets(mass, n, n, [(i, i=1, n)], [(i, i=1, n)], [(1.0_wp, i=1, n)], error)
      call new_csr_from_triplets(stiffness, n, n, [(i, i=1, n), (i, i=1, n - 1), (i + 1, i=1, n - 1)], &
         [(i, i=1, n), (i + 1, i=1, n - 1), (i, i=1, n - 1)], [(2.0_wp, i=1, n), (-1.0_wp, i=1, 2*n - 2)], error)
      call new_modal_problem(problem, mass, stiffness, error)
   end if

   options%modes = 3
   options%communicator = MPI_COMM_WORLD%mpi_val
   options%distribute = 1
   ! Every process calls; those but the first give an empty problem and get no result.
   call solve_modes(problem, options, result, error)
   if (allocated(error)) then
      ! The same in all of them.
      print "(a, i0, 2a)", "process ", rank, ": ", error%message
   else if (rank == 0) then
      print "(a)", "     rad/s        exact"
      print "(2f12.9)", (abs(result%eigenvalues(i)), 2*sin(i*pi/(2*n + 2)), i=1, 3)
   end if
   call MPI_Finalize()
end program modes_on_processes
