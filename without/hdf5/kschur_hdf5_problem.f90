!> Replaces the module of this name in a build without HDF5.
module kschur_hdf5_problem
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_problem, only: modal_problem_type
   implicit none
   private
   public :: read_hdf5_problem, read_hdf5_rows, write_hdf5_problem

contains

   !> Fails with `error_usage`.
   subroutine read_hdf5_problem(problem, path, error, trial, symmetric)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: trial
      integer, intent(in), optional :: symmetric

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine read_hdf5_problem

   !> Fails with `error_usage`.
   subroutine read_hdf5_rows(rows, all_rows, path, part, error, trial)
      type(modal_problem_type), intent(out) :: rows
      integer, intent(out) :: all_rows(3)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: trial

      all_rows = 0
      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine read_hdf5_rows

   !> Fails with `error_usage`.
   subroutine write_hdf5_problem(problem, path, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_usage, path//": this kschur was built without HDF5")
   end subroutine write_hdf5_problem
end module kschur_hdf5_problem
