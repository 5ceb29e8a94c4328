!> Elimination of clamped and tied unknowns by short rows of the constraints.
module kschur_elimination
   use kschur_confinement, only: confinement_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: twelve_digits
   implicit none
   private
   public :: eliminate, ties_type

   ! Largest number of slaves of a master; further ties stay multipliers, to limit fill in T^T K T.
   integer, parameter :: max_slaves = 64

   !> Eliminations from m constraints in n unknowns.
   type :: ties_type
      !> Number of eliminated constraints, each with one unknown.
      integer :: eliminated = 0
      !> Number of redundant constraints, which were dropped.
      integer :: redundant = 0
      !> Ties: phi(i) = ratio(i) phi(parent(i)); parent(i) = i for a master, 0 for a clamped unknown.
      integer, allocatable :: parent(:)
      real(wp), allocatable :: ratio(:)
      !> Bound of the relative error of each ratio, in units of rounding.
      real(wp), allocatable :: noise(:)
      !> Eliminated rows in order, with the unknown each eliminated and its coefficient.
      integer, allocatable :: row(:), unknown(:)
      real(wp), allocatable :: pivot(:)
      !> Remaining rows.
      integer, allocatable :: kept(:)
      !> Row operations before, and what they confine: the rows are then those of its constraints. Not allocated: none.
      type(confinement_type), allocatable :: confinement
   contains
      !> phi(i) = factor phi(master).
      procedure :: find_master
   end type ties_type

   ! State of the elimination.
   type :: work_type
      ! Entries of master i are first(i), next(first(i)) ...; entry k is in row(k).
      integer, allocatable :: first(:), next(:), row(:)
      ! Stack of rows to be examined; for other rows, the number of eliminations before they can be short.
      integer, allocatable :: stack(:), countdown(:)
      integer :: on_stack = 0
      logical, allocatable :: settled(:)
      ! Current row with `length` masters; for each master its coefficient, and the sum of magnitudes and errors of its terms.
      integer :: length = 0
      integer, allocatable :: masters(:)
      real(wp), allocatable :: values(:), errors(:), total(:), weight(:)
      ! Number of slaves of each master.
      integer, allocatable :: slaves(:)
   end type work_type

contains

   !> Eliminates all short rows, in time linear in the number of entries.
   subroutine eliminate(constraints, short_rows, ties, rest, error)
      type(csr_matrix_type), intent(in) :: constraints
      !> False: eliminates nothing.
      logical, intent(in) :: short_rows
      type(ties_type), intent(inout) :: ties
      !> The rows that stay, m' x n, with entries of masters only.
      type(csr_matrix_type), intent(out) :: rest
      type(error_type), allocatable, intent(out) :: error
      type(work_type) :: work
      integer :: i, m, n, r

      m = constraints%rows
      n = constraints%columns
      allocate (ties%parent(0:n), source=[(i, i=0, n)])
      allocate (ties%ratio(n), source=1.0_wp)
      allocate (ties%noise(n), source=0.0_wp)
      allocate (ties%row(m), ties%unknown(m), ties%pivot(m))
      call start(work, constraints)
      if (.not. short_rows) work%on_stack = 0
      do while (work%on_stack > 0)
         r = work%stack(work%on_stack)
         work%on_stack = work%on_stack - 1
         call eliminate_with(work, constraints, ties, r)
      end do
      allocate (ties%kept(count(.not. work%settled)), source=pack([(i, i=1, m)], .not. work%settled))
      call rewrite(work, constraints, ties, rest, error)
   end subroutine eliminate

   ! Lists the entries of each column, and puts all rows on the stack, short ones on top.
   subroutine start(work, constraints)
      type(work_type), intent(inout) :: work
      type(csr_matrix_type), intent(in) :: constraints
      logical :: short(constraints%rows)
      integer :: i, k, m, n

      m = constraints%rows
      n = constraints%columns
      allocate (work%slaves(0:n), work%first(0:n), source=0)
      allocate (work%row(constraints%nonzeros()), source=constraints%row_indices())
      allocate (work%next(constraints%nonzeros()))
      do k = constraints%nonzeros(), 1, -1
         work%next(k) = work%first(constraints%column(k))
         work%first(constraints%column(k)) = k
      end do
      allocate (work%masters(n), work%values(n), work%errors(n))
      allocate (work%total(n), work%weight(n), source=0.0_wp)
      allocate (work%countdown(m), source=0)
      allocate (work%settled(m), source=.false.)
      ! Short rows are on top of the stack.
      short = constraints%row_start(m + 1:2:-1) - constraints%row_start(m:1:-1) <= 2
      allocate (work%stack(m), source=[pack([(i, i=m, 1, -1)], .not. short), pack([(i, i=m, 1, -1)], short)])
      work%on_stack = m
   end subroutine start

   ! Eliminates an unknown by row r if the row couples at most two masters: clamps it or ties it. A row without any is redundant.
   subroutine eliminate_with(work, constraints, ties, r)
      type(work_type), intent(inout) :: work
      type(csr_matrix_type), intent(in) :: constraints
      type(ties_type), intent(inout) :: ties
      integer, intent(in) :: r
      integer :: slave

      call substitute(work, constraints, ties, r)
      ! An elimination shortens a row by two entries at most: one is removed, and the one it is added to may cancel.
      work%countdown(r) = max(1, (work%length - 1)/2)
      associate (length => work%length, masters => work%masters, values => work%values, slaves => work%slaves)
         if (length == 0) then
            ties%redundant = ties%redundant + 1
            work%settled(r) = .true.
         else if (length == 1) then
            call tie(work, ties, r, 1, 0, 0.0_wp)
         else if (length == 2 .and. sum(slaves(masters(:2))) < max_slaves) then
            slave = 1
            associate (a => abs(values(:2)))
               if (a(2) > a(1) .or. (.not. a(1) > a(2) .and. slaves(masters(1)) > slaves(masters(2)))) slave = 2
            end associate
            call tie(work, ties, r, slave, masters(3 - slave), -values(3 - slave)/values(slave))
         end if
      end associate
   end subroutine eliminate_with

   ! Makes row r the current row: expresses it in masters, and drops entries that cancel.
   subroutine substitute(work, constraints, ties, r)
      type(work_type), intent(inout) :: work
      type(csr_matrix_type), intent(in) :: constraints
      type(ties_type), intent(in) :: ties
      integer, intent(in) :: r
      real(wp) :: factor, noise, term
      integer :: found, k, master

      associate (masters => work%masters, total => work%total, weight => work%weight)
         found = 0
         do k = constraints%row_start(r), constraints%row_start(r + 1) - 1
            call ties%find_master(constraints%column(k), master, factor, noise)
            term = factor*constraints%value(k)
            if (.not. abs(term) > 0) cycle
            if (.not. weight(master) > 0) then
               found = found + 1
               masters(found) = master
            end if
            total(master) = total(master) + term
            weight(master) = weight(master) + (1 + noise)*abs(term)
         end do

         work%length = 0
         do k = 1, found
            master = masters(k)
            ! A remainder at the rounding of twelve-digit input means a duplicate constraint, not a clamp.
            if (abs(total(master)) > twelve_digits*weight(master)) then
               work%length = work%length + 1
               masters(work%length) = master
               work%values(work%length) = total(master)
               work%errors(work%length) = weight(master)/abs(total(master))
            end if
            total(master) = 0
            weight(master) = 0
         end do
      end associate
   end subroutine substitute

   ! Ties entry j of the current row r to a master, or clamps it (master 0, ratio 0); puts affected rows on the stack.
   subroutine tie(work, ties, r, j, master, ratio)
      type(work_type), intent(inout) :: work
      type(ties_type), intent(inout) :: ties
      integer, intent(in) :: r, j, master
      real(wp), intent(in) :: ratio
      integer :: slave, k, last

      slave = work%masters(j)
      ties%eliminated = ties%eliminated + 1
      ties%row(ties%eliminated) = r
      ties%unknown(ties%eliminated) = slave
      ties%pivot(ties%eliminated) = work%values(j)
      ties%parent(slave) = master
      ties%ratio(slave) = ratio
      ties%noise(slave) = sum(work%errors(:work%length))
      work%slaves(master) = work%slaves(master) + work%slaves(slave) + 1
      work%settled(r) = .true.
      k = work%first(slave)
      last = k
      do while (k > 0)
         last = k
         associate (row => work%row(k))
            work%countdown(row) = work%countdown(row) - 1
            if (work%countdown(row) == 0 .and. .not. work%settled(row)) then
               work%on_stack = work%on_stack + 1
               work%stack(work%on_stack) = row
            end if
         end associate
         k = work%next(k)
      end do
      work%next(last) = work%first(master)
      work%first(master) = work%first(slave)
   end subroutine tie

   ! Forms the matrix of the remaining rows, expressed in masters.
   subroutine rewrite(work, constraints, ties, rest, error)
      type(work_type), intent(inout) :: work
      type(csr_matrix_type), intent(in) :: constraints
      type(ties_type), intent(in) :: ties
      type(csr_matrix_type), intent(out) :: rest
      type(error_type), allocatable, intent(out) :: error
      integer :: row(size(work%next)), column(size(work%next)), i, entries
      real(wp) :: value(size(work%next))

      entries = 0
      do i = 1, size(ties%kept)
         call substitute(work, constraints, ties, ties%kept(i))
         associate (length => work%length)
            row(entries + 1:entries + length) = i
            column(entries + 1:entries + length) = work%masters(:length)
            value(entries + 1:entries + length) = work%values(:length)
            entries = entries + length
         end associate
      end do
      call new_csr_from_triplets(rest, size(ties%kept), constraints%columns, row(:entries), column(:entries), &
         value(:entries), error)
   end subroutine rewrite

   pure subroutine find_master(self, i, master, factor, noise)
      class(ties_type), intent(in) :: self
      integer, intent(in) :: i
      !> Both are 0 if unknown i is clamped.
      integer, intent(out) :: master
      !> A product of at most max_slaves + 1 ratios.
      real(wp), intent(out) :: factor
      !> Bound of its relative error, in units of rounding.
      real(wp), intent(out) :: noise

      master = i
      factor = 1
      noise = 0
      do while (self%parent(master) /= master)
         factor = factor*self%ratio(master)
         noise = noise + self%noise(master)
         master = self%parent(master)
      end do
   end subroutine find_master
end module kschur_elimination
