!> Replaces the module of this name in a build without HDF5.
module kschur_hdf5_sweep
   use kschur_error, only: error_type, new_error, error_usage
   ! In the other order gfortran 12 ends with an internal error.
   use kschur_result, only: modal_result_type
   use kschur_kept_result, only: kept_result_type
   use kschur_sweep, only: sweep_type
   implicit none
   private
   public :: is_hdf5_sweep, read_hdf5_sweep, read_hdf5_sweep_point, write_hdf5_sweep

contains

   !> Fails with `error_usage`.
   subroutine write_hdf5_sweep(sweep, parameter, path, error, unit, kept)
      type(sweep_type), intent(in) :: sweep
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: unit
      type(kept_result_type), intent(in), optional :: kept(:)

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine write_hdf5_sweep

   !> Returns false: no HDF5 file can be read.
   logical function is_hdf5_sweep(path)
      character(len=*), intent(in) :: path

      associate (never_read => path)
      end associate
      is_hdf5_sweep = .false.
   end function is_hdf5_sweep

   !> Fails with `error_usage`.
   subroutine read_hdf5_sweep(sweep, parameter, unit, path, error, kept)
      type(sweep_type), intent(out) :: sweep
      character(len=:), allocatable, intent(out) :: parameter, unit
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical, allocatable, intent(out), optional :: kept(:)

      parameter = ""
      unit = ""
      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine read_hdf5_sweep

   !> Fails with `error_usage`.
   subroutine read_hdf5_sweep_point(result, path, point, error, trial)
      type(modal_result_type), intent(out) :: result
      character(len=*), intent(in) :: path
      integer, intent(in) :: point
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: trial

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine read_hdf5_sweep_point
end module kschur_hdf5_sweep
