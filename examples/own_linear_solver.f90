!> Modes with a linear solver of one's own, here dense LU by LAPACK: a chain of
!> 20 equal masses between walls, 1 kg and 100 N/m each, with damping 0.02 K,
!> and a constraint that keeps the mean of the four middle masses at rest.
!>
!> Closed form: the constraint does not disturb the second mode of the chain, which is
!> antisymmetric: omega^2 = 400 sin^2(pi/21), damping ratio 0.01 omega.
module dense_solver
   use kschur, only: csr_matrix_type, error_singular, error_type, matrix_structure_type, new_error, real_linear_solver_type, wp
   implicit none
   private
   public :: dense_solver_type

   type, extends(real_linear_solver_type) :: dense_solver_type
      private
      real(wp), allocatable :: lu(:, :)
      integer, allocatable :: pivot(:)
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
   end type dense_solver_type

   interface
      subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgetrf

      subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         character, intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs
   end interface

contains

   subroutine factorize(self, matrix, structure, error)
      class(dense_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      integer :: i, k, n, info

      n = matrix%rows
      if (allocated(self%lu)) deallocate (self%lu, self%pivot)
      allocate (self%lu(n, n), source=0.0_wp)
      allocate (self%pivot(n))
      do i = 1, n
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            self%lu(i, matrix%column(k)) = matrix%value(k)
         end do
      end do
      call dgetrf(n, n, self%lu, n, self%pivot, info)
      ! The library tries another shift then.
      if (info > 0) call new_error(error, error_singular, "the matrix is singular")
      self%factor_entries = size(self%lu)
      self%description = "dense LU"
      if (structure%symmetric) self%description = "dense LU of a symmetric matrix"
   end subroutine factorize

   subroutine solve(self, x, error)
      class(dense_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute(self, "N", x)
   end subroutine solve

   subroutine solve_adjoint(self, x, error)
      class(dense_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute(self, "T", x)
   end subroutine solve_adjoint

   subroutine substitute(self, transposed, x)
      type(dense_solver_type), intent(in) :: self
      character, intent(in) :: transposed
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer :: info

      call dgetrs(transposed, size(x, 1), size(x, 2), self%lu, size(x, 1), self%pivot, x, size(x, 1), info)
   end subroutine substitute
end module dense_solver

program own_linear_solver
   use dense_solver, only: dense_solver_type
   use kschur, only: csr_matrix_type, error_type, formulation_quadratic, inner_solvers_type, modal_options_type, &
      modal_problem_type, modal_result_type, new_csr_from_triplets, new_modal_problem, solve_modes, wp
   implicit none
   integer, parameter :: n = 20
   type(csr_matrix_type) :: mass, damping, stiffness, constraints
   type(modal_problem_type) :: problem
   type(inner_solvers_type) :: solvers
   type(modal_result_type) :: result
   type(error_type), allocatable :: error
   integer :: i, rows(3*n - 2), columns(3*n - 2)
   real(wp) :: values(3*n - 2)

   rows = [[(i, i=1, n)], [(i, i=1, n - 1)], [(i + 1, i=1, n - 1)]]
   columns = [[(i, i=1, n)], [(i + 1, i=1, n - 1)], [(i, i=1, n - 1)]]
   values = [spread(200.0_wp, 1, n), spread(-100.0_wp, 1, 2*n - 2)]
   call new_csr_from_triplets(mass, n, n, rows(:n), columns(:n), spread(1.0_wp, 1, n), error)
   call new_csr_from_triplets(damping, n, n, rows, columns, 0.02_wp*values, error)
   call new_csr_from_triplets(stiffness, n, n, rows, columns, values, error)
   call new_csr_from_triplets(constraints, 1, n, [1, 1, 1, 1], [9, 10, 11, 12], spread(1.0_wp, 1, 4), error)
   call new_modal_problem(problem, mass, stiffness, error, damping, constraints)

   ! A prototype: each matrix is factored by a copy of it.
   allocate (dense_solver_type :: solvers%real)
   if (.not. allocated(error)) call solve_modes(problem, &
      modal_options_type(modes=1, formulation=formulation_quadratic), result, error, solvers=solvers)
   if (allocated(error)) then
      print "(a)", error%message
      error stop
   end if
   print "(a, f9.6, a, f9.6)", "frequency ", result%frequency_hz(1), " Hz, damping ratio ", result%damping_ratio(1)
   print "(a)", "solved by "//result%inner
end program own_linear_solver
