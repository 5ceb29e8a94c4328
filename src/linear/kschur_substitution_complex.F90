!> Forward and backward substitution with complex supernodal factors L D L^T, for one right-hand side or a block of two or four;
!> reads L once for each.
module kschur_substitution_complex
   use, intrinsic :: iso_c_binding, only: c_double_complex, c_int
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts_complex, only: supernodal_factors_type
   use kschur_kinds, only: wp
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: substitute, sides_at_once

   ! Of one supernode, for one side, and for two or four.
   interface
      pure subroutine forward_side(sides, columns, below, lower, x, rows) bind(c, name="kschur_forward_complex_side")
         import :: c_double_complex, c_int
         integer(c_int), value :: sides, columns, below
         complex(c_double_complex), intent(in) :: lower(*)
         complex(c_double_complex), intent(inout) :: x(sides, columns)
         complex(c_double_complex), intent(out) :: rows(sides, below)
      end subroutine forward_side

      pure subroutine backward_side(sides, columns, below, lower, x, rows) bind(c, name="kschur_backward_complex_side")
         import :: c_double_complex, c_int
         integer(c_int), value :: sides, columns, below
         complex(c_double_complex), intent(in) :: lower(*)
         complex(c_double_complex), intent(inout) :: x(sides, columns)
         complex(c_double_complex), intent(in) :: rows(sides, below)
      end subroutine backward_side

      pure subroutine forward_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_forward_complex_sides")
         import :: c_double_complex, c_int
         integer(c_int), value :: sides, columns, below
         complex(c_double_complex), intent(in) :: lower(*)
         complex(c_double_complex), intent(inout) :: x(sides, columns)
         complex(c_double_complex), intent(out) :: rows(sides, below)
      end subroutine forward_sides

      pure subroutine backward_sides(sides, columns, below, lower, x, rows) bind(c, name="kschur_backward_complex_sides")
         import :: c_double_complex, c_int
         integer(c_int), value :: sides, columns, below
         complex(c_double_complex), intent(in) :: lower(*)
         complex(c_double_complex), intent(inout) :: x(sides, columns)
         complex(c_double_complex), intent(in) :: rows(sides, below)
      end subroutine backward_sides
   end interface

#define SCALAR complex(wp)
#define LANES 2
#include "kschur_substitution.inc"

   ! x := T^{-1} x, rows := B x, T the triangle and B the block of a supernode.
   pure subroutine forward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      complex(wp), intent(in) :: lower(*)
      complex(wp), intent(inout) :: x(1, columns)
      complex(wp), intent(out) :: rows(1, below)

      call forward_side(1, columns, below, lower, x, rows)
   end subroutine forward_one

   ! x := T^{-T} (x - B^T rows).
   pure subroutine backward_one(columns, below, lower, x, rows)
      integer, intent(in) :: columns, below
      complex(wp), intent(in) :: lower(*)
      complex(wp), intent(inout) :: x(1, columns)
      complex(wp), intent(in) :: rows(1, below)

      call backward_side(1, columns, below, lower, x, rows)
   end subroutine backward_one
end module kschur_substitution_complex
