!> Factors and solves of LDL and MUMPS against the number of threads.
!>
!>     benchmark_threads [PROBLEM.h5 SHIFT]
!>
!> The matrix is K + SHIFT^2 M, bordered by the constraints, after presolve; without a problem those of grids of beams and
!> of free blocks of a solid. Each time is the least of several, in milliseconds; a solve is one right-hand side, alone and
!> in a block of four.
program threads
   use kschur, only: csr_matrix_type, error_type, matrix_structure_type, modal_problem_type, read_hdf5_problem, &
      real_linear_solver_type, text, wp
   use kschur_clock, only: clock, seconds_since
   use kschur_kinds, only: long
   use kschur_ldl, only: ldl_real_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_presolve, only: presolve, presolve_type
   use kschur_quasi_definite, only: quasi_definite_type
   use kschur_saddle, only: symmetric_saddle
   use kschur_scenes, only: build_scene
   use kschur_threads, only: enter_solve, leave_solve, team_size
   use solid_block, only: build_block
   implicit none
   integer, parameter :: sides = 4, repetitions = 3
   type(modal_problem_type) :: problem
   type(error_type), allocatable :: error
   character(len=200) :: words(2)
   real(wp) :: shift
   integer :: k

   print "(a)", "| matrix | order | solver | entries a column | threads | analyse | factorise | solve | in a block |"
   print "(a)", "|---|---:|---|"//repeat("---:|", 6)
   if (command_argument_count() == 2) then
      do k = 1, 2
         call get_command_argument(k, words(k))
      end do
      read (words(2), *) shift
      call read_hdf5_problem(problem, trim(words(1)), error)
      call compare(trim(words(1)), shift)
   else
      call build_scene("grid", [character(len=16) :: "--cells", "60x42"], problem, error)
      call compare("grid 60x42", 1.0_wp)
      call build_scene("grid", [character(len=16) :: "--cells", "120x80"], problem, error)
      call compare("grid 120x80", 1.0_wp)
      do k = 10, 20, 5
         call build_block(spread(k, 1, 3), .false., problem, error)
         call compare("block "//text(k), 100.0_wp)
      end do
   end if

contains

   subroutine compare(name, shift)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: shift
      type(modal_problem_type) :: work
      type(presolve_type) :: plan
      type(csr_matrix_type) :: matrix
      type(matrix_structure_type) :: structure
      class(real_linear_solver_type), allocatable :: solver
      integer :: most, n

      if (.not. allocated(error)) call presolve(problem, work, plan, error)
      if (.not. allocated(error)) call symmetric_saddle(work, spread(1.0_wp, 1, work%multipliers()), -shift**2, matrix, &
         structure, error)
      if (allocated(error)) then
         print "(a)", name//": "//error%message
         error stop
      end if
      most = team_size()
      do n = 1, most
         if (structure%multipliers > 0) then
            allocate (quasi_definite_type :: solver)
         else
            allocate (ldl_real_type :: solver)
         end if
         call measure(name, "LDL", solver, matrix, structure, n)
         deallocate (solver)
      end do
      do n = 1, most
         allocate (mumps_real_type :: solver)
         call measure(name, "MUMPS", solver, matrix, structure, n)
         deallocate (solver)
      end do
   end subroutine compare

   subroutine measure(name, label, solver, matrix, structure, threads)
      character(len=*), intent(in) :: name, label
      class(real_linear_solver_type), intent(inout) :: solver
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(in) :: threads
      type(error_type), allocatable :: error
      real(wp), allocatable :: x(:, :), many(:, :)
      real(wp) :: analysis, factors, one, block
      integer(long) :: started
      integer :: i, before

      call enter_solve(threads, matrix%rows, before, error)
      allocate (x(matrix%rows, 1), many(matrix%rows, sides), source=1.0_wp)
      analysis = huge(one)
      factors = huge(one)
      one = huge(one)
      block = huge(block)
      do i = 1, repetitions
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) exit
         analysis = min(analysis, solver%analyze_seconds)
         factors = min(factors, solver%factorize_seconds)
         started = clock()
         call solver%solve(x, error)
         one = min(one, seconds_since(started))
         started = clock()
         call solver%solve(many, error)
         block = min(block, seconds_since(started)/sides)
      end do
      call leave_solve(before)
      if (allocated(error)) then
         print "(a)", "| "//name//" | "//text(matrix%rows)//" | "//error%message//" |"
         return
      end if
      print "(3a, i0, 3a, f0.1, a, i0, 4(a, f9.3), a)", "| ", name, " | ", matrix%rows, " | ", label, " | ", &
         real(solver%factor_entries, wp)/matrix%rows, " | ", threads, " | ", 1000*analysis, " | ", 1000*factors, " | ", &
         1000*one, " | ", 1000*block, " |"
   end subroutine measure
end program threads
