!> Quantities derived from modes, for C: modal properties, MAC, sensitivities.
module kschur_capi_study
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_double_complex, c_f_pointer, c_int, c_int64_t, c_ptr
   use kschur, only: eigenvalue_rates, error_type, find_modal_properties, frequency_response, modal_assurance, new_error, &
      problem_rate_type, rate_between, text, wp
   use kschur_capi_arrays, only: give_array, put
   use kschur_capi_callbacks, only: progress_type
   use kschur_capi_options, only: options_handle_type, options_of
   use kschur_capi_problem, only: problem_handle_type, check_problem, problem_of
   use kschur_capi_result, only: result_handle_type, has_modes, result_of
   use kschur_capi_status, only: fail, outcome, require, status_null, status_order, status_usage
   implicit none
   private

contains

   integer(c_int) function kschur_result_find_properties(address, problem, directions, count) bind(c) result(status)
      type(c_ptr), value :: address, problem, directions
      integer(c_int64_t), value :: count
      type(result_handle_type), pointer :: handle
      type(problem_handle_type), pointer :: problem_handle
      type(error_type), allocatable :: error
      real(c_double), pointer :: given(:, :)

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require_problem(problem, problem_handle, error)
      if (.not. allocated(error) .and. (count < 0 .or. count > huge(1))) &
         call new_error(error, status_usage, "the number of directions must lie between 0 and "//text(huge(1))//", not be "// &
            text(count))
      if (count > 0) call require(directions, "directions", error)
      if (.not. allocated(error)) then
         if (count > 0) then
            call c_f_pointer(directions, given, [problem_handle%problem%unknowns(), int(count)])
            call find_modal_properties(problem_handle%problem, handle%result, error, given)
         else
            call find_modal_properties(problem_handle%problem, handle%result, error)
         end if
      end if
      status = outcome(handle, error)
   end function kschur_result_find_properties

#define GETTER kschur_result_get_generalised_masses
#define PROPERTY mass
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_generalised_dampings
#define PROPERTY damping
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_generalised_stiffnesses
#define PROPERTY stiffness
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_modal_a
#define PROPERTY a
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_modal_b
#define PROPERTY b
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_participation_factors
#define PROPERTY participation
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_effective_masses
#define PROPERTY effective_mass
#include "kschur_capi_properties.inc"

#define GETTER kschur_result_get_total_masses
#define PROPERTY total_mass
#include "kschur_capi_properties.inc"

   integer(c_int) function kschur_result_get_mac(address, other, values, length) bind(c) result(status)
      type(c_ptr), value :: address, other, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle, second
      type(error_type), allocatable :: error
      real(wp), allocatable :: mac(:, :)

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(other, "other", error)
      if (.not. allocated(error)) then
         second => result_of(other)
         call modal_assurance(handle%result, second%result, mac, error)
      end if
      status = outcome(handle, error)
      if (.not. allocated(error)) status = give_array(handle, mac, values, length)
   end function kschur_result_get_mac

   integer(c_int) function kschur_result_get_rates(address, problem, changed, step, values, length) bind(c) result(status)
      type(c_ptr), value :: address, problem, changed, values
      real(c_double), value :: step
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle
      type(problem_handle_type), pointer :: here, there
      type(problem_rate_type) :: rate
      type(error_type), allocatable :: error
      complex(wp), allocatable :: rates(:)

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require_problem(problem, here, error)
      if (.not. allocated(error)) call require_problem(changed, there, error)
      if (.not. allocated(error)) call rate_between(here%problem, there%problem, step, rate, error)
      if (.not. allocated(error)) call eigenvalue_rates(here%problem, handle%result, rate, rates, error)
      status = outcome(handle, error)
      if (.not. allocated(error)) status = give_array(handle, rates, values, length)
   end function kschur_result_get_rates

   integer(c_int) function kschur_problem_get_response(address, frequencies, points, forces, count, options, response, &
      multipliers, done) bind(c) result(status)
      type(c_ptr), value :: address, frequencies, forces, options, response, multipliers, done
      integer(c_int64_t), value :: points, count
      type(problem_handle_type), pointer :: handle
      type(options_handle_type), pointer :: wanted
      type(progress_type) :: progress
      type(error_type), allocatable :: error
      real(c_double), pointer :: hz(:)
      complex(c_double_complex), pointer :: f(:, :), place(:, :, :)
      complex(wp), allocatable :: x(:, :, :), xi(:, :, :)

      status = status_null
      call put(done, 0_c_int64_t)
      handle => problem_of(address)
      if (.not. associated(handle)) return
      wanted => options_of(options)
      if (associated(wanted)) progress = wanted%progress
      call check_problem(handle, error)
      if (.not. allocated(error) .and. (min(points, count) < 1 .or. max(points, count) > huge(1))) call new_error(error, &
         status_usage, "the numbers of frequencies and forces must lie between 1 and "//text(huge(1))//", not be "// &
         text(points)//" and "//text(count))
      call require(frequencies, "frequencies", error)
      call require(forces, "forces", error)
      call require(response, "response", error)
      if (.not. allocated(error)) then
         call c_f_pointer(frequencies, hz, [points])
         call c_f_pointer(forces, f, [handle%problem%unknowns(), int(count)])
         if (associated(wanted)) then
            call frequency_response(handle%problem, hz, f, x, error, xi, monitor=progress, threads=wanted%options%threads)
         else
            call frequency_response(handle%problem, hz, f, x, error, xi)
         end if
      end if
      status = outcome(handle, error)
      if (allocated(error)) return
      call put(done, size(x, 3, c_int64_t))
      call c_f_pointer(response, place, shape(x))
      place = x
      if (.not. c_associated(multipliers)) return
      call c_f_pointer(multipliers, place, shape(xi))
      place = xi
   end function kschur_problem_get_response

   ! Returns the problem of a handle, completed and checked; fails if it is null or not valid.
   subroutine require_problem(address, handle, error)
      type(c_ptr), intent(in) :: address
      type(problem_handle_type), pointer, intent(out) :: handle
      type(error_type), allocatable, intent(out) :: error

      nullify (handle)
      call require(address, "problem", error)
      if (allocated(error)) return
      handle => problem_of(address)
      call check_problem(handle, error)
   end subroutine require_problem
end module kschur_capi_study
