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

   integer(c_int) function kschur_result_get_eigenvalues(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%eigenvalues, values, length)
   end function kschur_result_get_eigenvalues

   integer(c_int) function kschur_result_get_eigenvectors(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%eigenvectors, values, length)
   end function kschur_result_get_eigenvectors

   integer(c_int) function kschur_result_get_multipliers(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%multipliers, values, length)
   end function kschur_result_get_multipliers

   integer(c_int) function kschur_result_get_frequencies_hz(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%frequency_hz, values, length)
   end function kschur_result_get_frequencies_hz

   integer(c_int) function kschur_result_get_damped_frequencies_hz(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%damped_frequency_hz, values, length)
   end function kschur_result_get_damped_frequencies_hz

   integer(c_int) function kschur_result_get_damping_ratios(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%damping_ratio, values, length)
   end function kschur_result_get_damping_ratios

   integer(c_int) function kschur_result_get_backward_errors(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%backward_error, values, length)
   end function kschur_result_get_backward_errors

   integer(c_int) function kschur_result_get_errors(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%error_bound, values, length)
   end function kschur_result_get_errors

   integer(c_int) function kschur_result_get_kinds(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%kind, values, length)
   end function kschur_result_get_kinds

   integer(c_int) function kschur_result_get_left_eigenvectors(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%left_eigenvectors, values, length)
   end function kschur_result_get_left_eigenvectors

   integer(c_int) function kschur_result_get_left_multipliers(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%left_multipliers, values, length)
   end function kschur_result_get_left_multipliers

   integer(c_int) function kschur_result_get_condition_numbers(address, values, length) bind(c) result(status)
      type(c_ptr), value :: address, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      status = status_null
      handle => result_of(address)
      if (associated(handle)) status = give_array(handle, handle%result%condition, values, length)
   end function kschur_result_get_condition_numbers

   integer(c_int) function kschur_kind_name(kind, buffer, length) bind(c) result(status)
      integer(c_int), value :: kind
      type(c_ptr), value :: buffer
      integer(c_int64_t), value :: length

      status = give_name(kind_names, kind, buffer, length)
   end function kschur_kind_name
end module kschur_capi_modes
