!> Memory is asked for before it is used. What a step of a computation takes is required before the step, with a margin:
!> the compiler allocates results of functions and copies of expressions on its own, and ends the program where it gets none.
module kschur_memory
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_text, only: text
   implicit none
   private
   public :: require_memory

   !> Bytes of an integer, of a real and of a complex number, and of what messages count in.
   real(wp), parameter, public :: integer_bytes = storage_size(1)/8, real_bytes = storage_size(1.0_wp)/8, &
      complex_bytes = 2*real_bytes, megabyte = 1.0e6_wp
   ! So much is left for what is small.
   real(wp), parameter :: margin = 1.6e7_wp

   interface
      integer(c_int) function c_can_have(bytes) bind(c, name="kschur_can_have")
         import :: c_double, c_int
         real(c_double), value :: bytes
      end function c_can_have
   end interface

contains

   !> Fails where so many bytes cannot be had.
   subroutine require_memory(bytes, what, error)
      real(wp), intent(in) :: bytes
      !> What they are for, as in "no memory for ...".
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (c_can_have(real(bytes + margin, c_double)) /= 0) return
      call new_error(error, error_memory, "no memory for "//what//": "// &
         text(ceiling((bytes + margin)/megabyte, long))//" MB more are needed")
   end subroutine require_memory
end module kschur_memory
