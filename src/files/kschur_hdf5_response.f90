!> A response to a harmonic force in an HDF5 file. What h5py shows is points x unknowns.
module kschur_hdf5_response
   use hdf5, only: hid_t
   use kschur_error, only: error_type
   use kschur_files, only: staging_type
   use kschur_hdf5_attributes, only: write_attribute
   use kschur_hdf5_basics, only: printing_type, silence_hdf5, restore_printing, create_hdf5_file, finish_hdf5_file
   use kschur_hdf5_datasets, only: write_dataset
   use kschur_kinds, only: long, wp
   use kschur_release, only: kschur_version
   implicit none
   private
   public :: write_hdf5_response

contains

   !> Writes what `frequency_response` found of one force. The file appears under its name when it is whole.
   subroutine write_hdf5_response(frequencies, force, response, multipliers, path, error)
      !> Hz.
      real(wp), intent(in) :: frequencies(:)
      !> f, n; x, n x frequencies; xi, m x frequencies.
      complex(wp), intent(in) :: force(:), response(:, :), multipliers(:, :)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer(long), parameter :: bytes_of_a_number = 16
      type(staging_type) :: staging
      type(printing_type) :: printing
      integer(hid_t) :: file

      call silence_hdf5(printing, error)
      call create_hdf5_file(file, staging, path, &
         bytes_of_a_number*(size(response, kind=long) + size(multipliers, kind=long)), error)
      call write_attribute(file, "/", "kschur_response", kschur_version, error)
      call write_dataset(file, "/frequency_hz", frequencies, error)
      call write_dataset(file, "/force", force, error)
      call write_dataset(file, "/response", response, error)
      call write_dataset(file, "/multipliers", multipliers, error)
      call finish_hdf5_file(file, staging, path, error)
      call restore_printing(printing)
   end subroutine write_hdf5_response
end module kschur_hdf5_response
