!> File-system operations that Fortran does not provide. Output is written into a staging folder beside its final place, and is
!> renamed after it is complete and flushed to disk, so that no incomplete output appears.
module kschur_files
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long_long, c_null_char, c_size_t
   use kschur_error, only: error_type, new_error, error_file
   use kschur_kinds, only: long
   use kschur_text, only: text
   implicit none
   private
   public :: staging_type, check_length, is_link, kind_of_file, last_reason, make_folder, remove_file, require_space, &
      system_reason

   !> Results of `kind_of_file`.
   integer(c_int), parameter, public :: no_file = 0, regular_file = 1, folder = 2, pipe_or_device = 3

   integer, parameter :: longest_path = 4096
   integer(c_int), parameter :: everyone = int(o'777', c_int)

   !> A staging folder beside the final place of an output, with a name unique to the process. Folders that killed runs left are
   !> removed when the same output is staged again.
   type :: staging_type
      private
      !> The file or folder to write; empty if the output has no final place.
      character(len=:), allocatable, public :: path
      character(len=:), allocatable :: target, name
      integer(c_int) :: descriptor = -1
   contains
      !> Makes the folder; fails with the place and the system's reason.
      procedure :: open => open_staging
      !> Creates the file at `path`; fails if that many bytes cannot be allocated for it.
      procedure :: reserve
      !> Moves the output to its final place, unless an error is raised; removes the staging folder.
      procedure :: finish => finish_staging
   end type staging_type

   interface
      integer(c_int) function c_kind_of_file(path) bind(c, name="kschur_kind_of_file")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_kind_of_file

      integer(c_int) function c_stage(path, staging) bind(c, name="kschur_stage")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: staging(*)
      end function c_stage

      integer(c_int) function c_reserve(path, bytes) bind(c, name="kschur_reserve")
         import :: c_char, c_int, c_long_long
         character(kind=c_char), intent(in) :: path(*)
         integer(c_long_long), value :: bytes
      end function c_reserve

      subroutine c_unstage(descriptor, staging) bind(c, name="kschur_unstage")
         import :: c_char, c_int
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: staging(*)
      end subroutine c_unstage

      integer(c_int) function c_publish(finished, path) bind(c, name="kschur_publish")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: finished(*), path(*)
      end function c_publish

      integer(c_int) function c_errno() bind(c, name="kschur_errno")
         import :: c_int
      end function c_errno

      subroutine c_reason(failure, words, size) bind(c, name="kschur_system_reason")
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: failure
         character(kind=c_char), intent(out) :: words(*)
         integer(c_size_t), value :: size
      end subroutine c_reason

      integer(c_int) function c_remove(path) bind(c, name="remove")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_remove

      integer(c_int) function c_has_room(path, bytes) bind(c, name="kschur_has_room")
         import :: c_char, c_int, c_long_long
         character(kind=c_char), intent(in) :: path(*)
         integer(c_long_long), value :: bytes
      end function c_has_room

      integer(c_int) function c_mkdir(path, mode) bind(c, name="mkdir")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir

      ! ssize_t has the size of size_t, but is signed, as integers of Fortran are.
      integer(c_size_t) function c_readlink(path, target, size) bind(c, name="readlink")
         import :: c_char, c_size_t
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: target(*)
         integer(c_size_t), value :: size
      end function c_readlink
   end interface

contains

   subroutine open_staging(self, path, error)
      class(staging_type), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      character(kind=c_char, len=1) :: bytes(longest_path)
      integer(c_int) :: kind
      integer :: i

      self%path = ""
      if (allocated(error)) return
      kind = kind_of_file(path)
      if (is_among_devices(path) .or. kind == pipe_or_device) then
         call new_error(error, error_file, path//": a pipe or a device, not a place for a file")
         return
      end if
      self%target = path
      self%descriptor = c_stage(path//c_null_char, bytes)
      if (self%descriptor < 0) then
         call new_error(error, error_file, path//": cannot be written: "//trim(last_reason()))
         return
      end if
      self%name = ""
      do i = 1, longest_path
         if (bytes(i) == c_null_char) exit
         self%name = self%name//bytes(i)
      end do
      self%path = self%name//"/whole"
   end subroutine open_staging

   ! Whether a path is in /dev, where a link to a regular file must not be replaced. Shared memory, which is mounted there, is
   ! treated as any other folder.
   pure logical function is_among_devices(path)
      character(len=*), intent(in) :: path

      is_among_devices = index(path, "/dev/") == 1 .and. index(path, "/dev/shm/") /= 1
   end function is_among_devices

   subroutine reserve(self, bytes, error)
      class(staging_type), intent(in) :: self
      integer(long), intent(in) :: bytes
      type(error_type), allocatable, intent(inout) :: error
      integer(c_int) :: failure

      if (allocated(error)) return
      failure = c_reserve(self%path//c_null_char, int(bytes, c_long_long))
      if (failure /= 0) call new_error(error, error_file, self%target//": cannot be written: "//trim(system_reason(failure)))
   end subroutine reserve

   subroutine finish_staging(self, error)
      class(staging_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      integer(c_int) :: failure

      if (self%descriptor < 0) return
      if (.not. allocated(error)) then
         failure = c_publish(self%path//c_null_char, self%target//c_null_char)
         if (failure /= 0) call new_error(error, error_file, self%target//": cannot be replaced by what was just written: "// &
            trim(system_reason(failure)))
      end if
      call c_unstage(self%descriptor, self%name//c_null_char)
      self%descriptor = -1
   end subroutine finish_staging

   !> The system's message for the last error.
   function last_reason() result(reason)
      character(len=128) :: reason

      reason = system_reason(c_errno())
   end function last_reason

   !> The system's message for a value of errno.
   function system_reason(failure) result(reason)
      integer(c_int), intent(in) :: failure
      character(len=128) :: reason
      character(kind=c_char) :: bytes(len(reason))
      integer :: i

      call c_reason(failure, bytes, size(bytes, kind=c_size_t))
      reason = ""
      do i = 1, size(bytes)
         if (bytes(i) == c_null_char) exit
         reason(i:i) = bytes(i)
      end do
   end function system_reason

   !> What a path names, after links: `no_file`, `regular_file`, `folder` or `pipe_or_device`.
   integer(c_int) function kind_of_file(path)
      character(len=*), intent(in) :: path

      kind_of_file = c_kind_of_file(path//c_null_char)
   end function kind_of_file

   !> Compares the length of a closed file with the number of bytes written; if they differ and `status` is 0, sets status and
   !> reason. gfortran does not report a full disk.
   subroutine check_length(path, bytes, status, reason)
      character(len=*), intent(in) :: path
      integer(long), intent(in) :: bytes
      integer, intent(inout) :: status
      character(len=*), intent(inout) :: reason
      integer(long) :: found

      if (status /= 0) return
      inquire (file=path, size=found)
      if (found == bytes) return
      status = 1
      reason = "the disk is full"
   end subroutine check_length

   !> Removes a file, if it exists.
   subroutine remove_file(path)
      character(len=*), intent(in) :: path
      integer(c_int) :: status

      status = c_remove(path//c_null_char)
   end subroutine remove_file

   !> Whether `path` is a symbolic link, wherever that leads.
   logical function is_link(path)
      character(len=*), intent(in) :: path
      character(kind=c_char) :: target(1)

      is_link = c_readlink(path//c_null_char, target, 1_c_size_t) >= 0
   end function is_link

   !> Fails if the file system of a folder has less free space than `bytes`; does nothing if that is unknown.
   subroutine require_space(path, bytes, error)
      character(len=*), intent(in) :: path
      integer(long), intent(in) :: bytes
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (c_has_room(path//c_null_char, int(bytes, c_long_long)) == 0) call new_error(error, error_file, &
         "the disk has no room for "//text(bytes)//" bytes")
   end subroutine require_space

   !> Creates a folder, if it does not exist. A missing parent is not reported here: writing into the folder will fail.
   subroutine make_folder(path)
      character(len=*), intent(in) :: path
      integer(c_int) :: status

      status = c_mkdir(path//c_null_char, everyone)
   end subroutine make_folder
end module kschur_files
