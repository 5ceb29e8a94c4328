!> Reads a text file line by line and word by word, through a fixed buffer. A line longer than the buffer is read in pieces,
!> each as a line of its own, unless it is a comment.
module kschur_line_reader
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf, ieee_negative_inf
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_int, c_intptr_t, c_loc, c_null_char, c_null_ptr, &
      c_ptr, c_size_t
   use kschur_error, only: error_type, new_error, error_file
   use kschur_files, only: is_link, kind_of_file, last_reason, folder, regular_file
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: line_reader_type, lower_case

   integer, parameter :: buffer_size = 2**17
   character(len=*), parameter :: newline = achar(10)

   !> An open file or pipe, and its current line.
   type :: line_reader_type
      private
      !> Number of the line, from 1.
      integer, public :: line = 0
      !> Whether a read error occurred.
      logical, public :: failed = .false.
      !> Size of the file in bytes; of a pipe huge.
      integer(long), public :: bytes = huge(1_long)
      character(len=:), allocatable :: buffer
      type(c_ptr) :: stream = c_null_ptr
      integer :: filled = 0
      ! Whether the end of the file is in the buffer.
      logical :: ended = .false.
      ! Remaining part of the line, and start of the next one.
      integer :: cursor = 1, line_end = 0, next = 1
      ! Whether the line continues in the next piece.
      logical :: unfinished = .false.
   contains
      !> Opens a file; fails if it cannot be read.
      procedure :: open => open_file
      !> Closes it.
      procedure :: close => close_file
      !> Advances to the next line that is not blank and does not begin with `comment`.
      procedure :: next_line
      !> Returns the next word of the line, empty at its end.
      procedure :: next_word
      !> Whether the line has no more words.
      procedure :: at_end
      !> The next word as an integer.
      procedure :: next_integer
      !> The next word as a real number.
      procedure :: next_real
   end type line_reader_type

   interface
      real(c_double) function c_strtod(word, after) bind(c, name="strtod")
         import :: c_char, c_double, c_intptr_t
         character(kind=c_char), intent(in) :: word(*)
         integer(c_intptr_t), intent(out) :: after
      end function c_strtod

      type(c_ptr) function c_fopen(path, mode) bind(c, name="fopen")
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*), mode(*)
      end function c_fopen

      integer(c_size_t) function c_fread(bytes, size, count, stream) bind(c, name="fread")
         import :: c_char, c_ptr, c_size_t
         character(kind=c_char), intent(out) :: bytes(*)
         integer(c_size_t), value :: size, count
         type(c_ptr), value :: stream
      end function c_fread

      integer(c_int) function c_ferror(stream) bind(c, name="ferror")
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_ferror

      integer(c_int) function c_fclose(stream) bind(c, name="fclose")
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fclose
   end interface

contains

   ! The name - means standard input.
   subroutine open_file(self, path, error)
      class(line_reader_type), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name, reason

      name = path
      if (path == "-") name = "/dev/stdin"
      if (kind_of_file(name) == folder) then
         call new_error(error, error_file, path//": a folder, not a file")
         return
      end if
      self%stream = c_fopen(name//c_null_char, "r"//c_null_char)
      if (.not. c_associated(self%stream)) then
         reason = trim(last_reason())
         if (is_link(path)) reason = reason//" (where this link leads)"
         call new_error(error, error_file, path//": "//reason)
         return
      end if
      if (kind_of_file(name) == regular_file) inquire (file=name, size=self%bytes)
      allocate (character(len=buffer_size) :: self%buffer)
   end subroutine open_file

   subroutine close_file(self)
      class(line_reader_type), intent(inout) :: self
      integer(c_int) :: status

      status = c_fclose(self%stream)
      self%stream = c_null_ptr
   end subroutine close_file

   !> `found` is false at the end of the file, or after a read error.
   subroutine next_line(self, comment, found)
      class(line_reader_type), intent(inout) :: self
      character(len=1), intent(in) :: comment
      logical, intent(out) :: found

      do
         call next_raw_line(self, found)
         if (.not. found) return
         call skip_blanks(self)
         if (self%cursor > self%line_end) cycle
         if (self%buffer(self%cursor:self%cursor) /= comment) return
         do while (self%unfinished)
            call next_raw_line(self, found)
         end do
      end do
   end subroutine next_line

   ! Advances to the next line, blank ones and comments included, or to the next piece of a line longer than the buffer.
   subroutine next_raw_line(self, found)
      class(line_reader_type), intent(inout) :: self
      logical, intent(out) :: found
      integer :: place
      logical :: continues

      continues = self%unfinished
      place = self%next
      do
         do while (place <= self%filled)
            if (self%buffer(place:place) == newline) exit
            place = place + 1
         end do
         if (place <= self%filled .or. self%ended .or. place - self%next == buffer_size) exit
         place = place - self%next + 1
         call refill(self)
      end do
      found = self%next <= self%filled
      self%cursor = self%next
      self%line_end = place - 1
      self%next = min(place, self%filled) + 1
      self%unfinished = place > self%filled .and. .not. self%ended
      if (found .and. .not. continues) self%line = self%line + 1
   end subroutine next_raw_line

   ! Moves the unfinished line to the front of the buffer, and fills the rest.
   subroutine refill(self)
      class(line_reader_type), intent(inout) :: self
      integer :: kept, asked, fresh

      kept = self%filled - self%next + 1
      self%buffer(:kept) = self%buffer(self%next:self%filled)
      asked = buffer_size - kept
      fresh = int(c_fread(self%buffer(kept + 1:), 1_c_size_t, int(asked, c_size_t), self%stream))
      self%next = 1
      self%filled = kept + fresh
      self%ended = fresh < asked
      if (self%ended) self%failed = c_ferror(self%stream) /= 0
   end subroutine refill

   ! Whether a byte separates words: space, and tab to carriage return. Other control characters belong to words.
   elemental logical function is_blank(byte)
      character(len=1), intent(in) :: byte

      is_blank = byte == " " .or. (byte >= achar(9) .and. byte <= achar(13))
   end function is_blank

   subroutine skip_blanks(self)
      class(line_reader_type), intent(inout) :: self

      do while (self%cursor <= self%line_end)
         if (.not. is_blank(self%buffer(self%cursor:self%cursor))) return
         self%cursor = self%cursor + 1
      end do
   end subroutine skip_blanks

   ! Finds the next word and advances past it.
   subroutine find_word(self, first, last)
      class(line_reader_type), intent(inout) :: self
      integer, intent(out) :: first, last

      call skip_blanks(self)
      first = self%cursor
      do while (self%cursor <= self%line_end)
         if (is_blank(self%buffer(self%cursor:self%cursor))) exit
         self%cursor = self%cursor + 1
      end do
      last = self%cursor - 1
   end subroutine find_word

   subroutine next_word(self, word)
      class(line_reader_type), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: word
      integer :: first, last

      call find_word(self, first, last)
      word = self%buffer(first:last)
   end subroutine next_word

   pure logical function at_end(self)
      class(line_reader_type), intent(in) :: self
      integer :: place

      at_end = .true.
      do place = self%cursor, self%line_end
         if (.not. is_blank(self%buffer(place:place))) at_end = .false.
      end do
   end function at_end

   !> Sets `valid` to false if the word is not an integer, or none is left; else leaves it unchanged.
   subroutine next_integer(self, number, valid)
      class(line_reader_type), intent(inout) :: self
      integer(long), intent(out) :: number
      logical, intent(inout) :: valid
      integer :: first, last, place, digit
      logical :: negative

      call find_word(self, first, last)
      call take_sign(self%buffer(first:last), first, negative)
      number = 0
      if (first > last .or. last - first > 17) valid = .false.
      do place = first, min(last, first + 17)
         digit = iachar(self%buffer(place:place)) - iachar("0")
         if (digit < 0 .or. digit > 9) then
            valid = .false.
            return
         end if
         number = 10*number + digit
      end do
      if (negative) number = -number
   end subroutine next_integer

   ! Advances `first` past the sign that a word may begin with.
   pure subroutine take_sign(word, first, negative)
      character(len=*), intent(in) :: word
      integer, intent(inout) :: first
      logical, intent(out) :: negative

      negative = .false.
      if (len(word) == 0) return
      negative = word(1:1) == "-"
      if (negative .or. word(1:1) == "+") first = first + 1
   end subroutine take_sign

   !> As `next_integer`; accepts numbers as Fortran and C write them: 1, 1.5e3, .5D-2, 1.5-300, nan, -inf.
   subroutine next_real(self, number, valid)
      class(line_reader_type), intent(inout) :: self
      real(wp), intent(out) :: number
      logical, intent(inout) :: valid
      integer :: first, last

      call find_word(self, first, last)
      call read_real(self%buffer(first:last), number, valid)
   end subroutine next_real

   ! Converts a word to a real: by strtod, which is much faster, or by Fortran if that stops early, at exponents in Fortran notation
   ! or if the locale has another decimal point.
   subroutine read_real(word, number, valid)
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: number
      logical, intent(inout) :: valid
      character(kind=c_char, len=1), target :: bytes(len(word) + 1)
      integer(c_intptr_t) :: after
      integer :: i, status

      number = 0
      if (.not. is_decimal(lower_case(word))) then
         call read_special(lower_case(word), number, valid)
         return
      end if
      do i = 1, len(word)
         bytes(i) = word(i:i)
      end do
      bytes(len(word) + 1) = c_null_char
      number = real(c_strtod(bytes, after), wp)
      if (after - transfer(c_loc(bytes), after) == len(word)) return
      read (word, *, iostat=status) number
      if (status /= 0) valid = .false.
   end subroutine read_real

   ! Whether a word in lower case is a decimal number: digits with or without a point, and an optional exponent.
   pure logical function is_decimal(word)
      character(len=*), intent(in) :: word
      integer :: first, last, point

      first = 1
      if (scan(word, "+-") == 1) first = 2
      last = first + verify(word(first:)//" ", "0123456789.") - 2
      point = index(word(first:last), ".")
      is_decimal = last - first + 1 > min(point, 1) .and. index(word(first:last), ".", back=.true.) == point
      if (last == len(word)) return
      first = last + 1
      if (scan(word(first:first), "ed") == 1) first = first + 1
      if (first > len(word)) then
         is_decimal = .false.
         return
      end if
      if (scan(word(first:first), "+-") == 1) then
         first = first + 1
      else if (first == last + 1) then
         is_decimal = .false.
      end if
      is_decimal = is_decimal .and. first <= len(word) .and. verify(word(first:), "0123456789") == 0
   end function is_decimal

   ! Converts nan and inf.
   subroutine read_special(word, number, valid)
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: number
      logical, intent(inout) :: valid

      number = 0
      select case (word)
      case ("nan", "+nan", "-nan")
         number = ieee_value(number, ieee_quiet_nan)
      case ("inf", "infinity", "+inf", "+infinity")
         number = ieee_value(number, ieee_positive_inf)
      case ("-inf", "-infinity")
         number = ieee_value(number, ieee_negative_inf)
      case default
         valid = .false.
      end select
   end subroutine read_special

   !> The same word in lower-case ASCII letters.
   pure function lower_case(word) result(lower)
      character(len=*), intent(in) :: word
      character(len=len(word)) :: lower
      integer :: i

      lower = word
      do i = 1, len(word)
         if (word(i:i) >= "A" .and. word(i:i) <= "Z") lower(i:i) = achar(iachar(word(i:i)) + 32)
      end do
   end function lower_case
end module kschur_line_reader
