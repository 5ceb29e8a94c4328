!> Pages of memory that is read over and over: bases and factors.
module kschur_pages
   use, intrinsic :: iso_c_binding, only: c_double, c_loc, c_ptr
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: prefer_large_pages

   ! Bytes. Of less the processor's table of pages holds enough, and a large page that is used in part costs what it saves.
   real(wp), parameter :: worth_it = 1.6e7_wp
   integer, parameter :: bits_of_a_byte = 8

   !> Asks the system to map an array in large pages, before it is filled. Where there are none, nothing happens.
   interface prefer_large_pages
      module procedure prefer_for_list, prefer_for_real, prefer_for_complex
   end interface prefer_large_pages

   interface
      subroutine c_prefer_large_pages(first, bytes) bind(c, name="kschur_prefer_large_pages")
         import :: c_double, c_ptr
         type(c_ptr), value :: first
         real(c_double), value :: bytes
      end subroutine c_prefer_large_pages
   end interface

contains

   subroutine prefer_for_list(array)
      real(wp), contiguous, target, intent(in) :: array(:)
      real(wp) :: bytes

      bytes = real(size(array, kind=long), wp)*(storage_size(array)/bits_of_a_byte)
      if (bytes >= worth_it) call c_prefer_large_pages(c_loc(array), real(bytes, c_double))
   end subroutine prefer_for_list

   subroutine prefer_for_real(array)
      real(wp), contiguous, target, intent(in) :: array(:, :)
      real(wp) :: bytes

      bytes = real(size(array, 1), wp)*size(array, 2)*(storage_size(array)/bits_of_a_byte)
      if (bytes >= worth_it) call c_prefer_large_pages(c_loc(array), real(bytes, c_double))
   end subroutine prefer_for_real

   subroutine prefer_for_complex(array)
      complex(wp), contiguous, target, intent(in) :: array(:, :)
      real(wp) :: bytes

      bytes = real(size(array, 1), wp)*size(array, 2)*(storage_size(array)/bits_of_a_byte)
      if (bytes >= worth_it) call c_prefer_large_pages(c_loc(array), real(bytes, c_double))
   end subroutine prefer_for_complex
end module kschur_pages
