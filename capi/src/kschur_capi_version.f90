!> The version of the library, for C.
module kschur_capi_version
   use, intrinsic :: iso_c_binding, only: c_int, c_ptr
   use kschur, only: kschur_release => kschur_version
   use kschur_capi_arrays, only: put
   use kschur_capi_status, only: status_ok
   implicit none
   private

contains

   integer(c_int) function kschur_version(major, minor, patch) bind(c) result(status)
      type(c_ptr), value :: major, minor, patch
      integer(c_int) :: numbers(3)
      character(len=len(kschur_release)) :: words
      integer :: i

      do i = 1, len(words)
         words(i:i) = merge(" ", kschur_release(i:i), kschur_release(i:i) == ".")
      end do
      read (words, *) numbers
      call put(major, numbers(1))
      call put(minor, numbers(2))
      call put(patch, numbers(3))
      status = status_ok
   end function kschur_version
end module kschur_capi_version
