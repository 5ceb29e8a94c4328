!> Memory is asked for before it is used. What a step of a computation takes is required before the step, with a margin:
!> the compiler allocates results of functions and copies of expressions on its own, and ends the program where it gets none.
module kschur_memory
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp, long
   use kschur_text, only: text
   implicit none
   private
   public :: allocate_array, require_memory

   !> Bytes of an integer, of a real and of a complex number.
   real(wp), parameter, public :: integer_bytes = storage_size(1)/8, real_bytes = storage_size(1.0_wp)/8, &
      complex_bytes = 2*real_bytes
   ! So much is left for what is small.
   real(wp), parameter :: margin = 1.6e7_wp

   !> Allocates an array; fails where it, or the margin after it, cannot be had.
   interface allocate_array
      module procedure allocate_integers, allocate_longs, allocate_reals, allocate_real_matrix, allocate_complexes, &
         allocate_complex_matrix
   end interface allocate_array

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
      call raise(bytes, what, error)
   end subroutine require_memory

   subroutine raise(bytes, what, error)
      real(wp), intent(in) :: bytes
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      real(wp), parameter :: megabyte = 1.0e6_wp

      call new_error(error, error_memory, "no memory for "//what//": "// &
         text(ceiling((bytes + margin)/megabyte, long))//" MB more are needed")
   end subroutine raise

   ! What was allocated stays only where the margin can be had after it.
   logical function stays(status, bytes, what, error)
      integer, intent(in) :: status
      real(wp), intent(in) :: bytes
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error

      stays = status == 0
      if (stays) stays = c_can_have(real(margin, c_double)) /= 0
      if (.not. stays) call raise(bytes, what, error)
   end function stays

   subroutine allocate_integers(array, n, what, error)
      integer, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: n
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n), stat=status)
      if (stays(status, real(n, wp)*integer_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_integers

   subroutine allocate_longs(array, n, what, error)
      integer(long), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: n
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n), stat=status)
      if (stays(status, real(n, wp)*real_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_longs

   subroutine allocate_reals(array, n, what, error)
      real(wp), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: n
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n), stat=status)
      if (stays(status, real(n, wp)*real_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_reals

   subroutine allocate_real_matrix(array, n, m, what, error)
      real(wp), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: n, m
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n, m), stat=status)
      if (stays(status, real(n, wp)*m*real_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_real_matrix

   subroutine allocate_complexes(array, n, what, error)
      complex(wp), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: n
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n), stat=status)
      if (stays(status, real(n, wp)*complex_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_complexes

   subroutine allocate_complex_matrix(array, n, m, what, error)
      complex(wp), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: n, m
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      if (allocated(error)) return
      allocate (array(n, m), stat=status)
      if (stays(status, real(n, wp)*m*complex_bytes, what, error)) return
      if (status == 0) deallocate (array)
   end subroutine allocate_complex_matrix
end module kschur_memory
