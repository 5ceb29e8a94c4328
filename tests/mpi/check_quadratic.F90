!> The quadratic form by rows, against matmul on one process: mpirun -np N check_quadratic. Random states and what the operator
!> makes of them, one by one and in blocks, at real and complex shifts, with constraints and without, symmetric and not, with a
!> rigid motion that is kept out, processes with few rows. Prints each check that fails, then `N passed, N failed`.
module dense_problem
   use kschur_csr, only: csr_matrix_type
   use kschur_csr_assembly, only: new_csr_from_triplets
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type, new_modal_problem
   implicit none
   private
   public :: check, close, conclude, dense_problem_type, new_dense_problem

   !> Of numbers of order one.
   real(wp), parameter :: close = 1.0e-12_wp

   !> A chain of masses with springs and dampers between them.
   type :: dense_problem_type
      !> n x n.
      real(wp), allocatable :: mass(:, :), damping(:, :), stiffness(:, :)
      !> Unknowns that are the same, 2 x m.
      integer, allocatable :: pairs(:, :)
      !> Rigid motions of unit length in M, n x k.
      real(wp), allocatable :: motions(:, :)
   contains
      procedure :: make
   end type dense_problem_type

   integer :: passed = 0, failed = 0

contains

   subroutine check(name, holds)
      character(len=*), intent(in) :: name
      logical, intent(in) :: holds

      if (holds) passed = passed + 1
      if (holds) return
      failed = failed + 1
      print "(a)", "FAILED  "//name
   end subroutine check

   subroutine conclude()
      print "(i0, a, i0, a)", passed, " passed, ", failed, " failed"
   end subroutine conclude

   !> Free with a rigid motion, or tied to the ground, and with gyroscopic forces.
   function new_dense_problem(n, m, free) result(given)
      integer, intent(in) :: n, m
      logical, intent(in) :: free
      type(dense_problem_type) :: given
      integer :: i

      allocate (given%mass(n, n), given%damping(n, n), given%stiffness(n, n), source=0.0_wp)
      do i = 1, n
         given%mass(i, i) = 1 + 0.1_wp*mod(i, 5)
         if (i == n) cycle
         call join(given%stiffness, 3.0_wp + mod(i, 3))
         call join(given%damping, 0.2_wp*mod(i, 4))
      end do
      if (free) then
         ! It decays.
         given%damping = given%damping + 0.3_wp*given%mass
         allocate (given%motions(n, 1), source=1/sqrt(sum(given%mass)))
      else
         do i = 1, n
            given%stiffness(i, i) = given%stiffness(i, i) + 0.5_wp
            if (i < n - 1) given%damping(i, i + 2) = given%damping(i, i + 2) + 0.4_wp
            if (i < n - 1) given%damping(i + 2, i) = given%damping(i + 2, i) - 0.4_wp
         end do
         allocate (given%motions(n, 0))
      end if
      given%pairs = reshape([(i, n/2 + i, i=1, m)], [2, m])

   contains

      subroutine join(matrix, value)
         real(wp), intent(inout) :: matrix(:, :)
         real(wp), intent(in) :: value

         matrix(i:i + 1, i:i + 1) = matrix(i:i + 1, i:i + 1) + value*reshape([1, -1, -1, 1], [2, 2])
      end subroutine join
   end function new_dense_problem

   subroutine make(self, problem, deflation)
      class(dense_problem_type), intent(in) :: self
      type(modal_problem_type), intent(out) :: problem
      type(deflation_type), intent(out) :: deflation
      real(wp) :: constraints(size(self%pairs, 2), size(self%mass, 1)), none(size(self%pairs, 2), size(self%motions, 2))
      type(error_type), allocatable :: error
      integer :: j

      constraints = 0
      do j = 1, size(self%pairs, 2)
         constraints(j, self%pairs(:, j)) = [1, -1]
      end do
      call new_modal_problem(problem, sparse(self%mass), sparse(self%stiffness), error, sparse(self%damping), sparse(constraints))
      call check("a problem", .not. allocated(error))
      none = 0
      call new_deflation(deflation, problem, self%motions, none)
      call check("motions that are kept out", size(deflation%decay) == size(self%motions, 2))
   end subroutine make

   function sparse(dense) result(matrix)
      real(wp), intent(in) :: dense(:, :)
      type(csr_matrix_type) :: matrix
      type(error_type), allocatable :: error
      integer :: i, j

      associate (there => abs(dense) > 0)
         call new_csr_from_triplets(matrix, size(dense, 1), size(dense, 2), &
            pack(spread([(i, i=1, size(dense, 1))], 2, size(dense, 2)), there), &
            pack(spread([(j, j=1, size(dense, 2))], 1, size(dense, 1)), there), pack(dense, there), error)
      end associate
      call check("a matrix", .not. allocated(error))
   end function sparse
end module dense_problem

module quadratic_checks_real
   use dense_problem, only: check, close, dense_problem_type
   use kschur_deflation, only: deflation_type
   use kschur_direct_solver, only: direct_real_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_quadratic_real, only: quadratic_operator_type, new_quadratic_operator
   use kschur_quadratic_rows, only: end_sharing, share_operator
   use kschur_random, only: random_vector
   use kschur_row_problem, only: row_problem_type
   use kschur_two_level_real, only: two_level_basis_type
   implicit none
   private
   public :: check_states

#define SCALAR real(wp)
#define SOLVER_TYPE direct_real_type
#define PARENT_TYPE real_linear_solver_type
#define SHIFT (0.7_wp, 0.0_wp)
#include "check_quadratic.inc"
#undef SCALAR
#undef SOLVER_TYPE
#undef PARENT_TYPE
#undef SHIFT
end module quadratic_checks_real

module quadratic_checks_complex
   use dense_problem, only: check, close, dense_problem_type
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_quadratic_complex, only: quadratic_operator_type, new_quadratic_operator
   use kschur_quadratic_rows, only: end_sharing, share_operator
   use kschur_random, only: random_vector
   use kschur_row_problem, only: row_problem_type
   use kschur_two_level_complex, only: two_level_basis_type
   implicit none
   private
   public :: check_states

#define SCALAR complex(wp)
#define SOLVER_TYPE mumps_complex_type
#define PARENT_TYPE complex_linear_solver_type
#define SHIFT (0.7_wp, 1.9_wp)
#include "check_quadratic.inc"
end module quadratic_checks_complex

program check_quadratic
   use quadratic_checks_complex, only: check_complex => check_states
   use quadratic_checks_real, only: check_real => check_states
   use dense_problem, only: check, conclude, dense_problem_type, new_dense_problem
   use kschur_error, only: error_type
   use kschur_worker_loop, only: worker_loop
   use kschur_processes, only: join_processes, processes_type
   use mpi_f08, only: MPI_COMM_WORLD, MPI_Finalize, MPI_Init
   implicit none

   ! Unknowns and constraints, and states that go together.
   integer, parameter :: extents(2, 4) = reshape([12, 0, 16, 2, 61, 5, 700, 40], [2, 4]), blocks(2) = [1, 3]
   type(dense_problem_type) :: given
   type(processes_type), target :: processes
   type(processes_type), pointer :: all
   type(error_type), allocatable :: error
   integer, allocatable :: communicator
   character(len=40) :: name
   integer :: i, j, k

   call MPI_Init()
   allocate (communicator, source=MPI_COMM_WORLD%mpi_val)
   call join_processes(communicator, 1, processes, error)
   all => processes
   if (processes%rank > 0) then
      call worker_loop(processes)
   else
      do i = 1, size(extents, 2)
         do j = 1, size(blocks)
            do k = 0, 1
               write (name, "(3(i0, a))") extents(1, i), " unknowns, ", extents(2, i), " constraints, ", blocks(j), " together"
               name = trim(name)//merge(", free", "      ", k == 1)
               given = new_dense_problem(extents(1, i), extents(2, i), k == 1)
               call check_real("real, "//trim(name), given, blocks(j), all)
               call check_complex("complex, "//trim(name), given, blocks(j), all)
            end do
         end do
      end do
   end if
   call processes%leave(error)
   call check("no error is left", .not. allocated(error))
   if (processes%rank == 0) call conclude()
   call MPI_Finalize()
end program check_quadratic
