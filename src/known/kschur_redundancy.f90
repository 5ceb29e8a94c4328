!> How many constraints follow from the others, and which.
module kschur_redundancy
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_null_space, only: orthonormalize
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: above_all_rounding
   implicit none
   private
   public :: count_redundant, find_redundant

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
      logical :: last

      redundant = 0
      if (constraints%rows == 0) return
      call bordered(constraints, above_all_rounding, matrix, error)
      if (allocated(error)) return
      structure%symmetric = .true.
      if (present(counting)) then
         if (allocated(counting)) allocate (solver, source=counting)
      end if
      do
         last = .not. allocated(solver)
         if (last) allocate (mumps_real_type :: solver)
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) then
            ! It is nearly singular where constraints are redundant.
            if (last .or. error%code /= error_singular) return
         else
            if (present(effort)) call effort%add_factors(solver)
            if (last .or. solver%negative_pivots >= 0) exit
         end if
         deallocate (solver)
      end do
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
      real(wp), allocatable :: x(:, :), shares(:, :), none(:, :), column(:)
      integer(long) :: state
      integer :: i, j, m, place(2)

      m = constraints%rows
      allocate (follows(m), source=.false.)
      if (redundant == 0) return
      call bordered(constraints, -above_all_rounding, matrix, error)
      if (allocated(error)) return
      structure%symmetric = .true.
      call solver%factorize(matrix, structure, error)
      if (allocated(error)) return
      call effort%add_factors(solver)
      ! Columns of zeros make fresh starts.
      allocate (x(matrix%rows, redundant), none(matrix%rows, 0), source=0.0_wp)
      state = 1
      call orthonormalize(none, m, x, state)
      do i = 1, iterations
         call solver%solve(x, error)
         if (allocated(error)) return
         call orthonormalize(none, m, x, state)
         x(m + 1:, :) = 0
      end do
      call effort%add_solves(solver)
      allocate (shares, source=x(:m, :))
      do i = 1, redundant
         place = maxloc(abs(shares))
         follows(place(1)) = .true.
         column = shares(:, place(2))/shares(place(1), place(2))
         do j = 1, redundant
            shares(:, j) = shares(:, j) - shares(place(1), j)*column
         end do
         ! Rounding must not bring them back.
         shares(place(1), :) = 0
         shares(:, place(2)) = 0
      end do
   end subroutine find_redundant

   ! [tau I, C; C^T, I], C without empty columns and of rows and columns of one size.
   subroutine bordered(constraints, tau, matrix, error)
      type(csr_matrix_type), intent(in) :: constraints
      real(wp), intent(in) :: tau
      type(csr_matrix_type), intent(out) :: matrix
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: value(:)
      integer, allocatable :: row(:), column(:)
      integer :: m, n, i

      m = constraints%rows
      call number_columns(constraints, column, n)
      allocate (row(size(column)), source=constraints%row_indices())
      allocate (value(size(column)), source=constraints%value)
      call center(row, m, column, n, value)
      value = scale(value, -exponent(norms(column, n, value)))
      value = scale(value, -exponent(norms(row, m, value)))
      call new_csr_from_triplets(matrix, m + n, m + n, [[(i, i=1, m + n)], row, m + column], &
         [[(i, i=1, m + n)], m + column, row], [spread(tau, 1, m), spread(1.0_wp, 1, n), value, value], error)
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
      integer, parameter :: sweeps = 20
      real(wp) :: level(size(value)), entries(size(value)), of_rows(rows), of_columns(columns)
      integer :: i

      level = exponent(value)
      entries = merge(1, 0, abs(value) > 0)
      of_columns = 0
      do i = 1, sweeps
         of_rows = sums(row, rows, entries*(level - of_columns(column)))/max(sums(row, rows, entries), 1.0_wp)
         of_columns = sums(column, columns, entries*(level - of_rows(row)))/max(sums(column, columns, entries), 1.0_wp)
      end do
      value = scale(value, -nint(of_rows(row)) - nint(of_columns(column)))
   end subroutine center

   ! The Euclidean norm of the line (row or column) that each entry belongs to; of an empty one 1/2.
   pure function norms(line, lines, value)
      integer, intent(in) :: line(:), lines
      real(wp), intent(in) :: value(:)
      real(wp) :: norms(size(value)), total(lines)

      total = sqrt(sums(line, lines, value**2))
      where (.not. total > 0) total = 0.5_wp
      norms = total(line)
   end function norms

   ! Over the entries of each line.
   pure function sums(line, lines, value)
      integer, intent(in) :: line(:), lines
      real(wp), intent(in) :: value(:)
      real(wp) :: sums(lines)
      integer :: k

      sums = 0
      do k = 1, size(value)
         sums(line(k)) = sums(line(k)) + value(k)
      end do
   end function sums
end module kschur_redundancy
