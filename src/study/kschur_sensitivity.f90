!> Derivatives of eigenvalues with respect to a parameter of the matrices.
module kschur_sensitivity
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgees
   use kschur_memory, only: require_memory
   use kschur_mode_groups, only: bytes_of_groups, check_modes_of, form_between, group_of, mode_group_type, solve_small
   use kschur_loss, only: loss_or_none
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_text, only: text
   use kschur_threads, only: enter_solve, leave_solve, one_thread
   implicit none
   private
   public :: problem_rate_type, eigenvalue_rates, rate_between

   !> The derivatives of M, R, K, Cq and H by a parameter; what is not allocated does not depend on it.
   type :: problem_rate_type
      type(csr_matrix_type), allocatable :: mass, damping, stiffness, constraints, loss
   end type problem_rate_type

contains

   !> Derivatives of the matrices by finite differences: exact if they are linear in the parameter.
   subroutine rate_between(problem, changed, step, rate, error)
      type(modal_problem_type), intent(in) :: problem
      !> The problem with the parameter increased by the step, not 0.
      type(modal_problem_type), intent(in) :: changed
      real(wp), intent(in) :: step
      type(problem_rate_type), intent(out) :: rate
      type(error_type), allocatable, intent(out) :: error

      if (any([problem%unknowns(), problem%multipliers()] /= [changed%unknowns(), changed%multipliers()])) then
         call new_error(error, error_usage, "the two problems do not have the same numbers of unknowns and constraints")
      else if (.not. abs(step) > 0) then
         call new_error(error, error_usage, "the step of the parameter is zero")
      end if
      if (.not. allocated(error)) &
         call require_memory(2*(problem%bytes() + changed%bytes()), "the derivatives of the matrices", error)
      if (allocated(error)) return
      allocate (rate%mass, source=linear_combination(1/step, changed%mass, -1/step, problem%mass))
      allocate (rate%damping, source=linear_combination(1/step, changed%damping, -1/step, problem%damping))
      allocate (rate%stiffness, source=linear_combination(1/step, changed%stiffness, -1/step, problem%stiffness))
      allocate (rate%constraints, source=linear_combination(1/step, changed%constraints, -1/step, problem%constraints))
      if (.not. (allocated(problem%loss) .or. allocated(changed%loss))) return
      allocate (rate%loss, source=linear_combination(1/step, loss_or_none(changed%stiffness, changed%loss), &
         -1/step, loss_or_none(problem%stiffness, problem%loss)))
   end subroutine rate_between

   !> Computes d lambda/d p of each mode (1/s for a unit of the parameter), -(psi^* (lambda^2 dM + lambda dR + dK) phi + psi^*
   !> dCq^T xi + eta^* dCq phi)/(psi^* (2 lambda M + R) phi). Modes of a multiple eigenvalue get the rates of the eigenvalues it
   !> splits into, in no order. NaN if no derivative exists: double zeros, defective eigenvalues. Fails as
   !> `find_modal_properties` does.
   subroutine eigenvalue_rates(problem, result, rate, rates, error)
      type(modal_problem_type), intent(in) :: problem
      !> Modes of the problem, with left vectors if it is unsymmetric.
      type(modal_result_type), intent(in) :: result
      type(problem_rate_type), intent(in) :: rate
      complex(wp), allocatable, intent(out) :: rates(:)
      type(error_type), allocatable, intent(out) :: error
      logical, allocatable :: pending(:)
      type(mode_group_type) :: group
      integer :: j, threads_before

      call check_modes_of(problem, result, error)
      if (.not. allocated(error)) call check_rate(problem, rate, error)
      call require_memory(bytes_of_groups(problem, result), "the rates of the eigenvalues", error)
      if (allocated(error)) return
      allocate (rates(size(result%eigenvalues)))
      allocate (pending(size(rates)), source=.true.)
      call enter_solve(one_thread, problem%unknowns(), threads_before, error)
      do j = 1, size(rates)
         if (allocated(error)) exit
         if (.not. pending(j)) cycle
         group = group_of(problem, result, j)
         pending(group%member) = .false.
         rates(group%member) = rates_of(problem, group, rate)
      end do
      call leave_solve(threads_before)
   end subroutine eigenvalue_rates

   ! Fails if a derivative does not have the extents of its matrix.
   subroutine check_rate(problem, rate, error)
      type(modal_problem_type), intent(in) :: problem
      type(problem_rate_type), intent(in) :: rate
      type(error_type), allocatable, intent(out) :: error

      call check(rate%mass, problem%mass, "mass matrix M")
      call check(rate%damping, problem%damping, "damping matrix R")
      call check(rate%stiffness, problem%stiffness, "stiffness matrix K")
      call check(rate%constraints, problem%constraints, "constraint Jacobian Cq")
      call check(rate%loss, problem%stiffness, "loss matrix H")

   contains

      subroutine check(matrix, given, name)
         type(csr_matrix_type), allocatable, intent(in) :: matrix
         type(csr_matrix_type), intent(in) :: given
         character(len=*), intent(in) :: name

         if (allocated(error) .or. .not. allocated(matrix)) return
         if (matrix%rows /= given%rows .or. matrix%columns /= given%columns) call new_error(error, error_usage, &
            "the derivative of the "//name//" is "//text(matrix%rows)//" x "//text(matrix%columns)//" but must be "// &
            text(given%rows)//" x "//text(given%columns)//" to fit the problem")
      end subroutine check
   end subroutine check_rate

   ! Derivatives of k equal eigenvalues: the eigenvalues of a k x k matrix (first-order perturbation). NaN if there are none.
   function rates_of(problem, group, rate) result(rates)
      type(modal_problem_type), intent(in) :: problem
      type(mode_group_type), intent(in) :: group
      type(problem_rate_type), intent(in) :: rate
      complex(wp) :: rates(size(group%member))
      complex(wp) :: change(size(rates), size(rates)), no_vectors(1, 1), work(4*size(rates))
      real(wp) :: rwork(size(rates))
      logical :: no_order(1), singular
      integer :: info, unused

      rates = cmplx(ieee_value(1.0_wp, ieee_quiet_nan), ieee_value(1.0_wp, ieee_quiet_nan), wp)
      change = 0
      if (allocated(rate%mass)) change = change + group%lambda**2*form_between(group%chi, rate%mass, group%phi)
      if (allocated(rate%damping)) change = change + group%lambda*form_between(group%chi, rate%damping, group%phi)
      if (allocated(rate%stiffness)) change = change + form_between(group%chi, rate%stiffness, group%phi)
      if (allocated(rate%loss)) change = change + (0.0_wp, 1.0_wp)*form_between(group%chi, rate%loss, group%phi)
      if (allocated(rate%constraints)) change = change + form_between(group%eta, rate%constraints, group%phi) + &
         transpose(form_between(group%xi, rate%constraints, group%chi))
      call solve_small(group%derivative(problem), change, singular)
      if (singular .or. .not. all(abs(change) <= huge(1.0_wp)) .or. .not. abs(group%lambda) > 0) return
      change = -change
      call zgees("N", "N", no_selection, size(rates), change, size(rates), unused, rates, no_vectors, 1, work, size(work), rwork, &
         no_order, info)
   end function rates_of

   ! zgees needs this argument even if it does not sort.
   pure logical function no_selection(w)
      complex(wp), intent(in) :: w

      no_selection = abs(w) < 0
   end function no_selection
end module kschur_sensitivity
