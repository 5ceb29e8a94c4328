!> Binary file of the state of a computation (checkpoint). The same calls in the same order write it and read it. A checksum
!> over the whole file is verified before any value is read.
module kschur_archive
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_size_t
   use kschur_error, only: error_type, new_error, error_file, error_input, error_memory
   use kschur_files, only: system_reason
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: archive_type, checksum

   !> An open file. The first failure is recorded, and `close` reports it.
   type :: archive_type
      private
      type(c_ptr) :: handle = c_null_ptr
      character(len=:), allocatable :: path
      integer(c_int) :: failure = 0
      logical :: saving = .false.
   contains
      procedure :: open => open_archive
      !> Writes a variable, or reads it back. Arrays are allocated with the shape that was written; of a matrix with `used` only
      !> the first `used` columns are stored.
      generic :: carry => carry_integer, carry_long, carry_logical, carry_real, carry_text, carry_integers, carry_reals, &
         carry_complexes, carry_real_columns, carry_complex_columns
      procedure :: close => close_archive
      !> Returns whether a call failed; records that memory for the data read could not be allocated.
      procedure :: has_failed
      procedure :: record_no_memory
      procedure, private :: carry_integer
      procedure, private :: carry_long
      procedure, private :: carry_logical
      procedure, private :: carry_real
      procedure, private :: carry_text
      procedure, private :: carry_integers
      procedure, private :: carry_reals
      procedure, private :: carry_complexes
      procedure, private :: carry_real_columns
      procedure, private :: carry_complex_columns
      procedure, private :: carry_shape
      procedure, private :: carry_words
   end type archive_type

   integer(c_int), parameter :: damaged = -1, no_memory = -2
   integer(c_size_t), parameter :: word = storage_size(1_long)/8

   !> Extends the checksum `before` by the data x.
   interface checksum
      module procedure checksum_of_longs, checksum_of_integers, checksum_of_reals
   end interface checksum

   interface
      type(c_ptr) function c_open(path, saving, failure) bind(c, name="kschur_archive_open")
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: saving
         integer(c_int), intent(out) :: failure
      end function c_open

      integer(c_int) function c_carry(archive, words, bytes) bind(c, name="kschur_archive_carry")
         import :: c_int, c_ptr, c_size_t
         type(c_ptr), value :: archive, words
         integer(c_size_t), value :: bytes
      end function c_carry

      integer(c_int) function c_close(archive) bind(c, name="kschur_archive_close")
         import :: c_int, c_ptr
         type(c_ptr), value :: archive
      end function c_close

      integer(c_int64_t) function c_checksum(sum, words, bytes) bind(c, name="kschur_checksum")
         import :: c_int64_t, c_ptr, c_size_t
         integer(c_int64_t), value :: sum
         type(c_ptr), value :: words
         integer(c_size_t), value :: bytes
      end function c_checksum
   end interface

contains

   !> Fails if the file cannot be opened, or was not written by an archive.
   subroutine open_archive(self, path, saving, error)
      class(archive_type), intent(out) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: saving
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%path = path
      self%saving = saving
      self%handle = c_open(path//c_null_char, merge(1_c_int, 0_c_int, saving), self%failure)
      if (.not. c_associated(self%handle)) call self%close(error)
   end subroutine open_archive

   !> Closes the file, and reports the first failure since it was opened.
   subroutine close_archive(self, error)
      class(archive_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      integer(c_int) :: failure

      failure = 0
      if (c_associated(self%handle)) failure = c_close(self%handle)
      self%handle = c_null_ptr
      if (self%failure == 0) self%failure = failure
      if (allocated(error) .or. self%failure == 0) return
      if (self%failure == damaged) then
         call new_error(error, error_input, self%path//": not a checkpoint, or a damaged one")
      else if (self%failure == no_memory) then
         call new_error(error, error_memory, "there is no memory for the checkpoint "//self%path)
      else if (self%saving) then
         call new_error(error, error_file, self%path//": cannot be written: "//trim(system_reason(self%failure)))
      else
         call new_error(error, error_input, self%path//": cannot be read: "//trim(system_reason(self%failure)))
      end if
   end subroutine close_archive

   pure logical function has_failed(self)
      class(archive_type), intent(in) :: self

      has_failed = self%failure /= 0
   end function has_failed

   ! Records that memory was short, for `close` to report.
   pure subroutine record_no_memory(self)
      class(archive_type), intent(inout) :: self

      self%failure = no_memory
   end subroutine record_no_memory

   ! Writes or reads 8-byte words, unless the archive has failed.
   subroutine carry_words(self, words, count)
      class(archive_type), intent(inout) :: self
      type(c_ptr), intent(in) :: words
      integer(c_size_t), intent(in) :: count

      if (self%failure == 0 .and. count > 0) self%failure = c_carry(self%handle, words, word*count)
   end subroutine carry_words

   subroutine carry_long(self, x)
      class(archive_type), intent(inout) :: self
      integer(long), target, intent(inout) :: x

      call self%carry_words(c_loc(x), 1_c_size_t)
   end subroutine carry_long

   subroutine carry_integer(self, x)
      class(archive_type), intent(inout) :: self
      integer, intent(inout) :: x
      integer(long) :: held

      held = x
      call self%carry_long(held)
      if (self%failure == 0) x = int(held)
   end subroutine carry_integer

   subroutine carry_logical(self, x)
      class(archive_type), intent(inout) :: self
      logical, intent(inout) :: x
      integer :: held

      held = merge(1, 0, x)
      call self%carry_integer(held)
      if (self%failure == 0) x = held /= 0
   end subroutine carry_logical

   subroutine carry_real(self, x)
      class(archive_type), intent(inout) :: self
      real(wp), target, intent(inout) :: x

      call self%carry_words(c_loc(x), 1_c_size_t)
   end subroutine carry_real

   ! Stores one character in each 8-byte word.
   subroutine carry_text(self, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(inout) :: x
      integer :: i, code

      do i = 1, len(x)
         code = ichar(x(i:i))
         call self%carry_integer(code)
         if (self%failure == 0) x(i:i) = achar(code)
      end do
   end subroutine carry_text

   subroutine carry_integers(self, x)
      class(archive_type), intent(inout) :: self
      integer, allocatable, intent(inout) :: x(:)
      integer :: length, status, i

      length = 0
      if (self%saving) length = size(x)
      call self%carry_integer(length)
      if (self%failure == 0 .and. .not. self%saving) then
         if (allocated(x)) deallocate (x)
         allocate (x(length), stat=status)
         if (status /= 0) self%failure = no_memory
      end if
      do i = 1, length
         if (self%failure /= 0) exit
         call self%carry_integer(x(i))
      end do
   end subroutine carry_integers

   subroutine carry_reals(self, x)
      class(archive_type), intent(inout) :: self
      real(wp), allocatable, target, intent(inout) :: x(:)
      integer :: length, status

      length = 0
      if (self%saving) length = size(x)
      call self%carry_integer(length)
      if (self%failure == 0 .and. .not. self%saving) then
         if (allocated(x)) deallocate (x)
         allocate (x(length), stat=status)
         if (status /= 0) self%failure = no_memory
      end if
      if (self%failure == 0 .and. length > 0) call self%carry_words(c_loc(x), int(length, c_size_t))
   end subroutine carry_reals

   subroutine carry_complexes(self, x)
      class(archive_type), intent(inout) :: self
      complex(wp), allocatable, target, intent(inout) :: x(:)
      integer :: length, status

      length = 0
      if (self%saving) length = size(x)
      call self%carry_integer(length)
      if (self%failure == 0 .and. .not. self%saving) then
         if (allocated(x)) deallocate (x)
         allocate (x(length), stat=status)
         if (status /= 0) self%failure = no_memory
      end if
      if (self%failure == 0 .and. length > 0) call self%carry_words(c_loc(x), 2*int(length, c_size_t))
   end subroutine carry_complexes

   subroutine carry_real_columns(self, x, used)
      class(archive_type), intent(inout) :: self
      real(wp), allocatable, target, intent(inout) :: x(:, :)
      integer, optional, intent(in) :: used
      integer :: extent(2), kept, status

      extent = 0
      if (self%saving) extent = shape(x)
      call self%carry_shape(extent, kept, used)
      if (self%failure == 0 .and. .not. self%saving) then
         if (allocated(x)) then
            if (any(shape(x) /= extent)) deallocate (x)
         end if
         status = 0
         if (.not. allocated(x)) allocate (x(extent(1), extent(2)), stat=status)
         if (status /= 0) self%failure = no_memory
      end if
      if (self%failure == 0 .and. min(kept, extent(1)) > 0) &
         call self%carry_words(c_loc(x), int(extent(1), c_size_t)*kept)
   end subroutine carry_real_columns

   subroutine carry_complex_columns(self, x, used)
      class(archive_type), intent(inout) :: self
      complex(wp), allocatable, target, intent(inout) :: x(:, :)
      integer, optional, intent(in) :: used
      integer :: extent(2), kept, status

      extent = 0
      if (self%saving) extent = shape(x)
      call self%carry_shape(extent, kept, used)
      if (self%failure == 0 .and. .not. self%saving) then
         if (allocated(x)) then
            if (any(shape(x) /= extent)) deallocate (x)
         end if
         status = 0
         if (.not. allocated(x)) allocate (x(extent(1), extent(2)), stat=status)
         if (status /= 0) self%failure = no_memory
      end if
      if (self%failure == 0 .and. min(kept, extent(1)) > 0) &
         call self%carry_words(c_loc(x), 2*int(extent(1), c_size_t)*kept)
   end subroutine carry_complex_columns

   ! Writes the extents of an array and the number of its columns in use, or reads them.
   subroutine carry_shape(self, extent, kept, used)
      class(archive_type), intent(inout) :: self
      integer, intent(inout) :: extent(2)
      integer, intent(out) :: kept
      integer, optional, intent(in) :: used

      call self%carry_integer(extent(1))
      call self%carry_integer(extent(2))
      kept = extent(2)
      if (present(used)) kept = used
      call self%carry_integer(kept)
   end subroutine carry_shape

   integer(long) function checksum_of_longs(before, x) result(sum)
      integer(long), intent(in) :: before
      integer(long), contiguous, target, intent(in) :: x(:)

      sum = before
      if (size(x) > 0) sum = c_checksum(before, c_loc(x), size(x, kind=c_size_t)*word)
   end function checksum_of_longs

   integer(long) function checksum_of_integers(before, x) result(sum)
      integer(long), intent(in) :: before
      integer, contiguous, target, intent(in) :: x(:)

      sum = before
      if (size(x) > 0) sum = c_checksum(before, c_loc(x), size(x, kind=c_size_t)*(storage_size(1)/8))
   end function checksum_of_integers

   integer(long) function checksum_of_reals(before, x) result(sum)
      integer(long), intent(in) :: before
      real(wp), contiguous, target, intent(in) :: x(:)

      sum = before
      if (size(x) > 0) sum = c_checksum(before, c_loc(x), size(x, kind=c_size_t)*word)
   end function checksum_of_reals
end module kschur_archive
