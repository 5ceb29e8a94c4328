!> Problems, for C: their matrices from arrays and files.
module kschur_capi_problem
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int32_t, c_int64_t, c_loc, &
      c_null_ptr, c_ptr
   use kschur, only: add_context, csr_matrix_type, empty_csr_matrix, error_type, modal_problem_type, new_csr_from_triplets, &
      new_csr_matrix, new_error, read_hdf5_problem, settle_mesh, symmetric_check, symmetric_names, text, wp, write_hdf5_problem
   use kschur_capi_arrays, only: put
   use kschur_capi_status, only: handle_type, get_message, outcome, require, status_input, status_memory, status_null, &
      status_ok, status_order, status_usage
   use kschur_capi_options, only: take_name
   use kschur_capi_text, only: take_text
   use kschur_lock, only: acquire_lock, release_lock, lock_problem
   use kschur_problem, only: settle_modal_problem
   implicit none
   private
   public :: problem_handle_type, check_problem, problem_of, take_indices

   !> Target of a `kschur_problem` handle.
   type, extends(handle_type) :: problem_handle_type
      !> Matrices are stored as they are set; the rest is valid if `checked`.
      type(modal_problem_type) :: problem
      !> Which matrices were set.
      logical :: given(0:5) = .false.
      logical :: checked = .false.
      !> Storage of symmetric ones: `symmetric_check` and its like.
      integer :: symmetric = symmetric_check
   end type problem_handle_type

   ! Enumeration kschur_matrix.
   integer, parameter :: mass = 0, stiffness = 1, damping = 2, constraints = 3, loss = 4, transformation = 5
   character(len=*), parameter :: names(0:5) = [character(len=22) :: "mass matrix M", "stiffness matrix K", &
      "damping matrix R", "constraint Jacobian Cq", "loss matrix H", "transformation T"]

contains

#define HANDLE_TYPE problem_handle_type
#define HANDLE_OF problem_of
#define CREATE kschur_problem_create
#define DESTROY kschur_problem_destroy
#define MESSAGE kschur_problem_get_message
#include "kschur_capi_handle.inc"

   !> Completes and checks `handle%problem`, unless that was done since the last change; thread-safe.
   subroutine check_problem(handle, error)
      type(problem_handle_type), intent(inout) :: handle
      type(error_type), allocatable, intent(out) :: error

      call acquire_lock(lock_problem)
      if (.not. handle%checked) call complete(handle, error)
      call release_lock(lock_problem)
   end subroutine check_problem

   ! Takes R and Cq as empty if they were not set, and checks the problem; fails without M or K.
   subroutine complete(handle, error)
      type(problem_handle_type), intent(inout) :: handle
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: problem
      integer :: n

      if (.not. all(handle%given(mass:stiffness))) then
         call new_error(error, status_order, "a problem needs a mass matrix and a stiffness matrix")
         return
      end if
      n = handle%problem%mass%rows
      if (.not. handle%given(damping)) handle%problem%damping = empty_csr_matrix(n, n)
      if (.not. handle%given(constraints)) handle%problem%constraints = empty_csr_matrix(0, n)
      problem = handle%problem
      if (allocated(problem%position)) deallocate (problem%position)
      call settle_modal_problem(problem, error, symmetric=handle%symmetric)
      if (.not. allocated(error) .and. allocated(problem%mesh)) call settle_mesh(problem%mesh, n, error)
      if (allocated(error)) return
      handle%problem = problem
      handle%checked = .true.
   end subroutine complete

   integer(c_int) function kschur_problem_set_csr(problem, matrix, rows, columns, entries, base, row_start, column, &
      value) bind(c) result(status)
      type(c_ptr), value :: problem, row_start, column, value
      integer(c_int), value :: matrix, base
      integer(c_int64_t), value :: rows, columns, entries

      status = set_matrix(problem, matrix, rows, columns, entries, base, row_start, column, value, .true., .false.)
   end function kschur_problem_set_csr

   integer(c_int) function kschur_problem_set_csr64(problem, matrix, rows, columns, entries, base, row_start, column, &
      value) bind(c) result(status)
      type(c_ptr), value :: problem, row_start, column, value
      integer(c_int), value :: matrix, base
      integer(c_int64_t), value :: rows, columns, entries

      status = set_matrix(problem, matrix, rows, columns, entries, base, row_start, column, value, .true., .true.)
   end function kschur_problem_set_csr64

   integer(c_int) function kschur_problem_set_triplets(problem, matrix, rows, columns, entries, base, row, column, &
      value) bind(c) result(status)
      type(c_ptr), value :: problem, row, column, value
      integer(c_int), value :: matrix, base
      integer(c_int64_t), value :: rows, columns, entries

      status = set_matrix(problem, matrix, rows, columns, entries, base, row, column, value, .false., .false.)
   end function kschur_problem_set_triplets

   integer(c_int) function kschur_problem_set_triplets64(problem, matrix, rows, columns, entries, base, row, column, &
      value) bind(c) result(status)
      type(c_ptr), value :: problem, row, column, value
      integer(c_int), value :: matrix, base
      integer(c_int64_t), value :: rows, columns, entries

      status = set_matrix(problem, matrix, rows, columns, entries, base, row, column, value, .false., .true.)
   end function kschur_problem_set_triplets64

   ! Checks the arguments, and stores a matrix of the problem.
   integer(c_int) function set_matrix(problem, matrix, rows, columns, entries, base, row, column, value, compressed, &
      wide) result(status)
      type(c_ptr), intent(in) :: problem
      integer(c_int), intent(in) :: matrix, base
      integer(c_int64_t), intent(in) :: rows, columns, entries
      !> Row indices, or row starts.
      type(c_ptr), intent(in) :: row
      type(c_ptr), intent(in) :: column, value
      !> Whether the format is CSR; whether indices have 64 bits.
      logical, intent(in) :: compressed, wide
      type(problem_handle_type), pointer :: handle
      type(csr_matrix_type) :: made
      type(error_type), allocatable :: error

      status = status_null
      handle => problem_of(problem)
      if (.not. associated(handle)) return
      if (matrix < mass .or. matrix > transformation) then
         call new_error(error, status_usage, "there is no matrix number "//text(int(matrix))// &
            "; KSCHUR_MASS and its like are numbers from 0 to 5")
      else if (matrix == transformation .and. .not. allocated(handle%problem%mesh)) then
         call new_error(error, status_order, "the transformation is that of nodes: call kschur_problem_set_nodes first")
      else
         call make_matrix(made, rows, columns, entries, int(base), row, column, value, compressed, wide, error)
         call add_context(error, "the "//trim(names(matrix)))
      end if
      status = outcome(handle, error)
      if (status /= status_ok) return
      select case (matrix)
      case (mass)
         handle%problem%mass = made
      case (stiffness)
         handle%problem%stiffness = made
      case (damping)
         handle%problem%damping = made
      case (constraints)
         handle%problem%constraints = made
      case (loss)
         if (.not. allocated(handle%problem%loss)) allocate (handle%problem%loss)
         handle%problem%loss = made
      case (transformation)
         if (.not. allocated(handle%problem%mesh%transformation)) allocate (handle%problem%mesh%transformation)
         handle%problem%mesh%transformation = made
      end select
      if (matrix /= transformation) handle%problem%index_base = base
      handle%given(matrix) = .true.
      handle%checked = .false.
   end function set_matrix

   ! Makes a matrix from the caller's arrays, compressed rows or triplets, with indices of 32 or, if `wide`, 64 bits.
   subroutine make_matrix(matrix, rows, columns, entries, base, row, column, value, compressed, wide, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer(c_int64_t), intent(in) :: rows, columns, entries
      integer, intent(in) :: base
      type(c_ptr), intent(in) :: row, column, value
      logical, intent(in) :: compressed, wide
      type(error_type), allocatable, intent(out) :: error
      integer(c_int64_t), parameter :: most = huge(1) - 1
      integer, allocatable :: row_index(:), column_index(:)
      real(c_double), pointer :: values(:)
      real(wp), target :: none(0)

      if (base /= 0 .and. base /= 1) then
         call new_error(error, status_usage, "the index base is "//text(base)//" but must be 0 or 1")
      else if (min(rows, columns, entries) < 0 .or. max(rows, columns, entries) > most) then
         call new_error(error, status_input, "numbers of rows, columns and entries must lie between 0 and "//text(most)// &
            ", not be "//text(rows)//", "//text(columns)//" and "//text(entries))
      end if
      if (allocated(error)) return
      if (compressed) then
         call take_indices(row, "row_start", wide, rows + 1, base, entries, row_index, error)
      else
         call take_indices(row, "row", wide, entries, base, rows - 1, row_index, error)
      end if
      call take_indices(column, "column", wide, entries, base, columns - 1, column_index, error)
      values => none
      if (entries > 0) call require(value, "value", error)
      if (allocated(error)) return
      if (entries > 0) call c_f_pointer(value, values, [entries])
      if (compressed) then
         call new_csr_matrix(matrix, int(rows), int(columns), row_index, column_index, values, error)
      else
         call new_csr_from_triplets(matrix, int(rows), int(columns), row_index, column_index, values, error)
      end if
   end subroutine make_matrix

   ! Converts indices of a caller to indices from 1.
   subroutine take_indices(address, name, wide, count, base, last, indices, error)
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name
      logical, intent(in) :: wide
      integer(c_int64_t), intent(in) :: count
      integer, intent(in) :: base
      !> Largest valid index, from 0.
      integer(c_int64_t), intent(in) :: last
      integer, allocatable, intent(out) :: indices(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(c_int32_t), pointer :: narrow(:)
      integer(c_int64_t), pointer :: broad(:)
      integer(c_int64_t) :: k, index
      integer :: failed

      if (count > 0) call require(address, name, error)
      if (allocated(error)) return
      allocate (indices(count), stat=failed)
      if (failed /= 0) then
         call new_error(error, status_memory, "there is not enough memory for "//text(count)//" indices")
         return
      end if
      if (count == 0) return
      if (wide) then
         call c_f_pointer(address, broad, [count])
      else
         call c_f_pointer(address, narrow, [count])
      end if
      do k = 1, count
         if (wide) then
            index = broad(k)
         else
            index = narrow(k)
         end if
         if (index < base .or. index > last + base) then
            call new_error(error, status_input, name//"["//text(k - 1)//"] is "//text(index)// &
               " but must lie between "//text(base)//" and "//text(last + base))
            return
         end if
         indices(k) = int(index) - base + 1
      end do
   end subroutine take_indices

   integer(c_int) function kschur_problem_set_symmetric(problem, name) bind(c) result(status)
      type(c_ptr), value :: problem, name
      type(problem_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      status = status_null
      handle => problem_of(problem)
      if (.not. associated(handle)) return
      call take_name(name, "storage of symmetric matrices", symmetric_names, handle%symmetric, error)
      if (.not. allocated(error)) handle%checked = .false.
      status = outcome(handle, error)
   end function kschur_problem_set_symmetric

   integer(c_int) function kschur_problem_get_size(problem, unknowns, multipliers) bind(c) result(status)
      type(c_ptr), value :: problem, unknowns, multipliers
      type(problem_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      status = status_null
      handle => problem_of(problem)
      if (.not. associated(handle)) return
      call check_problem(handle, error)
      status = outcome(handle, error)
      if (status /= status_ok) return
      call put(unknowns, int(handle%problem%unknowns(), c_int64_t))
      call put(multipliers, int(handle%problem%multipliers(), c_int64_t))
   end function kschur_problem_get_size

   integer(c_int) function kschur_problem_read_hdf5(problem, path) bind(c) result(status)
      type(c_ptr), value :: problem, path
      type(problem_handle_type), pointer :: handle
      type(modal_problem_type) :: read
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name

      status = status_null
      handle => problem_of(problem)
      if (.not. associated(handle)) return
      call require(path, "path", error)
      if (.not. allocated(error)) then
         call take_text(path, name)
         call read_hdf5_problem(read, name, error, symmetric=handle%symmetric)
      end if
      status = outcome(handle, error)
      if (status /= status_ok) return
      handle%problem = read
      handle%given = .true.
      handle%checked = .true.
   end function kschur_problem_read_hdf5

   integer(c_int) function kschur_problem_write_hdf5(problem, path) bind(c) result(status)
      type(c_ptr), value :: problem, path
      type(problem_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name

      status = status_null
      handle => problem_of(problem)
      if (.not. associated(handle)) return
      call require(path, "path", error)
      if (.not. allocated(error)) call check_problem(handle, error)
      if (.not. allocated(error)) then
         call take_text(path, name)
         call write_hdf5_problem(handle%problem, name, error)
      end if
      status = outcome(handle, error)
   end function kschur_problem_write_hdf5
end module kschur_capi_problem
