!> Large pages of virtual memory for arrays that are read many times, as Krylov bases.
module kschur_pages
   use, intrinsic :: iso_c_binding, only: c_double, c_loc, c_ptr
   use kschur_kinds, only: wp
   implicit none
   private
   public :: prefer_large_pages

   ! Twice the bytes that a translation lookaside buffer of 2048 pages of 4 KiB maps, as x86-64 processors have: of a smaller
   ! array it holds half, and a partly used large page costs what it saves.
   integer, parameter :: least_bytes = 2*2048*4096
   integer, parameter :: bits_of_a_byte = 8

   !> Asks the operating system to map an array in large pages, before it is filled. Does nothing if it has none.
   interface prefer_large_pages
      module procedure prefer_for_real, prefer_for_complex
   end interface prefer_large_pages

   interface
      subroutine c_prefer_large_pages(first, bytes) bind(c, name="kschur_prefer_large_pages")
         import :: c_double, c_ptr
         type(c_ptr), value :: first
         real(c_double), value :: bytes
      end subroutine c_prefer_large_pages
   end interface

contains

   subroutine prefer_for_real(array)
      real(wp), contiguous, target, intent(in) :: array(:, :)
      real(wp) :: bytes

      bytes = real(size(array, 1), wp)*size(array, 2)*(storage_size(array)/bits_of_a_byte)
      if (bytes >= least_bytes) call c_prefer_large_pages(c_loc(array), real(bytes, c_double))
   end subroutine prefer_for_real

   subroutine prefer_for_complex(array)
      complex(wp), contiguous, target, intent(in) :: array(:, :)
      real(wp) :: bytes

      bytes = real(size(array, 1), wp)*size(array, 2)*(storage_size(array)/bits_of_a_byte)
      if (bytes >= least_bytes) call c_prefer_large_pages(c_loc(array), real(bytes, c_double))
   end subroutine prefer_for_complex
end module kschur_pages
