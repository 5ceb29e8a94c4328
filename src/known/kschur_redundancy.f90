!> How many constraints follow from the others, and which.
module kschur_redundancy
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   implicit none
   private
   public :: count_redundant, find_redundant

   ! A singular value of the scaled Cq below the root of this is zero.
   real(wp), parameter :: negligible = 1.0e-13_wp
   integer, parameter :: scalings = 20

contains

   !> The number of rows of Cq less its rank. Pivots that vanish do not tell it for certain;
   !> an inertia does: [I C^T; C tau I], C the scaled Cq, has a negative eigenvalue for each
   !> singular value of C above sqrt(tau) (Sylvester, by the Schur complement tau I - C C^T).
   subroutine count_redundant(constraints, redundant, error, effort, counting)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(out) :: redundant
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), optional, intent(inout) :: effort
      !> A solver that tells the inertia of indefinite matrices, a copy of which is used. MUMPS does where there is none, or
      !> where it does not tell.
      class(real_linear_solver_type), allocatable, optional, intent(in) :: counting
      class(real_linear_solver_type), allocatable :: solver
      type(matrix_structure_type) :: structure
      type(csr_matrix_type) :: matrix
      integer :: columns

      redundant = 0
      if (constraints%rows == 0) return
      call bordered(constraints, negligible, matrix, columns, error)
      if (allocated(error)) return
      structure%symmetric = .true.
      if (present(counting)) then
         if (allocated(counting)) allocate (solver, source=counting)
      end if
      if (allocated(solver)) then
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) then
            ! It is nearly singular where constraints are redundant.
            if (error%code /= error_singular) return
            deallocate (error, solver)
         else
            if (present(effort)) call effort%add_factors(solver)
            if (solver%negative_pivots < 0) deallocate (solver)
         end if
      end if
      if (.not. allocated(solver)) then
         allocate (mumps_real_type :: solver)
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) return
         if (present(effort)) call effort%add_factors(solver)
      end if
      redundant = constraints%rows - solver%negative_pivots
   end subroutine count_redundant

   !> Which rows follow from the others: the combinations of rows that vanish are found by inverse iteration on
   !> C C^T + tau I, and each takes the row that has the largest share in it.
   subroutine find_redundant(constraints, redundant, follows, error, effort)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      !> How many they are.
      integer, intent(in) :: redundant
      !> m answers.
      logical, allocatable, intent(out) :: follows(:)
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), intent(inout) :: effort
      integer, parameter :: iterations = 2
      type(mumps_real_type) :: solver
      type(matrix_structure_type) :: structure
      type(csr_matrix_type) :: matrix
      real(wp), allocatable :: x(:, :), shares(:, :)
      integer(long) :: state
      integer :: i, j, n, place(2)

      allocate (follows(constraints%rows), source=.false.)
      if (redundant == 0) return
      call bordered(constraints, -negligible, matrix, n, error)
      if (allocated(error)) return
      structure%symmetric = .true.
      call solver%factorize(matrix, structure, error)
      if (allocated(error)) return
      call effort%add_factors(solver)
      allocate (x(matrix%rows, redundant), source=0.0_wp)
      state = 1
      do j = 1, redundant
         call random_vector(state, x(n + 1:, j))
      end do
      do i = 1, iterations
         x(:n, :) = 0
         call solver%solve(x, error)
         if (allocated(error)) return
         call orthonormalize(x(n + 1:, :))
      end do
      call effort%add_solves(solver)
      allocate (shares, source=x(n + 1:, :))
      do i = 1, redundant
         place = maxloc(abs(shares))
         associate (row => place(1), column => place(2))
            follows(row) = .true.
            x(n + 1:, 1) = shares(:, column)/shares(row, column)
            do j = 1, redundant
               shares(:, j) = shares(:, j) - shares(row, j)*x(n + 1:, 1)
            end do
            ! Rounding must not bring them back.
            shares(row, :) = 0
            shares(:, column) = 0
         end associate
      end do
   end subroutine find_redundant

   pure subroutine orthonormalize(x)
      real(wp), intent(inout) :: x(:, :)
      integer :: j, pass

      do j = 1, size(x, 2)
         do pass = 1, 2
            x(:, j) = x(:, j)/norm2(x(:, j))
            x(:, j) = x(:, j) - matmul(x(:, :j - 1), matmul(x(:, j), x(:, :j - 1)))
         end do
         x(:, j) = x(:, j)/norm2(x(:, j))
      end do
   end subroutine orthonormalize

   ! [I C^T; C tau I], C without empty columns and of rows and columns of one size.
   subroutine bordered(constraints, tau, matrix, columns, error)
      type(csr_matrix_type), intent(in) :: constraints
      real(wp), intent(in) :: tau
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(out) :: columns
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: value(:)
      integer, allocatable :: row(:), column(:)
      integer :: m, i

      m = constraints%rows
      call number_columns(constraints, column, columns)
      allocate (row(size(column)), source=constraints%row_indices())
      allocate (value(size(column)), source=constraints%value)
      call center(row, m, column, columns, value)
      call equilibrate(column, columns, value)
      call equilibrate(row, m, value)
      associate (n => columns)
         call new_csr_from_triplets(matrix, n + m, n + m, [[(i, i=1, n + m)], n + row, column], &
            [[(i, i=1, n + m)], column, n + row], [spread(1.0_wp, 1, n), spread(tau, 1, m), value, value], error)
      end associate
   end subroutine bordered

   ! Numbers the columns that are not empty: of each entry its new column.
   subroutine number_columns(matrix, column, columns)
      type(csr_matrix_type), intent(in) :: matrix
      integer, allocatable, intent(out) :: column(:)
      integer, intent(out) :: columns
      integer :: number(matrix%columns), k

      number = 0
      columns = 0
      allocate (column(matrix%nonzeros()))
      do k = 1, size(column)
         if (number(matrix%column(k)) == 0) then
            columns = columns + 1
            number(matrix%column(k)) = columns
         end if
         column(k) = number(matrix%column(k))
      end do
   end subroutine number_columns

   ! Scales rows and columns so that the squares of the logarithms of all entries are small (Curtis, Reid, J. Inst. Maths
   ! Applics 10 (1972)): one large entry must not make another row of its column look like a third.
   pure subroutine center(row, rows, column, columns, value)
      integer, intent(in) :: row(:), rows, column(:), columns
      real(wp), intent(inout) :: value(:)
      real(wp) :: level(size(value)), of_rows(rows), of_columns(columns)
      integer :: i

      level = exponent(value)
      of_columns = 0
      do i = 1, scalings
         of_rows = means(row, rows, level - of_columns(column), value)
         of_columns = means(column, columns, level - of_rows(row), value)
      end do
      value = scale(value, -nint(of_rows(row)) - nint(of_columns(column)))
   end subroutine center

   ! Of each line, over its entries that are not zero.
   pure function means(line, lines, level, value)
      integer, intent(in) :: line(:), lines
      real(wp), intent(in) :: level(:), value(:)
      real(wp) :: means(lines)
      integer :: entries(lines), k

      means = 0
      entries = 0
      do k = 1, size(value)
         if (.not. abs(value(k)) > 0) cycle
         means(line(k)) = means(line(k)) + level(k)
         entries(line(k)) = entries(line(k)) + 1
      end do
      means = means/max(entries, 1)
   end function means

   ! Scales the lines (rows or columns) to Euclidean norms near one, by powers of two.
   pure subroutine equilibrate(line, lines, value)
      integer, intent(in) :: line(:), lines
      real(wp), intent(inout) :: value(:)
      real(wp) :: largest(lines), total(lines)
      integer :: k

      largest = 0
      do k = 1, size(value)
         largest(line(k)) = max(largest(line(k)), abs(value(k)))
      end do
      where (.not. largest > 0) largest = 1
      total = 0
      do k = 1, size(value)
         total(line(k)) = total(line(k)) + (value(k)/largest(line(k)))**2
      end do
      total = largest*sqrt(total)
      do k = 1, size(value)
         if (total(line(k)) > 0) value(k) = value(k)*scale(1.0_wp, -exponent(total(line(k))))
      end do
   end subroutine equilibrate
end module kschur_redundancy
