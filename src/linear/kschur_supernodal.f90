!> LDL^T without pivoting, left-looking, one supernode after the other: its columns of A are spread out as a dense panel,
!> the descendants in the elimination tree subtract what they make of it, and it is factored.
!> E. G. Ng, B. W. Peyton, SIAM J. Sci. Comput. 14 (1993), doi 10.1137/0914063.
module kschur_supernodal
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_panel, only: enclosure_type, factor_panel, multiply_trapezoid
   use kschur_sparse, only: csr_matrix_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: supernodal_factors_type, eliminate

   !> L and D, in the order and with the supernodes of a symbolic factorisation.
   type :: supernodal_factors_type
      !> From offset(s) on, the columns of supernode s: first, one behind the other, what they have below the diagonal in its
      !> own rows, then a dense block of its other rows.
      integer(long), allocatable :: offset(:)
      real(wp), allocatable :: lower(:)
      real(wp), allocatable :: pivot(:)
   end type supernodal_factors_type

   ! What a factorisation needs besides.
   type :: workspace_type
      ! The lower triangle of A in the order of elimination, by columns.
      integer, allocatable :: start(:), row(:)
      real(wp), allocatable :: value(:)
      ! The row of the panel that each row of the matrix is.
      integer, allocatable :: place(:)
      ! Supernodes that are to update supernode s: head(s), next(head(s)) ...; the first of their rows that is in s.
      integer, allocatable :: head(:), next(:)
      integer(long), allocatable :: reached(:)
      real(wp), allocatable :: panel(:), product(:), scaled(:)
      integer, allocatable :: relative(:)
      ! Of each row of the matrix, as in enclosure_type.
      real(wp), allocatable :: sum(:), terms(:)
   end type workspace_type

contains

   !> Factors a symmetric matrix, of which it reads the lower triangle. Goes no further than a pivot that is zero, or not a
   !> number: later ones are zero. With a `side`, each pivot is moved downwards (-1) or upwards (1) by as much as rounding
   !> may do.
   subroutine eliminate(matrix, symbolic, side, factors, error)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      type(supernodal_factors_type), intent(inout) :: factors
      type(error_type), allocatable, intent(out) :: error
      type(workspace_type) :: work
      type(enclosure_type) :: enclosure
      integer :: s, status

      call set_up(matrix, symbolic, factors, work, status)
      if (status == 0) call set_up_enclosure(symbolic, side, work, enclosure, status)
      if (status /= 0) then
         call new_error(error, error_memory, "no memory for the LDL^T factors")
         return
      end if
      do s = 1, size(symbolic%first) - 1
         associate (first => symbolic%first(s), last => symbolic%first(s + 1) - 1, &
            below => int(symbolic%start(s + 1) - symbolic%start(s)))
            call fill_panel(symbolic, s, last - first + 1 + below, work)
            call subtract_descendants(symbolic, factors, s, last - first + 1 + below, work)
            call enter_rows(symbolic, s, work, enclosure)
            call factor_panel(last - first + 1 + below, last - first + 1, work%panel, factors%pivot(first:last), &
               work%product, work%scaled, enclosure)
            if (.not. all(abs(factors%pivot(first:last)) > 0)) return
            call leave_rows(symbolic, s, work, enclosure)
            call store(last - first + 1, below, work%panel, factors%lower(factors%offset(s):))
            call pass_on(symbolic, s, symbolic%start(s), work)
         end associate
      end do
   end subroutine eliminate

   ! Room, and the entries of A.
   subroutine set_up(matrix, symbolic, factors, work, status)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(inout) :: factors
      type(workspace_type), intent(inout) :: work
      integer, intent(out) :: status
      integer :: nodes, most_rows, most_entries, s

      nodes = size(symbolic%first) - 1
      allocate (factors%offset(nodes + 1), factors%pivot(matrix%rows), work%place(matrix%rows), work%head(nodes), &
         work%next(nodes), work%reached(nodes), stat=status)
      if (status /= 0) return
      factors%offset(1) = 1
      most_rows = 0
      most_entries = 0
      do s = 1, nodes
         associate (columns => symbolic%first(s + 1) - symbolic%first(s), below => symbolic%start(s + 1) - symbolic%start(s))
            factors%offset(s + 1) = factors%offset(s) + (columns*(columns - 1))/2 + columns*below
            most_rows = max(most_rows, columns + int(below))
            most_entries = max(most_entries, columns*(columns + int(below)))
         end associate
      end do
      allocate (factors%lower(factors%offset(nodes + 1) - 1), work%panel(most_entries), work%product(most_entries), &
         work%scaled(widest**2), work%relative(most_rows), stat=status)
      if (status /= 0) return
      factors%pivot = 0
      work%head = 0
      call take_lower_triangle(matrix, symbolic, work, status)
   end subroutine set_up

   ! Sorted by columns, as rows come in ascending order.
   subroutine take_lower_triangle(matrix, symbolic, work, status)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      type(workspace_type), intent(inout) :: work
      integer, intent(out) :: status
      integer :: i, k, p

      allocate (work%start(matrix%rows + 2), source=0, stat=status)
      if (status /= 0) return
      do k = 1, matrix%rows
         do p = matrix%row_start(k), matrix%row_start(k + 1) - 1
            i = symbolic%position(matrix%column(p))
            if (i <= symbolic%position(k)) work%start(i + 2) = work%start(i + 2) + 1
         end do
      end do
      work%start(1:2) = 1
      do k = 3, size(work%start)
         work%start(k) = work%start(k) + work%start(k - 1)
      end do
      allocate (work%row(work%start(size(work%start)) - 1), work%value(work%start(size(work%start)) - 1), stat=status)
      if (status /= 0) return
      do k = 1, matrix%rows
         do p = matrix%row_start(symbolic%order(k)), matrix%row_start(symbolic%order(k) + 1) - 1
            i = symbolic%position(matrix%column(p))
            if (i > k) cycle
            work%row(work%start(i + 1)) = k
            work%value(work%start(i + 1)) = matrix%value(p)
            work%start(i + 1) = work%start(i + 1) + 1
         end do
      end do
   end subroutine take_lower_triangle

   subroutine set_up_enclosure(symbolic, side, work, enclosure, status)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: side
      type(workspace_type), intent(inout) :: work
      type(enclosure_type), intent(out) :: enclosure
      integer, intent(out) :: status
      integer :: n, s, k

      status = 0
      enclosure%side = side
      if (side == 0) return
      n = size(symbolic%order)
      enclosure%underflow = n*tiny(1.0_wp)
      allocate (work%sum(n), work%terms(n), source=0.0_wp, stat=status)
      if (status == 0) allocate (enclosure%sum(size(work%relative)), enclosure%terms(widest), stat=status)
      if (status /= 0) return
      do s = 1, size(symbolic%first) - 1
         associate (first => symbolic%first(s), columns => symbolic%first(s + 1) - symbolic%first(s), &
            row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            work%terms(first:first + columns - 1) = work%terms(first:first + columns - 1) + [(k, k=0, columns - 1)]
            work%terms(row) = work%terms(row) + columns
         end associate
      end do
   end subroutine set_up_enclosure

   ! The columns of A, as so many rows of a dense panel.
   subroutine fill_panel(symbolic, s, rows, work)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s, rows
      type(workspace_type), intent(inout) :: work
      integer :: columns, j, k, p

      associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
         columns = symbolic%first(s + 1) - first
         do k = 1, columns
            work%place(first + k - 1) = k
         end do
         do k = 1, size(row)
            work%place(row(k)) = columns + k
         end do
         work%panel(:rows*columns) = 0
         do j = 1, columns
            do p = work%start(first + j - 1), work%start(first + j) - 1
               k = (j - 1)*rows + work%place(work%row(p))
               work%panel(k) = work%panel(k) + work%value(p)
            end do
         end do
      end associate
   end subroutine fill_panel

   subroutine subtract_descendants(symbolic, factors, s, rows, work)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: s, rows
      type(workspace_type), intent(inout) :: work
      integer(long) :: reached, next
      integer :: k, following, columns, below

      k = work%head(s)
      do while (k /= 0)
         following = work%next(k)
         reached = work%reached(k)
         next = reached
         do while (next < symbolic%start(k + 1))
            if (symbolic%row(next) >= symbolic%first(s + 1)) exit
            next = next + 1
         end do
         columns = symbolic%first(k + 1) - symbolic%first(k)
         below = int(symbolic%start(k + 1) - symbolic%start(k))
         call subtract_one(int(symbolic%start(k + 1) - reached), int(next - reached), columns, below, &
            factors%lower(factors%offset(k) + (columns*(columns - 1))/2 + (reached - symbolic%start(k))), &
            factors%pivot(symbolic%first(k)), symbolic%row(reached))
         call pass_on(symbolic, k, next, work)
         k = following
      end do

   contains

      ! The block `lower` of a descendant, with so many rows, of which the first `wide` are columns of the panel.
      subroutine subtract_one(high, wide, terms, lda, lower, pivot, row)
         integer, intent(in) :: high, wide, terms, lda
         real(wp), intent(in) :: lower(lda, *), pivot(terms)
         integer, intent(in) :: row(high)
         integer :: i, j, at

         do j = 1, wide
            work%scaled((j - 1)*terms + 1:j*terms) = pivot*lower(j, :terms)
         end do
         call multiply_trapezoid(high, wide, terms, lower, lda, work%scaled, work%product)
         work%relative(:high) = work%place(row)
         do j = 1, wide
            at = (work%relative(j) - 1)*rows
            do i = j, high
               work%panel(at + work%relative(i)) = work%panel(at + work%relative(i)) - work%product((j - 1)*high + i)
            end do
         end do
      end subroutine subtract_one
   end subroutine subtract_descendants

   ! Supernode s, whose rows before `reached` are done, will update the one of this row.
   subroutine pass_on(symbolic, s, reached, work)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      integer(long), intent(in) :: reached
      type(workspace_type), intent(inout) :: work

      if (reached >= symbolic%start(s + 1)) return
      work%reached(s) = reached
      associate (target => symbolic%supernode(symbolic%row(reached)))
         work%next(s) = work%head(target)
         work%head(target) = s
      end associate
   end subroutine pass_on

   ! What is known of the rounding in the rows of a supernode, for its panel.
   subroutine enter_rows(symbolic, s, work, enclosure)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(workspace_type), intent(in) :: work
      type(enclosure_type), intent(inout) :: enclosure

      if (enclosure%side == 0) return
      associate (first => symbolic%first(s), last => symbolic%first(s + 1) - 1)
         enclosure%sum = 0
         enclosure%sum(:last - first + 1) = work%sum(first:last)
         enclosure%terms(:last - first + 1) = work%terms(first:last)
      end associate
   end subroutine enter_rows

   ! What its columns add to it in the rows below.
   subroutine leave_rows(symbolic, s, work, enclosure)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s
      type(workspace_type), intent(inout) :: work
      type(enclosure_type), intent(in) :: enclosure

      if (enclosure%side == 0) return
      associate (columns => symbolic%first(s + 1) - symbolic%first(s), &
         row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
         work%sum(row) = work%sum(row) + enclosure%sum(columns + 1:columns + size(row))
      end associate
   end subroutine leave_rows

   pure subroutine store(columns, below, panel, lower)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: panel(columns + below, columns)
      real(wp), intent(out) :: lower(*)
      integer :: j, k

      k = 0
      do j = 1, columns - 1
         lower(k + 1:k + columns - j) = panel(j + 1:columns, j)
         k = k + columns - j
      end do
      do j = 1, columns
         lower(k + 1:k + below) = panel(columns + 1:columns + below, j)
         k = k + below
      end do
   end subroutine store
end module kschur_supernodal
