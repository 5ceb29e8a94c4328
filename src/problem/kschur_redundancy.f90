!> How many constraints follow from the others.
module kschur_redundancy
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   implicit none
   private
   public :: count_redundant

   ! A singular value of the scaled Cq below the root of this is zero.
   real(wp), parameter :: negligible = 1.0e-13_wp
   integer, parameter :: scalings = 3

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
      real(wp), allocatable :: value(:)
      integer, allocatable :: row(:), column(:)
      integer :: m, n, i

      redundant = 0
      m = constraints%rows
      if (m == 0) return
      call number_columns(constraints, column, n)
      allocate (row(size(column)), source=constraints%row_indices())
      allocate (value(size(column)), source=constraints%value)
      do i = 1, scalings
         call equilibrate(column, n, value)
         call equilibrate(row, m, value)
      end do
      call new_csr_from_triplets(matrix, n + m, n + m, [[(i, i=1, n + m)], n + row, column], &
         [[(i, i=1, n + m)], column, n + row], [spread(1.0_wp, 1, n), spread(negligible, 1, m), value, value], error)
      if (allocated(error)) return
      structure%symmetric = .true.
      if (present(counting)) then
         if (allocated(counting)) allocate (solver, source=counting)
      end if
      if (allocated(solver)) then
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) return
         if (present(effort)) call effort%add_factors(solver)
         if (solver%negative_pivots < 0) deallocate (solver)
      end if
      if (.not. allocated(solver)) then
         allocate (mumps_real_type :: solver)
         call solver%factorize(matrix, structure, error)
         if (allocated(error)) return
         if (present(effort)) call effort%add_factors(solver)
      end if
      redundant = m - solver%negative_pivots
   end subroutine count_redundant

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
