!> Forward and backward substitution with supernodal factors L D L^T, for one right-hand side or a block of four; reads L once
!> for each.
module kschur_substitution
   use, intrinsic :: iso_c_binding, only: c_double, c_float, c_int
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: supernodal_factors_type
   use kschur_kinds, only: wp, single
   use kschur_lapack, only: dgemv
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: substitute, sides_at_once

   ! Entries of a block below which a loop is faster than a call of BLAS.
   integer, parameter :: small = 600

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

      ! As these, with L in single precision: each entry becomes a double one where it is read.
      pure subroutine forward_rounded_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_forward_rounded_sides")
         import :: c_double, c_float, c_int
         integer(c_int), value :: sides, columns, below
         real(c_float), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(out) :: rows(sides, below)
      end subroutine forward_rounded_sides

      pure subroutine backward_rounded_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_backward_rounded_sides")
         import :: c_double, c_float, c_int
         integer(c_int), value :: sides, columns, below
         real(c_float), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(in) :: rows(sides, below)
      end subroutine backward_rounded_sides

      pure subroutine forward_rounded_side(sides, columns, below, lower, x, rows) bind(c, name="kschur_forward_rounded_side")
         import :: c_double, c_float, c_int
         integer(c_int), value :: sides, columns, below
         real(c_float), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(out) :: rows(sides, below)
      end subroutine forward_rounded_side

      pure subroutine backward_rounded_side(sides, columns, below, lower, x, rows) bind(c, name="kschur_backward_rounded_side")
         import :: c_double, c_float, c_int
         integer(c_int), value :: sides, columns, below
         real(c_float), intent(in) :: lower(*)
         real(c_double), intent(inout) :: x(sides, columns)
         real(c_double), intent(in) :: rows(sides, below)
      end subroutine backward_rounded_side
   end interface

#define SCALAR real(wp)
#define ROUNDED real(single)
#define LANES 4
#define SOLVE_COMMON solve_common
#include "kschur_substitution.inc"

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

   ! As `forward_one` or `forward_sides`, for any number of sides.
   pure subroutine forward_rounded(sides, columns, below, lower, x, rows)
      integer, intent(in) :: sides, columns, below
      real(single), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(sides, columns)
      real(wp), intent(out) :: rows(sides, below)

      if (sides == 1) then
         call forward_rounded_side(sides, columns, below, lower, x, rows)
      else
         call forward_rounded_sides(sides, columns, below, lower, x, rows)
      end if
   end subroutine forward_rounded

   ! As `backward_one` or `backward_sides`, for any number of sides.
   pure subroutine backward_rounded(sides, columns, below, lower, x, rows)
      integer, intent(in) :: sides, columns, below
      real(single), intent(in) :: lower(*)
      real(wp), intent(inout) :: x(sides, columns)
      real(wp), intent(in) :: rows(sides, below)

      if (sides == 1) then
         call backward_rounded_side(sides, columns, below, lower, x, rows)
      else
         call backward_rounded_sides(sides, columns, below, lower, x, rows)
      end if
   end subroutine backward_rounded

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
