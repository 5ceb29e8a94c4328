!> The matrices of a problem bordered by its constraints.
module kschur_saddle
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets
   implicit none
   private
   public :: saddle_blocks, symmetric_saddle

contains

   !> [K - s M, Cq^T D; D Cq, 0] of a symmetric problem, D a diagonal of factors.
   subroutine symmetric_saddle(problem, factors, s, matrix, structure, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> The square of a frequency (1/s^2).
      real(wp), intent(in) :: s
      type(csr_matrix_type), intent(out) :: matrix
      type(matrix_structure_type), intent(out) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: blocks(3)
      integer :: i

      call saddle_blocks(problem, factors, blocks, error)
      if (allocated(error)) return
      matrix = linear_combination([-s, 0.0_wp, 1.0_wp], blocks)
      structure%symmetric = .true.
      structure%multipliers = size(factors)
      allocate (structure%node(problem%unknowns()), source=[(i, i=1, problem%unknowns())])
   end subroutine symmetric_saddle

   !> [M 0; 0 0], [R 0; 0 0] and [K Cq^T D; D Cq 0], D a diagonal of
   !> factors: sigma^2, sigma and 1 times them is the matrix to be factored.
   subroutine saddle_blocks(problem, factors, blocks, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      type(csr_matrix_type), intent(out) :: blocks(3)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: scaled(:)
      integer, allocatable :: constraint(:)
      integer :: n, order

      n = problem%unknowns()
      order = n + problem%multipliers()
      call bordered(problem%mass, blocks(1))
      if (.not. allocated(error)) call bordered(problem%damping, blocks(2))
      if (allocated(error)) return
      associate (k => problem%stiffness, cq => problem%constraints)
         allocate (constraint(cq%nonzeros()), source=cq%row_indices())
         allocate (scaled(cq%nonzeros()), source=factors(constraint)*cq%value)
         call new_csr_from_triplets(blocks(3), order, order, [k%row_indices(), n + constraint, cq%column], &
            [k%column, cq%column, n + constraint], [k%value, scaled, scaled], error)
      end associate

   contains

      subroutine bordered(matrix, block)
         type(csr_matrix_type), intent(in) :: matrix
         type(csr_matrix_type), intent(out) :: block

         call new_csr_from_triplets(block, order, order, matrix%row_indices(), matrix%column, matrix%value, error)
      end subroutine bordered
   end subroutine saddle_blocks
end module kschur_saddle
