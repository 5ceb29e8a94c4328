!> Opens, creates and closes HDF5 files; common procedures of the `kschur_hdf5_*` modules. HDF5 is initialised if necessary, and
!> never closed, as the caller may use it too.
module kschur_hdf5_basics
   use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_int64_t, c_null_funptr, c_null_ptr, c_ptr, c_size_t
   use hdf5, only: hid_t, h5open_f, h5iis_valid_f, h5kind_to_type, H5_INTEGER_KIND, H5_REAL_KIND, H5T_NATIVE_INTEGER, &
      h5fis_hdf5_f, h5fopen_f, h5fcreate_f, h5fclose_f, H5F_ACC_RDONLY_F, H5F_ACC_TRUNC_F, h5gcreate_f, h5gopen_f, &
      h5gclose_f, h5lexists_f, h5oexists_by_name_f, h5tcreate_f, h5tinsert_f, h5tclose_f, h5tget_class_f, &
      h5tget_member_index_f, h5tget_member_offset_f, h5tget_member_type_f, h5tget_offset_f, h5tget_precision_f, &
      h5tget_size_f, h5tequal_f, H5T_COMPOUND_F, H5T_FLOAT_F, H5T_IEEE_F32BE, H5T_IEEE_F32LE, H5T_IEEE_F64BE, &
      H5T_IEEE_F64LE, H5T_INTEGER_F
   use kschur_error, only: error_type, new_error, add_context, error_file, error_input, error_library
   use kschur_files, only: kind_of_file, folder, no_file, pipe_or_device, staging_type
   use kschur_kinds, only: wp, long
   use kschur_lock, only: acquire_lock, release_lock, lock_hdf5
   implicit none
   private
   public :: output_type, printing_type, silence_hdf5, restore_printing
   public :: forbid_external_links, open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, create_group, &
      open_group, close_group, relative, exists
   public :: integer_type, real_type, new_complex_type, check_class

   !> HDF5's error printing before it was silenced.
   type :: printing_type
      private
      logical :: saved = .false.
      type(c_funptr) :: printer
      type(c_ptr) :: data = c_null_ptr
   end type printing_type

   !> A file being written.
   type :: output_type
      integer(hid_t) :: file = -1
      character(len=:), allocatable, private :: path
      type(staging_type), private :: staging
      type(printing_type), private :: printing
   end type output_type

   ! H5E_DEFAULT: the error stack of this thread; H5L_TYPE_EXTERNAL.
   integer(c_int64_t), parameter :: default_stack = 0
   integer(c_int), parameter :: external_links = 64

   interface
      integer(c_int) function c_get_printing(stack, printer, data) bind(c, name="H5Eget_auto2")
         import :: c_funptr, c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: stack
         type(c_funptr), intent(out) :: printer
         type(c_ptr), intent(out) :: data
      end function c_get_printing

      integer(c_int) function c_set_printing(stack, printer, data) bind(c, name="H5Eset_auto2")
         import :: c_funptr, c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: stack
         type(c_funptr), value :: printer
         type(c_ptr), value :: data
      end function c_set_printing

      integer(c_int) function c_unregister_links(kind) bind(c, name="H5Lunregister")
         import :: c_int
         integer(c_int), value :: kind
      end function c_unregister_links
   end interface

contains

   !> Initialises HDF5, turns its error printing off, and locks it for this thread, until `restore_printing`.
   subroutine silence_hdf5(printing, error)
      type(printing_type), intent(out) :: printing
      type(error_type), allocatable, intent(out) :: error
      logical :: ready
      integer :: status

      call acquire_lock(lock_hdf5)
      printing%saved = c_get_printing(default_stack, printing%printer, printing%data) >= 0
      if (printing%saved) printing%saved = c_set_printing(default_stack, c_null_funptr, c_null_ptr) >= 0
      call h5iis_valid_f(H5T_NATIVE_INTEGER, ready, status)
      if (status == 0 .and. .not. ready) call h5open_f(status)
      if (status < 0) call new_error(error, error_library, "the HDF5 library cannot be initialised")
   end subroutine silence_hdf5

   !> Restores error printing, and releases the lock.
   subroutine restore_printing(printing)
      type(printing_type), intent(in) :: printing
      integer(c_int) :: status

      if (printing%saved) status = c_set_printing(default_stack, printing%printer, printing%data)
      call release_lock(lock_hdf5)
   end subroutine restore_printing

   !> Permanently forbids HDF5 to follow links into other files: for a process that reads one file.
   subroutine forbid_external_links()
      integer(c_int) :: status

      status = c_unregister_links(external_links)
   end subroutine forbid_external_links

   !> Opens a file for reading. Fails, without naming the file, if it does not exist, is not HDF5, or is damaged.
   subroutine open_hdf5_file(file, path, error)
      integer(hid_t), intent(out) :: file
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      logical :: is_hdf5
      integer :: status

      file = -1
      if (allocated(error)) return
      select case (kind_of_file(path))
      case (no_file)
         call new_error(error, error_file, "no such file")
      case (folder)
         call new_error(error, error_file, "a folder, not an HDF5 file")
      case (pipe_or_device)
         call new_error(error, error_file, "a pipe or a device, not an HDF5 file")
      end select
      if (allocated(error)) return
      call h5fis_hdf5_f(path, is_hdf5, status)
      if (status < 0) then
         call new_error(error, error_file, "the file cannot be read")
      else if (.not. is_hdf5) then
         call new_error(error, error_file, "not an HDF5 file")
      else
         call h5fopen_f(path, H5F_ACC_RDONLY_F, file, status)
         if (status == 0) return
         file = -1
         call new_error(error, error_file, "an HDF5 file, but truncated, damaged or in use by a program that writes it")
      end if
   end subroutine open_hdf5_file

   !> Silences HDF5 and creates a staged file, to be completed by `finish_hdf5_file`. Fails with the system's reason, also if
   !> disk space is less than `bytes`: HDF5 does not survive a full disk.
   subroutine create_hdf5_file(output, path, bytes, error)
      type(output_type), intent(out) :: output
      character(len=*), intent(in) :: path
      !> Total size of the data to be written.
      integer(long), intent(in) :: bytes
      type(error_type), allocatable, intent(out) :: error
      integer(long), parameter :: of_hdf5_itself = 2**16
      integer :: status

      output%path = path
      call silence_hdf5(output%printing, error)
      if (allocated(error)) return
      call output%staging%open(path, error)
      call output%staging%reserve(bytes + of_hdf5_itself, error)
      if (allocated(error)) return
      call h5fcreate_f(output%staging%path, H5F_ACC_TRUNC_F, output%file, status)
      if (status == 0) return
      output%file = -1
      call new_error(error, error_file, path//": the file cannot be created")
   end subroutine create_hdf5_file

   !> Closes a file opened for reading.
   subroutine close_hdf5_file(file)
      integer(hid_t), intent(in) :: file
      integer :: status

      if (file >= 0) call h5fclose_f(file, status)
   end subroutine close_hdf5_file

   !> Closes the file and moves it to its final place, or deletes it if an error is raised. Restores error printing.
   subroutine finish_hdf5_file(output, error)
      type(output_type), intent(inout) :: output
      type(error_type), allocatable, intent(inout) :: error
      integer :: status, unit

      if (output%file >= 0) then
         if (allocated(error)) then
            ! Truncates the file, so that HDF5 can flush its buffers to a full disk: a failed close corrupts the library, which
            ! then crashes at program end.
            open (newunit=unit, file=output%staging%path, status="replace", iostat=status)
            if (status == 0) close (unit, iostat=status)
         end if
         call h5fclose_f(output%file, status)
         if (status < 0 .and. .not. allocated(error)) &
            call new_error(error, error_file, "the file cannot be written: is the disk full?")
         call add_context(error, output%path)
      end if
      call output%staging%finish(error)
      call restore_printing(output%printing)
   end subroutine finish_hdf5_file

   !> Creates the group `name`. Here and in the procedures that read and write, `file` may be a group: names begin there.
   subroutine create_group(file, name, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: group
      integer :: status

      if (allocated(error)) return
      call h5gcreate_f(file, relative(name), group, status)
      if (status == 0) call h5gclose_f(group, status)
      if (status < 0) call new_error(error, error_file, "group "//name//" cannot be written")
   end subroutine create_group

   !> Opens the group `name`, to be closed by `close_group`; -1 if it cannot be opened.
   subroutine open_group(group, file, name, error)
      integer(hid_t), intent(out) :: group
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer :: status

      group = -1
      if (allocated(error)) return
      call h5gopen_f(file, relative(name), group, status)
      if (status == 0) return
      group = -1
      call new_error(error, error_input, name//" is not a group")
   end subroutine open_group

   !> Closes a group.
   subroutine close_group(group)
      integer(hid_t), intent(in) :: group
      integer :: status

      if (group >= 0) call h5gclose_f(group, status)
   end subroutine close_group

   !> The name without its leading slash, for HDF5: with it, HDF5 begins at the root even where it is given a group.
   pure function relative(name)
      character(len=*), intent(in) :: name
      character(len=max(1, len(name) - merge(1, 0, index(name, "/") == 1))) :: relative

      relative = "."
      if (name /= "/") relative = name(1 + len(name) - len(relative):)
   end function relative

   !> Whether the file has an object of this name; its group must exist. Fails if HDF5 fails, or the name is an external or
   !> dangling link.
   logical function exists(file, name, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer :: status
      logical :: resolved

      exists = .false.
      if (allocated(error)) return
      call h5lexists_f(file, relative(name), exists, status)
      if (status < 0) call new_error(error, error_input, name//" cannot be looked up: the file is damaged")
      if (status < 0 .or. .not. exists) return
      call h5oexists_by_name_f(file, relative(name), resolved, status)
      exists = status == 0 .and. resolved
      if (.not. exists) call new_error(error, error_input, &
         name//" cannot be opened: it is damaged, or a link into another file, which is not followed")
   end function exists

   !> HDF5 type of integers in memory; not to be closed.
   integer(hid_t) function integer_type()
      integer_type = h5kind_to_type(long, H5_INTEGER_KIND)
   end function integer_type

   !> HDF5 type of reals in memory; not to be closed.
   integer(hid_t) function real_type()
      real_type = h5kind_to_type(wp, H5_REAL_KIND)
   end function real_type

   !> Compound type {r, i} of h5py for complex numbers; to be closed.
   subroutine new_complex_type(type, error)
      integer(hid_t), intent(out) :: type
      type(error_type), allocatable, intent(inout) :: error
      integer(c_size_t), parameter :: bytes = storage_size(1.0_wp)/8
      integer :: status, ignored

      type = -1
      if (allocated(error)) return
      call h5tcreate_f(H5T_COMPOUND_F, 2*bytes, type, status)
      if (status == 0) then
         call h5tinsert_f(type, "r", 0_c_size_t, real_type(), status)
         if (status == 0) call h5tinsert_f(type, "i", bytes, real_type(), status)
         if (status == 0) return
         call h5tclose_f(type, ignored)
      end if
      call new_error(error, error_library, "HDF5 cannot make a complex type")
   end subroutine new_complex_type

   !> Fails if values of type `stored` cannot be converted to type `wanted`.
   subroutine check_class(stored, wanted, name, error)
      integer(hid_t), intent(in) :: stored, wanted
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer :: stored_class, wanted_class, status
      logical :: fits

      if (allocated(error)) return
      stored_class = -1
      wanted_class = -1
      call h5tget_class_f(stored, stored_class, status)
      call h5tget_class_f(wanted, wanted_class, status)
      fits = stored_class == wanted_class
      if (fits .and. wanted_class == H5T_FLOAT_F) fits = is_ieee(stored)
      if (wanted_class == H5T_FLOAT_F) fits = fits .or. stored_class == H5T_INTEGER_F
      if (fits .and. stored_class == H5T_INTEGER_F) fits = is_within(stored)
      if (wanted_class == H5T_COMPOUND_F .and. fits) fits = is_complex(stored)
      if (fits) return
      if (wanted_class == H5T_INTEGER_F) then
         call new_error(error, error_input, name//" does not hold integers")
      else if (wanted_class == H5T_FLOAT_F) then
         call new_error(error, error_input, name//" does not hold real numbers of single or double precision")
      else if (wanted_class == H5T_COMPOUND_F) then
         call new_error(error, error_input, name//" does not hold complex numbers {r, i}")
      else
         call new_error(error, error_input, name//" does not hold strings of fixed length")
      end if
   end subroutine check_class

   ! Whether a compound type has members r and i of one numeric type, adjacent and inside it.
   logical function is_complex(type)
      integer(hid_t), intent(in) :: type
      integer(c_size_t) :: whole, first(2), bytes(2)
      integer(hid_t) :: member(2)
      integer :: i, place, status
      logical :: are_equal

      is_complex = .false.
      member = -1
      whole = 0
      do i = 1, 2
         ! HDF5 does not set it if there is no such member.
         place = -1
         call h5tget_member_index_f(type, "ri"(i:i), place, status)
         if (place < 0 .or. status < 0) exit
         call h5tget_member_offset_f(type, place, first(i), status)
         if (status == 0) call h5tget_member_type_f(type, place, member(i), status)
         if (status == 0) call h5tget_size_f(member(i), bytes(i), status)
         if (status < 0) exit
         if (.not. is_ieee(member(i))) exit
      end do
      if (i > 2) then
         call h5tequal_f(member(1), member(2), are_equal, status)
         if (status == 0) call h5tget_size_f(type, whole, status)
         is_complex = status == 0 .and. are_equal .and. all(first >= 0 .and. first + bytes <= whole) .and. &
            (first(1) + bytes(1) <= first(2) .or. first(2) + bytes(2) <= first(1))
      end if
      do i = 1, 2
         if (member(i) >= 0) call h5tclose_f(member(i), status)
      end do
   end function is_complex

   ! Whether an integer type has a valid size and bit range.
   logical function is_within(type)
      integer(hid_t), intent(in) :: type
      integer(c_size_t) :: first, bits, bytes
      integer :: status(3)

      call h5tget_offset_f(type, first, status(1))
      call h5tget_precision_f(type, bits, status(2))
      call h5tget_size_f(type, bytes, status(3))
      is_within = minval(status) >= 0
      if (is_within) is_within = any(bytes == [1, 2, 4, 8]) .and. first >= 0 .and. bits >= 0 .and. first <= 8*bytes - bits
   end function is_within

   ! Whether a real type is IEEE single or double: a damaged type description would corrupt all values.
   logical function is_ieee(type)
      integer(hid_t), intent(in) :: type
      integer(hid_t) :: ieee_types(4)
      integer :: i, status

      ieee_types = [H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_IEEE_F64BE, H5T_IEEE_F32BE]
      is_ieee = .false.
      do i = 1, size(ieee_types)
         if (.not. is_ieee) call h5tequal_f(type, ieee_types(i), is_ieee, status)
      end do
   end function is_ieee
end module kschur_hdf5_basics
