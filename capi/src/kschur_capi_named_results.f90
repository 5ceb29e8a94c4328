!> Results by name and by part, for C. Names are those of result files.
module kschur_capi_named_results
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int64_t, c_null_ptr, c_ptr
   use kschur, only: certified_names, error_type, formulation_names, reason_names, text, wp
   use kschur_capi_arrays, only: give_array, put
   use kschur_capi_names, only: find_columns, gather_numbers
   use kschur_capi_result, only: result_handle_type, has_solution, result_of
   use kschur_capi_status, only: fail, give_text, outcome, require, status_length, status_null, status_ok, status_order, &
      status_usage
   use kschur_capi_text, only: take_text
   implicit none
   private

   !> The struct kschur_part of C: which rows of which modes.
   type, bind(c) :: part_type
      integer(c_int64_t) :: first = 0, count = 0
      type(c_ptr) :: rows = c_null_ptr
      integer(c_int64_t) :: row_count = 0
      integer(c_int) :: only_real = 0
   end type part_type

contains

   integer(c_int) function kschur_result_get_length(address, name, length) bind(c) result(status)
      type(c_ptr), value :: address, name, length
      type(result_handle_type), pointer :: handle
      complex(wp), pointer :: columns(:, :)
      real(wp), allocatable :: numbers(:)

      handle => result_of(address)
      if (.not. found(handle, name, columns, numbers, status)) return
      if (associated(columns)) then
         call put(length, 2*size(columns, kind=c_int64_t))
      else
         call put(length, size(numbers, kind=c_int64_t))
      end if
   end function kschur_result_get_length

   integer(c_int) function kschur_result_get_numbers(address, name, values, length) bind(c) result(status)
      type(c_ptr), value :: address, name, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle
      complex(wp), pointer :: columns(:, :)
      real(wp), allocatable :: numbers(:)
      type(part_type) :: whole

      handle => result_of(address)
      if (.not. found(handle, name, columns, numbers, status)) return
      if (associated(columns)) then
         status = give_part(handle, columns, whole, values, length)
      else
         status = give_array(handle, numbers, values, length)
      end if
   end function kschur_result_get_numbers

   integer(c_int) function kschur_result_get_text(address, name, buffer, length) bind(c) result(status)
      type(c_ptr), value :: address, name, buffer
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      character(len=:), allocatable :: word, given
      integer :: k

      handle => result_of(address)
      if (.not. has_solution(handle, status)) return
      call require(name, "name", error)
      status = outcome(handle, error)
      if (allocated(error)) return
      call take_text(name, word)
      given = ""
      associate (result => handle%result)
         select case (word)
         case ("method")
            if (allocated(result%method)) given = result%method
         case ("formulation")
            given = trim(formulation_names(result%formulation))
         case ("decision")
            given = result%decision
         case ("inner")
            given = result%inner
         case ("reason")
            given = trim(reason_names(result%reason))
         case ("certified")
            given = trim(certified_names(result%certified))
         case ("notes")
            do k = 1, size(result%notes)
               given = given//trim(result%notes(k))//new_line("a")
            end do
         case ("directions")
            if (allocated(result%properties)) then
               do k = 1, size(result%properties%direction)
                  given = given//trim(result%properties%direction(k))//new_line("a")
               end do
            end if
         case default
            status = fail(handle, status_usage, "a result has no text '"//word//"'")
            return
         end select
      end associate
      status = give_text(handle, given, buffer, length)
   end function kschur_result_get_text

   integer(c_int) function kschur_result_get_part(address, name, part, values, length) bind(c) result(status)
      type(c_ptr), value :: address, name, part, values
      integer(c_int64_t), value :: length
      type(result_handle_type), pointer :: handle
      complex(wp), pointer :: columns(:, :)
      real(wp), allocatable :: numbers(:)
      type(part_type), pointer :: wanted
      type(error_type), allocatable :: error

      handle => result_of(address)
      if (.not. found(handle, name, columns, numbers, status)) return
      call require(part, "part", error)
      status = outcome(handle, error)
      if (allocated(error)) return
      if (.not. associated(columns)) then
         status = fail(handle, status_usage, "parts are given of eigenvectors and multipliers, right and left ones, alone")
         return
      end if
      call c_f_pointer(part, wanted)
      status = give_part(handle, columns, wanted, values, length)
   end function kschur_result_get_part

   integer(c_int) function kschur_result_is_real(address, name, mode, answer) bind(c) result(status)
      type(c_ptr), value :: address, name, answer
      integer(c_int64_t), value :: mode
      type(result_handle_type), pointer :: handle
      complex(wp), pointer :: columns(:, :)
      real(wp), allocatable :: numbers(:)

      handle => result_of(address)
      if (.not. found(handle, name, columns, numbers, status)) return
      if (.not. associated(columns)) then
         status = fail(handle, status_usage, "only eigenvectors and multipliers may be real or not")
      else if (mode < 0 .or. mode >= size(columns, 2)) then
         status = fail(handle, status_usage, "there is no mode "//text(mode)//" of "//text(size(columns, 2)))
      else
         call put(answer, merge(0_c_int, 1_c_int, any(abs(aimag(columns(:, mode + 1))) > 0)))
      end if
   end function kschur_result_is_real

   ! Copies some rows of some modes to the caller. Checks all counts before it reads pointers.
   integer(c_int) function give_part(handle, columns, part, values, length) result(status)
      type(result_handle_type), intent(inout) :: handle
      complex(wp), intent(in) :: columns(:, :)
      type(part_type), intent(in) :: part
      type(c_ptr), intent(in) :: values
      integer(c_int64_t), intent(in) :: length
      integer(c_int64_t) :: available, modes, count, needed, each, k
      integer(c_int64_t), allocatable :: row(:)
      real(c_double), pointer :: place(:)

      available = size(columns, 2, c_int64_t)
      modes = part%count
      if (modes == 0 .and. part%first >= 0) modes = max(available - part%first, 0_c_int64_t)
      count = part%row_count
      if (.not. c_associated(part%rows)) count = size(columns, 1, c_int64_t)
      status = status_ok
      if (part%first < 0 .or. part%first > available .or. modes < 0 .or. modes > available - max(part%first, 0_c_int64_t)) then
         status = fail(handle, status_usage, text(modes)//" modes from mode "//text(part%first)// &
            " on were asked for, of "//text(available)//" counted from 0")
      else if (count < 0) then
         status = fail(handle, status_usage, "there cannot be "//text(count)//" rows")
      else if (part%row_count /= 0 .and. .not. c_associated(part%rows)) then
         status = fail(handle, status_null, "the argument 'rows' is null")
      end if
      if (status /= status_ok) return
      each = merge(1, 2, part%only_real /= 0)*modes
      needed = huge(needed)
      if (count <= huge(needed)/max(each, 1_c_int64_t)) needed = each*count
      if (needed > 0 .and. .not. c_associated(values)) then
         status = fail(handle, status_null, "the argument 'values' is null")
      else if (length < needed) then
         status = fail(handle, status_length, "the array has a length of "//text(length)//" but needs "//text(needed))
      else if (part%only_real /= 0) then
         if (any(abs(aimag(columns(:, part%first + 1:part%first + modes))) > 0)) &
            status = fail(handle, status_usage, "not all of these modes are real: see kschur_result_is_real")
      end if
      if (status /= status_ok .or. needed == 0) return
      call take_rows(part, size(columns, 1, c_int64_t), row)
      if (any(row < 1)) then
         status = fail(handle, status_usage, "rows must lie between 0 and "//text(size(columns, 1) - 1))
         return
      end if
      call c_f_pointer(values, place, [needed])
      each = needed/modes
      do k = 1, modes
         call copy(columns(:, part%first + k), row, place((k - 1)*each + 1:k*each))
      end do
   end function give_part

   ! Row numbers of a part, converted to count from 1; 0 for those out of range. All rows if the part lists none.
   subroutine take_rows(part, n, row)
      type(part_type), intent(in) :: part
      integer(c_int64_t), intent(in) :: n
      integer(c_int64_t), allocatable, intent(out) :: row(:)
      integer(c_int64_t), pointer :: given(:)
      integer(c_int64_t) :: k

      if (c_associated(part%rows)) then
         call c_f_pointer(part%rows, given, [part%row_count])
         allocate (row(size(given, kind=c_int64_t)), source=0_c_int64_t)
         where (given >= 0 .and. given < n) row = given + 1
      else
         allocate (row(n), source=[(k, k=1, n)])
      end if
   end subroutine take_rows

   ! Copies rows of a column: as (re, im) pairs if there is room for two numbers for each row, else real parts alone.
   pure subroutine copy(column, row, place)
      complex(wp), intent(in) :: column(:)
      integer(c_int64_t), intent(in) :: row(:)
      real(c_double), intent(out) :: place(:)

      if (size(place) == size(row)) then
         place = real(column(row), wp)
      else
         place(1::2) = real(column(row), wp)
         place(2::2) = aimag(column(row))
      end if
   end subroutine copy

   ! Whether a result has numbers of this name, as columns or gathered; else sets the status.
   logical function found(handle, name, columns, numbers, status)
      type(result_handle_type), pointer, intent(in) :: handle
      type(c_ptr), intent(in) :: name
      complex(wp), pointer, intent(out) :: columns(:, :)
      real(wp), allocatable, intent(out) :: numbers(:)
      integer(c_int), intent(out) :: status
      type(error_type), allocatable :: error
      character(len=:), allocatable :: word
      logical :: known

      found = .false.
      nullify (columns)
      if (.not. has_solution(handle, status)) return
      call require(name, "name", error)
      status = outcome(handle, error)
      if (allocated(error)) return
      call take_text(name, word)
      call find_columns(handle%result, word, columns, known)
      if (.not. known) call gather_numbers(handle%result, word, numbers, known)
      if (.not. known) then
         status = fail(handle, status_usage, "a result has no numbers '"//word//"'")
      else if (.not. (associated(columns) .or. allocated(numbers))) then
         status = fail(handle, status_order, "the result does not hold '"//word// &
            "': solve, with the options that ask for it, first")
      end if
      found = status == status_ok
   end function found

end module kschur_capi_named_results
