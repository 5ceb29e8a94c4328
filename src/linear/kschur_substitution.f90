!> Solves with supernodal factors L D L^T: reads L once forward and once backward, for one right-hand side or for four.
module kschur_substitution
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm, dgemv
   use kschur_supernodal, only: supernodal_factors_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: substitute_one, substitute_block, block

   !> Right-hand sides that share one pass over L.
   integer, parameter :: block = 4

   ! Entries that are read before a call of BLAS returns.
   integer, parameter :: small = 600, small_block = 1000

contains

   !> y := L^{-T} D^{-1} L^{-1} y, in the order of elimination.
   subroutine substitute_one(symbolic, factors, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      real(wp), intent(inout) :: y(size(symbolic%order))
      !> Workspace: as long as the longest list of rows.
      real(wp), intent(inout) :: rows(*)
      integer :: s, columns, below, i

      do s = 1, size(symbolic%first) - 1
         associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            columns = symbolic%first(s + 1) - first
            below = size(row)
            call forward_one(columns, below, factors%lower(factors%offset(s):), y(first:), rows)
            do i = 1, below
               y(row(i)) = y(row(i)) - rows(i)
            end do
         end associate
      end do
      y = y/factors%pivot
      do s = size(symbolic%first) - 1, 1, -1
         associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            columns = symbolic%first(s + 1) - first
            below = size(row)
            do i = 1, below
               rows(i) = y(row(i))
            end do
            call backward_one(columns, below, factors%lower(factors%offset(s):), y(first:), rows)
         end associate
      end do
   end subroutine substitute_one

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

   !> The same for a block: y holds the right-hand sides of an unknown side by side.
   subroutine substitute_block(symbolic, factors, y, rows)
      type(symbolic_type), intent(in) :: symbolic
      type(supernodal_factors_type), intent(in) :: factors
      real(wp), contiguous, intent(inout) :: y(:, :), rows(:, :)
      integer :: s, columns, below, i

      do s = 1, size(symbolic%first) - 1
         associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            columns = symbolic%first(s + 1) - first
            below = size(row)
            call forward_block(columns, below, factors%lower(factors%offset(s):), y(:, first:), rows)
            do i = 1, below
               y(:block, row(i)) = y(:block, row(i)) - rows(:block, i)
            end do
         end associate
      end do
      do i = 1, size(y, 2)
         y(:block, i) = y(:block, i)/factors%pivot(i)
      end do
      do s = size(symbolic%first) - 1, 1, -1
         associate (first => symbolic%first(s), row => symbolic%row(symbolic%start(s):symbolic%start(s + 1) - 1))
            columns = symbolic%first(s + 1) - first
            below = size(row)
            do i = 1, below
               rows(:block, i) = y(:block, row(i))
            end do
            call backward_block(columns, below, factors%lower(factors%offset(s):), y(:, first:), rows)
         end associate
      end do
   end subroutine substitute_block

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
