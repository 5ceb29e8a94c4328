!> Replaces the module of this name in a build without ARPACK.
module kschur_arpack
   use kschur_arpack_options, only: arpack_options_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_monitor, only: monitor_type
   use kschur_operator, only: complex_operator_type, real_operator_type, symmetric_operator_type
   use kschur_selection, only: selection_type
   implicit none
   private
   public :: arpack, arpack_symmetric

   interface arpack
      module procedure arpack_of_real, arpack_of_complex
   end interface arpack

   character(len=*), parameter :: reason = "this kschur was built without ARPACK"

contains

   !> Fails with `error_usage`.
   subroutine arpack_of_real(operator, selection, options, values, vectors, statistics, error, monitor)
      class(real_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      call new_error(error, error_usage, reason)
      allocate (values(0), vectors(0, 0))
   end subroutine arpack_of_real

   !> Fails with `error_usage`.
   subroutine arpack_of_complex(operator, selection, options, values, vectors, statistics, error, monitor)
      class(complex_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      call new_error(error, error_usage, reason)
      allocate (values(0), vectors(0, 0))
   end subroutine arpack_of_complex

   !> Fails with `error_usage`.
   subroutine arpack_symmetric(operator, selection, options, values, vectors, statistics, error, monitor)
      class(symmetric_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      real(wp), allocatable, intent(out) :: values(:)
      real(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      call new_error(error, error_usage, reason)
      allocate (values(0), vectors(0, 0))
   end subroutine arpack_symmetric
end module kschur_arpack
