!> The matrices of a problem bordered by its constraints.
module kschur_saddle
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets
   use kschur_symbolic, only: sparse_order
   implicit none
   private
   public :: order_elimination, saddle_blocks, saddle_structure, symmetric_saddle

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
      type(csr_matrix_type) :: parts(2)

      parts(1) = problem%stiffness
      parts(2) = problem%mass
      call border(linear_combination([1.0_wp, -s], parts), problem%constraints, factors, matrix, error)
      if (allocated(error)) return
      structure = saddle_structure(problem)
      structure%symmetric = .true.
   end subroutine symmetric_saddle

   !> What a solver may know of [A, Cq^T; Cq, 0] where A is made of M, R and K.
   pure function saddle_structure(problem) result(structure)
      type(modal_problem_type), intent(in) :: problem
      type(matrix_structure_type) :: structure
      integer :: i

      structure%symmetric = problem%symmetric
      structure%multipliers = problem%multipliers()
      allocate (structure%node(problem%unknowns()), source=[(i, i=1, problem%unknowns())])
      if (allocated(problem%position)) allocate (structure%position, source=problem%position)
   end function saddle_structure

   !> Finds one order for all matrices that are made of M, R, K and Cq: that of the pattern of all.
   subroutine order_elimination(problem, error)
      !> Its `position` is set.
      type(modal_problem_type), intent(inout) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: pattern
      real(wp) :: factors(problem%multipliers())

      factors = 1
      call border(linear_combination([1.0_wp, 1.0_wp, 1.0_wp], [problem%stiffness, problem%mass, problem%damping]), &
         problem%constraints, factors, pattern, error)
      if (.not. allocated(error)) &
         call sparse_order(pattern%row_start, pattern%column, saddle_structure(problem), problem%position, error)
   end subroutine order_elimination

   !> [M 0; 0 0], [R 0; 0 0] and [K Cq^T D; D Cq 0], D a diagonal of
   !> factors: sigma^2, sigma and 1 times them is the matrix to be factored.
   subroutine saddle_blocks(problem, factors, blocks, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      type(csr_matrix_type), intent(out) :: blocks(3)
      type(error_type), allocatable, intent(out) :: error
      integer :: order

      order = problem%unknowns() + problem%multipliers()
      blocks(1) = enlarge(problem%mass, order)
      blocks(2) = enlarge(problem%damping, order)
      call border(problem%stiffness, problem%constraints, factors, blocks(3), error)
   end subroutine saddle_blocks

   ! [A Cq^T D; D Cq 0].
   subroutine border(matrix, constraints, factors, bordered, error)
      type(csr_matrix_type), intent(in) :: matrix, constraints
      real(wp), intent(in) :: factors(:)
      type(csr_matrix_type), intent(out) :: bordered
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: parts(2)
      integer, allocatable :: constraint(:)
      real(wp), allocatable :: scaled(:)
      integer :: n, order

      n = matrix%rows
      order = n + constraints%rows
      bordered = enlarge(matrix, order)
      if (constraints%rows == 0) return
      allocate (constraint(constraints%nonzeros()), source=constraints%row_indices())
      allocate (scaled(constraints%nonzeros()), source=factors(constraint)*constraints%value)
      parts(1) = bordered
      call new_csr_from_triplets(parts(2), order, order, [n + constraint, constraints%column], &
         [constraints%column, n + constraint], [scaled, scaled], error)
      if (.not. allocated(error)) bordered = linear_combination([1.0_wp, 1.0_wp], parts)
   end subroutine border

   ! [A 0; 0 0].
   pure function enlarge(matrix, order) result(block)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: order
      type(csr_matrix_type) :: block

      block = matrix
      block%rows = order
      block%columns = order
      block%row_start = [matrix%row_start, spread(matrix%nonzeros() + 1, 1, order - matrix%rows)]
   end function enlarge
end module kschur_saddle
