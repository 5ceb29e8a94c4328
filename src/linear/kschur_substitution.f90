!> Solves with supernodal factors L D L^T: reads L once forward and once backward, for one right-hand side or for four.
module kschur_substitution
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dgemv
   use kschur_left_looking, only: supernodal_factors_type
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: substitute, block

   !> Right-hand sides that share one pass over L.
   integer, parameter :: block = 4

   ! Entries that are read before a call of BLAS returns.
   integer, parameter :: small = 600, small_block = 1000

   ! What a subtree subtracts from the rows above it.
   type :: passed_type
      real(wp), allocatable :: values(:, :)
   end type passed_type

contains

   !> y := L^{-T} D^{-1} L^{-1} y, in the order of elimination: y holds the right-hand sides of an unknown side by side,
   !> one or a block. Subtrees are independent of each other; what they pass on is added up in their order.
   subroutine substitute(symbolic, subtrees, factors, y, error)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      real(wp), contiguous, intent(inout) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(passed_type), allocatable :: passed(:)
      ! Workspace of a thread: the rows of a supernode; what is above its subtree.
      real(wp), allocatable :: rows(:, :), above(:, :)
      integer :: lanes, n, t, i, status, failed

      lanes = size(y, 1)
      n = size(y, 2)
      allocate (passed(size(subtrees%root)))
      failed = 0
      !$omp parallel private(rows, above, status) reduction(max: failed) if (size(passed) > 1)
      allocate (rows(lanes, symbolic%most_rows()), above(lanes, subtrees%columns), stat=status)
      failed = max(failed, abs(status))
      if (status == 0) above = 0
      !$omp do schedule(dynamic)
      do t = 1, size(passed)
         if (status == 0) call climb(symbolic, subtrees, factors, t, y, rows, above, passed(t))
      end do
      !$omp end do
      !$omp single
      if (status == 0) then
         do t = 1, size(passed)
            call add_passed(symbolic, subtrees%root(t), passed(t), y)
         end do
         do i = 1, size(subtrees%top)
            call forward(symbolic, subtrees%place, factors, subtrees%top(i), n, y, rows, above)
         end do
         call divide(factors%pivot, y)
         do i = size(subtrees%top), 1, -1
            call backward(symbolic, factors, subtrees%top(i), y, rows)
         end do
      end if
      !$omp end single
      !$omp do schedule(dynamic)
      do t = 1, size(passed)
         if (status == 0) call descend(symbolic, factors, subtrees%first(t), subtrees%root(t), y, rows)
      end do
      !$omp end do
      !$omp end parallel
      if (failed /= 0) call new_error(error, error_memory, "no memory for the right-hand sides")
   end subroutine substitute

   subroutine climb(symbolic, subtrees, factors, t, y, rows, above, passed)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: t
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      !> Zero, as it is left.
      real(wp), contiguous, intent(inout) :: above(:, :)
      type(passed_type), intent(inout) :: passed
      integer :: s

      do s = subtrees%first(t), subtrees%root(t)
         call forward(symbolic, subtrees%place, factors, s, symbolic%first(subtrees%root(t) + 1) - 1, y, rows, above)
      end do
      ! The rows of its root are all that a subtree reaches.
      associate (root => subtrees%root(t))
         associate (place => subtrees%place(symbolic%row(symbolic%start(root):symbolic%start(root + 1) - 1)))
            passed%values = above(:, place)
            above(:, place) = 0
         end associate
      end associate
   end subroutine climb

   pure subroutine divide(pivot, y)
      real(wp), intent(in) :: pivot(:)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i

      if (size(y, 1) == 1) then
         y(1, :) = y(1, :)/pivot
      else
         do i = 1, size(pivot)
            y(:block, i) = y(:block, i)/pivot(i)
         end do
      end if
   end subroutine divide

   pure subroutine add_passed(symbolic, root, passed, y)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: root
      type(passed_type), intent(in) :: passed
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i

      associate (row => symbolic%row(symbolic%start(root):symbolic%start(root + 1) - 1))
         do i = 1, size(row)
            y(:, row(i)) = y(:, row(i)) + passed%values(:, i)
         end do
      end associate
   end subroutine add_passed

   subroutine descend(symbolic, factors, first, root, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: first, root
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      integer :: s

      do s = root, first, -1
         call backward(symbolic, factors, s, y, rows)
      end do
   end subroutine descend

   ! L^{-1} of one supernode: what is in rows up to `last` is subtracted there, the rest from what is above.
   subroutine forward(symbolic, place, factors, s, last, y, rows, above)
      type(symbolic_type), intent(in) :: symbolic
      !> Of a row, where it stands above.
      integer, intent(in) :: place(:)
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: s, last
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :), above(:, :)
      integer :: i, inside

      associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1), &
         columns => symbolic%first(s + 1) - symbolic%first(s))
         if (size(y, 1) == 1) then
            call forward_one(columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
         else
            call forward_block(columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
         end if
         do inside = size(row), 1, -1
            if (row(inside) <= last) exit
         end do
         if (size(y, 1) == 1) then
            do i = 1, inside
               y(1, row(i)) = y(1, row(i)) - rows(1, i)
            end do
            do i = inside + 1, size(row)
               above(1, place(row(i))) = above(1, place(row(i))) - rows(1, i)
            end do
         else
            do i = 1, inside
               y(:block, row(i)) = y(:block, row(i)) - rows(:block, i)
            end do
            do i = inside + 1, size(row)
               above(:block, place(row(i))) = above(:block, place(row(i))) - rows(:block, i)
            end do
         end if
      end associate
   end subroutine forward

   ! L^{-T} of one supernode.
   subroutine backward(symbolic, factors, s, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      integer, intent(in) :: s
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      integer :: i

      associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1), &
         columns => symbolic%first(s + 1) - symbolic%first(s))
         if (size(y, 1) == 1) then
            do i = 1, size(row)
               rows(1, i) = y(1, row(i))
            end do
            call backward_one(columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
         else
            do i = 1, size(row)
               rows(:block, i) = y(:block, row(i))
            end do
            call backward_block(columns, size(row), factors%lower(factors%offset(s):), y(:, first:), rows)
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

   subroutine forward_block(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(block, columns), rows(block, below)
      integer :: i, j, k

      k = 0
      do j = 1, columns - 1
         do i = j + 1, columns
            x(:, i) = x(:, i) - lower(k + i - j)*x(:, j)
         end do
         k = k + columns - j
      end do
      if (columns*below > small_block) then
         call dgemm("N", "T", block, below, columns, 1.0_wp, x, block, lower(k + 1), below, 0.0_wp, rows, block)
      else
         call multiply_block(columns, below, lower(k + 1), x, rows)
      end if
   end subroutine forward_block

   pure subroutine multiply_block(columns, below, b, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: b(below, columns), x(block, columns)
      real(wp), intent(out) :: rows(block, below)
      integer :: i, j

      rows = 0
      do j = 1, columns - 1, 2
         do i = 1, below
            rows(:, i) = rows(:, i) + (b(i, j)*x(:, j) + b(i, j + 1)*x(:, j + 1))
         end do
      end do
      if (mod(columns, 2) == 0) return
      do i = 1, below
         rows(:, i) = rows(:, i) + b(i, columns)*x(:, columns)
      end do
   end subroutine multiply_block

   subroutine backward_block(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(block, columns)
      real(wp), intent(in) :: rows(block, below)
      integer :: i, j, k

      k = (columns*(columns - 1))/2
      if (columns*below > small_block) then
         call dgemm("N", "N", block, columns, below, -1.0_wp, rows, block, lower(k + 1), below, 1.0_wp, x, block)
      else
         call subtract_block(columns, below, lower(k + 1), rows, x)
      end if
      do j = columns - 1, 1, -1
         k = k - (columns - j)
         do i = j + 1, columns
            x(:, j) = x(:, j) - lower(k + i - j)*x(:, i)
         end do
      end do
   end subroutine backward_block

   pure subroutine subtract_block(columns, below, b, rows, x)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: b(below, columns), rows(block, below)
      real(wp), intent(inout) :: x(block, columns)
      real(wp), dimension(block) :: first, second
      integer :: i, j

      do j = 1, columns - 1, 2
         first = x(:, j)
         second = x(:, j + 1)
         do i = 1, below
            first = first - b(i, j)*rows(:, i)
            second = second - b(i, j + 1)*rows(:, i)
         end do
         x(:, j) = first
         x(:, j + 1) = second
      end do
      if (mod(columns, 2) == 0) return
      first = x(:, columns)
      do i = 1, below
         first = first - b(i, columns)*rows(:, i)
      end do
      x(:, columns) = first
   end subroutine subtract_block
end module kschur_substitution
