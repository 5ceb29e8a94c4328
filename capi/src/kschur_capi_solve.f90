!> Solves, for C: the modes of a problem, eigenvalues of an operator.
module kschur_capi_solve
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_funptr, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, inner_solvers_type, krylov_options_type, krylov_statistics_type, krylov_schur, &
      named_selection_type, new_error, solve_band, solve_modes, text, wp
   use kschur_capi_callbacks, only: called_complex_operator_type, called_real_operator_type, progress_type
   use kschur_capi_options, only: options_handle_type, options_of
   use kschur_capi_problem, only: problem_handle_type, check_problem, problem_of
   use kschur_capi_result, only: result_handle_type, clear, eigenvalues_of_operator, keep, modes_of_problem, result_of
   use kschur_capi_status, only: outcome, require, status_null, status_usage
   use kschur_capi_text, only: take_text
   use kschur_krylov_options, only: subspace_dimension
   use kschur_threads, only: enter_solve, leave_solve
   implicit none
   private

   ! In the order of the constants of kschur_selection.
   character(len=*), parameter :: criteria(7) = [character(len=18) :: "nearest-target", "largest-magnitude", &
      "smallest-magnitude", "largest-real", "smallest-real", "largest-imaginary", "smallest-imaginary"]

contains

   integer(c_int) function kschur_solve(problem, options, result) bind(c) result(status)
      type(c_ptr), value :: problem, options, result

      status = solve(problem, options, result)
   end function kschur_solve

   integer(c_int) function kschur_solve_band(problem, first, last, options, result) bind(c) result(status)
      type(c_ptr), value :: problem, options, result
      real(c_double), value :: first, last

      status = solve(problem, options, result, [first, last])
   end function kschur_solve_band

   ! Computes the modes nearest to the target, or all in a band.
   integer(c_int) function solve(problem, options, result, band) result(status)
      type(c_ptr), intent(in) :: problem, options, result
      real(wp), intent(in), optional :: band(2)
      type(problem_handle_type), pointer :: problem_handle
      type(options_handle_type), pointer :: options_handle
      type(result_handle_type), pointer :: handle
      type(progress_type) :: progress
      ! Null for solvers of the library: then an absent argument.
      type(inner_solvers_type), pointer :: solvers
      type(problem_handle_type), target :: nothing
      type(error_type), allocatable :: error

      status = status_null
      handle => result_of(result)
      if (.not. associated(handle)) return
      call clear(handle)
      call require(problem, "problem", error)
      call require(options, "options", error)
      problem_handle => problem_of(problem)
      options_handle => options_of(options)
      if (.not. allocated(error)) call check_problem(problem_handle, error)
      if (associated(options_handle) .and. allocated(error)) then
         if (allocated(options_handle%options%communicator)) then
            ! Other processes need no problem; if the first one fails, so do they, as they wait for it.
            deallocate (error)
            problem_handle => nothing
         end if
      end if
      if (.not. allocated(error)) then
         progress = options_handle%progress
         nullify (solvers)
         if (allocated(options_handle%solvers%real) .or. allocated(options_handle%solvers%complex)) &
            solvers => options_handle%solvers
         if (present(band)) then
            call solve_band(problem_handle%problem, band(1), band(2), options_handle%options, handle%result, error, &
               progress, solvers)
         else
            call solve_modes(problem_handle%problem, options_handle%options, handle%result, error, progress, solvers)
         end if
      end if
      if (allocated(error)) then
         call clear(handle)
      else if (.not. allocated(handle%result%eigenvalues)) then
         ! One of the other processes.
         call clear(handle)
      else
         call keep(handle, modes_of_problem)
      end if
      status = outcome(handle, error)
   end function solve

   integer(c_int) function kschur_solve_real_operator(n, apply, context, which, options, result) bind(c) result(status)
      integer(c_int64_t), value :: n
      type(c_funptr), value :: apply
      type(c_ptr), value :: context, which, options, result

      status = solve_operator(n, apply, context, which, options, result, .false.)
   end function kschur_solve_real_operator

   integer(c_int) function kschur_solve_complex_operator(n, apply, context, which, options, result) bind(c) result(status)
      integer(c_int64_t), value :: n
      type(c_funptr), value :: apply
      type(c_ptr), value :: context, which, options, result

      status = solve_operator(n, apply, context, which, options, result, .true.)
   end function kschur_solve_complex_operator

   ! Checks the arguments, and computes eigenvalues of an operator that a callback applies.
   integer(c_int) function solve_operator(n, apply, context, which, options, result, is_complex) result(status)
      integer(c_int64_t), intent(in) :: n
      type(c_funptr), intent(in) :: apply
      type(c_ptr), intent(in) :: context, which, options, result
      logical, intent(in) :: is_complex
      type(options_handle_type), pointer :: options_handle
      type(result_handle_type), pointer :: handle
      type(named_selection_type) :: selection
      type(error_type), allocatable :: error

      status = status_null
      handle => result_of(result)
      if (.not. associated(handle)) return
      call clear(handle)
      if (.not. c_associated(apply)) call new_error(error, status_null, "the argument 'apply' is null")
      call require(which, "which", error)
      call require(options, "options", error)
      options_handle => options_of(options)
      if (.not. allocated(error)) then
         selection%wanted = options_handle%options%modes
         selection%target = options_handle%options%target
         call take_criterion(which, selection%criterion, error)
      end if
      if (.not. allocated(error) .and. (n < 1 .or. n > huge(1))) &
         call new_error(error, status_usage, "the length of the vectors is "//text(n)//" but must be 1 to "//text(huge(1)))
      if (.not. allocated(error) .and. selection%wanted > n) call new_error(error, status_usage, &
         text(selection%wanted)//" eigenvalues were asked for, more than vectors of length "//text(n)//" can give")
      if (.not. allocated(error)) call iterate(int(n), apply, context, is_complex, selection, options_handle, handle, error)
      if (allocated(error)) then
         call clear(handle)
      else
         call keep(handle, eigenvalues_of_operator)
      end if
      status = outcome(handle, error)
   end function solve_operator

   ! Takes the name of a criterion, which eigenvalues are wanted, as its position in the list.
   subroutine take_criterion(address, criterion, error)
      type(c_ptr), intent(in) :: address
      integer, intent(out) :: criterion
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name

      call take_text(address, name)
      do criterion = 1, size(criteria)
         if (criteria(criterion) == name) return
      end do
      call new_error(error, status_usage, "there is no criterion '"//name//"' for which eigenvalues are wanted")
   end subroutine take_criterion

   ! Runs the Krylov-Schur iteration on the operator, and stores what it found in the result.
   subroutine iterate(n, apply, context, is_complex, selection, options, handle, error)
      integer, intent(in) :: n
      type(c_funptr), intent(in) :: apply
      type(c_ptr), intent(in) :: context
      logical, intent(in) :: is_complex
      type(named_selection_type), intent(in) :: selection
      type(options_handle_type), intent(in) :: options
      type(result_handle_type), intent(inout) :: handle
      type(error_type), allocatable, intent(out) :: error
      type(called_real_operator_type) :: real_operator
      type(called_complex_operator_type) :: complex_operator
      type(krylov_options_type) :: krylov
      type(krylov_statistics_type) :: statistics
      type(progress_type) :: progress
      integer :: threads_before

      progress = options%progress
      call enter_solve(options%options%threads, n, threads_before, error)
      if (allocated(error)) then
         call leave_solve(threads_before)
         return
      end if
      krylov%subspace = subspace_dimension(options%options%subspace, selection%wanted, krylov%block)
      krylov%tolerance = options%options%tolerance
      krylov%max_restarts = options%options%max_restarts
      krylov%seed = options%options%seed
      associate (result => handle%result)
         if (is_complex) then
            complex_operator = called_complex_operator_type(n, apply, context)
            call krylov_schur(complex_operator, selection, krylov, result%eigenvalues, result%eigenvectors, statistics, &
               error, progress)
         else
            real_operator = called_real_operator_type(n, apply, context)
            call krylov_schur(real_operator, selection, krylov, result%eigenvalues, result%eigenvectors, statistics, &
               error, progress)
         end if
         call leave_solve(threads_before)
         if (allocated(error)) return
         result%options = options%options
         result%modes_asked = selection%wanted
         result%unknowns = n
         result%reason = statistics%reason
         result%operator_applications = statistics%operator_applications
         result%restarts = statistics%restarts
         result%seconds%orthogonalize = statistics%orthogonalize_seconds
         result%history = statistics%history
      end associate
   end subroutine iterate
end module kschur_capi_solve
