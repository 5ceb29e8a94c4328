!> Outcome of a solve, for C: reason, notes, effort.
module kschur_capi_outcome
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, formulation_names, reason_names, text, wp
   use kschur_capi_arrays, only: put
   use kschur_capi_result, only: result_handle_type, has_modes, has_solution, result_of
   use kschur_capi_status, only: fail, give_name, give_text, outcome, require, status_length, status_ok, status_usage
   implicit none
   private

contains

   integer(c_int) function kschur_result_get_reason(address, reason) bind(c) result(status)
      type(c_ptr), value :: address, reason
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call require(reason, "reason", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(reason, int(handle%result%reason, c_int))
   end function kschur_result_get_reason

   integer(c_int) function kschur_reason_name(reason, buffer, length) bind(c) result(status)
      integer(c_int), value :: reason
      type(c_ptr), value :: buffer
      integer(c_int64_t), value :: length

      status = give_name(reason_names, reason, buffer, length)
   end function kschur_reason_name

   integer(c_int) function kschur_result_get_certified(address, certified) bind(c) result(status)
      type(c_ptr), value :: address, certified
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(certified, "certified", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(certified, int(handle%result%certified, c_int))
   end function kschur_result_get_certified

   integer(c_int) function kschur_result_get_missing(address, missing) bind(c) result(status)
      type(c_ptr), value :: address, missing
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(missing, "missing", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(missing, int(handle%result%missing, c_int64_t))
   end function kschur_result_get_missing

   integer(c_int) function kschur_result_get_note_count(address, count) bind(c) result(status)
      type(c_ptr), value :: address, count
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(count, "count", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(count, size(handle%result%notes, kind=c_int64_t))
   end function kschur_result_get_note_count

   integer(c_int) function kschur_result_get_note(address, index, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: index, length
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      if (index < 0 .or. index >= size(handle%result%notes)) then
         status = fail(handle, status_usage, "there is no note "//text(index)//" of "//text(size(handle%result%notes)))
      else
         status = give_text(handle, trim(handle%result%notes(index + 1)), buffer, length)
      end if
   end function kschur_result_get_note

   integer(c_int) function kschur_result_get_method(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      status = give_text(handle, handle%result%method, buffer, length)
   end function kschur_result_get_method

   integer(c_int) function kschur_result_get_formulation(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      status = give_text(handle, trim(formulation_names(handle%result%formulation)), buffer, length)
   end function kschur_result_get_formulation

   integer(c_int) function kschur_result_get_decision(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      status = give_text(handle, handle%result%decision, buffer, length)
   end function kschur_result_get_decision

   integer(c_int) function kschur_result_get_inner(address, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, buffer
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      status = give_text(handle, handle%result%inner, buffer, length)
   end function kschur_result_get_inner

   integer(c_int) function kschur_result_get_target(address, re, im) bind(c) result(status)
      type(c_ptr), value :: address, re, im
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call put(re, real(handle%result%target, wp))
      call put(im, aimag(handle%result%target))
   end function kschur_result_get_target

   integer(c_int) function kschur_result_get_shift(address, re, im) bind(c) result(status)
      type(c_ptr), value :: address, re, im
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call put(re, real(handle%result%shift, wp))
      call put(im, aimag(handle%result%shift))
   end function kschur_result_get_shift

   integer(c_int) function kschur_result_get_counts(address, operator_applications, restarts, factorizations) bind(c) &
      result(status)
      type(c_ptr), value :: address, operator_applications, restarts, factorizations
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call put(operator_applications, int(handle%result%operator_applications, c_int64_t))
      call put(restarts, int(handle%result%restarts, c_int64_t))
      call put(factorizations, int(handle%result%factorizations, c_int64_t))
   end function kschur_result_get_counts

   integer(c_int) function kschur_result_get_seconds(address, total, analyze, factorize, solve, orthogonalize) bind(c) &
      result(status)
      type(c_ptr), value :: address, total, analyze, factorize, solve, orthogonalize
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call put(total, handle%result%seconds%total)
      call put(analyze, handle%result%seconds%analyze)
      call put(factorize, handle%result%seconds%factorize)
      call put(solve, handle%result%seconds%solve)
      call put(orthogonalize, handle%result%seconds%orthogonalize)
   end function kschur_result_get_seconds

   integer(c_int) function kschur_result_get_factors(address, order, entries) bind(c) result(status)
      type(c_ptr), value :: address, order, entries
      type(result_handle_type), pointer :: handle

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call put(order, int(handle%result%factored_order, c_int64_t))
      call put(entries, handle%result%factor_entries)
   end function kschur_result_get_factors

   integer(c_int) function kschur_result_get_redundant_constraints(address, count) bind(c) result(status)
      type(c_ptr), value :: address, count
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_modes(handle, status)) return
      call require(count, "count", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(count, int(handle%result%redundant_constraints, c_int64_t))
   end function kschur_result_get_redundant_constraints

   integer(c_int) function kschur_result_get_history_count(address, count) bind(c) result(status)
      type(c_ptr), value :: address, count
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call require(count, "count", error)
      status = outcome(handle, error)
      if (status == status_ok) call put(count, size(handle%result%history%residual, kind=c_int64_t))
   end function kschur_result_get_history_count

   integer(c_int) function kschur_result_get_history(address, converged, applications, residual, length) bind(c) &
      result(status)
      type(c_ptr), value :: address, converged, applications, residual
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle
      integer(c_int64_t), pointer :: counts(:)
      real(c_double), pointer :: residuals(:)
      integer :: looks

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      associate (history => handle%result%history)
         looks = size(history%residual)
         if (length < looks) then
            status = fail(handle, status_length, "the arrays have a length of "//text(length)//" but need "//text(looks))
            return
         end if
         if (c_associated(converged)) then
            call c_f_pointer(converged, counts, [looks])
            counts = history%converged
         end if
         if (c_associated(applications)) then
            call c_f_pointer(applications, counts, [looks])
            counts = history%operator_applications
         end if
         if (c_associated(residual)) then
            call c_f_pointer(residual, residuals, [looks])
            residuals = history%residual
         end if
      end associate
   end function kschur_result_get_history
end module kschur_capi_outcome
