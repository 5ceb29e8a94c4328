!> Strict conversion of words to numbers, and formatting of numbers.
module cli_numbers
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur, only: text, wp
   implicit none
   private
   public :: aligned, exponential, plain, read_integer, read_list, read_range, read_real, rounded

   !> Formats a real, or a complex as `re+imi`, with about six digits.
   interface rounded
      module procedure rounded_real, rounded_complex
   end interface rounded

contains

   !> Reads an integer; `ok` is false if the word is anything else.
   subroutine read_integer(word, value, ok)
      character(len=*), intent(in) :: word
      integer, intent(inout) :: value
      logical, intent(out) :: ok
      integer :: status, number

      ok = is_digits(unsigned(word))
      if (.not. ok) return
      read (word, *, iostat=status) number
      ok = status == 0
      if (ok) value = number
   end subroutine read_integer

   !> Reads a finite decimal number; `ok` is false if the word is anything else.
   subroutine read_real(word, value, ok)
      character(len=*), intent(in) :: word
      real(wp), intent(inout) :: value
      logical, intent(out) :: ok
      character(len=:), allocatable :: mantissa
      integer :: exponent, point, status
      real(wp) :: number

      exponent = scan(word//"e", "eE")
      mantissa = unsigned(word(:exponent - 1))
      point = index(mantissa//".", ".")
      ok = is_digits(mantissa(:point - 1)//mantissa(point + 1:))
      if (ok .and. exponent <= len(word)) ok = is_digits(unsigned(word(exponent + 1:)))
      if (.not. ok) return
      read (word, *, iostat=status) number
      ok = status == 0
      if (ok) ok = ieee_is_finite(number)
      if (ok) value = number
   end subroutine read_real

   !> Reads numbers A,B,...; `ok` is false if the word is anything else.
   subroutine read_list(word, values, ok)
      character(len=*), intent(in) :: word
      real(wp), allocatable, intent(out) :: values(:)
      logical, intent(out) :: ok
      real(wp) :: value
      integer :: first, comma

      allocate (values(0))
      first = 1
      do
         comma = first - 1 + index(word(first:)//",", ",")
         call read_real(word(first:comma - 1), value, ok)
         if (.not. ok) return
         values = [values, value]
         if (comma > len(word)) exit
         first = comma + 1
      end do
   end subroutine read_list

   !> Reads FIRST:LAST:POINTS as equally spaced numbers, two or more; `ok` is false if the word is anything else.
   subroutine read_range(word, most, values, ok)
      character(len=*), intent(in) :: word
      !> Largest number of points.
      integer, intent(in) :: most
      real(wp), allocatable, intent(out) :: values(:)
      logical, intent(out) :: ok
      real(wp) :: first, last
      integer :: one, two, points, i

      one = index(word, ":")
      two = index(word, ":", back=.true.)
      ok = one > 0 .and. two > one
      if (ok) call read_real(word(:one - 1), first, ok)
      if (ok) call read_real(word(one + 1:two - 1), last, ok)
      if (ok) call read_integer(word(two + 1:), points, ok)
      if (ok) ok = points >= 2 .and. points <= most
      if (.not. ok) return
      allocate (values(points), source=[(((points - 1 - i)*first + i*last)/(points - 1), i=0, points - 1)])
   end subroutine read_range

   pure function unsigned(word)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: unsigned

      unsigned = word
      if (scan(word, "+-") == 1) unsigned = word(2:)
   end function unsigned

   pure logical function is_digits(word)
      character(len=*), intent(in) :: word

      is_digits = len(word) > 0 .and. verify(word, "0123456789") == 0
   end function is_digits

   !> Formats a finite number with all its digits, as JSON and spreadsheets read it; `undefined` if it is not finite.
   pure function plain(x, undefined)
      real(wp), intent(in) :: x
      character(len=*), intent(in) :: undefined
      character(len=:), allocatable :: plain
      integer :: point

      if (.not. ieee_is_finite(x)) then
         plain = undefined
      else if (.not. abs(x) > 0) then
         plain = "0"
      else
         plain = text(x)
         point = index(plain, ".E")
         if (point > 0) plain = plain(:point - 1)//plain(point + 1:)
      end if
   end function plain

   pure function rounded_real(x) result(rounded)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: rounded
      character(len=24) :: buffer
      integer :: exponent, last

      buffer = "0"
      if (abs(x) >= 1.0e-3_wp .and. abs(x) < 1.0e6_wp) then
         write (buffer, "(f24.6)") x
      else if (abs(x) > 0) then
         write (buffer, "(es24.5e3)") x
      end if
      buffer = adjustl(buffer)
      exponent = scan(trim(buffer)//"E", "E")
      last = exponent - 1
      if (index(buffer, ".") > 0) last = verify(buffer(:last), "0", back=.true.)
      if (buffer(last:last) == ".") last = last - 1
      rounded = buffer(:last)//trim(buffer(exponent:exponent + 1))
      if (buffer(exponent + 2:exponent + 2) == "0") exponent = exponent + 1
      rounded = rounded//trim(buffer(exponent + 2:))
   end function rounded_real

   pure function rounded_complex(z) result(rounded)
      complex(wp), intent(in) :: z
      character(len=:), allocatable :: rounded

      rounded = rounded_real(real(z, wp))
      if (.not. abs(aimag(z)) > 0) return
      if (.not. abs(real(z, wp)) > 0) rounded = ""
      if (rounded /= "" .and. aimag(z) > 0) rounded = rounded//"+"
      rounded = rounded//rounded_real(aimag(z))//"i"
   end function rounded_complex

   !> Formats a number with an exponent in a cell of given width, with the letter E, which Fortran drops before three digits.
   pure function exponential(x, width, decimals) result(cell)
      real(wp), intent(in) :: x
      integer, intent(in) :: width, decimals
      character(len=width) :: cell
      character(len=16) :: notation

      write (notation, "(a, i0, a, i0, a)") "(es", width, ".", decimals, ")"
      write (cell, notation) x
      if (scan(cell, "E") > 0) return
      write (notation, "(a, i0, a, i0, a)") "(es", width, ".", decimals, "e3)"
      write (cell, notation) x
   end function exponential

   !> Formats a column of numbers in cells of 15 characters in one notation: six decimals if these show four digits of each,
   !> else with exponents. Zero is `0`, nonfinite `-`.
   pure function aligned(values) result(cells)
      real(wp), intent(in) :: values(:)
      character(len=15) :: cells(size(values))
      logical :: wide
      integer :: i

      wide = any(abs(values) > 0 .and. abs(values) < 1.0e-3_wp) .or. any(abs(values) >= 1.0e6_wp)
      do i = 1, size(values)
         if (.not. ieee_is_finite(values(i))) then
            cells(i) = repeat(" ", 14)//"-"
         else if (abs(values(i)) > 0 .and. wide) then
            cells(i) = exponential(values(i), len(cells), 6)
         else if (abs(values(i)) > 0) then
            write (cells(i), "(f15.6)") values(i)
         else
            cells(i) = repeat(" ", 14)//"0"
         end if
      end do
   end function aligned
end module cli_numbers
