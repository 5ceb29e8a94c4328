!> Numbers as text, for messages and file formats.
module kschur_text
   use kschur_kinds, only: wp
   implicit none
   private
   public :: magnitude, text

   !> The shortest plain text of an integer, or a real with 17 significant digits'
   !> worth of accuracy where they are needed.
   interface text
      module procedure text_of_integer, text_of_real
   end interface text

contains

   pure function text_of_integer(number) result(text)
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      character(len=12) :: buffer

      write (buffer, "(i0)") number
      text = trim(buffer)
   end function text_of_integer

   ! The first precision that reads back as the same number.
   pure function text_of_real(number) result(text)
      real(wp), intent(in) :: number
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      character(len=12) :: layout
      integer :: digits
      real(wp) :: back

      do digits = 1, 17
         write (layout, "(a, i0, a)") "(es32.", digits - 1, "e3)"
         write (buffer, layout) number
         read (buffer, *) back
         if (.not. abs(back - number) > 0) exit
      end do
      text = trim(adjustl(buffer))
   end function text_of_real

   !> A real with two digits.
   pure function magnitude(number) result(digits)
      real(wp), intent(in) :: number
      character(len=:), allocatable :: digits
      character(len=12) :: buffer

      write (buffer, "(es12.1)") number
      digits = trim(adjustl(buffer))
   end function magnitude
end module kschur_text
