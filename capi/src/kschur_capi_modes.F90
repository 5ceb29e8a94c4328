!> The modes of a result, for C: an array for each of their properties.
module kschur_capi_modes
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_ptr
   use kschur, only: kind_names
   use kschur_capi_arrays, only: give_array, put
   use kschur_capi_result, only: result_handle_type, has_modes, has_solution, result_of
   use kschur_capi_status, only: give_name, status_null
   implicit none
   private

contains

   integer(c_int) function kschur_result_get_modes(address, found, asked) bind(c) result(status)
      type(c_ptr), value :: address, found, asked
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call put(found, size(handle%result%eigenvalues, kind=c_int64_t))
      call put(asked, int(handle%result%modes_asked, c_int64_t))
   end function kschur_result_get_modes

   integer(c_int) function kschur_result_get_size(address, unknowns, multipliers) bind(c) result(status)
      type(c_ptr), value :: address, unknowns, multipliers
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call put(unknowns, int(handle%result%unknowns, c_int64_t))
      call put(multipliers, int(handle%result%constraints, c_int64_t))
   end function kschur_result_get_size

#define GETTER kschur_result_get_eigenvalues
#define PROPERTY eigenvalues
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_eigenvectors
#define PROPERTY eigenvectors
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_multipliers
#define PROPERTY multipliers
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_frequencies_hz
#define PROPERTY frequency_hz
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_damped_frequencies_hz
#define PROPERTY damped_frequency_hz
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_damping_ratios
#define PROPERTY damping_ratio
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_backward_errors
#define PROPERTY backward_error
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_errors
#define PROPERTY error_bound
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_kinds
#define PROPERTY kind
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_left_eigenvectors
#define PROPERTY left_eigenvectors
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_left_multipliers
#define PROPERTY left_multipliers
#include "kschur_capi_modes.inc"

#define GETTER kschur_result_get_condition_numbers
#define PROPERTY condition
#include "kschur_capi_modes.inc"

   integer(c_int) function kschur_kind_name(kind, buffer, length) bind(c) result(status)
      integer(c_int), value :: kind
      type(c_ptr), value :: buffer
      integer(c_int64_t), value :: length

      status = give_name(kind_names, kind, buffer, length)
   end function kschur_kind_name
end module kschur_capi_modes
