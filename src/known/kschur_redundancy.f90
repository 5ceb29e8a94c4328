!> Redundant constraints, rows of Cq that are linearly dependent on others to the rounding of their entries, and replacements for
!> rows that are nearly dependent.
!>
!> The scaled rows of Cq are eliminated one after the other in extended precision, each by the pivot rows before it. The remainder
!> is the component of the row that is independent of these: if it is rounding, the row is redundant and dropped. If it is small,
!> the remainder, scaled, takes the place of the row: the null space stays the same, and no digits are lost to the small angle
!> between rows.
module kschur_redundancy
   use kschur_column_order, only: minimum_degree_columns
   use kschur_equilibration, only: equilibrate
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, xp
   use kschur_number_heap, only: number_heap_type
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: nearly_dependent, rounding_of_row, usable_pivot
   implicit none
   private
   public :: count_redundant, dependence_type, find_dependence

   !> Linear dependence of the rows of a matrix C, m x n.
   type :: dependence_type
      !> Which of the m rows are redundant, that is dropped: they depend on the others to rounding.
      logical, allocatable :: is_redundant(:)
      !> The k rows that nearly depend on others, in the order of elimination: each on others and on those before it.
      integer, allocatable :: near(:)
      !> The independent component of each of these, relative to it.
      real(wp), allocatable :: distance(:)
      !> Y, k x m, and Y C: the combinations of rows that replace them, each with its own row and without redundant ones.
      type(csr_matrix_type) :: combinations, rows
   end type dependence_type

   ! A sparse row: its nonzero entries and their columns.
   type :: row_type
      integer, allocatable :: column(:)
      real(xp), allocatable :: value(:)
   end type row_type

contains

   !> Counts the redundant rows of a matrix: their number less the rank.
   subroutine count_redundant(constraints, redundant, error)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(out) :: redundant
      type(error_type), allocatable, intent(out) :: error
      type(dependence_type) :: dependence

      redundant = 0
      call find_dependence(constraints, dependence, error)
      if (.not. allocated(error)) redundant = count(dependence%is_redundant)
   end subroutine count_redundant

   !> Finds the rows of a matrix that depend on others, and combinations that replace those that nearly do.
   subroutine find_dependence(constraints, dependence, error)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      type(dependence_type), intent(out) :: dependence
      type(error_type), allocatable, intent(out) :: error
      ! The scaled matrix, and exponents of the powers of two that scale rows and columns.
      type(csr_matrix_type) :: matrix
      integer, allocatable :: row_exponents(:), column_exponents(:)
      ! Pivot row p, `reduced(p)`, is row_of(p) of the matrix less the multiples `factors_of(p)` of pivot rows before it; its pivot
      ! is its first entry.
      type(row_type), allocatable :: factors_of(:), reduced(:)
      integer, allocatable :: row_of(:)
      integer :: pivots
      ! The pivot row of each column, 0: none; the number of entries of each column.
      integer, allocatable :: pivot_of(:), entries(:)
      ! The current row, as a dense vector, and the positions of its `length` nonzero entries; the multiples of pivot rows that were
      ! subtracted from it, and the combination of rows of the matrix that this makes.
      real(xp), allocatable :: value(:)
      logical, allocatable :: is_nonzero(:)
      integer, allocatable :: nonzeros(:)
      integer :: length
      type(row_type) :: factors, combination
      integer, allocatable :: order(:)
      type(row_type), allocatable :: combinations(:), rows(:)
      ! The largest entries of each row, scaled and as given.
      real(wp), allocatable :: sizes(:), given_sizes(:)
      ! Size of the remainder of a row: in the scaled matrix, and relative to the row in the units of the constraints as given, in
      ! which they are factored later.
      real(xp) :: remainder, distance
      integer :: i, j, m

      m = constraints%rows
      allocate (dependence%is_redundant(m), source=.false.)
      allocate (dependence%near(0), dependence%distance(0), combinations(m), rows(m))
      if (m == 0) return
      call minimum_degree_columns(constraints%columns, constraints%row_start, constraints%column, order, error)
      if (allocated(error)) return
      call start_elimination()
      allocate (sizes, source=matrix%row_maxima())
      allocate (given_sizes, source=constraints%row_maxima())
      do j = 1, m
         i = order(j)
         call eliminate(i)
         associate (columns => nonzeros(:length))
            remainder = maxval([0.0_xp, abs(value(columns))])
            distance = maxval([0.0_xp, scale(abs(value(columns)), -row_exponents(i) - column_exponents(columns))])/ &
               given_sizes(i)
         end associate
         if (.not. (remainder >= nearly_dependent*sizes(i) .and. distance >= nearly_dependent)) then
            ! The terms of the combination, whose rounding the remainder may be, are at least as large as the row.
            dependence%is_redundant(i) = remainder <= rounding_of_row*sizes(i)
            if (.not. dependence%is_redundant(i)) then
               call combine(i)
               dependence%is_redundant(i) = remainder <= rounding_of_row*sum(abs(combination%value)*sizes(combination%column))
            end if
            if (dependence%is_redundant(i)) then
               call drop_entries(huge(1.0_xp))
               cycle
            end if
            dependence%near = [dependence%near, i]
            dependence%distance = [dependence%distance, real(distance, wp)]
            associate (k => size(dependence%near), to_size_one => 1 - exponent(distance))
               combinations(k) = combination
               combinations(k)%value = scale(combination%value, to_size_one + row_exponents(combination%column) - row_exponents(i))
               associate (columns => nonzeros(:length))
                  rows(k) = row_type(columns, scale(value(columns), to_size_one - row_exponents(i) - column_exponents(columns)))
               end associate
            end associate
         end if
         call add_pivot(i)
      end do
      call assemble(combinations(:size(dependence%near)), m, dependence%combinations, error)
      if (.not. allocated(error)) call assemble(rows(:size(dependence%near)), constraints%columns, dependence%rows, error)

   contains

      ! Starts the elimination with the matrix scaled by powers of two. Scaling by the largest entry alone would make all others of
      ! its column vanish, so that two rows that differ in that column only would seem dependent.
      subroutine start_elimination()
         real(wp) :: rows(constraints%rows), columns(constraints%columns)
         integer :: k

         matrix = constraints
         pivots = 0
         length = 0
         rows = 1
         columns = 1
         call equilibrate(matrix, rows, columns, always=.true.)
         row_exponents = exponent(rows) - 1
         column_exponents = exponent(columns) - 1
         allocate (row_of(m), factors_of(m), reduced(m))
         allocate (pivot_of(size(columns)), entries(size(columns)), source=0)
         do k = 1, constraints%nonzeros()
            entries(constraints%column(k)) = entries(constraints%column(k)) + 1
         end do
         allocate (value(size(columns)), source=0.0_xp)
         allocate (is_nonzero(size(columns)), source=.false.)
         allocate (nonzeros(size(columns)))
      end subroutine start_elimination

      ! Eliminates row i: subtracts multiples of the pivot rows, in the order of their pivots, and leaves the remainder as the
      ! current row.
      subroutine eliminate(i)
         integer, intent(in) :: i
         type(number_heap_type) :: pending
         integer :: pivot(pivots)
         real(xp) :: factor(pivots)
         real(xp) :: ratio
         integer :: applied, k, p

         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            if (abs(matrix%value(k)) > 0) call add(pending, matrix%column(k), real(matrix%value(k), xp))
         end do
         applied = 0
         do while (pending%length > 0)
            p = pending%least()
            associate (pivot_row => reduced(p))
               ratio = value(pivot_row%column(1))
               if (.not. abs(ratio) > 0) cycle
               ratio = ratio/pivot_row%value(1)
               do k = 2, size(pivot_row%column)
                  call add(pending, pivot_row%column(k), -ratio*pivot_row%value(k))
               end do
               value(pivot_row%column(1)) = 0
            end associate
            applied = applied + 1
            pivot(applied) = p
            factor(applied) = ratio
         end do
         factors = row_type(pivot(:applied), factor(:applied))
         ! The largest entry was about one.
         call drop_entries(16*epsilon(1.0_xp))
      end subroutine eliminate

      ! Adds to an entry of the current row; a new entry in the column of a pivot schedules this pivot.
      subroutine add(pending, column, term)
         type(number_heap_type), intent(inout) :: pending
         integer, intent(in) :: column
         real(xp), intent(in) :: term

         if (.not. is_nonzero(column)) then
            is_nonzero(column) = .true.
            length = length + 1
            nonzeros(length) = column
            if (pivot_of(column) > 0) call pending%put(pivot_of(column))
         end if
         value(column) = value(column) + term
      end subroutine add

      ! Drops the entries of the current row up to a limit.
      subroutine drop_entries(limit)
         real(xp), intent(in) :: limit
         integer :: columns(length)
         logical :: kept(length)

         columns = nonzeros(:length)
         kept = abs(value(columns)) > limit
         value(pack(columns, .not. kept)) = 0
         is_nonzero(pack(columns, .not. kept)) = .false.
         length = count(kept)
         nonzeros(:length) = pack(columns, kept)
      end subroutine drop_entries

      ! Expresses the remainder, row i less multiples of pivot rows, as a combination of rows of the matrix by back substitution.
      subroutine combine(i)
         integer, intent(in) :: i
         real(xp) :: weight(pivots)
         integer :: p

         weight = 0
         weight(factors%column) = -factors%value
         combination = row_type([i], [1.0_xp])
         ! The latest pivot row first, as each is a combination of those before it.
         do p = pivots, 1, -1
            if (.not. abs(weight(p)) > 0) cycle
            combination%column = [combination%column, row_of(p)]
            combination%value = [combination%value, weight(p)]
            associate (others => factors_of(p)%column)
               weight(others) = weight(others) - weight(p)*factors_of(p)%value
            end associate
         end do
      end subroutine combine

      ! Makes the current row the next pivot row, and chooses its pivot for low fill. Clears the current row.
      subroutine add_pivot(i)
         integer, intent(in) :: i
         real(xp) :: magnitude(length)
         integer :: place

         ! The pivot: among entries of usable size in the units of the constraints the one whose column has the fewest entries,
         ! which keeps fill low (Markowitz).
         associate (columns => nonzeros(:length))
            magnitude = scale(abs(value(columns)), -column_exponents(columns))
            place = minloc(entries(columns), 1, magnitude >= usable_pivot**2*maxval(magnitude))
         end associate
         nonzeros([1, place]) = nonzeros([place, 1])
         pivots = pivots + 1
         associate (p => pivots, columns => nonzeros(:length))
            row_of(p) = i
            factors_of(p) = factors
            reduced(p) = row_type(columns, value(columns))
            pivot_of(columns(1)) = p
         end associate
         call drop_entries(huge(1.0_xp))
      end subroutine add_pivot
   end subroutine find_dependence

   ! Builds a sparse matrix from rows.
   subroutine assemble(rows, columns, matrix, error)
      type(row_type), intent(in) :: rows(:)
      integer, intent(in) :: columns
      type(csr_matrix_type), intent(out) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      call new_csr_from_triplets(matrix, size(rows), columns, [(spread(i, 1, size(rows(i)%column)), i=1, size(rows))], &
         [(rows(i)%column, i=1, size(rows))], [(real(rows(i)%value, wp), i=1, size(rows))], error)
   end subroutine assemble
end module kschur_redundancy
