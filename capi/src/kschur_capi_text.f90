!> Conversion between C strings and Fortran texts.
module kschur_capi_text
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int64_t, c_null_char, c_ptr, c_size_t
   implicit none
   private
   public :: put_text, take_text

   interface
      integer(c_size_t) function c_strlen(string) bind(c, name="strlen")
         import :: c_ptr, c_size_t
         type(c_ptr), value :: string
      end function c_strlen
   end interface

contains

   !> Copies a text with a terminating null; truncates it if necessary.
   subroutine put_text(given, buffer, length, fits)
      character(len=*), intent(in) :: given
      !> Room for `length` characters; not null.
      type(c_ptr), intent(in) :: buffer
      integer(c_int64_t), intent(in) :: length
      logical, intent(out) :: fits
      character(kind=c_char), pointer :: place(:)
      integer :: i, last

      fits = len(given) < length
      if (length < 1) return
      last = int(min(int(len(given), c_int64_t), length - 1))
      call c_f_pointer(buffer, place, [last + 1])
      do i = 1, last
         place(i) = given(i:i)
      end do
      place(last + 1) = c_null_char
   end subroutine put_text

   !> Returns the text up to its terminating null.
   subroutine take_text(address, taken)
      !> Not null.
      type(c_ptr), intent(in) :: address
      character(len=:), allocatable, intent(out) :: taken
      character(kind=c_char), pointer :: place(:)
      integer :: i

      call c_f_pointer(address, place, [c_strlen(address)])
      allocate (character(len=size(place)) :: taken)
      do i = 1, size(place)
         taken(i:i) = place(i)
      end do
   end subroutine take_text
end module kschur_capi_text
