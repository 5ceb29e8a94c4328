!> Adapters of C callbacks to monitors and operators.
module kschur_capi_callbacks
   use, intrinsic :: iso_c_binding, only: c_double, c_double_complex, c_funptr, c_int, c_int64_t, c_null_funptr, &
      c_null_ptr, c_associated, c_f_procpointer, c_ptr
   use kschur, only: complex_operator_type, error_type, monitor_type, real_operator_type, wp
   use kschur_capi_status, only: check_returned
   implicit none
   private
   public :: progress_type, called_real_operator_type, called_complex_operator_type

   !> Monitor that calls a kschur_progress_callback and a kschur_stop_callback, if given; once cancelled it stays so.
   type, extends(monitor_type) :: progress_type
      type(c_funptr) :: callback = c_null_funptr, stop_callback = c_null_funptr
      type(c_ptr) :: context = c_null_ptr, stop_context = c_null_ptr
      logical, private :: ended = .false.
   contains
      procedure :: report
      procedure :: stops
   end type progress_type

   !> Operator on real vectors that calls a kschur_apply_callback.
   type, extends(real_operator_type) :: called_real_operator_type
      integer :: n = 0
      type(c_funptr) :: callback = c_null_funptr
      type(c_ptr) :: context = c_null_ptr
   contains
      procedure :: order => order_real
      procedure :: apply => apply_real
   end type called_real_operator_type

   !> Operator on complex vectors that calls a kschur_apply_callback.
   type, extends(complex_operator_type) :: called_complex_operator_type
      integer :: n = 0
      type(c_funptr) :: callback = c_null_funptr
      type(c_ptr) :: context = c_null_ptr
   contains
      procedure :: order => order_complex
      procedure :: apply => apply_complex
   end type called_complex_operator_type

   abstract interface
      integer(c_int) function stop_interface(context) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: context
      end function stop_interface

      integer(c_int) function progress_interface(context, restart, converged, wanted, residual) bind(c)
         import :: c_double, c_int, c_int64_t, c_ptr
         type(c_ptr), value :: context
         integer(c_int64_t), value :: restart, converged, wanted
         real(c_double), value :: residual
      end function progress_interface

      integer(c_int) function apply_real_interface(context, n, vectors, x, y) bind(c)
         import :: c_double, c_int, c_int64_t, c_ptr
         type(c_ptr), value :: context
         integer(c_int64_t), value :: n, vectors
         real(c_double), intent(in) :: x(*)
         real(c_double), intent(out) :: y(*)
      end function apply_real_interface

      integer(c_int) function apply_complex_interface(context, n, vectors, x, y) bind(c)
         import :: c_double_complex, c_int, c_int64_t, c_ptr
         type(c_ptr), value :: context
         integer(c_int64_t), value :: n, vectors
         complex(c_double_complex), intent(in) :: x(*)
         complex(c_double_complex), intent(out) :: y(*)
      end function apply_complex_interface
   end interface

contains

   subroutine report(self, restart, converged, wanted, residual, proceed)
      class(progress_type), intent(inout) :: self
      integer, intent(in) :: restart, converged, wanted
      real(wp), intent(in) :: residual
      logical, intent(inout) :: proceed
      procedure(progress_interface), pointer :: callback

      if (.not. c_associated(self%callback)) return
      call c_f_procpointer(self%callback, callback)
      if (callback(self%context, int(restart, c_int64_t), int(converged, c_int64_t), int(wanted, c_int64_t), &
         residual) /= 0) self%ended = .true.
      if (self%ended) proceed = .false.
   end subroutine report

   logical function stops(self)
      class(progress_type), intent(inout) :: self
      procedure(stop_interface), pointer :: callback

      if (c_associated(self%stop_callback) .and. .not. self%ended) then
         call c_f_procpointer(self%stop_callback, callback)
         self%ended = callback(self%stop_context) /= 0
      end if
      stops = self%ended
   end function stops

   integer function order_real(self)
      class(called_real_operator_type), intent(in) :: self

      order_real = self%n
   end function order_real

   integer function order_complex(self)
      class(called_complex_operator_type), intent(in) :: self

      order_complex = self%n
   end function order_complex

   subroutine apply_real(self, x, y, error)
      class(called_real_operator_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      procedure(apply_real_interface), pointer :: callback

      call c_f_procpointer(self%callback, callback)
      call check_returned(callback(self%context, int(self%n, c_int64_t), size(x, 2, c_int64_t), x, y), "apply", error)
   end subroutine apply_real

   subroutine apply_complex(self, x, y, error)
      class(called_complex_operator_type), intent(inout) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      procedure(apply_complex_interface), pointer :: callback

      call c_f_procpointer(self%callback, callback)
      call check_returned(callback(self%context, int(self%n, c_int64_t), size(x, 2, c_int64_t), x, y), "apply", error)
   end subroutine apply_complex
end module kschur_capi_callbacks
