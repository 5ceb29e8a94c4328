!> Copies numbers and arrays to memory of the caller.
module kschur_capi_arrays
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_double_complex, c_f_pointer, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, text, wp
   use kschur_capi_status, only: handle_type, fail, outcome, require, status_length, status_ok, status_order
   implicit none
   private
   public :: give_array, put

   !> Copies an array to the caller; fails if the result does not hold it, or the caller's array is too short.
   interface give_array
      module procedure give_reals, give_real_columns, give_integers, give_complex, give_complex_columns
   end interface give_array

   !> Writes a number to an address of the caller; to none if that is null.
   interface put
      module procedure put_int, put_int64, put_double
   end interface put

contains

   ! Whether data exist and fit in the caller's array; else sets the status.
   logical function has_room(handle, is_there, needed, address, length, status)
      class(handle_type), intent(inout) :: handle
      ! Whether the data exist.
      logical, intent(in) :: is_there
      integer(c_int64_t), intent(in) :: needed
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      integer(c_int), intent(out) :: status
      type(error_type), allocatable :: error

      status = status_ok
      if (.not. is_there) then
         status = fail(handle, status_order, "the result does not hold this: solve, with the options that ask for it, first")
      else
         if (needed > 0) call require(address, "values", error)
         status = outcome(handle, error)
         if (status == status_ok .and. length < needed) &
            status = fail(handle, status_length, "the array has a length of "//text(length)//" but needs "//text(needed))
      end if
      has_room = status == status_ok
   end function has_room

   integer(c_int) function give_reals(handle, values, address, length) result(status)
      class(handle_type), intent(inout) :: handle
      real(wp), allocatable, intent(in) :: values(:)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      real(c_double), pointer :: place(:)
      integer(c_int64_t) :: needed

      needed = 0
      if (allocated(values)) needed = size(values)
      if (.not. has_room(handle, allocated(values), needed, address, length, status) .or. needed == 0) return
      call c_f_pointer(address, place, [needed])
      place = values
   end function give_reals

   integer(c_int) function give_real_columns(handle, values, address, length) result(status)
      class(handle_type), intent(inout) :: handle
      real(wp), allocatable, intent(in) :: values(:, :)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      real(c_double), pointer :: place(:, :)
      integer(c_int64_t) :: needed

      needed = 0
      if (allocated(values)) needed = size(values, kind=c_int64_t)
      if (.not. has_room(handle, allocated(values), needed, address, length, status) .or. needed == 0) return
      call c_f_pointer(address, place, shape(values))
      place = values
   end function give_real_columns

   integer(c_int) function give_integers(handle, values, address, length) result(status)
      class(handle_type), intent(inout) :: handle
      integer, allocatable, intent(in) :: values(:)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      integer(c_int), pointer :: place(:)
      integer(c_int64_t) :: needed

      needed = 0
      if (allocated(values)) needed = size(values)
      if (.not. has_room(handle, allocated(values), needed, address, length, status) .or. needed == 0) return
      call c_f_pointer(address, place, [needed])
      place = int(values, c_int)
   end function give_integers

   integer(c_int) function give_complex(handle, values, address, length) result(status)
      class(handle_type), intent(inout) :: handle
      complex(wp), allocatable, intent(in) :: values(:)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      complex(c_double_complex), pointer :: place(:)
      integer(c_int64_t) :: needed

      needed = 0
      if (allocated(values)) needed = 2*size(values, kind=c_int64_t)
      if (.not. has_room(handle, allocated(values), needed, address, length, status) .or. needed == 0) return
      call c_f_pointer(address, place, [needed/2])
      place = values
   end function give_complex

   integer(c_int) function give_complex_columns(handle, values, address, length) result(status)
      class(handle_type), intent(inout) :: handle
      complex(wp), allocatable, intent(in) :: values(:, :)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: length
      complex(c_double_complex), pointer :: place(:, :)
      integer(c_int64_t) :: needed

      needed = 0
      if (allocated(values)) needed = 2*size(values, kind=c_int64_t)
      if (.not. has_room(handle, allocated(values), needed, address, length, status) .or. needed == 0) return
      call c_f_pointer(address, place, shape(values))
      place = values
   end function give_complex_columns

   subroutine put_int(address, value)
      type(c_ptr), intent(in) :: address
      integer(c_int), intent(in) :: value
      integer(c_int), pointer :: place

      if (.not. c_associated(address)) return
      call c_f_pointer(address, place)
      place = value
   end subroutine put_int

   subroutine put_int64(address, value)
      type(c_ptr), intent(in) :: address
      integer(c_int64_t), intent(in) :: value
      integer(c_int64_t), pointer :: place

      if (.not. c_associated(address)) return
      call c_f_pointer(address, place)
      place = value
   end subroutine put_int64

   subroutine put_double(address, value)
      type(c_ptr), intent(in) :: address
      real(c_double), intent(in) :: value
      real(c_double), pointer :: place

      if (.not. c_associated(address)) return
      call c_f_pointer(address, place)
      place = value
   end subroutine put_double
end module kschur_capi_arrays
