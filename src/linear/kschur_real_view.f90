!> Complex arrays seen as real ones, for what is done alike to real and imaginary parts.
module kschur_real_view
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: as_reals, as_real_rows

contains

   !> The n first numbers as 2n real ones, real and imaginary parts in turn.
   function as_reals(n, numbers) result(view)
      integer(long), intent(in) :: n
      complex(wp), target, intent(in) :: numbers(*)
      real(wp), contiguous, pointer :: view(:)

      call c_f_pointer(c_loc(numbers), view, [2*n])
   end function as_reals

   !> An array with each row as two, of real and of imaginary parts.
   function as_real_rows(rows) result(view)
      complex(wp), contiguous, target, intent(in) :: rows(:, :)
      real(wp), contiguous, pointer :: view(:, :)

      call c_f_pointer(c_loc(rows), view, [2*size(rows, 1), size(rows, 2)])
   end function as_real_rows
end module kschur_real_view
