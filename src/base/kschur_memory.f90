!> Checks that memory is available before a step allocates it, with a margin: the compiler allocates function results and array
!> temporaries itself, and ends the program if that fails.
module kschur_memory
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long, single
   use kschur_text, only: text
   implicit none
   private
   public :: machine_memory, require_memory, return_memory

   !> Bytes of an integer, a real number of either precision and a complex one; the unit of messages.
   real(wp), parameter, public :: integer_bytes = storage_size(1)/8, real_bytes = storage_size(1.0_wp)/8, &
      single_bytes = storage_size(1.0_single)/8, complex_bytes = 2*real_bytes, megabyte = 1.0e6_wp
   ! Bytes left for small arrays.
   real(wp), parameter :: margin = 1.6e7_wp

   interface
      integer(c_int) function c_can_have(bytes) bind(c, name="kschur_can_have")
         import :: c_double, c_int
         real(c_double), value :: bytes
      end function c_can_have

      real(c_double) function c_machine_memory() bind(c, name="kschur_machine_memory")
         import :: c_double
      end function c_machine_memory

      !> Returns freed memory to the system, which malloc would keep: for use before large allocations.
      subroutine return_memory() bind(c, name="kschur_return_memory")
      end subroutine return_memory
   end interface

contains

   !> Memory of this machine (bytes); zero: not known.
   real(wp) function machine_memory()
      machine_memory = real(c_machine_memory(), wp)
   end function machine_memory

   !> Fails with `error_memory` if `bytes` bytes, and a margin, are not available; allocates nothing.
   subroutine require_memory(bytes, what, error)
      real(wp), intent(in) :: bytes
      !> Purpose, as in "no memory for ...".
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (c_can_have(real(bytes + margin, c_double)) /= 0) return
      call new_error(error, error_memory, "no memory for "//what//": "// &
         text(ceiling((bytes + margin)/megabyte, long))//" MB more are needed")
   end subroutine require_memory
end module kschur_memory
