!> Replaces the module of this name in a build without HDF5.
module kschur_hdf5_response
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_mesh, only: mesh_type
   implicit none
   private
   public :: write_hdf5_response

contains

   !> Fails with `error_usage`.
   subroutine write_hdf5_response(frequencies, force, response, multipliers, mesh, path, error)
      real(wp), intent(in) :: frequencies(:)
      complex(wp), intent(in) :: force(:), response(:, :), multipliers(:, :)
      type(mesh_type), allocatable, intent(in) :: mesh
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine write_hdf5_response
end module kschur_hdf5_response
