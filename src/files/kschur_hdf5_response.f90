!> Frequency response in an HDF5 file. Datasets in h5py: points x unknowns.
module kschur_hdf5_response
   use kschur_error, only: error_type
   use kschur_hdf5_attributes, only: write_attribute
   use kschur_hdf5_basics, only: output_type, create_hdf5_file, finish_hdf5_file
   use kschur_hdf5_datasets, only: write_dataset
   use kschur_hdf5_mesh, only: bytes_of_mesh, write_mesh
   use kschur_kinds, only: long, wp
   use kschur_mesh, only: mesh_type
   use kschur_release, only: kschur_version
   implicit none
   private
   public :: write_hdf5_response

contains

   !> Writes the response to one force, as `frequency_response` returns it. The file appears under its name when it is complete.
   subroutine write_hdf5_response(frequencies, force, response, multipliers, mesh, path, error)
      !> Hz.
      real(wp), intent(in) :: frequencies(:)
      !> f, n; x, n x frequencies; xi, m x frequencies.
      complex(wp), intent(in) :: force(:), response(:, :), multipliers(:, :)
      !> Where the unknowns stand; not allocated: not known.
      type(mesh_type), allocatable, intent(in) :: mesh
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer(long), parameter :: bytes_of_a_number = 16
      type(output_type) :: output

      call create_hdf5_file(output, path, &
         bytes_of_a_number*(size(response, kind=long) + size(multipliers, kind=long)) + bytes_of_mesh(mesh), error)
      call write_attribute(output%file, "/", "kschur_response", kschur_version, error)
      call write_dataset(output%file, "/frequency_hz", frequencies, error)
      call write_dataset(output%file, "/force", force, error)
      call write_dataset(output%file, "/response", response, error)
      call write_dataset(output%file, "/multipliers", multipliers, error)
      call write_mesh(output%file, mesh, error)
      call finish_hdf5_file(output, error)
   end subroutine write_hdf5_response
end module kschur_hdf5_response
