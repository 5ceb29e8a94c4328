!> A sweep in an HDF5 file: parameter values, branches, events. Datasets in h5py: points x branches.
module kschur_hdf5_sweep
   use hdf5, only: hid_t
   use kschur_error, only: add_context, error_input, error_type, new_error, error_usage
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: output_type, printing_type, close_hdf5_file, create_hdf5_file, finish_hdf5_file, create_group, &
      open_hdf5_file, restore_printing, silence_hdf5
   use kschur_hdf5_datasets, only: read_dataset, write_dataset, kind_length
   use kschur_hdf5_facts, only: position_of
   use kschur_kinds, only: long, wp
   use kschur_release, only: kschur_version
   use kschur_sweep, only: sweep_type, event_names
   implicit none
   private
   public :: is_hdf5_sweep, read_hdf5_sweep, write_hdf5_sweep

   character(len=*), parameter :: root = "/"

contains

   !> Writes a finished sweep. The file appears under its name when it is complete.
   subroutine write_hdf5_sweep(sweep, parameter, path, error, unit)
      type(sweep_type), intent(in) :: sweep
      !> The name of the parameter.
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Unit of the parameter. Absent or empty: unknown.
      character(len=*), intent(in), optional :: unit
      integer(long), parameter :: bytes_of_a_mode = 40
      character(len=kind_length), allocatable :: kinds(:)
      type(output_type) :: output

      if (.not. allocated(sweep%eigenvalues)) then
         call new_error(error, error_usage, path//": the sweep is not finished and cannot be written: call finish first")
         return
      end if
      call create_hdf5_file(output, path, bytes_of_a_mode*size(sweep%eigenvalues, kind=long), error)
      call write_attribute(output%file, root, "kschur_sweep", kschur_version, error)
      call write_attribute(output%file, root, "parameter", parameter, error)
      if (present(unit)) then
         if (unit /= "") call write_attribute(output%file, root, "unit", unit, error)
      end if
      call write_dataset(output%file, "/values", sweep%values, error)
      call write_dataset(output%file, "/eigenvalues", sweep%eigenvalues, error)
      call write_dataset(output%file, "/frequency_hz", sweep%frequency_hz, error)
      call write_dataset(output%file, "/damping_ratio", sweep%damping_ratio, error)
      call write_dataset(output%file, "/share", sweep%share, error)
      call create_group(output%file, "/events", error)
      allocate (kinds(size(sweep%events)))
      kinds = event_names(sweep%events%kind)
      call write_dataset(output%file, "/events/kind", kinds, error)
      call write_dataset(output%file, "/events/first", [sweep%events%first], error)
      call write_dataset(output%file, "/events/second", [sweep%events%second], error)
      call write_dataset(output%file, "/events/value", [sweep%events%value], error)
      call create_group(output%file, "/onsets", error)
      call write_dataset(output%file, "/onsets/branch", [sweep%onsets%branch], error)
      call write_dataset(output%file, "/onsets/unstable", [merge(1, 0, sweep%onsets%unstable)], error)
      call write_dataset(output%file, "/onsets/value", [sweep%onsets%value], error)
      call write_dataset(output%file, "/onsets/within", [sweep%onsets%within], error)
      call finish_hdf5_file(output, error)
   end subroutine write_hdf5_sweep

   !> Whether a file is a sweep; false if it cannot be read.
   logical function is_hdf5_sweep(path)
      character(len=*), intent(in) :: path
      type(error_type), allocatable :: error
      type(printing_type) :: printing
      integer(hid_t) :: file

      call silence_hdf5(printing, error)
      call open_hdf5_file(file, path, error)
      is_hdf5_sweep = has_attribute(file, root, "kschur_sweep", error)
      call close_hdf5_file(file)
      call restore_printing(printing)
      is_hdf5_sweep = is_hdf5_sweep .and. .not. allocated(error)
   end function is_hdf5_sweep

   !> Reads a sweep that `write_hdf5_sweep` wrote: results of a finished sweep, without positions of modes. No point can be
   !> added. Fails with the file and the reason.
   subroutine read_hdf5_sweep(sweep, parameter, unit, path, error)
      type(sweep_type), intent(out) :: sweep
      !> Name and unit of the parameter; the unit is empty if unknown.
      character(len=:), allocatable, intent(out) :: parameter, unit
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(printing_type) :: printing
      integer(hid_t) :: file

      unit = ""
      call silence_hdf5(printing, error)
      call open_hdf5_file(file, path, error)
      if (.not. has_attribute(file, root, "kschur_sweep", error)) then
         if (.not. allocated(error)) call new_error(error, error_input, "not a sweep of kschur")
      end if
      call read_attribute(parameter, file, root, "parameter", error)
      if (has_attribute(file, root, "unit", error)) call read_attribute(unit, file, root, "unit", error)
      call read_dataset(sweep%values, file, "/values", error)
      call read_dataset(sweep%eigenvalues, file, "/eigenvalues", error)
      call read_dataset(sweep%frequency_hz, file, "/frequency_hz", error)
      call read_dataset(sweep%damping_ratio, file, "/damping_ratio", error)
      call read_dataset(sweep%share, file, "/share", error)
      call read_events(sweep, file, error)
      call read_onsets(sweep, file, error)
      call close_hdf5_file(file)
      if (.not. allocated(error)) call check_shapes(sweep, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_sweep

   subroutine read_events(sweep, file, error)
      type(sweep_type), intent(inout) :: sweep
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      character(len=kind_length), allocatable :: kinds(:)
      integer, allocatable :: first(:), second(:)
      real(wp), allocatable :: value(:)
      integer :: i

      call read_dataset(kinds, file, "/events/kind", error)
      if (allocated(error)) return
      call read_dataset(first, file, "/events/first", 0, huge(1), error, size(kinds))
      call read_dataset(second, file, "/events/second", 0, huge(1), error, size(kinds))
      call read_dataset(value, file, "/events/value", error, size(kinds))
      if (allocated(error)) return
      allocate (sweep%events(size(kinds)))
      do i = 1, size(kinds)
         sweep%events(i)%kind = position_of(trim(kinds(i)), event_names, "/events/kind", error)
      end do
      sweep%events%first = first
      sweep%events%second = second
      sweep%events%value = value
   end subroutine read_events

   subroutine read_onsets(sweep, file, error)
      type(sweep_type), intent(inout) :: sweep
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      integer, allocatable :: branch(:), unstable(:)
      real(wp), allocatable :: value(:), within(:)

      call read_dataset(branch, file, "/onsets/branch", 1, huge(1), error)
      if (allocated(error)) return
      call read_dataset(unstable, file, "/onsets/unstable", 0, 1, error, size(branch))
      call read_dataset(value, file, "/onsets/value", error, size(branch))
      call read_dataset(within, file, "/onsets/within", error, size(branch))
      if (allocated(error)) return
      allocate (sweep%onsets(size(branch)))
      sweep%onsets%branch = branch
      sweep%onsets%unstable = unstable == 1
      sweep%onsets%value = value
      sweep%onsets%within = within
   end subroutine read_onsets

   subroutine check_shapes(sweep, error)
      type(sweep_type), intent(in) :: sweep
      type(error_type), allocatable, intent(inout) :: error
      integer :: extents(2)

      extents = [size(sweep%eigenvalues, 1), size(sweep%values)]
      if (any([shape(sweep%eigenvalues), shape(sweep%frequency_hz), shape(sweep%damping_ratio), shape(sweep%share)] /= &
         [extents, extents, extents, extents])) then
         call new_error(error, error_input, "the datasets differ in their numbers of points and branches")
      else if (any([sweep%events%first, sweep%events%second, sweep%onsets%branch] > extents(1))) then
         call new_error(error, error_input, "an event or an onset names a branch that is not there")
      end if
   end subroutine check_shapes
end module kschur_hdf5_sweep
