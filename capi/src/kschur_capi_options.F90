!> Options, for C: a setter for each.
module kschur_capi_options
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_funptr, c_int, c_int64_t, c_loc, &
      c_null_ptr, c_ptr
   use kschur, only: arpack_names, error_type, formulation_names, index_of_name, inner_names, inner_solvers_type, &
      method_names, modal_options_type, new_error, &
      normalisation_names, scaling_names, text, wp
   use kschur_capi_callbacks, only: progress_type
   use kschur_capi_linear_solver, only: called_complex_solver_type, called_real_solver_type, solver_callbacks_type
   use kschur_capi_status, only: handle_type, fail, get_message, outcome, require, status_memory, status_null, status_ok, &
      status_usage
   use kschur_capi_text, only: take_text
   use kschur_settings, only: check_options
   implicit none
   private
   public :: options_handle_type, options_of, take_name
   ! Options that are set by name.
   public :: kschur_options_set_arpack, kschur_options_set_block, kschur_options_set_certify, &
      kschur_options_set_checkpoint, kschur_options_set_resume, &
      kschur_options_set_constraint_scaling, kschur_options_set_distribute, kschur_options_set_formulation, &
      kschur_options_set_groups, kschur_options_set_inner, &
      kschur_options_set_left, kschur_options_set_max_restarts, kschur_options_set_memory, kschur_options_set_method, &
      kschur_options_set_modes, &
      kschur_options_set_normalisation, kschur_options_set_presolve, kschur_options_set_seed, kschur_options_set_shift, &
      kschur_options_set_subspace, kschur_options_set_target, kschur_options_set_target_hz, kschur_options_set_threads, &
      kschur_options_set_tolerance

   !> Target of a `kschur_options` handle.
   type, extends(handle_type) :: options_handle_type
      type(modal_options_type) :: options
      type(progress_type) :: progress
      !> Linear solvers of the caller; not allocated: not given.
      type(inner_solvers_type) :: solvers
   end type options_handle_type

   ! Options that a setter changes: a copy, which replaces those of the handle if it is valid.
   type :: change_type
      type(options_handle_type), pointer :: handle => null()
      type(modal_options_type) :: options
      type(error_type), allocatable :: error
   end type change_type

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

#define HANDLE_TYPE options_handle_type
#define HANDLE_OF options_of
#define CREATE kschur_options_create
#define DESTROY kschur_options_destroy
#define MESSAGE kschur_options_get_message
#include "kschur_capi_handle.inc"

#define SETTER kschur_options_set_modes
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of modes", change%options%modes, change%error)
#include "kschur_capi_options.inc"

   integer(c_int) function kschur_options_set_target(address, re, im) bind(c) result(status)
      type(c_ptr), value :: address
      real(c_double), value :: re, im
      type(change_type) :: change

      call begin(change, address)
      change%options%target = cmplx(re, im, wp)
      status = accept(change)
   end function kschur_options_set_target

   integer(c_int) function kschur_options_set_target_hz(address, frequency) bind(c) result(status)
      type(c_ptr), value :: address
      real(c_double), value :: frequency
      type(change_type) :: change

      call begin(change, address)
      if (frequency < 0) call new_error(change%error, status_usage, "the frequency must not be negative")
      change%options%target = cmplx(0, 2*pi*frequency, wp)
      status = accept(change)
   end function kschur_options_set_target_hz

   integer(c_int) function kschur_options_set_shift(address, re, im) bind(c) result(status)
      type(c_ptr), value :: address
      real(c_double), value :: re, im
      type(change_type) :: change

      call begin(change, address)
      change%options%shift = cmplx(re, im, wp)
      status = accept(change)
   end function kschur_options_set_shift

   integer(c_int) function kschur_options_clear_shift(address) bind(c) result(status)
      type(c_ptr), value :: address
      type(change_type) :: change

      call begin(change, address)
      if (allocated(change%options%shift)) deallocate (change%options%shift)
      status = accept(change)
   end function kschur_options_clear_shift

#define SETTER kschur_options_set_method
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "method", method_names, change%options%method, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_arpack
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "setting of ARPACK", arpack_names, change%options%arpack, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_formulation
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "formulation", formulation_names, change%options%formulation, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_constraint_scaling
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "constraint scaling", scaling_names, change%options%constraint_scaling, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_inner
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "inner solver", inner_names, change%options%inner, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_subspace
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "subspace dimension", change%options%subspace, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_tolerance
#define GIVEN_TYPE real(c_double)
#define CHANGE change%options%tolerance = given
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_max_restarts
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of restarts", change%options%max_restarts, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_block
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of vectors of a block", change%options%block, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_threads
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of threads", change%options%threads, change%error)
#include "kschur_capi_options.inc"

   integer(c_int) function kschur_options_set_communicator(address, given) bind(c) result(status)
      type(c_ptr), value :: address
      integer(c_int), value :: given
      type(change_type) :: change

      call begin(change, address)
      change%options%communicator = given
      status = accept(change)
   end function kschur_options_set_communicator

#define SETTER kschur_options_set_distribute
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of rows", change%options%distribute, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_groups
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "number of groups", change%options%groups, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_memory
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE change%options%memory = given
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_presolve
#define GIVEN_TYPE integer(c_int)
#define CHANGE change%options%presolve = given /= 0
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_left
#define GIVEN_TYPE integer(c_int)
#define CHANGE change%options%left = given /= 0
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_certify
#define GIVEN_TYPE integer(c_int)
#define CHANGE change%options%certify = given > 0; change%options%uncounted = given < 0
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_normalisation
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_name(given, "normalisation", normalisation_names, change%options%normalisation, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_seed
#define GIVEN_TYPE integer(c_int64_t)
#define CHANGE call take_integer(given, "seed", change%options%seed, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_checkpoint
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_file(given, change%options%checkpoint, change%error)
#include "kschur_capi_options.inc"

#define SETTER kschur_options_set_resume
#define GIVEN_TYPE type(c_ptr)
#define CHANGE call take_file(given, change%options%resume, change%error)
#include "kschur_capi_options.inc"

   integer(c_int) function kschur_options_set_progress(address, callback, context) bind(c) result(status)
      type(c_ptr), value :: address, context
      type(c_funptr), value :: callback
      type(options_handle_type), pointer :: handle

      status = status_null
      handle => options_of(address)
      if (.not. associated(handle)) return
      handle%progress%callback = callback
      handle%progress%context = context
      status = status_ok
   end function kschur_options_set_progress

   integer(c_int) function kschur_options_set_stop(address, callback, context) bind(c) result(status)
      type(c_ptr), value :: address, context
      type(c_funptr), value :: callback
      type(options_handle_type), pointer :: handle

      status = status_null
      handle => options_of(address)
      if (.not. associated(handle)) return
      handle%progress%stop_callback = callback
      handle%progress%stop_context = context
      status = status_ok
   end function kschur_options_set_stop

   integer(c_int) function kschur_options_set_real_solver(address, factorize, solve, release, context) bind(c) &
      result(status)
      type(c_ptr), value :: address, context
      type(c_funptr), value :: factorize, solve, release
      type(options_handle_type), pointer :: handle
      type(called_real_solver_type) :: solver

      status = status_null
      handle => options_of(address)
      if (.not. associated(handle)) return
      status = status_ok
      if (c_associated(factorize) .neqv. c_associated(solve)) then
         status = fail(handle, status_null, "a linear solver needs both 'factorize' and 'solve'")
         return
      end if
      if (allocated(handle%solvers%real)) deallocate (handle%solvers%real)
      if (.not. c_associated(factorize)) return
      solver%callbacks = solver_callbacks_type(factorize, solve, release, context)
      allocate (handle%solvers%real, source=solver)
   end function kschur_options_set_real_solver

   integer(c_int) function kschur_options_set_complex_solver(address, factorize, solve, release, context) bind(c) &
      result(status)
      type(c_ptr), value :: address, context
      type(c_funptr), value :: factorize, solve, release
      type(options_handle_type), pointer :: handle
      type(called_complex_solver_type) :: solver

      status = status_null
      handle => options_of(address)
      if (.not. associated(handle)) return
      status = status_ok
      if (c_associated(factorize) .neqv. c_associated(solve)) then
         status = fail(handle, status_null, "a linear solver needs both 'factorize' and 'solve'")
         return
      end if
      if (allocated(handle%solvers%complex)) deallocate (handle%solvers%complex)
      if (.not. c_associated(factorize)) return
      solver%callbacks = solver_callbacks_type(factorize, solve, release, context)
      allocate (handle%solvers%complex, source=solver)
   end function kschur_options_set_complex_solver

   ! Copies the options of a handle, for a setter to change the copy.
   subroutine begin(change, address)
      type(change_type), intent(out) :: change
      type(c_ptr), intent(in) :: address

      change%handle => options_of(address)
      if (associated(change%handle)) change%options = change%handle%options
   end subroutine begin

   ! Stores the changed options in the handle if no error is raised and `check_options` finds none; sets the status.
   integer(c_int) function accept(change) result(status)
      type(change_type), intent(inout) :: change

      status = status_null
      if (.not. associated(change%handle)) return
      if (.not. allocated(change%error)) call check_options(change%options, change%error)
      if (.not. allocated(change%error)) change%handle%options = change%options
      status = outcome(change%handle, change%error)
   end function accept

   ! Converts an integer of C to one of Fortran; fails if it does not fit.
   subroutine take_integer(given, name, number, error)
      integer(c_int64_t), intent(in) :: given
      character(len=*), intent(in) :: name
      integer, intent(inout) :: number
      type(error_type), allocatable, intent(out) :: error

      if (given > huge(number) .or. given < -huge(number)) then
         call new_error(error, status_usage, "the "//name//" is "//text(given)//", beyond "//text(huge(number)))
      else
         number = int(given)
      end if
   end subroutine take_integer

   ! Takes the name of a file; an empty one means none, not allocated.
   subroutine take_file(address, path, error)
      type(c_ptr), intent(in) :: address
      character(len=:), allocatable, intent(inout) :: path
      type(error_type), allocatable, intent(out) :: error

      call require(address, "path", error)
      if (allocated(error)) return
      call take_text(address, path)
      if (path == "") deallocate (path)
   end subroutine take_file

   ! Takes a name as its position in a list, from 0; fails if it is not there.
   subroutine take_name(address, what, names, number, error)
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: what, names(0:)
      integer, intent(inout) :: number
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name, list
      integer :: position, i

      call require(address, "name", error)
      if (allocated(error)) return
      call take_text(address, name)
      position = index_of_name(name, names)
      if (position >= 0) then
         number = position
         return
      end if
      list = trim(names(0))
      do i = 1, ubound(names, 1)
         list = list//", "//trim(names(i))
      end do
      call new_error(error, status_usage, "there is no "//what//" '"//name//"', only "//list)
   end subroutine take_name
end module kschur_capi_options
