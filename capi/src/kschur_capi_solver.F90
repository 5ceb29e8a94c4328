!> Solvers that reuse factors and analyses between solves, for C.
module kschur_capi_solver
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use kschur, only: error_type, modal_result_type, modal_solver_type, new_error, new_modal_solver, solve_bands, &
      solve_targets, symmetric_no, text, wp
   use kschur_capi_callbacks, only: progress_type
   use kschur_capi_options, only: options_handle_type, options_of
   use kschur_capi_problem, only: problem_handle_type, check_problem, problem_of
   use kschur_capi_result, only: result_handle_type, clear, keep, modes_of_problem, result_of
   use kschur_capi_status, only: handle_type, get_message, outcome, require, status_memory, status_null, status_ok, &
      status_order, status_usage
   implicit none
   private

   !> Target of a `kschur_solver` handle.
   type, extends(handle_type) :: solver_handle_type
      !> Not allocated before a problem is set.
      type(modal_solver_type), allocatable :: solver
   end type solver_handle_type

contains

#define HANDLE_TYPE solver_handle_type
#define HANDLE_OF solver_of
#define CREATE kschur_solver_create
#define DESTROY kschur_solver_destroy
#define MESSAGE kschur_solver_get_message
#include "kschur_capi_handle.inc"

   integer(c_int) function kschur_solver_set_problem(address, problem) bind(c) result(status)
      type(c_ptr), value :: address, problem
      type(solver_handle_type), pointer :: handle
      type(problem_handle_type), pointer :: given
      type(error_type), allocatable :: error

      status = status_null
      handle => solver_of(address)
      if (.not. associated(handle)) return
      call require(problem, "problem", error)
      given => problem_of(problem)
      if (.not. allocated(error)) call check_problem(given, error)
      if (.not. allocated(error)) then
         if (allocated(handle%solver)) then
            associate (p => given%problem)
               call handle%solver%update_values(p%mass, p%stiffness, error, p%damping, p%constraints, symmetric_no, p%loss, p%mesh)
            end associate
         else
            allocate (handle%solver)
            call new_modal_solver(handle%solver, given%problem)
         end if
      end if
      status = outcome(handle, error)
   end function kschur_solver_set_problem

   integer(c_int) function kschur_solver_solve(address, options, result) bind(c) result(status)
      type(c_ptr), value :: address, options, result

      status = solve(address, options, result)
   end function kschur_solver_solve

   integer(c_int) function kschur_solver_solve_band(address, first, last, options, result) bind(c) result(status)
      type(c_ptr), value :: address, options, result
      real(c_double), value :: first, last

      status = solve(address, options, result, [first, last])
   end function kschur_solver_solve_band

   ! Computes the modes nearest to the target, or all in a band. Messages are stored with the result, as in kschur_solve.
   integer(c_int) function solve(address, options, result, band) result(status)
      type(c_ptr), intent(in) :: address, options, result
      real(wp), intent(in), optional :: band(2)
      type(solver_handle_type), pointer :: handle
      type(options_handle_type), pointer :: wanted
      type(result_handle_type), pointer :: found
      type(progress_type) :: progress
      type(error_type), allocatable :: error

      status = status_null
      found => result_of(result)
      if (.not. associated(found)) return
      call clear(found)
      call require(address, "solver", error)
      call require(options, "options", error)
      handle => solver_of(address)
      wanted => options_of(options)
      if (.not. allocated(error)) call check_ready(handle, wanted, error)
      if (.not. allocated(error)) then
         progress = wanted%progress
         if (present(band)) then
            call handle%solver%solve_band(band(1), band(2), wanted%options, found%result, error, progress)
         else
            call handle%solver%solve(wanted%options, found%result, error, progress)
         end if
      end if
      if (allocated(error)) then
         call clear(found)
      else
         call keep(found, modes_of_problem)
      end if
      status = outcome(found, error)
   end function solve

   integer(c_int) function kschur_solver_solve_targets(address, count, targets, options, results) bind(c) result(status)
      type(c_ptr), value :: address, targets, options, results
      integer(c_int64_t), value :: count

      status = solve_several(address, count, targets, "targets", options, results)
   end function kschur_solver_solve_targets

   integer(c_int) function kschur_solver_solve_bands(address, count, edges, options, results) bind(c) result(status)
      type(c_ptr), value :: address, edges, options, results
      integer(c_int64_t), value :: count

      status = solve_several(address, count, edges, "bands", options, results)
   end function kschur_solver_solve_bands

   ! Checks the arguments, and solves for all targets or bands.
   integer(c_int) function solve_several(address, count, wanted, what, options, results) result(status)
      type(c_ptr), intent(in) :: address, wanted, options, results
      integer(c_int64_t), intent(in) :: count
      !> "targets", "bands": pairs of numbers.
      character(len=*), intent(in) :: what
      type(solver_handle_type), pointer :: handle
      type(error_type), allocatable :: error

      status = status_null
      handle => solver_of(address)
      if (.not. associated(handle)) return
      call require(wanted, what, error)
      call require(options, "options", error)
      call require(results, "results", error)
      if (.not. allocated(error)) call check_ready(handle, options_of(options), error)
      if (.not. allocated(error) .and. (count < 1 .or. count > huge(1))) &
         call new_error(error, status_usage, "the number of "//what//" must lie between 1 and "//text(huge(1))//", not be "// &
            text(count))
      if (.not. allocated(error)) call solve_each(handle, int(count), wanted, what, options_of(options), results, error)
      status = outcome(handle, error)
   end function solve_several

   ! Solves for all targets or bands, and fills the caller's results, one for each; after an error of a solve all of them are empty.
   subroutine solve_each(handle, count, pairs, what, wanted, results, error)
      type(solver_handle_type), intent(inout) :: handle
      integer, intent(in) :: count
      type(c_ptr), intent(in) :: pairs, results
      character(len=*), intent(in) :: what
      type(options_handle_type), intent(in) :: wanted
      type(error_type), allocatable, intent(out) :: error
      real(c_double), pointer :: values(:, :)
      type(c_ptr), pointer :: places(:)
      type(modal_result_type), allocatable :: solved(:)
      type(result_handle_type), pointer :: found
      type(progress_type) :: progress
      integer :: i

      call c_f_pointer(pairs, values, [2, count])
      call c_f_pointer(results, places, [count])
      do i = 1, count
         call require(places(i), "results["//text(i - 1)//"]", error)
         if (allocated(error)) return
         found => result_of(places(i))
         call clear(found)
      end do
      progress = wanted%progress
      if (what == "targets") then
         call solve_targets(handle%solver, cmplx(values(1, :), values(2, :), wp), wanted%options, solved, error, progress)
      else
         call solve_bands(handle%solver, values, wanted%options, solved, error, progress)
      end if
      if (allocated(error)) return
      do i = 1, count
         found => result_of(places(i))
         found%result = solved(i)
         call keep(found, modes_of_problem)
      end do
   end subroutine solve_each

   ! Fails if the solver has no problem, or the options bring linear solvers of the caller.
   subroutine check_ready(handle, wanted, error)
      type(solver_handle_type), intent(in) :: handle
      type(options_handle_type), intent(in) :: wanted
      type(error_type), allocatable, intent(out) :: error

      if (.not. allocated(handle%solver)) then
         call new_error(error, status_order, "the solver has no problem: call kschur_solver_set_problem first")
      else if (allocated(wanted%solvers%real) .or. allocated(wanted%solvers%complex)) then
         call new_error(error, status_usage, "a solver that remembers takes the linear solvers of the library")
      end if
   end subroutine check_ready
end module kschur_capi_solver
