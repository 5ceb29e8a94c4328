!> Replaces the module of this name in a build without HDF5.
module kschur_hdf5_result
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_result, only: modal_result_type
   implicit none
   private
   public :: is_hdf5_result, read_hdf5_result, write_hdf5_result

contains

   !> Returns false: no HDF5 file can be read.
   logical function is_hdf5_result(path, trial)
      character(len=*), intent(in) :: path
      logical, intent(in), optional :: trial

      is_hdf5_result = .false.
   end function is_hdf5_result

   !> Fails with `error_usage`.
   subroutine read_hdf5_result(result, path, error, trial)
      type(modal_result_type), intent(out) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: trial

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine read_hdf5_result

   !> Fails with `error_usage`.
   subroutine write_hdf5_result(result, path, error)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine write_hdf5_result
end module kschur_hdf5_result
