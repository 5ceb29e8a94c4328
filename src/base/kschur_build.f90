!> What this library was built with.
module kschur_build
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
   use, intrinsic :: iso_fortran_env, only: compiler_version
   implicit none
   private
   public :: built_with

   integer, parameter :: longest = 300

   interface
      subroutine c_libraries(text, length) bind(c, name="kschur_libraries")
         import :: c_char, c_int
         character(kind=c_char), intent(out) :: text(*)
         integer(c_int), value :: length
      end subroutine c_libraries
   end interface

contains

   !> Returns one line with the compiler and the libraries: versions from their headers, that of OpenBLAS from the loaded
   !> library; parts that were left out as "no HDF5".
   function built_with() result(words)
      character(len=longest) :: words
      character(kind=c_char) :: text(longest)
      integer :: i, first

      words = compiler_version()
      !$ words = trim(words)//", OpenMP"
      words = trim(words)//", "
      first = len_trim(words) + 1
      call c_libraries(text, int(longest - first, c_int))
      do i = 1, longest - first
         if (text(i) == c_null_char) exit
         words(first + i:first + i) = text(i)
      end do
   end function built_with
end module kschur_build
