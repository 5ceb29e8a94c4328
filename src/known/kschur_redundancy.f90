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
      ! The largest entries of each row, scaled and as given.
      real(wp), allocatable :: sizes(:), given_sizes(:)
      ! Size of the remainder of a row: in the scaled matrix, and relative to the row in the units of the constraints as given, in
      ! which they are factored later.
      real(xp) :: remainder, distance
      integer :: i, j, m, power

      m = constraints%rows
      allocate (dependence%is_redundant(m), source=.false.)
      allocate (dependence%near(0), dependence%distance(0), combinations(m), rows(m))
      if (m == 0) return
      call minimum_degree_columns(constraints%columns, constraints%row_start, constraints%column, order, error)
      if (allocated(error)) return
      call start_elimination(elimination, constraints, row_exponents, column_exponents)
      allocate (sizes, source=elimination%matrix%row_maxima())
      allocate (given_sizes, source=constraints%row_maxima())
      do j = 1, m
         i = order(j)
         call eliminate(elimination, i, factors)
         associate (columns => elimination%nonzeros(:elimination%length))
            remainder = maxval([0.0_xp, abs(elimination%value(columns))])
            distance = maxval([0.0_xp, scale(abs(elimination%value(columns)), -row_exponents(i) - column_exponents(columns))])/ &
               given_sizes(i)
         end associate
         power = 0
         if (.not. (remainder >= nearly_dependent*sizes(i) .and. distance >= nearly_dependent)) then
            ! The terms of the combination, whose rounding the remainder may be, are at least as large as the row.
            dependence%is_redundant(i) = remainder <= rounding_of_row*sizes(i)
            if (.not. dependence%is_redundant(i)) then
               combination = combination_of(elimination, i, factors)
               dependence%is_redundant(i) = remainder <= rounding_of_row*sum(abs(combination%value)*sizes(combination%column))
            end if
            if (dependence%is_redundant(i)) then
               call drop_entries(elimination, huge(1.0_xp))
               cycle
            end if
            if (remainder < nearly_dependent*sizes(i)) power = 1 - exponent(remainder)
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

   ! Starts an elimination with the matrix scaled by powers of two. Scaling by the largest entry alone would make all others of its
   ! column vanish, so that two rows that differ in that column only would seem dependent.
   subroutine start_elimination(elimination, constraints, row_exponents, column_exponents)
      type(elimination_type), intent(out) :: elimination
      type(csr_matrix_type), intent(in) :: constraints
      !> The exponents of the powers.
      integer, allocatable, intent(out) :: row_exponents(:), column_exponents(:)
      real(wp) :: rows(constraints%rows), columns(constraints%columns)
      integer :: k

      elimination%matrix = constraints
      rows = 1
      columns = 1
      call equilibrate(elimination%matrix, rows, columns)
      row_exponents = exponent(rows) - 1
      column_exponents = exponent(columns) - 1
      allocate (elimination%row(size(rows)), elimination%magnified(size(rows)), elimination%factors(size(rows)), &
         elimination%reduced(size(rows)))
      allocate (elimination%pivot_of(size(columns)), elimination%entries(size(columns)), source=0)
      do k = 1, constraints%nonzeros()
         elimination%entries(constraints%column(k)) = elimination%entries(constraints%column(k)) + 1
      end do
      allocate (elimination%value(size(columns)), source=0.0_xp)
      allocate (elimination%is_nonzero(size(columns)), source=.false.)
      allocate (elimination%nonzeros(size(columns)))
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
      ! The largest entry was about one.
      call drop_entries(elimination, 16*epsilon(1.0_xp))

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

   ! Drops the entries of the current row up to a limit.
   subroutine drop_entries(elimination, limit)
      type(elimination_type), intent(inout) :: elimination
      real(xp), intent(in) :: limit
      integer :: columns(elimination%length)
      logical :: kept(elimination%length)

      columns = elimination%nonzeros(:elimination%length)
      kept = abs(elimination%value(columns)) > limit
      elimination%value(pack(columns, .not. kept)) = 0
      elimination%is_nonzero(pack(columns, .not. kept)) = .false.
      elimination%length = count(kept)
      elimination%nonzeros(:elimination%length) = pack(columns, kept)
   end subroutine drop_entries

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
      call drop_entries(elimination, huge(1.0_xp))
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
end module kschur_redundancy
