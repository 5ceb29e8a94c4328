!> Reads and writes arrays in datasets of an HDF5 file, each identified by its path. Does nothing if `error` is already raised;
!> messages name the dataset, callers add the file.
module kschur_hdf5_datasets
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr, c_size_t
   use hdf5, only: hid_t, hsize_t, h5dget_space_f, h5dread_f, h5dwrite_f, h5screate_simple_f, h5sclose_f, &
      h5sselect_hyperslab_f, H5S_SELECT_SET_F, h5tcopy_f, h5tset_size_f, h5tclose_f, H5T_FORTRAN_S1, h5kind_to_type, &
      H5_INTEGER_KIND
   use kschur_error, only: error_type, new_error, error_input, error_library
   use kschur_hdf5_basics, only: integer_type, real_type, new_complex_type
   use kschur_hdf5_storage, only: open_dataset, check_length, create_dataset, close_dataset
   use kschur_kinds, only: wp, long
   use kschur_text, only: text
   implicit none
   private
   public :: read_dataset, write_dataset, kind_length

   !> Length of strings in a dataset, blank-padded.
   integer, parameter :: kind_length = 16

   !> Reads a whole dataset of the rank of `values`; extents are in Fortran order, the reverse of h5py's.
   interface read_dataset
      module procedure read_integers, read_reals, read_real_block, read_complexes, read_complex_block, read_words
   end interface read_dataset

   !> Writes a new dataset.
   interface write_dataset
      module procedure write_integers, write_reals, write_real_block, write_complexes, write_complex_block, write_words
   end interface write_dataset

contains

   ! The HDF5 interface requires a variable for the address.
   subroutine read_values(dataset, type, address, status)
      integer(hid_t), intent(in) :: dataset, type
      type(c_ptr), intent(in) :: address
      integer, intent(out) :: status
      type(c_ptr) :: buffer

      buffer = address
      call h5dread_f(dataset, type, buffer, status)
   end subroutine read_values

   ! Reads a contiguous part of a one-dimensional dataset.
   subroutine read_part(dataset, type, before, address, number, status)
      integer(hid_t), intent(in) :: dataset, type
      !> Number of values before the part, and in it.
      integer, intent(in) :: before, number
      type(c_ptr), intent(in) :: address
      integer, intent(out) :: status
      type(c_ptr) :: buffer
      integer(hid_t) :: chosen, place
      integer :: ignored

      buffer = address
      call h5dget_space_f(dataset, chosen, status)
      if (status < 0) return
      call h5sselect_hyperslab_f(chosen, H5S_SELECT_SET_F, [int(before, hsize_t)], [int(number, hsize_t)], status)
      if (status == 0) call h5screate_simple_f(1, [int(number, hsize_t)], place, status)
      if (status == 0) then
         call h5dread_f(dataset, type, buffer, status, mem_space_id=place, file_space_id=chosen)
         call h5sclose_f(place, ignored)
      end if
      call h5sclose_f(chosen, ignored)
   end subroutine read_part

   ! Range of values to be read: all by default.
   pure subroutine choose(all, first, length, before, number)
      integer, intent(in) :: all
      integer, intent(out) :: first, length
      integer, intent(in), optional :: before, number

      first = 0
      if (present(before)) first = before
      length = all - first
      if (present(number)) length = number
   end subroutine choose

   !> Reads integers of any size in the file; fails if one is below `lowest` or above `highest`.
   subroutine read_integers(values, file, name, lowest, highest, error, expected, before, number)
      integer, allocatable, intent(out) :: values(:)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer, intent(in) :: lowest, highest
      type(error_type), allocatable, intent(inout) :: error
      !> Required number of values.
      integer, intent(in), optional :: expected
      !> Reads `number` values after the first `before`, at most as many as expected.
      integer, intent(in), optional :: before, number
      integer(long), allocatable, target :: stored(:)
      integer(hid_t) :: dataset
      integer :: extents(1), first, length, status
      character(len=20) :: digits

      call open_dataset(dataset, extents, file, name, integer_type(), error)
      call check_length(dataset, extents, name, error, expected)
      if (allocated(error)) return
      call choose(extents(1), first, length, before, number)
      allocate (stored(length), values(length), stat=status)
      if (status == 0 .and. length > 0) call read_part(dataset, integer_type(), first, c_loc(stored), length, status)
      call close_dataset(dataset, status, name//" cannot be read", error)
      if (allocated(error)) return
      if (any(stored < lowest .or. stored > highest)) then
         write (digits, "(i0)") merge(minval(stored), maxval(stored), minval(stored) < lowest)
         call new_error(error, error_input, name//" holds "//trim(digits)// &
            ", which is not between "//text(lowest)//" and "//text(highest))
         return
      end if
      values = int(stored)
   end subroutine read_integers

   subroutine read_reals(values, file, name, error, expected, before, number)
      real(wp), allocatable, target, intent(out) :: values(:)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      !> How many there must be.
      integer, intent(in), optional :: expected
      !> Reads `number` values after the first `before`, at most as many as expected.
      integer, intent(in), optional :: before, number
      integer(hid_t) :: dataset
      integer :: extents(1), first, length, status

      call open_dataset(dataset, extents, file, name, real_type(), error)
      call check_length(dataset, extents, name, error, expected)
      if (allocated(error)) return
      call choose(extents(1), first, length, before, number)
      allocate (values(length), stat=status)
      if (status == 0 .and. length > 0) call read_part(dataset, real_type(), first, c_loc(values), length, status)
      call close_dataset(dataset, status, name//" cannot be read", error)
   end subroutine read_reals

   subroutine read_real_block(values, file, name, error)
      real(wp), allocatable, target, intent(out) :: values(:, :)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset
      integer :: extents(2), status

      call open_dataset(dataset, extents, file, name, real_type(), error)
      if (allocated(error)) return
      allocate (values(extents(1), extents(2)), stat=status)
      if (status == 0 .and. minval(extents) > 0) call read_values(dataset, real_type(), c_loc(values), status)
      call close_dataset(dataset, status, name//" cannot be read", error)
   end subroutine read_real_block

   subroutine read_complexes(values, file, name, error)
      complex(wp), allocatable, target, intent(out) :: values(:)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, type
      integer :: extents(1), status, ignored

      call new_complex_type(type, error)
      call open_dataset(dataset, extents, file, name, type, error)
      if (.not. allocated(error)) then
         allocate (values(extents(1)), stat=status)
         if (status == 0 .and. extents(1) > 0) call read_values(dataset, type, c_loc(values), status)
         call close_dataset(dataset, status, name//" cannot be read", error)
      end if
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine read_complexes

   subroutine read_complex_block(values, file, name, error)
      complex(wp), allocatable, target, intent(out) :: values(:, :)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, type
      integer :: extents(2), status, ignored

      call new_complex_type(type, error)
      call open_dataset(dataset, extents, file, name, type, error)
      if (.not. allocated(error)) then
         allocate (values(extents(1), extents(2)), stat=status)
         if (status == 0 .and. minval(extents) > 0) call read_values(dataset, type, c_loc(values), status)
         call close_dataset(dataset, status, name//" cannot be read", error)
      end if
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine read_complex_block

   subroutine read_words(values, file, name, error)
      character(len=kind_length), allocatable, target, intent(out) :: values(:)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, type
      integer :: extents(1), status, ignored

      call new_text_type(type, error)
      call open_dataset(dataset, extents, file, name, type, error)
      if (.not. allocated(error)) then
         allocate (values(extents(1)), stat=status)
         if (status == 0 .and. extents(1) > 0) call read_values(dataset, type, c_loc(values), status)
         call close_dataset(dataset, status, name//" cannot be read", error)
      end if
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine read_words

   ! Creates a dataset and writes the values at an address.
   subroutine write_values(file, name, type, extents, address, error)
      integer(hid_t), intent(in) :: file, type
      character(len=*), intent(in) :: name
      integer, intent(in) :: extents(:)
      type(c_ptr), intent(in) :: address
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset
      integer :: status

      call create_dataset(dataset, file, name, type, extents, error)
      if (allocated(error)) return
      status = 0
      if (all(extents > 0)) call h5dwrite_f(dataset, type, address, status)
      call close_dataset(dataset, status, name//" cannot be written", error)
   end subroutine write_values

   subroutine write_integers(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer, target, contiguous, intent(in) :: values(:)
      type(error_type), allocatable, intent(inout) :: error

      call write_values(file, name, h5kind_to_type(kind(values), H5_INTEGER_KIND), shape(values), c_loc(values), error)
   end subroutine write_integers

   subroutine write_reals(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      real(wp), target, contiguous, intent(in) :: values(:)
      type(error_type), allocatable, intent(inout) :: error

      call write_values(file, name, real_type(), shape(values), c_loc(values), error)
   end subroutine write_reals

   subroutine write_real_block(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      real(wp), target, contiguous, intent(in) :: values(:, :)
      type(error_type), allocatable, intent(inout) :: error

      call write_values(file, name, real_type(), shape(values), c_loc(values), error)
   end subroutine write_real_block

   subroutine write_complexes(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      complex(wp), target, contiguous, intent(in) :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: type
      integer :: ignored

      call new_complex_type(type, error)
      call write_values(file, name, type, shape(values), c_loc(values), error)
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine write_complexes

   subroutine write_complex_block(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      complex(wp), target, contiguous, intent(in) :: values(:, :)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: type
      integer :: ignored

      call new_complex_type(type, error)
      call write_values(file, name, type, shape(values), c_loc(values), error)
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine write_complex_block

   subroutine write_words(file, name, values, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      character(len=kind_length), target, contiguous, intent(in) :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: type
      integer :: ignored

      call new_text_type(type, error)
      call write_values(file, name, type, shape(values), c_loc(values), error)
      if (type >= 0) call h5tclose_f(type, ignored)
   end subroutine write_words

   ! HDF5 type of the names of kinds of modes in memory; to be closed.
   subroutine new_text_type(type, error)
      integer(hid_t), intent(out) :: type
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      type = -1
      if (allocated(error)) return
      call h5tcopy_f(H5T_FORTRAN_S1, type, status)
      if (status == 0) call h5tset_size_f(type, int(kind_length, c_size_t), status)
      if (status < 0) call new_error(error, error_library, "HDF5 cannot make a string type")
   end subroutine new_text_type
end module kschur_hdf5_datasets
