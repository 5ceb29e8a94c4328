!> Numbers as text, for messages and file formats.
!>
!> The lengths of the results are specified, not deferred: gfortran keeps a deferred length of a function result in static
!> memory, which is not thread-safe.
module kschur_text
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: magnitude, text

   !> Returns an integer or a real as text; of a real the shortest decimal that reads back as the same number, at most 17
   !> significant digits.
   interface text
      module procedure text_of_integer, text_of_long, text_of_real
   end interface text

   integer, parameter :: longest = 32

contains

   ! Decimal digits of an integer.
   pure function shown(number) result(buffer)
      integer(long), intent(in) :: number
      character(len=longest) :: buffer

      write (buffer, "(i0)") number
   end function shown

   ! The shortest decimal that reads back as the same number. The search starts at the precision of the kind: a number that needs
   ! fewer digits is printed with trailing zeros, which are removed.
   pure function shortest(number) result(buffer)
      real(wp), intent(in) :: number
      character(len=longest) :: buffer
      integer, parameter :: enough_for_fewer = precision(1.0_wp)
      character(len=12) :: layout
      integer :: digits, exponent
      real(wp) :: back

      do digits = merge(enough_for_fewer, 1, abs(number) >= tiny(1.0_wp)), 17
         write (layout, "(a, i0, a)") "(es32.", digits - 1, "e3)"
         write (buffer, layout) number
         read (buffer, *) back
         if (.not. abs(back - number) > 0) exit
      end do
      buffer = adjustl(buffer)
      exponent = index(buffer, "E")
      if (exponent > 0) buffer = buffer(:verify(buffer(:exponent - 1), "0", back=.true.))//buffer(exponent:)
   end function shortest

   ! A real with two significant digits.
   pure function rounded(number) result(buffer)
      real(wp), intent(in) :: number
      character(len=longest) :: buffer

      write (buffer, "(es12.1)") number
      if (scan(buffer, "E") == 0) write (buffer, "(es12.1e3)") number
      buffer = adjustl(buffer)
   end function rounded

   pure function text_of_integer(number) result(text)
      integer, intent(in) :: number
      character(len=len_trim(shown(int(number, long)))) :: text

      text = shown(int(number, long))
   end function text_of_integer

   pure function text_of_long(number) result(text)
      integer(long), intent(in) :: number
      character(len=len_trim(shown(number))) :: text

      text = shown(number)
   end function text_of_long

   pure function text_of_real(number) result(text)
      real(wp), intent(in) :: number
      character(len=len_trim(shortest(number))) :: text

      text = shortest(number)
   end function text_of_real

   !> Returns a real with two significant digits, as text for messages.
   pure function magnitude(number) result(digits)
      real(wp), intent(in) :: number
      character(len=len_trim(rounded(number))) :: digits

      digits = rounded(number)
   end function magnitude
end module kschur_text
