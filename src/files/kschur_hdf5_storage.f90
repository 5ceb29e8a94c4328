!> Opens datasets of an HDF5 file after checking them, creates and closes them. Does nothing if `error` is already raised;
!> messages name the dataset, callers add the file.
module kschur_hdf5_storage
   use hdf5, only: hid_t, hsize_t, size_t, h5dcreate_f, h5dopen_f, h5dclose_f, h5dget_space_f, &
      h5dget_type_f, h5dget_create_plist_f, H5D_COMPACT_F, H5D_CONTIGUOUS_F, H5D_CHUNKED_F, h5fclose_f, &
      h5fget_filesize_f, h5iget_file_id_f, &
      h5pget_layout_f, h5pget_external_count_f, h5pget_nfilters_f, h5pget_filter_f, h5pclose_f, h5zfilter_avail_f, &
      h5screate_simple_f, h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5sclose_f, h5tget_size_f, h5tclose_f
   use kschur_error, only: error_type, new_error, error_file, error_input, error_memory, error_library
   use kschur_hdf5_basics, only: check_class, exists, relative
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_text, only: text
   implicit none
   private
   public :: open_dataset, check_length, create_dataset, close_dataset

contains

   !> Opens a dataset and returns its extents, after checks of storage, type and size.
   subroutine open_dataset(dataset, extents, file, name, type, error)
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: extents(:)
      integer(hid_t), intent(in) :: file, type
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      extents = 0
      dataset = -1
      if (.not. exists(file, name, error)) then
         if (.not. allocated(error)) call new_error(error, error_input, "there is no dataset "//name)
         return
      end if
      call h5dopen_f(file, relative(name), dataset, status)
      if (status < 0) then
         call new_error(error, error_input, name//" is not a dataset")
         return
      end if
      call check_storage(dataset, name, error)
      call check_type(dataset, type, name, error)
      call find_extents(extents, dataset, name, error)
      call check_size(extents, dataset, type, name, error)
      if (allocated(error)) call h5dclose_f(dataset, status)
   end subroutine open_dataset

   ! Fails if values are stored outside the file, or filtered in an unknown way.
   subroutine check_storage(dataset, name, error)
      integer(hid_t), intent(in) :: dataset
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: creation
      integer :: layout, outside, status, ignored

      if (allocated(error)) return
      outside = 0
      layout = -1
      call h5dget_create_plist_f(dataset, creation, status)
      if (status == 0) then
         call h5pget_layout_f(creation, layout, status)
         if (status == 0) call h5pget_external_count_f(creation, outside, status)
         if (status == 0) call check_filters(creation, name, status, error)
         call h5pclose_f(creation, ignored)
      end if
      if (allocated(error)) return
      if (status < 0) then
         call new_error(error, error_input, "how "//name//" is stored cannot be read")
      else if (layout /= H5D_COMPACT_F .and. layout /= H5D_CONTIGUOUS_F .and. layout /= H5D_CHUNKED_F) then
         call new_error(error, error_input, name//" is a virtual dataset, which is not followed")
      else if (outside > 0) then
         call new_error(error, error_input, name//" is stored in another file, which is not followed")
      end if
   end subroutine check_storage

   ! Fails if a filter of the dataset is not available, as that of an unknown compression.
   subroutine check_filters(creation, name, status, error)
      integer(hid_t), intent(in) :: creation
      character(len=*), intent(in) :: name
      integer, intent(inout) :: status
      type(error_type), allocatable, intent(inout) :: error
      integer(size_t) :: parameters
      integer :: number, filters, filter, flags, values(32)
      character(len=64) :: filter_name
      logical :: available

      filters = 0
      call h5pget_nfilters_f(creation, filters, status)
      do number = 0, filters - 1
         parameters = size(values)
         call h5pget_filter_f(creation, number, flags, parameters, values, len(filter_name, kind=size_t), filter_name, &
            filter, status)
         if (status == 0) call h5zfilter_avail_f(filter, available, status)
         if (status < 0) return
         if (available) cycle
         call new_error(error, error_input, name//" is compressed by filter "//text(filter)//", which HDF5 does not have here")
         return
      end do
   end subroutine check_filters

   ! Fails if the values of the dataset cannot be converted to a type.
   subroutine check_type(dataset, type, name, error)
      integer(hid_t), intent(in) :: dataset, type
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: stored
      integer :: status

      if (allocated(error)) return
      call h5dget_type_f(dataset, stored, status)
      if (status < 0) then
         call new_error(error, error_input, "the type of "//name//" cannot be read")
         return
      end if
      call check_class(stored, type, name, error)
      call h5tclose_f(stored, status)
   end subroutine check_type

   ! Extents of the dataset in Fortran order; fails if it has another rank.
   subroutine find_extents(extents, dataset, name, error)
      integer, intent(out) :: extents(:)
      integer(hid_t), intent(in) :: dataset
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: space
      integer(hsize_t) :: stored(size(extents)), maxima(size(extents))
      integer :: rank, status, ignored

      extents = 0
      if (allocated(error)) return
      stored = 0
      call h5dget_space_f(dataset, space, status)
      if (status == 0) then
         call h5sget_simple_extent_ndims_f(space, rank, status)
         if (status == 0 .and. rank /= size(extents)) then
            call new_error(error, error_input, name//" has "//text(rank)//" dimensions instead of "//text(size(extents)))
         else if (status == 0) then
            call h5sget_simple_extent_dims_f(space, stored, maxima, status)
         end if
         call h5sclose_f(space, ignored)
      end if
      if (allocated(error)) return
      if (status < 0) then
         call new_error(error, error_input, "the extents of "//name//" cannot be read")
      else if (any(stored < 0 .or. stored > huge(1))) then
         call new_error(error, error_input, name//" is too long")
      else
         extents = int(stored)
      end if
   end subroutine find_extents

   ! Fails if the declared size exceeds what the file can contain with best compression.
   subroutine check_size(extents, dataset, type, name, error)
      integer, intent(in) :: extents(:)
      integer(hid_t), intent(in) :: dataset, type
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      ! zlib reaches 1032.
      real(wp), parameter :: best_compression = 1100
      integer(hsize_t) :: bytes
      integer(size_t) :: bytes_each
      integer(hid_t) :: file
      integer :: status, ignored

      if (allocated(error)) return
      call h5iget_file_id_f(dataset, file, status)
      if (status == 0) then
         call h5fget_filesize_f(file, bytes, status)
         call h5fclose_f(file, ignored)
      end if
      if (status == 0) call h5tget_size_f(type, bytes_each, status)
      if (status < 0) then
         call new_error(error, error_library, "HDF5 does not tell the size of the file")
      else if (product(real(extents, wp))*real(bytes_each, wp) > best_compression*real(bytes, wp)) then
         call new_error(error, error_input, name//" declares more values than a file of "//text(bytes)//" bytes can hold")
      end if
   end subroutine check_size

   !> Closes the dataset and fails if it does not have `expected` values.
   subroutine check_length(dataset, extents, name, error, expected)
      integer(hid_t), intent(in) :: dataset
      integer, intent(in) :: extents(1)
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in), optional :: expected
      integer :: status

      if (allocated(error) .or. .not. present(expected)) return
      if (extents(1) == expected) return
      call h5dclose_f(dataset, status)
      call new_error(error, error_input, name//" has "//text(extents(1))//" values instead of "//text(expected))
   end subroutine check_length

   !> Creates a dataset of given extents.
   subroutine create_dataset(dataset, file, name, type, extents, error)
      integer(hid_t), intent(out) :: dataset
      integer(hid_t), intent(in) :: file, type
      character(len=*), intent(in) :: name
      integer, intent(in) :: extents(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: space
      integer :: status, ignored

      dataset = -1
      if (allocated(error)) return
      call h5screate_simple_f(size(extents), int(extents, hsize_t), space, status)
      if (status == 0) then
         call h5dcreate_f(file, relative(name), type, space, dataset, status)
         call h5sclose_f(space, ignored)
      end if
      if (status < 0) call new_error(error, error_file, name//" cannot be created")
   end subroutine create_dataset

   !> Closes the dataset. `status` is that of the transfer before: of HDF5 if negative, of an allocation if positive.
   subroutine close_dataset(dataset, status, complaint, error)
      integer(hid_t), intent(in) :: dataset
      integer, intent(in) :: status
      character(len=*), intent(in) :: complaint
      type(error_type), allocatable, intent(inout) :: error
      integer :: close_status

      call h5dclose_f(dataset, close_status)
      if (allocated(error)) return
      if (status > 0) then
         call new_error(error, error_memory, complaint//": there is not enough memory")
      else if (min(status, close_status) < 0) then
         call new_error(error, error_file, complaint)
      end if
      call require_memory(0.0_wp, "what is in the file", error)
   end subroutine close_dataset
end module kschur_hdf5_storage
