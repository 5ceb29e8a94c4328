!> Solves with supernodal factors L D L^T: reads L once forward and once backward, for one right-hand side or for four.
module kschur_substitution
   use kschur_kinds, only: wp
   use kschur_supernodal, only: supernodal_factors_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: substitute_one, substitute_block, block

   !> Right-hand sides that share one pass over L.
   integer, parameter :: block = 4

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
   pure subroutine forward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(columns), rows(below)
      integer :: i, j, k

      k = 0
      do j = 1, columns - 1
         do i = j + 1, columns
            x(i) = x(i) - lower(k + i - j)*x(j)
         end do
         k = k + columns - j
      end do
      rows = 0
      do j = 1, columns - 3, 4
         do i = 1, below
            rows(i) = rows(i) + (lower(k + i)*x(j) + lower(k + below + i)*x(j + 1)) &
               + (lower(k + 2*below + i)*x(j + 2) + lower(k + 3*below + i)*x(j + 3))
         end do
         k = k + 4*below
      end do
      do j = j, columns
         do i = 1, below
            rows(i) = rows(i) + lower(k + i)*x(j)
         end do
         k = k + below
      end do
   end subroutine forward_one

   ! x := T^{-T} (x - B^T rows).
   pure subroutine backward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(columns)
      real(wp), intent(in) :: rows(below)
      real(wp) :: z(4)
      integer :: i, j, k

      k = (columns*(columns - 1))/2
      do j = 1, columns - 3, 4
         z = 0
         do i = 1, below
            z(1) = z(1) + lower(k + i)*rows(i)
            z(2) = z(2) + lower(k + below + i)*rows(i)
            z(3) = z(3) + lower(k + 2*below + i)*rows(i)
            z(4) = z(4) + lower(k + 3*below + i)*rows(i)
         end do
         x(j:j + 3) = x(j:j + 3) - z
         k = k + 4*below
      end do
      do j = j, columns
         z(1) = 0
         do i = 1, below
            z(1) = z(1) + lower(k + i)*rows(i)
         end do
         x(j) = x(j) - z(1)
         k = k + below
      end do
      k = (columns*(columns - 1))/2
      do j = columns - 1, 1, -1
         k = k - (columns - j)
         do i = j + 1, columns
            x(j) = x(j) - lower(k + i - j)*x(i)
         end do
      end do
   end subroutine backward_one

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

   pure subroutine forward_block(columns, below, lower, x, rows)
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
      rows = 0
      do j = 1, columns - 1, 2
         do i = 1, below
            rows(:, i) = rows(:, i) + lower(k + i)*x(:, j) + lower(k + below + i)*x(:, j + 1)
         end do
         k = k + 2*below
      end do
      if (mod(columns, 2) == 0) return
      do i = 1, below
         rows(:, i) = rows(:, i) + lower(k + i)*x(:, columns)
      end do
   end subroutine forward_block

   pure subroutine backward_block(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      real(wp), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(block, columns)
      real(wp), intent(in) :: rows(block, below)
      real(wp) :: first(block), second(block)
      integer :: i, j, k

      k = (columns*(columns - 1))/2
      do j = 1, columns - 1, 2
         first = 0
         second = 0
         do i = 1, below
            first = first + lower(k + i)*rows(:, i)
            second = second + lower(k + below + i)*rows(:, i)
         end do
         x(:, j) = x(:, j) - first
         x(:, j + 1) = x(:, j + 1) - second
         k = k + 2*below
      end do
      if (mod(columns, 2) == 1) then
         first = 0
         do i = 1, below
            first = first + lower(k + i)*rows(:, i)
         end do
         x(:, columns) = x(:, columns) - first
      end if
      k = (columns*(columns - 1))/2
      do j = columns - 1, 1, -1
         k = k - (columns - j)
         first = x(:, j)
         do i = j + 1, columns
            first = first - lower(k + i - j)*x(:, i)
         end do
         x(:, j) = first
      end do
   end subroutine backward_block
end module kschur_substitution
