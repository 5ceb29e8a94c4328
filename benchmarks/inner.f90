!> LDL against MUMPS on definite matrices of growing fill: whether there is
!> one at which `--inner auto` should go over to MUMPS.
!>
!>     benchmark_inner
!>
!> Each time is the least of several, in milliseconds; a solve is one right-hand
!> side, alone and in a block of 16.
program inner
   use kschur, only: csr_matrix_type, error_type, matrix_structure_type, modal_problem_type, new_csr_from_triplets, &
      real_linear_solver_type, text, wp
   use kschur_clock, only: clock, seconds_since
   use kschur_kinds, only: long
   use kschur_ldl, only: ldl_real_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_presolve, only: presolve, presolve_type
   use kschur_scenes, only: build_scene
   use kschur_sparse, only: linear_combination
   implicit none
   integer, parameter :: sides = 16, repetitions = 5
   integer, parameter :: plates(3) = [50, 100, 200], cubes(5) = [8, 12, 16, 20, 25]
   integer :: k

   print "(a)", "| matrix | order | solver | entries | a column | analyse | factorise | solve | in a block |"
   print "(a)", "|---|---:|---|"//repeat("---:|", 6)
   call compare("grid 20x14", grid("20x14"))
   call compare("grid 60x42", grid("60x42"))
   do k = 1, size(plates)
      call compare("plate "//text(plates(k)), laplacian([plates(k), plates(k), 1], 1, 1))
   end do
   do k = 1, size(plates) - 1
      call compare("shell "//text(plates(k)), laplacian([plates(k), plates(k), 1], 3, 6))
   end do
   do k = 1, size(cubes)
      call compare("cube, 7 points, "//text(cubes(k)), laplacian(spread(cubes(k), 1, 3), 1, 1))
   end do
   do k = 1, size(cubes)
      call compare("cube, 27 points, "//text(cubes(k)), laplacian(spread(cubes(k), 1, 3), 3, 1))
   end do

contains

   subroutine compare(name, matrix)
      character(len=*), intent(in) :: name
      type(csr_matrix_type), intent(in) :: matrix
      type(ldl_real_type), allocatable :: ldl
      type(mumps_real_type), allocatable :: mumps

      allocate (ldl, mumps)
      call measure(name, "LDL", ldl, matrix)
      call measure(name, "MUMPS", mumps, matrix)
   end subroutine compare

   subroutine measure(name, label, solver, matrix)
      character(len=*), intent(in) :: name, label
      class(real_linear_solver_type), intent(inout) :: solver
      type(csr_matrix_type), intent(in) :: matrix
      type(error_type), allocatable :: error
      real(wp), allocatable :: x(:, :), many(:, :)
      real(wp) :: one, block
      integer(long) :: started
      integer :: i

      call solver%factorize(matrix, matrix_structure_type(symmetric=.true.), error)
      if (allocated(error)) then
         print "(a)", "| "//name//" | "//text(matrix%rows)//" | "//error%message//" |"
         return
      end if
      allocate (x(matrix%rows, 1), many(matrix%rows, sides), source=1.0_wp)
      one = huge(one)
      block = huge(block)
      do i = 1, repetitions
         started = clock()
         call solver%solve(x, error)
         one = min(one, seconds_since(started))
         started = clock()
         call solver%solve(many, error)
         block = min(block, seconds_since(started)/sides)
      end do
      print "(3a, i0, 3a, i0, a, f8.1, 4(a, f9.3), a)", "| ", name, " | ", matrix%rows, " | ", label, " | ", &
         solver%factor_entries, " | ", real(solver%factor_entries, wp)/matrix%rows, " | ", 1000*solver%analyze_seconds, " | ", &
         1000*solver%factorize_seconds, " | ", 1000*one, " | ", 1000*block, " |"
   end subroutine measure

   !> K + M of the scene after its ties are eliminated.
   function grid(cells) result(matrix)
      character(len=*), intent(in) :: cells
      type(csr_matrix_type) :: matrix, both(2)
      type(modal_problem_type) :: problem, work
      type(presolve_type) :: plan
      type(error_type), allocatable :: error

      call build_scene("grid", [character(len=16) :: "--cells", cells], problem, error)
      call presolve(problem, work, plan, error)
      both(1) = work%stiffness
      both(2) = work%mass
      matrix = linear_combination([1.0_wp, 1.0_wp], both)
   end function grid

   !> The Laplacian plus a little, on a box of nodes with `freedoms` unknowns each; couples nearest
   !> neighbours (reach 1: 5 or 7 points) or all that touch (reach 3: 9 or 27 points).
   function laplacian(points, reach, freedoms) result(matrix)
      integer, intent(in) :: points(3), reach, freedoms
      type(csr_matrix_type) :: matrix
      type(error_type), allocatable :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: at(3), offset(3), n, width, entries, here, there, k, a, b

      n = freedoms*product(points)
      width = 27*freedoms
      allocate (row(n*width), column(n*width), value(n*width))
      entries = 0
      do here = 1, product(points)
         at = [mod(here - 1, points(1)), mod((here - 1)/points(1), points(2)), (here - 1)/(points(1)*points(2))]
         do k = 0, 26
            offset = [mod(k, 3), mod(k/3, 3), k/9] - 1
            if (sum(abs(offset)) > reach .or. any(at + offset < 0) .or. any(at + offset >= points)) cycle
            there = here + offset(1) + points(1)*(offset(2) + points(2)*offset(3))
            do a = 1, freedoms
               do b = 1, freedoms
                  entries = entries + 1
                  row(entries) = freedoms*(here - 1) + a
                  column(entries) = freedoms*(there - 1) + b
                  value(entries) = merge(27.0_wp*freedoms, -1.0_wp, row(entries) == column(entries))
               end do
            end do
         end do
      end do
      call new_csr_from_triplets(matrix, n, n, row(:entries), column(:entries), value(:entries), error)
   end function laplacian
end program inner
