!> Reads and writes numbers and strings in attributes of an HDF5 file, each identified by the path of its object and its name.
!> Does nothing if `error` is already raised; messages name the attribute, callers add the file.
module kschur_hdf5_attributes
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_ptr
   use hdf5, only: hid_t, hsize_t, h5acreate_by_name_f, h5aopen_by_name_f, h5aexists_by_name_f, h5aget_space_f, &
      h5aget_type_f, h5aread_f, h5awrite_f, h5aclose_f, h5screate_f, h5screate_simple_f, h5sget_simple_extent_npoints_f, &
      h5sclose_f, H5S_SCALAR_F, h5tcopy_f, h5tset_cset_f, h5tclose_f, H5T_CSET_UTF8_F, H5T_STRING
   use kschur_error, only: error_type, new_error, error_file, error_input
   use kschur_hdf5_basics, only: integer_type, real_type, new_complex_type, check_class, relative
   use kschur_hdf5_strings, only: read_string_value
   use kschur_kinds, only: wp, long
   use kschur_text, only: text
   implicit none
   private
   public :: has_attribute, read_attribute, write_attribute

   !> Reads one number, a list of size(value) integers, or one string.
   interface read_attribute
      module procedure read_integer, read_integer_list, read_long, read_real, read_complex, read_string
   end interface read_attribute

   !> Writes a new attribute.
   interface write_attribute
      module procedure write_integer, write_integer_list, write_long, write_real, write_complex, write_string
   end interface write_attribute

contains

   !> Whether the object has an attribute of this name. Fails if HDF5 fails.
   logical function has_attribute(file, object, name, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      has_attribute = .false.
      if (allocated(error)) return
      call h5aexists_by_name_f(file, relative(object), name, has_attribute, status)
      if (status == 0) return
      has_attribute = .false.
      call new_error(error, error_input, label(object, name)//" cannot be looked up: the file is damaged")
   end function has_attribute

   ! Description of an attribute in messages.
   pure function label(object, name)
      character(len=*), intent(in) :: object, name
      character(len=len("attribute ") + len(name) + len(" of ") + len(object)) :: label

      label = "attribute "//name//" of "//object
   end function label

   ! Opens an attribute; fails if it does not exist or has another number of values than `count`.
   subroutine open_attribute(attribute, count, file, object, name, error)
      integer(hid_t), intent(out) :: attribute
      integer(hsize_t), intent(in) :: count
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: space
      integer(hsize_t) :: found
      integer :: status, ignored

      attribute = -1
      if (.not. has_attribute(file, object, name, error)) then
         if (.not. allocated(error)) call new_error(error, error_input, "there is no "//label(object, name))
         return
      end if
      call h5aopen_by_name_f(file, relative(object), name, attribute, status)
      if (status == 0) then
         found = -1
         call h5aget_space_f(attribute, space, status)
         if (status == 0) call h5sget_simple_extent_npoints_f(space, found, status)
         if (status == 0) call h5sclose_f(space, ignored)
         if (found == count) return
         call h5aclose_f(attribute, ignored)
      end if
      call new_error(error, error_input, label(object, name)//" does not have "//text(int(count))//" values")
   end subroutine open_attribute

   ! Reads `count` values to `address`.
   subroutine read_raw(file, object, name, type, count, address, error)
      integer(hid_t), intent(in) :: file, type
      character(len=*), intent(in) :: object, name
      integer(hsize_t), intent(in) :: count
      type(c_ptr), intent(in) :: address
      type(error_type), allocatable, intent(inout) :: error
      ! The HDF5 interface requires a variable for the address.
      type(c_ptr) :: buffer
      integer(hid_t) :: attribute, stored
      integer :: status, ignored

      buffer = address
      call open_attribute(attribute, count, file, object, name, error)
      if (allocated(error)) return
      call h5aget_type_f(attribute, stored, status)
      if (status == 0) then
         call check_class(stored, type, label(object, name), error)
         call h5tclose_f(stored, ignored)
      end if
      if (status == 0 .and. .not. allocated(error)) call h5aread_f(attribute, type, buffer, status)
      call h5aclose_f(attribute, ignored)
      if (status < 0) call new_error(error, error_file, label(object, name)//" cannot be read")
   end subroutine read_raw

   ! Writes `count` values from `address`; a scalar if `count` is 0.
   subroutine write_raw(file, object, name, type, count, address, error)
      integer(hid_t), intent(in) :: file, type
      character(len=*), intent(in) :: object, name
      integer(hsize_t), intent(in) :: count
      type(c_ptr), intent(in) :: address
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: attribute, space
      integer :: status, ignored

      if (allocated(error)) return
      if (count == 0) then
         call h5screate_f(H5S_SCALAR_F, space, status)
      else
         call h5screate_simple_f(1, [count], space, status)
      end if
      if (status == 0) then
         call h5acreate_by_name_f(file, relative(object), name, type, space, attribute, status)
         if (status == 0) then
            call h5awrite_f(attribute, type, address, status)
            call h5aclose_f(attribute, ignored)
         end if
         call h5sclose_f(space, ignored)
      end if
      if (status < 0) call new_error(error, error_file, label(object, name)//" cannot be written")
   end subroutine write_raw

   subroutine read_integer(value, file, object, name, error)
      integer, intent(out) :: value
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer :: list(1)

      call read_integer_list(list, file, object, name, error)
      value = list(1)
   end subroutine read_integer

   subroutine read_integer_list(value, file, object, name, error)
      integer, intent(out) :: value(:)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer(long), target :: stored(size(value))

      stored = 0
      call read_raw(file, object, name, integer_type(), size(value, kind=hsize_t), c_loc(stored), error)
      if (any(stored > huge(value) .or. stored < -huge(value)) .and. .not. allocated(error)) &
         call new_error(error, error_input, label(object, name)//" is beyond "//text(huge(value)))
      if (allocated(error)) stored = 0
      value = int(stored)
   end subroutine read_integer_list

   subroutine read_long(value, file, object, name, error)
      integer(long), intent(out) :: value
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer(long), target :: stored

      stored = 0
      call read_raw(file, object, name, integer_type(), 1_hsize_t, c_loc(stored), error)
      value = stored
   end subroutine read_long

   subroutine read_real(value, file, object, name, error)
      real(wp), intent(out) :: value
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      real(wp), target :: stored

      stored = 0
      call read_raw(file, object, name, real_type(), 1_hsize_t, c_loc(stored), error)
      value = stored
   end subroutine read_real

   subroutine read_complex(value, file, object, name, error)
      complex(wp), intent(out) :: value
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), target :: stored
      integer(hid_t) :: type
      integer :: ignored

      stored = 0
      call new_complex_type(type, error)
      call read_raw(file, object, name, type, 1_hsize_t, c_loc(stored), error)
      if (type >= 0) call h5tclose_f(type, ignored)
      value = stored
   end subroutine read_complex

   subroutine read_string(value, file, object, name, error)
      character(len=:), allocatable, intent(out) :: value
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: attribute, type
      integer :: status, ignored

      value = ""
      call open_attribute(attribute, 1_hsize_t, file, object, name, error)
      if (allocated(error)) return
      call h5aget_type_f(attribute, type, status)
      if (status == 0) then
         call read_string_value(value, attribute, type, status)
         call h5tclose_f(type, ignored)
      end if
      call h5aclose_f(attribute, ignored)
      if (status < 0) call new_error(error, error_input, label(object, name)//" is not a string, or damaged")
   end subroutine read_string

   subroutine write_integer(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error

      call write_long(file, object, name, int(value, long), error)
   end subroutine write_integer

   subroutine write_integer_list(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      integer, intent(in) :: value(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(long), target :: stored(size(value))

      stored = value
      call write_raw(file, object, name, integer_type(), size(value, kind=hsize_t), c_loc(stored), error)
   end subroutine write_integer_list

   subroutine write_long(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      integer(long), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      integer(long), target :: stored

      stored = value
      call write_raw(file, object, name, integer_type(), 0_hsize_t, c_loc(stored), error)
   end subroutine write_long

   subroutine write_real(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      real(wp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      real(wp), target :: stored

      stored = value
      call write_raw(file, object, name, real_type(), 0_hsize_t, c_loc(stored), error)
   end subroutine write_real

   subroutine write_complex(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name
      complex(wp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), target :: stored
      integer(hid_t) :: type
      integer :: ignored

      stored = value
      call new_complex_type(type, error)
      call write_raw(file, object, name, type, 0_hsize_t, c_loc(stored), error)
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine write_complex

   ! As a variable-length UTF-8 string, as h5py does.
   subroutine write_string(file, object, name, value, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: object, name, value
      type(error_type), allocatable, intent(inout) :: error
      character(kind=c_char), target :: bytes(len(value) + 1)
      type(c_ptr), target :: address
      integer(hid_t) :: type
      integer :: i, status, ignored

      if (allocated(error)) return
      do i = 1, len(value)
         bytes(i) = value(i:i)
      end do
      bytes(len(value) + 1) = c_null_char
      address = c_loc(bytes)
      call h5tcopy_f(H5T_STRING, type, status)
      if (status == 0) then
         call h5tset_cset_f(type, H5T_CSET_UTF8_F, status)
         call write_raw(file, object, name, type, 0_hsize_t, c_loc(address), error)
         call h5tclose_f(type, ignored)
      else
         call new_error(error, error_file, label(object, name)//" cannot be written")
      end if
   end subroutine write_string
end module kschur_hdf5_attributes
