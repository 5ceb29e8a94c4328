!> Reads string attributes of an HDF5 file, of fixed or variable length, ASCII or UTF-8. HDF5 1.10 does not validate
!> variable-length strings and crashes on damaged ones: HDF5 reads only the reference, kschur_hdf5_heap.c the heap.
module kschur_hdf5_strings
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funloc, c_funptr, c_int, c_int64_t, c_int8_t, &
      c_loc, c_null_char, c_ptr
   use hdf5, only: hid_t, hsize_t, size_t, h5aget_storage_size_f, h5aread_f, h5fclose_f, h5fget_create_plist_f, h5iget_file_id_f, &
      h5pclose_f, h5pget_userblock_f, h5tclose_f, h5tcreate_f, h5tget_class_f, h5tget_size_f, h5tis_variable_str_f, H5T_OPAQUE_F, &
      H5T_STRING_F
   implicit none
   private
   public :: read_string_value

   ! Largest accepted length.
   integer(size_t), parameter :: longest = 2**20
   ! Length, address and index in the heap.
   integer(size_t), parameter :: reference_bytes = 16
   integer(c_int), parameter :: soft_conversion = 1
   character(kind=c_char, len=*), parameter :: conversion_name = "kschur"//c_null_char

   interface
      integer(c_int) function c_register(kind, name, source, target, conversion) bind(c, name="H5Tregister")
         import :: c_char, c_funptr, c_int, c_int64_t
         integer(c_int), value :: kind
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int64_t), value :: source, target
         type(c_funptr), value :: conversion
      end function c_register

      integer(c_int) function c_unregister(kind, name, source, target, conversion) bind(c, name="H5Tunregister")
         import :: c_char, c_funptr, c_int, c_int64_t
         integer(c_int), value :: kind
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int64_t), value :: source, target
         type(c_funptr), value :: conversion
      end function c_unregister

      integer(c_int) function c_get_descriptor(file, access, descriptor) bind(c, name="H5Fget_vfd_handle")
         import :: c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: file, access
         type(c_ptr), intent(out) :: descriptor
      end function c_get_descriptor

      integer(c_int) function c_heap_object(file, base, reference, bytes) bind(c, name="kschur_heap_object")
         import :: c_char, c_int, c_int64_t, c_int8_t
         integer(c_int), value :: file
         integer(c_int64_t), value :: base
         integer(c_int8_t), intent(in) :: reference(*)
         character(kind=c_char), intent(out) :: bytes(*)
      end function c_heap_object

      subroutine c_as_they_are() bind(c, name="kschur_as_they_are")
      end subroutine c_as_they_are
   end interface

contains

   !> Reads a string attribute; `status` is negative if it is none, or damaged.
   subroutine read_string_value(value, attribute, type, status)
      character(len=:), allocatable, intent(out) :: value
      integer(hid_t), intent(in) :: attribute, type
      integer, intent(out) :: status
      integer :: class
      logical :: variable

      value = ""
      call h5tget_class_f(type, class, status)
      if (class /= H5T_STRING_F) status = -1
      if (status == 0) call h5tis_variable_str_f(type, variable, status)
      if (status < 0) return
      if (variable) then
         call read_variable_string(value, attribute, type, status)
      else
         call read_fixed_string(value, attribute, type, status)
      end if
   end subroutine read_string_value

   ! Reads a string of variable length: its reference by HDF5, its bytes from the heap.
   subroutine read_variable_string(value, attribute, type, status)
      character(len=:), allocatable, intent(out) :: value
      integer(hid_t), intent(in) :: attribute, type
      integer, intent(out) :: status
      integer(c_int8_t) :: reference(reference_bytes)
      integer(hsize_t) :: base
      integer(hid_t) :: file, creation
      character(kind=c_char), allocatable :: bytes(:)
      integer(c_int), pointer :: descriptor
      type(c_ptr) :: address
      integer :: ignored

      call read_reference(reference, attribute, type, status)
      value = ""
      if (status == 0) call h5iget_file_id_f(attribute, file, status)
      if (status < 0) return
      call h5fget_create_plist_f(file, creation, status)
      if (status == 0) then
         call h5pget_userblock_f(creation, base, status)
         call h5pclose_f(creation, ignored)
      end if
      if (status == 0) status = c_get_descriptor(int(file, c_int64_t), 0_c_int64_t, address)
      if (status == 0 .and. length_in(reference) <= longest .and. c_associated(address)) then
         call c_f_pointer(address, descriptor)
         allocate (bytes(length_in(reference)))
         status = c_heap_object(descriptor, int(base, c_int64_t), reference, bytes)
         if (status == 0) call join(bytes, value)
      else
         status = -1
      end if
      call h5fclose_f(file, ignored)
   end subroutine read_variable_string

   ! Reads the reference to a variable-length string as raw bytes: with a conversion that does nothing, HDF5 does not follow it.
   subroutine read_reference(reference, attribute, type, status)
      integer(c_int8_t), target, intent(out) :: reference(reference_bytes)
      integer(hid_t), intent(in) :: attribute, type
      integer, intent(out) :: status
      type(c_ptr) :: buffer
      integer(hid_t) :: opaque
      integer(hsize_t) :: bytes
      integer(c_int64_t) :: ids(2)
      integer(c_int) :: ignored

      reference = 0
      call h5aget_storage_size_f(attribute, bytes, status)
      if (bytes /= reference_bytes) status = -1
      if (status < 0) return
      call h5tcreate_f(H5T_OPAQUE_F, reference_bytes, opaque, status)
      if (status < 0) return
      ids = [type, opaque]
      status = c_register(soft_conversion, conversion_name, ids(1), ids(2), c_funloc(c_as_they_are))
      if (status == 0) then
         buffer = c_loc(reference)
         call h5aread_f(attribute, opaque, buffer, status)
         ignored = c_unregister(soft_conversion, conversion_name, ids(1), ids(2), c_funloc(c_as_they_are))
      end if
      call h5tclose_f(opaque, ignored)
   end subroutine read_reference

   ! Length of the string that a reference points to: its first four bytes, little-endian.
   pure integer(size_t) function length_in(reference) result(length)
      integer(c_int8_t), intent(in) :: reference(:)
      integer :: i

      length = 0
      do i = 4, 1, -1
         length = 256*length + iand(int(reference(i), size_t), 255_size_t)
      end do
   end function length_in

   subroutine read_fixed_string(value, attribute, type, status)
      character(len=:), allocatable, intent(out) :: value
      integer(hid_t), intent(in) :: attribute, type
      integer, intent(out) :: status
      character(kind=c_char), allocatable, target :: bytes(:)
      type(c_ptr) :: buffer
      integer(size_t) :: length

      value = ""
      call h5tget_size_f(type, length, status)
      if (length > longest) status = -1
      if (status < 0) return
      allocate (bytes(length))
      buffer = c_loc(bytes)
      call h5aread_f(attribute, type, buffer, status)
      if (status /= 0) return
      call join(bytes, value)
      value = trim(value)
   end subroutine read_fixed_string

   ! The string of the bytes before the first null.
   pure subroutine join(bytes, string)
      character(kind=c_char), intent(in) :: bytes(:)
      character(len=:), allocatable, intent(out) :: string
      integer :: i

      allocate (character(len=size(bytes)) :: string)
      do i = 1, size(bytes)
         string(i:i) = bytes(i)
      end do
      i = index(string, c_null_char)
      if (i > 0) string = string(:i - 1)
   end subroutine join
end module kschur_hdf5_strings
