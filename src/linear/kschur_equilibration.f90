!> Equilibration of the rows and columns of a matrix, each by a factor of its own: a rank decided by the size of residuals is that
!> of the matrix then, and not of its units.
module kschur_equilibration
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: equilibrate

contains

   !> Scales a matrix to D1 A D2 with diagonals of powers of two. First brings the geometric mean of the nonzero entries of
   !> each row and column to one, which spreads a long one-way chain of large entries evenly (Fulkerson, Wolfe, SIAM Review 4
   !> (1962)), then the largest entry (Ruiz, Rutherford Appleton Laboratory, RAL-TR-2001-034). Leaves a matrix as it is whose
   !> rows and columns have largest entries near one.
   pure subroutine equilibrate(matrix, rows, columns, always)
      type(csr_matrix_type), intent(inout) :: matrix
      !> Scale factors of its rows and columns so far, multiplied by those of D1 and D2.
      real(wp), intent(inout) :: rows(:), columns(:)
      !> Also where largest entries are near one, as small ones may be all that tells rows apart. Absent: not.
      logical, optional, intent(in) :: always
      integer, parameter :: most_passes = 100
      ! Of exponents, in which a pass changes nothing that matters.
      real(wp), parameter :: settled = 0.25_wp
      ! Exponents of largest entries that cost no more than two digits.
      real(wp), parameter :: even = 6
      real(wp), dimension(matrix%rows) :: of_row, row_change
      real(wp), dimension(matrix%columns) :: of_column, column_change
      real(wp), allocatable :: level(:)
      logical :: is_even
      integer :: pass

      allocate (level, source=log(max(abs(matrix%value), tiny(1.0_wp)))/log(2.0_wp))
      of_row = 0
      of_column = 0
      is_even = all(abs(largest(of_row, of_column, .true.)) <= even) .and. all(abs(largest(of_row, of_column, .false.)) <= even)
      if (present(always)) is_even = is_even .and. .not. always
      if (is_even) return
      do pass = 1, most_passes
         row_change = means(of_row, of_column, .true.)
         of_row = of_row - row_change
         column_change = means(of_row, of_column, .false.)
         of_column = of_column - column_change
         if (all(abs(column_change) <= settled)) exit
      end do
      do pass = 1, most_passes
         row_change = largest(of_row, of_column, .true.)
         column_change = largest(of_row, of_column, .false.)
         if (all(abs(row_change) <= settled) .and. all(abs(column_change) <= settled)) exit
         of_row = of_row - row_change/2
         of_column = of_column - column_change/2
      end do
      call matrix%scale_entries(scale(1.0_wp, nint(of_row)), scale(1.0_wp, nint(of_column)))
      rows = scale(rows, nint(of_row))
      columns = scale(columns, nint(of_column))

   contains

      ! Mean exponent of the nonzero entries of each row or column; 0 where there are none.
      pure function means(of_row, of_column, by_row)
         real(wp), intent(in) :: of_row(:), of_column(:)
         logical, intent(in) :: by_row
         real(wp) :: means(merge(size(of_row), size(of_column), by_row))
         integer :: entries(merge(size(of_row), size(of_column), by_row)), i, k, line

         means = 0
         entries = 0
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               if (.not. abs(matrix%value(k)) > 0) cycle
               line = merge(i, matrix%column(k), by_row)
               means(line) = means(line) + level(k) + of_row(i) + of_column(matrix%column(k))
               entries(line) = entries(line) + 1
            end do
         end do
         means = means/max(entries, 1)
      end function means

      ! Exponent of the largest entry of each row or column; 0 where there is none.
      pure function largest(of_row, of_column, by_row)
         real(wp), intent(in) :: of_row(:), of_column(:)
         logical, intent(in) :: by_row
         real(wp) :: largest(merge(size(of_row), size(of_column), by_row))
         integer :: i, k, line

         largest = -huge(1.0_wp)
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               if (.not. abs(matrix%value(k)) > 0) cycle
               line = merge(i, matrix%column(k), by_row)
               largest(line) = max(largest(line), level(k) + of_row(i) + of_column(matrix%column(k)))
            end do
         end do
         where (.not. largest > -huge(1.0_wp)) largest = 0
      end function largest
   end subroutine equilibrate
end module kschur_equilibration
