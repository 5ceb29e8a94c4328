!> Files and folders, as far as Fortran has no word for them.
module kschur_files
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_size_t
   use kschur_error, only: error_type, new_error, error_file
   use kschur_kinds, only: long
   implicit none
   private
   public :: temporary_name, check_length, replace_file, remove_file, make_folder, is_link

   character(len=*), parameter :: mark = ".partial-"
   ! Of the number of a process.
   integer, parameter :: longest_number = 10

   interface
      integer(c_int) function c_rename(from, to) bind(c, name="rename")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      integer(c_int) function c_remove(path) bind(c, name="remove")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_remove

      integer(c_int) function c_mkdir(path, mode) bind(c, name="mkdir")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir

      ! ssize_t is as long as size_t, but signed: as Fortran's integers are.
      integer(c_size_t) function c_readlink(path, target, size) bind(c, name="readlink")
         import :: c_char, c_size_t
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: target(*)
         integer(c_size_t), value :: size
      end function c_readlink

      integer(c_int) function c_getpid() bind(c, name="getpid")
         import :: c_int
      end function c_getpid
   end interface

contains

   !> A name beside `path` under which to write what will become `path`; no
   !> other process uses it.
   function temporary_name(path) result(name)
      character(len=*), intent(in) :: path
      character(len=len(path) + len(mark) + longest_number) :: name
      character(len=longest_number) :: process

      write (process, "(i10.10)") c_getpid()
      name = path//mark//process
   end function temporary_name

   !> Where `status` is 0, sets it and the reason if a closed file is not as long
   !> as what was written into it: gfortran does not report a disk that fills up.
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

   !> Renames the finished file `temporary` to `path`, which it replaces at once
   !> and as a whole. Where that fails, and where `path` is a device, the
   !> temporary is removed.
   subroutine replace_file(temporary, path, error)
      character(len=*), intent(in) :: temporary, path
      type(error_type), allocatable, intent(out) :: error

      if (index(path, "/dev/") == 1) then
         call new_error(error, error_file, path//": a device, not a place for a file")
      else if (c_rename(temporary//c_null_char, path//c_null_char) /= 0) then
         call new_error(error, error_file, path//": cannot be replaced by the file just written")
      end if
      if (allocated(error)) call remove_file(temporary)
   end subroutine replace_file

   !> Removes a file; nothing happens where there is none.
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

   !> Creates a folder; nothing happens where it exists, or where its parent
   !> does not: writing into it will fail then.
   subroutine make_folder(path)
      character(len=*), intent(in) :: path
      integer(c_int), parameter :: everyone = int(o'777', c_int)
      integer(c_int) :: status

      status = c_mkdir(path//c_null_char, everyone)
   end subroutine make_folder
end module kschur_files
