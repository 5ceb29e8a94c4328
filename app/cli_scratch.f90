!> Temporary folders for the files that a script reads.
module cli_scratch
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_null_char, c_ptr
   use cli_python, only: quoted
   use kschur, only: error_file, error_type, new_error
   implicit none
   private
   public :: make_scratch, remove_scratch

   interface
      type(c_ptr) function c_mkdtemp(template) bind(c, name="mkdtemp")
         import :: c_char, c_ptr
         character(kind=c_char), intent(inout) :: template(*)
      end function c_mkdtemp
   end interface

contains

   !> Makes a temporary folder beside the file that a script is to make: a disk with room for that has room for its input.
   subroutine make_scratch(path, folder, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: folder
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char, len=len(path) + 16) :: template

      template = path//".partial-XXXXXX"//c_null_char
      if (.not. c_associated(c_mkdtemp(template))) then
         call new_error(error, error_file, path//": no folder can be made beside it")
      else
         folder = template(:index(template, c_null_char) - 1)
      end if
   end subroutine make_scratch

   !> Removes a temporary folder with all that is in it.
   subroutine remove_scratch(folder)
      character(len=*), intent(in) :: folder
      integer :: status

      call execute_command_line("rm -rf -- "//quoted(folder), exitstat=status)
   end subroutine remove_scratch
end module cli_scratch
