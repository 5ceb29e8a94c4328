!> Which constraints follow from others to the rounding of their entries, and what those that nearly follow say beyond the
!> others.
!>
!> The rows of Cq, scaled, are eliminated one after the other in extended precision, each by those before it. What is left
!> of a row is its part that no row before it has: where that is rounding the row follows from these. Where it is small the
!> row stays, but what is left of it, in units of its own, takes its place: the rows have the same null space then, and none
!> loses digits to the angle between them.
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

   !> How the rows of a matrix C, m x n, depend on each other.
   type :: dependence_type
      !> Which follow from others, m answers: they are left out.
      logical, allocatable :: follows(:)
      !> Those that nearly follow from others, k of m, in an order in which each depends on others and on those before it.
      integer, allocatable :: near(:)
      !> What is left of each beside the others, relative to it.
      real(wp), allocatable :: distance(:)
      !> Y, k x m, and Y C: combinations of rows that take their places. Each has itself, and no row that follows.
      type(csr_matrix_type) :: combinations, rows
   end type dependence_type

   ! So many numbers at most are looked at to choose the rows that are left out.
   integer, parameter :: most_relations = 300000

   ! A sparse row.
   type :: row_type
      integer, allocatable :: column(:)
      real(xp), allocatable :: value(:)
   end type row_type

   ! The elimination on its way. Pivot p is row(p) less `factors(p)` times pivots before it, `magnified(p)` times; it stands
   ! in column(p).
   type :: elimination_type
      type(csr_matrix_type) :: matrix
      integer :: pivots = 0
      integer, allocatable :: row(:)
      real(xp), allocatable :: magnified(:)
      type(row_type), allocatable :: factors(:), reduced(:)
      ! The pivot of each column, 0: none; how many rows have an entry in it.
      integer, allocatable :: pivot_of(:), entries(:)
      ! The row at hand, where it is not zero.
      real(xp), allocatable :: value(:)
      logical, allocatable :: is_there(:)
      integer, allocatable :: there(:)
      integer :: length = 0
   end type elimination_type

contains

   !> The number of rows less the rank.
   subroutine count_redundant(constraints, redundant, error)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(out) :: redundant
      type(error_type), allocatable, intent(out) :: error
      type(dependence_type) :: dependence

      redundant = 0
      call find_dependence(constraints, dependence, error)
      if (.not. allocated(error)) redundant = count(dependence%follows)
   end subroutine count_redundant

   !> Which rows follow from others, or nearly do.
   subroutine find_dependence(constraints, dependence, error)
      !> Cq, m x n, without empty rows.
      type(csr_matrix_type), intent(in) :: constraints
      type(dependence_type), intent(out) :: dependence
      type(error_type), allocatable, intent(out) :: error
      type(elimination_type) :: work
      type(row_type) :: factors, combination
      integer, allocatable :: order(:), of_rows(:), of_columns(:)
      type(row_type), allocatable :: combinations(:), rows(:)
      real(wp), allocatable :: relations(:, :)
      ! What is left of a row: with rows and columns of one size, and relative to it as it stands.
      real(xp) :: left, distance
      integer :: i, j, m, power
      logical :: few

      m = constraints%rows
      allocate (dependence%follows(m), source=.false.)
      allocate (dependence%near(0), dependence%distance(0), combinations(m), rows(m), relations(m, 0))
      few = .true.
      if (m == 0) return
      call minimum_degree_columns(constraints%columns, constraints%row_start, constraints%column, order, error)
      if (allocated(error)) return
      call start(work, constraints, of_rows, of_columns)
      do j = 1, m
         i = order(j)
         call eliminate(work, i, factors)
         left = largest(work)
         distance = distance_of(work, constraints, i, of_rows(i), of_columns)
         power = 0
         if (min(left, distance) < nearly_dependent) then
            ! The sums are as large as the row at least.
            dependence%follows(i) = left <= rounding_of_row/2
            if (.not. dependence%follows(i)) then
               combination = combination_of(work, i, factors)
               dependence%follows(i) = left <= rounding_of_row*terms_of(work%matrix, combination)
            end if
            if (dependence%follows(i)) then
               call clear(work)
               few = few .and. count(dependence%follows)*m <= most_relations
               if (few) call add_relation(combination_of(work, i, factors), m, relations)
               cycle
            end if
            if (left < nearly_dependent) power = 1 - exponent(left)
            dependence%near = [dependence%near, i]
            dependence%distance = [dependence%distance, real(distance, wp)]
            associate (k => size(dependence%near), in_its_place => 1 - exponent(distance))
               combinations(k) = combination
               combinations(k)%value = scale(combination%value, in_its_place + of_rows(combination%column) - of_rows(i))
               allocate (rows(k)%column, source=work%there(:work%length))
               allocate (rows(k)%value, source=scale(work%value(rows(k)%column), &
                  in_its_place - of_rows(i) - of_columns(rows(k)%column)))
            end associate
         end if
         call take_pivot(work, i, factors, power, of_columns)
      end do
      if (size(dependence%near) == 0 .and. few) call choose_left_out(relations, dependence%follows)
      call assemble(combinations(:size(dependence%near)), m, dependence%combinations, error)
      if (.not. allocated(error)) call assemble(rows(:size(dependence%near)), constraints%columns, dependence%rows, error)
   end subroutine find_dependence

   ! Puts a combination of rows that vanishes, m numbers, behind others.
   subroutine add_relation(combination, m, relations)
      type(row_type), intent(in) :: combination
      integer, intent(in) :: m
      real(wp), allocatable, intent(inout) :: relations(:, :)
      real(wp), allocatable :: more(:, :)
      integer :: k

      k = size(relations, 2) + 1
      allocate (more(m, k), source=0.0_wp)
      more(:, :k - 1) = relations
      more(combination%column, k) = real(combination%value, wp)
      call move_alloc(more, relations)
   end subroutine add_relation

   ! Leaves out the rows that have the largest shares in what vanishes, by elimination with complete pivoting: those that stay
   ! depend on each other least.
   subroutine choose_left_out(relations, follows)
      !> Used up.
      real(wp), intent(inout) :: relations(:, :)
      logical, intent(inout) :: follows(:)
      real(wp) :: column(size(follows))
      integer :: i, j, place(2)

      follows = .false.
      do i = 1, size(relations, 2)
         place = maxloc(abs(relations))
         follows(place(1)) = .true.
         column = relations(:, place(2))/relations(place(1), place(2))
         do j = 1, size(relations, 2)
            relations(:, j) = relations(:, j) - relations(place(1), j)*column
         end do
         ! Rounding must not bring them back.
         relations(place(1), :) = 0
         relations(:, place(2)) = 0
      end do
   end subroutine choose_left_out

   ! The matrix with rows and columns of one size: times powers of two.
   subroutine start(work, constraints, of_rows, of_columns)
      type(elimination_type), intent(out) :: work
      type(csr_matrix_type), intent(in) :: constraints
      !> The powers.
      integer, allocatable, intent(out) :: of_rows(:), of_columns(:)
      integer, allocatable :: row(:)
      integer :: k, m, n

      m = constraints%rows
      n = constraints%columns
      work%matrix = constraints
      allocate (row, source=constraints%row_indices())
      call center(row, m, constraints%column, n, constraints%value, of_rows, of_columns)
      associate (value => work%matrix%value, column => constraints%column)
         value = scale(value, of_rows(row) + of_columns(column))
         call add_powers(column, of_columns)
         call add_powers(row, of_rows)
      end associate
      allocate (work%row(m), work%magnified(m), work%factors(m), work%reduced(m))
      allocate (work%pivot_of(n), work%entries(n), source=0)
      do k = 1, size(row)
         work%entries(constraints%column(k)) = work%entries(constraints%column(k)) + 1
      end do
      allocate (work%value(n), source=0.0_xp)
      allocate (work%is_there(n), source=.false.)
      allocate (work%there(n))

   contains

      ! The largest entry of each line becomes one, but for a factor of two.
      subroutine add_powers(line, powers)
         integer, intent(in) :: line(:)
         integer, intent(inout) :: powers(:)
         real(wp) :: greatest(size(powers))
         integer :: added(size(powers)), i

         greatest = 0
         do i = 1, size(line)
            greatest(line(i)) = max(greatest(line(i)), abs(work%matrix%value(i)))
         end do
         added = 0
         where (greatest > 0) added = 1 - exponent(greatest)
         work%matrix%value = scale(work%matrix%value, added(line))
         powers = powers + added
      end subroutine add_powers
   end subroutine start

   ! Row i less what the pivots have of it.
   subroutine eliminate(work, i, factors)
      type(elimination_type), intent(inout) :: work
      integer, intent(in) :: i
      !> Pivots, and how many times each was subtracted.
      type(row_type), intent(out) :: factors
      type(number_heap_type) :: pending
      integer, allocatable :: pivot(:)
      real(xp), allocatable :: factor(:)
      real(xp) :: ratio
      integer :: applied, k, p

      associate (matrix => work%matrix)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            if (abs(matrix%value(k)) > 0) call add(matrix%column(k), real(matrix%value(k), xp))
         end do
      end associate
      allocate (pivot(work%pivots), factor(work%pivots))
      applied = 0
      do while (pending%length > 0)
         p = pending%least()
         associate (reduced => work%reduced(p))
            ratio = work%value(reduced%column(1))
            if (.not. abs(ratio) > 0) cycle
            ratio = ratio/reduced%value(1)
            do k = 2, size(reduced%column)
               call add(reduced%column(k), -ratio*reduced%value(k))
            end do
            work%value(reduced%column(1)) = 0
         end associate
         applied = applied + 1
         pivot(applied) = p
         factor(applied) = ratio
      end do
      allocate (factors%column, source=pivot(:applied))
      allocate (factors%value, source=factor(:applied))
      call drop_rounding(work)

   contains

      subroutine add(column, value)
         integer, intent(in) :: column
         real(xp), intent(in) :: value

         if (.not. work%is_there(column)) then
            work%is_there(column) = .true.
            work%length = work%length + 1
            work%there(work%length) = column
            if (work%pivot_of(column) > 0) call pending%put(work%pivot_of(column))
         end if
         work%value(column) = work%value(column) + value
      end subroutine add
   end subroutine eliminate

   ! Leaves out what sums have cancelled to, of a row whose largest entry was one.
   subroutine drop_rounding(work)
      type(elimination_type), intent(inout) :: work
      real(xp), parameter :: rounding = 16*epsilon(1.0_xp)
      integer :: k, kept

      kept = 0
      do k = 1, work%length
         associate (column => work%there(k))
            if (abs(work%value(column)) > rounding) then
               kept = kept + 1
               work%there(kept) = column
            else
               work%value(column) = 0
               work%is_there(column) = .false.
            end if
         end associate
      end do
      work%length = kept
   end subroutine drop_rounding

   pure real(xp) function largest(work)
      type(elimination_type), intent(in) :: work

      largest = maxval(abs(work%value(work%there(:work%length))))
      largest = max(largest, 0.0_xp)
   end function largest

   ! What is left of row i relative to the row, in the units of the constraints: in these it is factored.
   pure real(xp) function distance_of(work, constraints, i, of_row, of_columns) result(distance)
      type(elimination_type), intent(in) :: work
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(in) :: i
      !> Powers of two by which it was scaled.
      integer, intent(in) :: of_row, of_columns(:)
      integer :: k

      distance = 0
      do k = 1, work%length
         associate (column => work%there(k))
            distance = max(distance, scale(abs(work%value(column)), -of_row - of_columns(column)))
         end associate
      end do
      distance = distance/maxval(abs(constraints%value(constraints%row_start(i):constraints%row_start(i + 1) - 1)))
   end function distance_of

   subroutine clear(work)
      type(elimination_type), intent(inout) :: work

      work%value(work%there(:work%length)) = 0
      work%is_there(work%there(:work%length)) = .false.
      work%length = 0
   end subroutine clear

   ! The combination of rows of the matrix that the row at hand is, row i less so many times pivots.
   function combination_of(work, i, factors) result(combination)
      type(elimination_type), intent(in) :: work
      integer, intent(in) :: i
      type(row_type), intent(in) :: factors
      type(row_type) :: combination
      type(number_heap_type) :: pending
      real(xp) :: weight(work%pivots), share
      integer :: k, p

      ! The latest pivot first: each is a combination of those before it.
      weight = 0
      do k = 1, size(factors%column)
         weight(factors%column(k)) = -factors%value(k)
         call pending%put(-factors%column(k))
      end do
      combination%column = [i]
      combination%value = [1.0_xp]
      do while (pending%length > 0)
         p = -pending%least()
         share = weight(p)*work%magnified(p)
         if (.not. abs(share) > 0) cycle
         combination%column = [combination%column, work%row(p)]
         combination%value = [combination%value, share]
         weight(p) = 0
         do k = 1, size(work%factors(p)%column)
            associate (q => work%factors(p)%column(k))
               weight(q) = weight(q) - share*work%factors(p)%value(k)
               call pending%put(-q)
            end associate
         end do
      end do
   end function combination_of

   ! How large the sums are in which a combination of rows cancels: their rounding is that of their largest entries.
   pure real(xp) function terms_of(matrix, combination) result(terms)
      type(csr_matrix_type), intent(in) :: matrix
      type(row_type), intent(in) :: combination
      integer :: k

      terms = 0
      do k = 1, size(combination%column)
         associate (i => combination%column(k))
            terms = terms + abs(combination%value(k))*maxval(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1)))
         end associate
      end do
   end function terms_of

   ! Makes the row at hand, magnified, a pivot.
   subroutine take_pivot(work, i, factors, power, of_columns)
      type(elimination_type), intent(inout) :: work
      integer, intent(in) :: i
      type(row_type), intent(inout) :: factors
      !> Of two.
      integer, intent(in) :: power
      !> Powers by which columns were scaled.
      integer, intent(in) :: of_columns(:)
      real(xp) :: size_there(work%length), limit
      integer :: k, place

      ! Among entries that are large in units of the constraints that of the shortest column: few rows are changed by it.
      size_there = [(scale(abs(work%value(work%there(k))), -of_columns(work%there(k))), k=1, work%length)]
      limit = usable_pivot**2*maxval(size_there)
      place = 0
      do k = 1, work%length
         if (size_there(k) < limit) cycle
         if (place == 0) place = k
         if (work%entries(work%there(k)) < work%entries(work%there(place))) place = k
      end do
      work%there([1, place]) = work%there([place, 1])
      work%pivots = work%pivots + 1
      associate (p => work%pivots, columns => work%there(:work%length))
         work%row(p) = i
         work%magnified(p) = scale(1.0_xp, power)
         call move_alloc(factors%column, work%factors(p)%column)
         call move_alloc(factors%value, work%factors(p)%value)
         allocate (work%reduced(p)%column, source=columns)
         allocate (work%reduced(p)%value, source=scale(work%value(columns), power))
         work%pivot_of(columns(1)) = p
      end associate
      call clear(work)
   end subroutine take_pivot

   subroutine assemble(rows, columns, matrix, error)
      type(row_type), intent(in) :: rows(:)
      integer, intent(in) :: columns
      type(csr_matrix_type), intent(out) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: i, k

      allocate (row(sum([(size(rows(i)%column), i=1, size(rows))])))
      allocate (column(size(row)), value(size(row)))
      k = 0
      do i = 1, size(rows)
         associate (length => size(rows(i)%column))
            row(k + 1:k + length) = i
            column(k + 1:k + length) = rows(i)%column
            value(k + 1:k + length) = real(rows(i)%value, wp)
            k = k + length
         end associate
      end do
      call new_csr_from_triplets(matrix, size(rows), columns, row, column, value, error)
   end subroutine assemble

   ! Powers of two for rows and columns that make the squares of the logarithms of all entries small (Curtis, Reid,
   ! J. Inst. Maths Applics 10 (1972)): one large entry must not make another row of its column look like a third.
   pure subroutine center(row, rows, column, columns, value, of_rows, of_columns)
      integer, intent(in) :: row(:), rows, column(:), columns
      real(wp), intent(in) :: value(:)
      integer, allocatable, intent(out) :: of_rows(:), of_columns(:)
      integer, parameter :: sweeps = 20
      real(wp) :: level(size(value)), entries(size(value)), row_mean(rows), column_mean(columns)
      integer :: i

      level = exponent(value)
      entries = merge(1, 0, abs(value) > 0)
      column_mean = 0
      do i = 1, sweeps
         row_mean = sums(row, rows, entries*(level - column_mean(column)))/max(sums(row, rows, entries), 1.0_wp)
         column_mean = sums(column, columns, entries*(level - row_mean(row)))/max(sums(column, columns, entries), 1.0_wp)
      end do
      allocate (of_rows, source=-nint(row_mean))
      allocate (of_columns, source=-nint(column_mean))
   end subroutine center

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
