!> Saddle-point matrices of a problem, bordered by its constraints.
module kschur_saddle
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_ordering, only: elimination_order
   use kschur_sparse, only: complex_combination, complex_csr_matrix_type, csr_matrix_type, linear_combination, transpose_csr, unite
   implicit none
   private
   public :: bordered, enlarged, order_elimination, saddle_blocks, saddle_structure, shifted_saddle, symmetric_saddle

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

      matrix = linear_combination(1.0_wp, problem%stiffness, -s, problem%mass)
      if (problem%multipliers() > 0) matrix = bordered(matrix, problem%constraints, factors)
      structure = saddle_structure(problem)
      structure%symmetric = .true.
   end subroutine symmetric_saddle

   !> Structure of [A, Cq^T; Cq, 0] for solvers, A a combination of M, R and K.
   pure function saddle_structure(problem, sigma) result(structure)
      type(modal_problem_type), intent(in) :: problem
      !> The shift, if A = P(sigma).
      complex(wp), intent(in), optional :: sigma
      type(matrix_structure_type) :: structure
      integer :: i

      structure%symmetric = problem%symmetric
      if (present(sigma)) structure%in_half_plane = real(sigma, wp) > 0 .or. .not. abs(sigma) > 0
      structure%multipliers = problem%multipliers()
      allocate (structure%node(problem%unknowns()), source=[(i, i=1, problem%unknowns())])
      if (allocated(problem%position)) allocate (structure%position, source=problem%position)
   end function saddle_structure

   !> Computes one elimination order for all combinations of M, R, K and Cq, from the union of their patterns. Without
   !> constraints it is left to the solvers: LDL orders definite matrices faster.
   subroutine order_elimination(problem, error)
      !> Its `position` is set.
      type(modal_problem_type), intent(inout) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: pattern
      integer, allocatable :: position(:)

      pattern%rows = problem%unknowns()
      pattern%columns = pattern%rows
      allocate (pattern%row_start, source=problem%stiffness%row_start)
      allocate (pattern%column, source=problem%stiffness%column)
      call unite(pattern%row_start, pattern%column, problem%mass)
      call unite(pattern%row_start, pattern%column, problem%damping)
      if (allocated(problem%loss)) call unite(pattern%row_start, pattern%column, problem%loss)
      if (problem%multipliers() > 0) then
         allocate (pattern%value(size(pattern%column)), source=0.0_wp)
         pattern = bordered(pattern, problem%constraints, spread(1.0_wp, 1, problem%multipliers()))
      end if
      call elimination_order(pattern%row_start, pattern%column, saddle_structure(problem), position, error)
      if (.not. allocated(error)) call move_alloc(position, problem%position)
   end subroutine order_elimination

   !> [M 0; 0 0], [R 0; 0 0] and [K Cq^T D; D Cq 0], D a diagonal of factors, with coefficients sigma^2, sigma and 1 in the
   !> matrix to be factored.
   subroutine saddle_blocks(problem, factors, blocks, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      type(csr_matrix_type), intent(out) :: blocks(3)
      type(error_type), allocatable, intent(out) :: error
      integer :: order

      order = problem%unknowns() + problem%multipliers()
      blocks(1) = enlarged(problem%mass, order)
      blocks(2) = enlarged(problem%damping, order)
      blocks(3) = bordered(problem%stiffness, problem%constraints, factors)
   end subroutine saddle_blocks

   !> [sigma^2 M + sigma R + K + i H, Cq^T D; D Cq, 0].
   pure function shifted_saddle(problem, blocks, sigma, loss) result(matrix)
      type(modal_problem_type), intent(in) :: problem
      !> Its `saddle_blocks`.
      type(csr_matrix_type), intent(in) :: blocks(3)
      complex(wp), intent(in) :: sigma
      !> Coefficient of H. Absent: i.
      complex(wp), intent(in), optional :: loss
      type(complex_csr_matrix_type) :: matrix
      type(csr_matrix_type) :: all(4)
      complex(wp) :: coefficients(4)

      coefficients = [sigma**2, sigma, (1.0_wp, 0.0_wp), (0.0_wp, 1.0_wp)]
      if (present(loss)) coefficients(4) = loss
      if (allocated(problem%loss)) then
         all(:3) = blocks
         all(4) = enlarged(problem%loss, blocks(1)%rows)
         matrix = complex_combination(coefficients, all)
      else
         matrix = complex_combination(coefficients(:3), blocks)
      end if
   end function shifted_saddle

   !> [A B^T; B C] of a matrix A, n x n, constraints B = D Cq with a diagonal D of factors, and C = 0 or diagonal.
   pure function bordered(matrix, constraints, factors, corner) result(saddle)
      type(csr_matrix_type), intent(in) :: matrix, constraints
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> The diagonal of C, m numbers. Without it C has no entries.
      real(wp), optional, intent(in) :: corner(:)
      type(csr_matrix_type) :: saddle
      type(csr_matrix_type) :: scaled, columns
      integer :: i, n, entries

      if (constraints%rows == 0) then
         saddle = matrix
         return
      end if
      n = matrix%rows
      scaled = constraints
      call scaled%scale_entries(factors, spread(1.0_wp, 1, n))
      columns = transpose_csr(scaled)
      saddle%rows = n + scaled%rows
      saddle%columns = saddle%rows
      entries = matrix%nonzeros() + 2*scaled%nonzeros()
      if (present(corner)) entries = entries + size(corner)
      allocate (saddle%row_start(saddle%rows + 1), saddle%column(entries), saddle%value(entries))
      saddle%row_start(1) = 1
      do i = 1, n
         saddle%row_start(i + 1) = saddle%row_start(i)
         call append(saddle, i, matrix, i, 0)
         call append(saddle, i, columns, i, n)
      end do
      do i = 1, scaled%rows
         saddle%row_start(n + i + 1) = saddle%row_start(n + i)
         call append(saddle, n + i, scaled, i, 0)
         if (.not. present(corner)) cycle
         associate (place => saddle%row_start(n + i + 1))
            saddle%column(place) = n + i
            saddle%value(place) = corner(i)
            place = place + 1
         end associate
      end do
   end function bordered

   ! Appends row `from` of a block, with its columns shifted by `offset`, to row i of the whole matrix.
   pure subroutine append(whole, i, part, from, offset)
      type(csr_matrix_type), intent(inout) :: whole
      integer, intent(in) :: i, from, offset
      type(csr_matrix_type), intent(in) :: part
      integer :: k, place

      place = whole%row_start(i + 1)
      do k = part%row_start(from), part%row_start(from + 1) - 1
         whole%column(place) = part%column(k) + offset
         whole%value(place) = part%value(k)
         place = place + 1
      end do
      whole%row_start(i + 1) = place
   end subroutine append

   !> [A 0; 0 0], order x order.
   pure function enlarged(matrix, order) result(block)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: order
      type(csr_matrix_type) :: block

      block%rows = order
      block%columns = order
      allocate (block%row_start(order + 1), source=matrix%nonzeros() + 1)
      block%row_start(:matrix%rows) = matrix%row_start(:matrix%rows)
      allocate (block%column, source=matrix%column)
      allocate (block%value, source=matrix%value)
   end function enlarged
end module kschur_saddle
