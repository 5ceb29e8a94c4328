!> Redundant constraints, rows of Cq that are linearly dependent on others to the rounding of their entries, and replacements for
!> rows that are nearly dependent.
!>
!> The scaled rows of Cq are eliminated one after the other in extended precision, each by the pivot rows before it. The remainder
!> is the component of the row that is independent of these: if it is rounding, the row is redundant and dropped. If it is small,
!> the remainder, scaled, takes the place of the row: the null space stays the same, and no digits are lost to the small angle
!> between rows.
module kschur_redundancy
   use kschur_column_order, only: minimum_degree_columns
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

   ! State of the elimination. Pivot row p, `reduced(p)`, is row(p) of the matrix less the multiples `factors(p)` of pivot rows
   ! before it, times magnified(p); its pivot is its first entry.
   type :: elimination_type
      type(csr_matrix_type) :: matrix
      integer :: pivots = 0
      integer, allocatable :: row(:)
      real(xp), allocatable :: magnified(:)
      type(row_type), allocatable :: factors(:), reduced(:)
      ! The pivot row of each column, 0: none; the number of entries of each column.
      integer, allocatable :: pivot_of(:), entries(:)
      ! The current row, as a dense vector, and the positions of its `length` nonzero entries.
      real(xp), allocatable :: value(:)
      logical, allocatable :: is_nonzero(:)
      integer, allocatable :: nonzeros(:)
      integer :: length = 0
   end type elimination_type

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
      type(elimination_type) :: elimination
      type(row_type) :: factors, combination
      integer, allocatable :: order(:), row_exponents(:), column_exponents(:)
      type(row_type), allocatable :: combinations(:), rows(:)
      ! Size of the remainder of a row: in the scaled matrix, and relative to the row as given.
      real(xp) :: remainder, distance
      integer :: i, j, m, power

      m = constraints%rows
      allocate (dependence%is_redundant(m), source=.false.)
      allocate (dependence%near(0), dependence%distance(0), combinations(m), rows(m))
      if (m == 0) return
      call minimum_degree_columns(constraints%columns, constraints%row_start, constraints%column, order, error)
      if (allocated(error)) return
      call start_elimination(elimination, constraints, row_exponents, column_exponents)
      do j = 1, m
         i = order(j)
         call eliminate(elimination, i, factors)
         remainder = largest(elimination)
         distance = distance_of(elimination, constraints, i, row_exponents(i), column_exponents)
         power = 0
         if (min(remainder, distance) < nearly_dependent) then
            ! The terms are at least as large as the row, of size one to two.
            dependence%is_redundant(i) = remainder <= rounding_of_row/2
            if (.not. dependence%is_redundant(i)) then
               combination = combination_of(elimination, i, factors)
               dependence%is_redundant(i) = remainder <= rounding_of_row*magnitude_of_terms(elimination%matrix, combination)
            end if
            if (dependence%is_redundant(i)) then
               call clear_row(elimination)
               cycle
            end if
            if (remainder < nearly_dependent) power = 1 - exponent(remainder)
            dependence%near = [dependence%near, i]
            dependence%distance = [dependence%distance, real(distance, wp)]
            associate (k => size(dependence%near), to_size_one => 1 - exponent(distance))
               combinations(k) = combination
               combinations(k)%value = scale(combination%value, to_size_one + row_exponents(combination%column) - row_exponents(i))
               allocate (rows(k)%column, source=elimination%nonzeros(:elimination%length))
               allocate (rows(k)%value, source=scale(elimination%value(rows(k)%column), &
                  to_size_one - row_exponents(i) - column_exponents(rows(k)%column)))
            end associate
         end if
         call add_pivot(elimination, i, factors, power, column_exponents)
      end do
      call assemble(combinations(:size(dependence%near)), m, dependence%combinations, error)
      if (.not. allocated(error)) call assemble(rows(:size(dependence%near)), constraints%columns, dependence%rows, error)
   end subroutine find_dependence

   ! Starts an elimination with the matrix scaled by powers of two such that the largest entries of rows and columns are about one.
   subroutine start_elimination(elimination, constraints, row_exponents, column_exponents)
      type(elimination_type), intent(out) :: elimination
      type(csr_matrix_type), intent(in) :: constraints
      !> The exponents of the powers.
      integer, allocatable, intent(out) :: row_exponents(:), column_exponents(:)
      integer, allocatable :: row(:)
      integer :: k, m, n

      m = constraints%rows
      n = constraints%columns
      elimination%matrix = constraints
      allocate (row, source=constraints%row_indices())
      call minimize_logarithms(row, m, constraints%column, n, constraints%value, row_exponents, column_exponents)
      associate (value => elimination%matrix%value, column => constraints%column)
         value = scale(value, row_exponents(row) + column_exponents(column))
         call add_powers(column, column_exponents)
         call add_powers(row, row_exponents)
      end associate
      allocate (elimination%row(m), elimination%magnified(m), elimination%factors(m), elimination%reduced(m))
      allocate (elimination%pivot_of(n), elimination%entries(n), source=0)
      do k = 1, size(row)
         elimination%entries(constraints%column(k)) = elimination%entries(constraints%column(k)) + 1
      end do
      allocate (elimination%value(n), source=0.0_xp)
      allocate (elimination%is_nonzero(n), source=.false.)
      allocate (elimination%nonzeros(n))

   contains

      ! Scales each line, row or column, so that its largest entry lies between one and two.
      subroutine add_powers(line, powers)
         integer, intent(in) :: line(:)
         integer, intent(inout) :: powers(:)
         real(wp) :: greatest(size(powers))
         integer :: added(size(powers)), i

         greatest = 0
         do i = 1, size(line)
            greatest(line(i)) = max(greatest(line(i)), abs(elimination%matrix%value(i)))
         end do
         added = 0
         where (greatest > 0) added = 1 - exponent(greatest)
         elimination%matrix%value = scale(elimination%matrix%value, added(line))
         powers = powers + added
      end subroutine add_powers
   end subroutine start_elimination

   ! Eliminates row i: subtracts multiples of the pivot rows, in the order of their pivots, and leaves the remainder in the state.
   subroutine eliminate(elimination, i, factors)
      type(elimination_type), intent(inout) :: elimination
      integer, intent(in) :: i
      !> Numbers of the pivot rows, and the multiple of each that was subtracted.
      type(row_type), intent(out) :: factors
      type(number_heap_type) :: pending
      integer, allocatable :: pivot(:)
      real(xp), allocatable :: factor(:)
      real(xp) :: ratio
      integer :: applied, k, p

      associate (matrix => elimination%matrix)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            if (abs(matrix%value(k)) > 0) call add(matrix%column(k), real(matrix%value(k), xp))
         end do
      end associate
      allocate (pivot(elimination%pivots), factor(elimination%pivots))
      applied = 0
      do while (pending%length > 0)
         p = pending%least()
         associate (reduced => elimination%reduced(p))
            ratio = elimination%value(reduced%column(1))
            if (.not. abs(ratio) > 0) cycle
            ratio = ratio/reduced%value(1)
            do k = 2, size(reduced%column)
               call add(reduced%column(k), -ratio*reduced%value(k))
            end do
            elimination%value(reduced%column(1)) = 0
         end associate
         applied = applied + 1
         pivot(applied) = p
         factor(applied) = ratio
      end do
      allocate (factors%column, source=pivot(:applied))
      allocate (factors%value, source=factor(:applied))
      call drop_rounding(elimination)

   contains

      ! Adds to an entry of the current row; a new entry in the column of a pivot schedules this pivot.
      subroutine add(column, value)
         integer, intent(in) :: column
         real(xp), intent(in) :: value

         if (.not. elimination%is_nonzero(column)) then
            elimination%is_nonzero(column) = .true.
            elimination%length = elimination%length + 1
            elimination%nonzeros(elimination%length) = column
            if (elimination%pivot_of(column) > 0) call pending%put(elimination%pivot_of(column))
         end if
         elimination%value(column) = elimination%value(column) + value
      end subroutine add
   end subroutine eliminate

   ! Drops entries of the current row that are rounding in extended precision, as its largest entry was about one.
   subroutine drop_rounding(elimination)
      type(elimination_type), intent(inout) :: elimination
      real(xp), parameter :: rounding = 16*epsilon(1.0_xp)
      integer :: k, kept

      kept = 0
      do k = 1, elimination%length
         associate (column => elimination%nonzeros(k))
            if (abs(elimination%value(column)) > rounding) then
               kept = kept + 1
               elimination%nonzeros(kept) = column
            else
               elimination%value(column) = 0
               elimination%is_nonzero(column) = .false.
            end if
         end associate
      end do
      elimination%length = kept
   end subroutine drop_rounding

   ! The largest entry of the remainder, 0 if there is none.
   pure real(xp) function largest(elimination)
      type(elimination_type), intent(in) :: elimination

      largest = maxval(abs(elimination%value(elimination%nonzeros(:elimination%length))))
      largest = max(largest, 0.0_xp)
   end function largest

   ! The largest entry of the remainder relative to the largest of row i, both in the units of the constraints as given, in which
   ! they are factored later.
   pure real(xp) function distance_of(elimination, constraints, i, row_exponent, column_exponents) result(distance)
      type(elimination_type), intent(in) :: elimination
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(in) :: i
      !> Exponents of the scaling of row i and of the columns.
      integer, intent(in) :: row_exponent, column_exponents(:)
      integer :: k

      distance = 0
      do k = 1, elimination%length
         associate (column => elimination%nonzeros(k))
            distance = max(distance, scale(abs(elimination%value(column)), -row_exponent - column_exponents(column)))
         end associate
      end do
      distance = distance/maxval(abs(constraints%value(constraints%row_start(i):constraints%row_start(i + 1) - 1)))
   end function distance_of

   ! Sets the current row to zero.
   subroutine clear_row(elimination)
      type(elimination_type), intent(inout) :: elimination

      elimination%value(elimination%nonzeros(:elimination%length)) = 0
      elimination%is_nonzero(elimination%nonzeros(:elimination%length)) = .false.
      elimination%length = 0
   end subroutine clear_row

   ! Expresses the remainder, row i less multiples of pivot rows, as a combination of rows of the matrix by back substitution.
   function combination_of(elimination, i, factors) result(combination)
      type(elimination_type), intent(in) :: elimination
      integer, intent(in) :: i
      type(row_type), intent(in) :: factors
      type(row_type) :: combination
      type(number_heap_type) :: pending
      real(xp) :: weight(elimination%pivots), share
      integer :: k, p

      ! The latest pivot row first, as each is a combination of those before it.
      weight = 0
      do k = 1, size(factors%column)
         weight(factors%column(k)) = -factors%value(k)
         call pending%put(-factors%column(k))
      end do
      combination%column = [i]
      combination%value = [1.0_xp]
      do while (pending%length > 0)
         p = -pending%least()
         share = weight(p)*elimination%magnified(p)
         if (.not. abs(share) > 0) cycle
         combination%column = [combination%column, elimination%row(p)]
         combination%value = [combination%value, share]
         weight(p) = 0
         do k = 1, size(elimination%factors(p)%column)
            associate (q => elimination%factors(p)%column(k))
               weight(q) = weight(q) - share*elimination%factors(p)%value(k)
               call pending%put(-q)
            end associate
         end do
      end do
   end function combination_of

   ! The size of the terms of a combination of rows, the sum of the largest entries of each row times its coefficient: its rounding
   ! is relative to them.
   pure real(xp) function magnitude_of_terms(matrix, combination) result(terms)
      type(csr_matrix_type), intent(in) :: matrix
      type(row_type), intent(in) :: combination
      integer :: k

      terms = 0
      do k = 1, size(combination%column)
         associate (i => combination%column(k))
            terms = terms + abs(combination%value(k))*maxval(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1)))
         end associate
      end do
   end function magnitude_of_terms

   ! Makes the current row, times a power of two, the next pivot row, and chooses its pivot for low fill. Clears the current row.
   subroutine add_pivot(elimination, i, factors, power, column_exponents)
      type(elimination_type), intent(inout) :: elimination
      integer, intent(in) :: i
      type(row_type), intent(inout) :: factors
      !> Exponent of the power of two.
      integer, intent(in) :: power
      !> Exponents of the scaling of columns.
      integer, intent(in) :: column_exponents(:)
      real(xp) :: magnitude(elimination%length), limit
      integer :: k, place

      ! The pivot: among entries of usable size in the units of the constraints the one whose column has the fewest entries, which
      ! keeps fill low (Markowitz).
      associate (columns => elimination%nonzeros(:elimination%length))
         magnitude = scale(abs(elimination%value(columns)), -column_exponents(columns))
      end associate
      limit = usable_pivot**2*maxval(magnitude)
      place = 0
      do k = 1, elimination%length
         if (magnitude(k) < limit) cycle
         if (place == 0) place = k
         if (elimination%entries(elimination%nonzeros(k)) < elimination%entries(elimination%nonzeros(place))) place = k
      end do
      elimination%nonzeros([1, place]) = elimination%nonzeros([place, 1])
      elimination%pivots = elimination%pivots + 1
      associate (p => elimination%pivots, columns => elimination%nonzeros(:elimination%length))
         elimination%row(p) = i
         elimination%magnified(p) = scale(1.0_xp, power)
         call move_alloc(factors%column, elimination%factors(p)%column)
         call move_alloc(factors%value, elimination%factors(p)%value)
         allocate (elimination%reduced(p)%column, source=columns)
         allocate (elimination%reduced(p)%value, source=scale(elimination%value(columns), power))
         elimination%pivot_of(columns(1)) = p
      end associate
      call clear_row(elimination)
   end subroutine add_pivot

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

   ! Computes exponents of powers of two for rows and columns that minimize the sum of squares of the logarithms of the scaled
   ! entries (Curtis, Reid, J. Inst. Maths Applics 10 (1972)), by alternating row and column means. Scaling by the largest entry
   ! alone would make all others of its column vanish, so that two rows that differ in that column only would seem dependent.
   pure subroutine minimize_logarithms(row, rows, column, columns, value, row_exponents, column_exponents)
      integer, intent(in) :: row(:), rows, column(:), columns
      real(wp), intent(in) :: value(:)
      integer, allocatable, intent(out) :: row_exponents(:), column_exponents(:)
      integer, parameter :: sweeps = 20
      real(wp) :: level(size(value)), entries(size(value)), row_mean(rows), column_mean(columns)
      integer :: i

      level = exponent(value)
      entries = merge(1, 0, abs(value) > 0)
      column_mean = 0
      do i = 1, sweeps
         row_mean = line_sums(row, rows, entries*(level - column_mean(column)))/max(line_sums(row, rows, entries), 1.0_wp)
         column_mean = line_sums(column, columns, entries*(level - row_mean(row)))/max(line_sums(column, columns, entries), 1.0_wp)
      end do
      allocate (row_exponents, source=-nint(row_mean))
      allocate (column_exponents, source=-nint(column_mean))
   end subroutine minimize_logarithms

   ! The sum over the entries of each line, row or column.
   pure function line_sums(line, lines, value)
      integer, intent(in) :: line(:), lines
      real(wp), intent(in) :: value(:)
      real(wp) :: line_sums(lines)
      integer :: k

      line_sums = 0
      do k = 1, size(value)
         line_sums(line(k)) = line_sums(line(k)) + value(k)
      end do
   end function line_sums
end module kschur_redundancy
