!> A sweep in an HDF5 file: values of the parameter, branches, events. What h5py shows is points x branches.
module kschur_hdf5_sweep
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_hdf5_attributes, only: write_attribute
   use kschur_hdf5_basics, only: output_type, create_hdf5_file, finish_hdf5_file, create_group
   use kschur_hdf5_datasets, only: write_dataset, word_length
   use kschur_kinds, only: long
   use kschur_release, only: kschur_version
   use kschur_sweep, only: sweep_type, event_names
   implicit none
   private
   public :: write_hdf5_sweep

   character(len=*), parameter :: root = "/"

contains

   !> Writes a sweep that is finished. The file appears under its name when it is whole.
   subroutine write_hdf5_sweep(sweep, parameter, path, error, unit)
      type(sweep_type), intent(in) :: sweep
      !> The name of the parameter.
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> That of the parameter. Absent or empty: not known.
      character(len=*), intent(in), optional :: unit
      integer(long), parameter :: bytes_of_a_mode = 40
      character(len=word_length), allocatable :: kinds(:)
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
end module kschur_hdf5_sweep
