!> Forward and backward substitution with supernodal factors L D L^T, for one right-hand side or a block of four; reads L once
!> for each.
module kschur_substitution
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: supernodal_factors_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemv
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: substitute, sides_at_once

   ! Sides that instructions work on at once.
   integer, parameter :: lanes = 4

   ! Entries of a block below which a loop is faster than a call of BLAS.
   integer, parameter :: small = 600

   ! Update that a part of the tree subtracts from the rows above it.
   type :: update_type
      real(wp), allocatable :: values(:, :)
   end type update_type

   ! Work arrays of a thread: rows of a supernode; update of the rows above the current part, zero between parts.
   type :: workspace_type
      real(wp), allocatable :: rows(:, :), above(:, :)
   end type workspace_type

   ! As `forward_one` and `backward_one`, for several sides, four or eight.
   interface
      pure subroutine forward_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_forward_sides")
         import :: c_double, c_int
         integer(c_int), value :: sides, columns, below
         real(c_double), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(out) :: rows(sides, below)
      end subroutine forward_sides

      pure subroutine backward_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_backward_sides")
         import :: c_double, c_int
         integer(c_int), value :: sides, columns, below
         real(c_double), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(in) :: rows(sides, below)
      end subroutine backward_sides
   end interface

contains

   !> How many right-hand sides share one pass over L, where so many are left: four take not much longer than one, and where
   !> factors are large eight not much longer than four.
   pure integer function sides_at_once(left) result(sides)
      integer, intent(in) :: left

      sides = 1
      if (left > 1) sides = lanes
      if (left > lanes + 1) sides = 2*lanes
   end function sides_at_once

   !> y := L^{-T} D^{-1} L^{-1} y, in elimination order; y has the right-hand sides of an unknown side by side, one or a block.
   !> Independent parts of the tree run in parallel; their updates are added in fixed order.
   subroutine substitute(symbolic, subtrees, factors, y, error, common)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      !> The supernodes that several processes share, the last part of `subtrees`: collective then. Each of their right-hand sides
      !> stands in one process, and is zero in the others.
      class(common_supernodes_type), optional, intent(in) :: common
      type(update_type), allocatable :: updates(:)
      type(workspace_type), allocatable :: work(:)
      ! Dependencies: forward, a part follows its children; backward, its parent.
      logical :: turn(size(subtrees%root) + 1), failed
      integer :: own, t, i, status

      allocate (updates(size(subtrees%root)), work(team_size()), stat=status)
      do i = 1, team_size()
         if (status == 0) allocate (work(i)%rows(size(y, 1), symbolic%most_rows()), stat=status)
         if (status == 0) allocate (work(i)%above(size(y, 1), subtrees%columns), source=0.0_wp, stat=status)
      end do
      failed = status /= 0
      own = size(updates)
      if (present(common)) then
         failed = common%any_of(failed)
         own = count(subtrees%root < common%first)
      end if
      if (failed) then
         call new_error(error, error_memory, "no memory for the right-hand sides")
         return
      end if
      !$omp parallel num_threads(size(work)) if (size(updates) > 1)
      !$omp master
      do i = 1, size(updates)
         t = subtrees%order(i)
         if (t > own) cycle
         !$omp task firstprivate(t) depend(out: turn(t)) depend(in: turn(subtrees%above(t)))
         call adopt_updates(symbolic, subtrees, t, y, work(thread_number()), updates)
         call forward_part(symbolic, subtrees, factors, t, y, work(thread_number()), updates)
         !$omp end task
      end do
      if (present(common)) then
         !$omp taskwait
         call solve_common(symbolic, subtrees, factors, own + 1, y, work(1), updates, common)
      end if
      do t = own, 1, -1
         !$omp task firstprivate(t) depend(out: turn(t)) depend(in: turn(subtrees%above(t)))
         call backward_part(symbolic, subtrees, factors, t, y, work(thread_number())%rows)
         !$omp end task
      end do
      !$omp end master
      !$omp end parallel
   end subroutine substitute

   ! Solves in part t, the common supernodes, below whose diagonal blocks each process has some rows of the factors. What it
   ! subtracts from the columns of a supernode is the sum of what all do; as T^{-T} is linear, so is the solution upwards.
   subroutine solve_common(symbolic, subtrees, factors, t, y, work, updates, common)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(workspace_type), intent(inout) :: work
      type(update_type), intent(inout) :: updates(:)
      class(common_supernodes_type), intent(in) :: common
      integer :: s

      if (t > size(updates)) return
      call adopt_updates(symbolic, subtrees, t, y, work, updates)
      associate (first => symbolic%first)
         do s = common%first, size(first) - 1
            call common%sum_rows(y(:, first(s):first(s + 1) - 1))
            call forward(symbolic, factors, s, y, work%rows)
            call subtract(symbolic, subtrees, s, size(y, 2), work%rows, y, work%above)
         end do
         do s = size(first) - 1, common%first, -1
            associate (last => first(s + 1) - 1)
               if (common%leads) then
                  call divide(factors%pivot(first(s):last), y(:, first(s):last))
               else
                  y(:, first(s):last) = 0
               end if
               call backward(symbolic, factors, s, y, work%rows)
               call common%sum_rows(y(:, first(s):last))
            end associate
         end do
      end associate
   end subroutine solve_common

   ! Adds the updates of the children of part t.
   subroutine adopt_updates(symbolic, subtrees, t, y, work, updates)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(workspace_type), intent(inout) :: work
      type(update_type), intent(inout) :: updates(:)
      integer :: last, c

      last = symbolic%first(subtrees%root(t) + 1) - 1
      do c = 1, t - 1
         if (subtrees%above(c) == t) call add_update(symbolic, subtrees, c, last, updates(c)%values, y, work%above)
      end do
   end subroutine adopt_updates

   ! Forward substitution in a part, after the updates of its children.
   subroutine forward_part(symbolic, subtrees, factors, t, y, work, updates)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(workspace_type), intent(inout) :: work
      type(update_type), intent(inout) :: updates(:)
      integer :: last, s

      last = symbolic%first(subtrees%root(t) + 1) - 1
      do s = subtrees%first(t), subtrees%root(t)
         call forward(symbolic, factors, s, y, work%rows)
         call subtract(symbolic, subtrees, s, last, work%rows, y, work%above)
      end do
      call store_update(symbolic, subtrees, t, work%above, updates(t)%values)
   end subroutine forward_part

   ! Moves the update of a part from the work array to `values`, ordered by the rows below its roots, which contain all rows that
   ! it reaches; two roots may share a row.
   subroutine store_update(symbolic, subtrees, t, above, values)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: above(:, :)
      real(wp), allocatable, intent(out) :: values(:, :)
      integer :: s, k, rows

      rows = 0
      do s = subtrees%first(t), subtrees%root(t)
         if (is_root(symbolic, subtrees, s, t)) rows = rows + rows_below(symbolic, s)
      end do
      allocate (values(size(above, 1), rows))
      k = 0
      do s = subtrees%first(t), subtrees%root(t)
         if (.not. is_root(symbolic, subtrees, s, t)) cycle
         rows = rows_below(symbolic, s)
         associate (place => subtrees%place(symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1)))
            values(:, k + 1:k + rows) = above(:, place)
            above(:, place) = 0
         end associate
         k = k + rows
      end do
   end subroutine store_update

   ! Subtracts the update of child part c from the rows of this part, and passes the rest on to the parts above.
   subroutine add_update(symbolic, subtrees, c, last, values, y, above)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: c, last
      real(wp), allocatable, intent(inout) :: values(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :), above(:, :)
      integer :: s, k

      k = 0
      do s = subtrees%first(c), subtrees%root(c)
         if (.not. is_root(symbolic, subtrees, s, c)) cycle
         call subtract(symbolic, subtrees, s, last, values(:, k + 1:k + rows_below(symbolic, s)), y, above)
         k = k + rows_below(symbolic, s)
      end do
      deallocate (values)
   end subroutine add_update

   ! Whether the parent of supernode s is outside part t.
   pure logical function is_root(symbolic, subtrees, s, t)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: s, t

      is_root = rows_below(symbolic, s) > 0
      if (is_root) is_root = symbolic%supernode(symbolic%row(symbolic%start(s))) > subtrees%root(t)
   end function is_root

   ! Number of rows of supernode s below its diagonal block.
   pure integer function rows_below(symbolic, s)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s

      rows_below = int(symbolic%start(s + 1) - symbolic%start(s))
   end function rows_below

   ! Subtracts values in the rows of supernode s: from y up to row `last`, from `above` beyond.
   pure subroutine subtract(symbolic, subtrees, s, last, values, y, above)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      integer, intent(in) :: s, last
      real(wp), contiguous, intent(in) :: values(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :), above(:, :)
      integer :: i, k, inside

      associate (row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1), place => subtrees%place)
         do inside = size(row), 1, -1
            if (row(inside) <= last) exit
         end do
         if (size(y, 1) == 1) then
            do i = 1, inside
               y(1, row(i)) = y(1, row(i)) - values(1, i)
            end do
            do i = inside + 1, size(row)
               above(1, place(row(i))) = above(1, place(row(i))) + values(1, i)
            end do
         else
            do i = 1, inside
               do k = 1, size(y, 1), lanes
                  y(k:k + lanes - 1, row(i)) = y(k:k + lanes - 1, row(i)) - values(k:k + lanes - 1, i)
               end do
            end do
            do i = inside + 1, size(row)
               do k = 1, size(y, 1), lanes
                  above(k:k + lanes - 1, place(row(i))) = above(k:k + lanes - 1, place(row(i))) + values(k:k + lanes - 1, i)
               end do
            end do
         end if
      end associate
   end subroutine subtract

   ! Division by D and backward substitution in a part.
   subroutine backward_part(symbolic, subtrees, factors, t, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      integer :: s

      associate (first => symbolic%first(subtrees%first(t)), last => symbolic%first(subtrees%root(t) + 1) - 1)
         call divide(factors%pivot(first:last), y(:, first:last))
      end associate
      do s = subtrees%root(t), subtrees%first(t), -1
         call backward(symbolic, factors, s, y, rows)
      end do
   end subroutine backward_part

   ! y := D^{-1} y.
   pure subroutine divide(pivot, y)
      real(wp), intent(in) :: pivot(:)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i

      if (size(y, 1) == 1) then
         y(1, :) = y(1, :)/pivot
      else
         do i = 1, size(pivot)
            y(:, i) = y(:, i)/pivot(i)
         end do
      end if
   end subroutine divide

   ! Forward substitution in one supernode; `rows` is to be subtracted below it.
   subroutine forward(symbolic, factors, s, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: s
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)

      associate (first => symbolic%first(s), below => int(symbolic%start(s + 1) - symbolic%start(s)), &
         columns => symbolic%first(s + 1) - symbolic%first(s))
         if (size(y, 1) == 1) then
            call forward_one(columns, below, factors%lower(factors%offset(s):), y(:, first:), rows)
         else
            call forward_sides(size(y, 1), columns, below, factors%lower(factors%offset(s):), y(:, first:), rows)
         end if
      end associate
   end subroutine forward

   ! Backward substitution in one supernode.
   subroutine backward(symbolic, factors, s, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: s
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      integer :: i, k

      associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1), &
         columns => symbolic%first(s + 1) - symbolic%first(s))
         if (size(y, 1) == 1) then
            do i = 1, size(row)
               rows(1, i) = y(1, row(i))
            end do
            call backward_one(columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
         else
            do i = 1, size(row)
               do k = 1, size(y, 1), lanes
                  rows(k:k + lanes - 1, i) = y(k:k + lanes - 1, row(i))
               end do
            end do
            call backward_sides(size(y, 1), columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
         end if
      end associate
   end subroutine backward

   ! x := T^{-1} x, rows := B x, T the triangle and B the block of a supernode.
   subroutine forward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(columns), rows(below)
      integer :: j, k

      k = 0
      do j = 1, columns - 1
         x(j + 1:columns) = x(j + 1:columns) - lower(k + 1:k + columns - j)*x(j)
         k = k + columns - j
      end do
      if (columns*below > small) then
         call dgemv("N", below, columns, 1.0_wp, lower(k + 1), below, x, 1, 0.0_wp, rows, 1)
      else
         call multiply(columns, below, lower(k + 1), x, rows)
      end if
   end subroutine forward_one

   ! rows := B x.
   pure subroutine multiply(columns, below, b, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: b(below, columns), x(columns)
      real(wp), intent(out) :: rows(below)
      integer :: j

      rows = 0
      do j = 1, columns - 3, 4
         rows = rows + (b(:, j)*x(j) + b(:, j + 1)*x(j + 1)) + (b(:, j + 2)*x(j + 2) + b(:, j + 3)*x(j + 3))
      end do
      do j = j, columns
         rows = rows + b(:, j)*x(j)
      end do
   end subroutine multiply

   ! x := T^{-T} (x - B^T rows).
   subroutine backward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(columns)
      real(wp), intent(in) :: rows(below)
      real(wp) :: sums(4)
      integer :: i, j, k

      k = (columns*(columns - 1))/2
      if (columns*below > small) then
         call dgemv("T", below, columns, -1.0_wp, lower(k + 1), below, rows, 1, 1.0_wp, x, 1)
      else
         call subtract_transposed(columns, below, lower(k + 1), rows, x)
      end if
      do j = columns - 1, 1, -1
         k = k - (columns - j)
         sums = 0
         do i = j + 1, columns - 3, 4
            sums = sums + lower(k + i - j:k + i - j + 3)*x(i:i + 3)
         end do
         x(j) = x(j) - sum(sums)
         do i = i, columns
            x(j) = x(j) - lower(k + i - j)*x(i)
         end do
      end do
   end subroutine backward_one

   ! x := x - B^T rows. Sums of two parts, so that one instruction adds to both.
   pure subroutine subtract_transposed(columns, below, b, rows, x)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: b(below, columns), rows(below)
      real(wp), intent(inout) :: x(columns)
      real(wp), dimension(2) :: first, second, third, fourth
      integer :: i, j

      do j = 1, columns - 3, 4
         first = 0
         second = 0
         third = 0
         fourth = 0
         do i = 1, below - 1, 2
            first = first + b(i:i + 1, j)*rows(i:i + 1)
            second = second + b(i:i + 1, j + 1)*rows(i:i + 1)
            third = third + b(i:i + 1, j + 2)*rows(i:i + 1)
            fourth = fourth + b(i:i + 1, j + 3)*rows(i:i + 1)
         end do
         x(j:j + 3) = x(j:j + 3) - [sum(first), sum(second), sum(third), sum(fourth)]
         if (i == below) x(j:j + 3) = x(j:j + 3) - b(below, j:j + 3)*rows(below)
      end do
      do j = j, columns
         first = 0
         do i = 1, below - 1, 2
            first = first + b(i:i + 1, j)*rows(i:i + 1)
         end do
         x(j) = x(j) - sum(first)
         if (i == below) x(j) = x(j) - b(below, j)*rows(below)
      end do
   end subroutine subtract_transposed
end module kschur_substitution
