!> Operating-system services.
module cli_system
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_funptr, c_int, c_intptr_t, c_null_char, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: error_unit
   use cli_colour, only: coloured_error, red
   use cli_processes, only: end_processes
   use kschur, only: error_file, error_library, error_type, long, new_error, wp
   implicit none
   private
   public :: check_new_file, check_new_folder, check_output, complain, end_program, ends_with, ignore_size_signal, &
      is_folder, &
      peak_memory_bytes, print_line, real_path, same_file, standard_error_is_terminal, wall_seconds

   ! Whether a line for standard output was lost.
   logical :: output_lost = .false.

   interface
      integer(c_int) function c_access(path, mode) bind(c, name="access")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_access

      type(c_ptr) function c_realpath(path, resolved) bind(c, name="realpath")
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: resolved(*)
      end function c_realpath

      integer(c_int) function c_puts(line) bind(c, name="puts")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: line(*)
      end function c_puts

      integer(c_int) function c_fflush(stream) bind(c, name="fflush")
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fflush

      subroutine c_exit(status) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit

      integer(c_int) function c_isatty(descriptor) bind(c, name="isatty")
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_isatty

      type(c_funptr) function c_signal(number, action) bind(c, name="signal")
         import :: c_funptr, c_int
         integer(c_int), value :: number
         type(c_funptr), value :: action
      end function c_signal
   end interface

contains

   !> Wall-clock time in seconds since an arbitrary moment.
   real(wp) function wall_seconds()
      integer(long) :: now, rate

      call system_clock(now, rate)
      wall_seconds = real(now, wp)/real(rate, wp)
   end function wall_seconds

   !> Ends the program, in all its processes, with this exit status and without further words.
   subroutine end_program(status)
      integer, intent(in) :: status

      flush (error_unit)
      call end_processes(status)
      call c_exit(int(status, c_int))
   end subroutine end_program

   !> Turns exceeding the file size limit into a write error, as on a full disk, instead of a signal that ends the program.
   subroutine ignore_size_signal()
      integer(c_int), parameter :: sigxfsz = 25
      ! SIG_IGN.
      integer(c_intptr_t), parameter :: ignore = 1
      type(c_funptr) :: before

      before = c_signal(sigxfsz, transfer(ignore, before))
   end subroutine ignore_size_signal

   !> Prints a line on standard output, by C: gfortran does not report a full disk or closed output; `check_output` does.
   subroutine print_line(line)
      character(len=*), intent(in) :: line

      if (c_puts(line//c_null_char) < 0) output_lost = .true.
   end subroutine print_line

   !> Fails if output of `print_line` was lost, unless `error` is already raised.
   subroutine check_output(error)
      type(error_type), allocatable, intent(inout) :: error

      if (c_fflush(c_null_ptr) /= 0) output_lost = .true.
      if (output_lost .and. .not. allocated(error)) &
         call new_error(error, error_library, "standard output cannot be written to")
   end subroutine check_output

   !> Prints a line on standard error, after the name of the program. Shows control characters in outside text as \xHH; omits
   !> the middle of a long message.
   subroutine complain(message)
      character(len=*), intent(in) :: message
      character(len=*), parameter :: name = "kschur: ", gap = " ... "
      integer, parameter :: longest = 240 - len(name), end_kept = 90
      character(len=:), allocatable :: line
      integer :: first, last

      line = escaped(message)
      if (len(line) > longest) then
         first = longest - len(gap) - end_kept
         last = len(line) - end_kept + 1
         ! Not within a character of UTF-8.
         do while (is_continuation(line(first + 1:first + 1)))
            first = first - 1
         end do
         do while (is_continuation(line(last:last)))
            last = last + 1
         end do
         line = line(:first)//gap//line(last:)
      end if
      write (error_unit, "(2a)") coloured_error(name, red), line
   end subroutine complain

   ! Shows control characters and bytes that are not UTF-8 as \xHH.
   function escaped(message) result(line)
      character(len=*), intent(in) :: message
      character(len=:), allocatable :: line
      character(len=4) :: code
      integer :: i, j, length

      line = ""
      i = 1
      do while (i <= len(message))
         length = length_of_character(message(i:))
         if (length > 0) then
            line = line//message(i:i + length - 1)
         else
            j = min(i + 1, len(message))
            length = merge(2, 1, iachar(message(i:i)) == 194 .and. is_continuation(message(j:j)))
            do j = i, i + length - 1
               write (code, "(a, z2.2)") "\x", iachar(message(j:j))
               line = line//code
            end do
         end if
         i = i + length
      end do
   end function escaped

   ! Number of bytes of the UTF-8 character that a text begins with; 0 if it is none, or a control character.
   pure integer function length_of_character(text) result(length)
      character(len=*), intent(in) :: text
      integer :: first, i

      first = iachar(text(1:1))
      length = 1
      if (first >= 192) length = 2
      if (first >= 224) length = 3
      if (first >= 240) length = 4
      if (first < 32 .or. first == 127 .or. (first >= 128 .and. first < 194) .or. first >= 245 .or. length > len(text)) length = 0
      do i = 2, length
         if (.not. is_continuation(text(i:i))) length = 0
         if (length == 0) exit
      end do
      if (first == 194 .and. length == 2) length = merge(2, 0, iachar(text(2:2)) >= 160)
   end function length_of_character

   ! Whether a byte continues a character of UTF-8: it is not its first.
   elemental logical function is_continuation(byte)
      character(len=1), intent(in) :: byte

      is_continuation = iachar(byte) >= 128 .and. iachar(byte) < 192
   end function is_continuation

   !> Whether standard error is a terminal.
   logical function standard_error_is_terminal()
      standard_error_is_terminal = c_isatty(2_c_int) == 1
   end function standard_error_is_terminal

   !> Whether `path` is a folder.
   logical function is_folder(path)
      character(len=*), intent(in) :: path

      is_folder = c_access(path//"/"//c_null_char, 0_c_int) == 0
   end function is_folder

   !> Whether a path has this ending, after a name.
   pure logical function ends_with(path, ending)
      character(len=*), intent(in) :: path, ending

      ends_with = .false.
      if (len(path) > len(ending)) ends_with = path(len(path) - len(ending) + 1:) == ending
   end function ends_with

   !> Whether two paths name one existing file.
   logical function same_file(first, second)
      character(len=*), intent(in) :: first, second
      character(len=:), allocatable :: resolved, other

      resolved = real_path(first)
      other = real_path(second)
      same_file = resolved /= "" .and. resolved == other
   end function same_file

   ! Canonical path; empty if the file does not exist.
   function real_path(path) result(resolved)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: resolved
      integer, parameter :: longest_path = 4096
      character(kind=c_char, len=longest_path) :: buffer

      resolved = ""
      if (.not. c_associated(c_realpath(path//c_null_char, buffer))) return
      resolved = buffer(:index(buffer, c_null_char) - 1)
   end function real_path

   !> Fails if a file `path` evidently cannot be created or replaced; changes nothing.
   subroutine check_new_file(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error

      if (is_folder(path)) then
         call new_error(error, error_file, path//": a folder, not a place for a file")
      else if (index(path, "/dev/") == 1 .and. index(path, "/dev/shm/") /= 1) then
         call new_error(error, error_file, path//": a pipe or a device, not a place for a file")
      else
         call check_writable(path(:index(path, "/", back=.true.)), path, error)
      end if
   end subroutine check_new_file

   !> Fails if `path` is not a writable folder, and cannot become one.
   subroutine check_new_folder(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical :: exists

      inquire (file=path, exist=exists)
      if (is_folder(path)) then
         call check_writable(path, path, error)
      else if (exists) then
         call new_error(error, error_file, path//": a file, not a place for a folder")
      else
         call check_writable(path(:index(path, "/", back=.true.)), path, error)
      end if
   end subroutine check_new_folder

   ! Fails if a folder is not writable; the current one has an empty name.
   subroutine check_writable(folder, path, error)
      character(len=*), intent(in) :: folder
      !> Path to be created, for messages.
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer(c_int), parameter :: write_and_search = 3
      character(len=:), allocatable :: place

      place = folder
      if (place == "") place = "."
      if (.not. is_folder(place)) then
         call new_error(error, error_file, path//": there is no folder "//place//" to write it to")
      else if (c_access(place//c_null_char, write_and_search) /= 0) then
         call new_error(error, error_file, path//": the folder "//place//" may not be written to")
      end if
   end subroutine check_writable

   !> Peak memory of the program; -1 if unknown. (getrusage includes what ran before `exec`.)
   integer(long) function peak_memory_bytes()
      character(len=128) :: line
      integer :: unit, status
      logical :: exists

      peak_memory_bytes = -1
      inquire (file="/proc/self/status", exist=exists)
      if (.not. exists) return
      open (newunit=unit, file="/proc/self/status", action="read", status="old", iostat=status)
      do while (status == 0)
         read (unit, "(a)", iostat=status) line
         if (status /= 0) exit
         if (line(:6) /= "VmHWM:") cycle
         read (line(7:index(line, "kB") - 1), *) peak_memory_bytes
         peak_memory_bytes = 1024*peak_memory_bytes
         exit
      end do
      close (unit, iostat=status)
   end function peak_memory_bytes
end module cli_system
