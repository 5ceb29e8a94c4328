!> Quadratic form with hysteretic losses, solved densely: all eigenpairs from the complex matrix of its operator on the null
!> space of the constraints.
module kschur_complex_dense_transform
   use kschur_deflation, only: deflation_type
   use kschur_dense_eigenpairs, only: dense_eigenpairs_type, matrix_eigenpairs
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_operator, only: complex_operator_type
   use kschur_outcome, only: history_type, reason_cancelled, reason_fewer_modes
   use kschur_problem, only: modal_problem_type
   use kschur_selection, only: order_by_preference
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_tolerances, only: twelve_digits
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: complex_dense_transform_type, new_complex_dense_transform

   !> All eigenpairs of a quadratic form.
   type, extends(transform_type) :: complex_dense_transform_type
      !> A complex quadratic transform, factored.
      class(transform_type), allocatable :: form
      ! Those of the operator on states in the span of some motions, in the coordinates of these.
      type(dense_eigenpairs_type), private :: pairs
      real(wp), allocatable, private :: motions(:, :)
      ! Whether an earlier iteration has counted the applications.
      logical, private :: counted = .false.
   contains
      !> Takes the form that the operator belongs to.
      procedure :: take_form
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: hand_over
      procedure :: order
      procedure :: transposed
   end type complex_dense_transform_type

contains

   !> Computes the eigenpairs of an operator on states (x, v) in the span of some motions, without those of an invariant subspace.
   subroutine new_complex_dense_transform(transform, operator, motions, invariant, error)
      type(complex_dense_transform_type), intent(out) :: transform
      !> Operator of the form to be taken.
      class(complex_operator_type), intent(inout) :: operator
      !> Orthonormal basis, n x p; deallocated.
      real(wp), allocatable, intent(inout) :: motions(:, :)
      !> In the span of the states.
      type(invariant_type), intent(in) :: invariant
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: states(:, :), images(:, :), t(:, :)
      type(invariant_type) :: projected
      integer :: n, p

      n = size(motions, 1)
      p = size(motions, 2)
      allocate (states(2*n, 2*p), images(2*n, 2*p), source=(0.0_wp, 0.0_wp))
      allocate (t(2*p, 2*p))
      states(:n, :p) = motions
      states(n + 1:, p + 1:) = motions
      if (p > 0) call operator%apply(states, images, error)
      if (allocated(error)) return
      t(:p, :) = matmul(transpose(motions), images(:n, :))
      t(p + 1:, :) = matmul(transpose(motions), images(n + 1:, :))
      allocate (projected%vectors(2*p, size(invariant%vectors, 2)))
      projected%vectors(:p, :) = matmul(transpose(motions), invariant%vectors(:n, :))
      projected%vectors(p + 1:, :) = matmul(transpose(motions), invariant%vectors(n + 1:, :))
      projected%projected = invariant%projected
      call matrix_eigenpairs(t, projected, twelve_digits, transform%pairs, error)
      call move_alloc(motions, transform%motions)
   end subroutine new_complex_dense_transform

   subroutine take_form(transform, form)
      class(complex_dense_transform_type), intent(inout) :: transform
      class(transform_type), allocatable, intent(inout) :: form

      call move_alloc(form, transform%form)
      transform%map = transform%form%map
      transform%shift = transform%form%shift
      transform%recover_applies = transform%form%recover_applies
      transform%borrows = transform%form%borrows
   end subroutine take_form

   ! Selects the wanted pairs from the Schur form.
   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(complex_dense_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      integer, allocatable :: chosen(:)
      integer :: needed, converged
      logical :: proceed

      associate (unused => options, none => error)
      end associate
      if (.not. self%counted) ritz%statistics%operator_applications = 2*size(self%motions, 2)
      self%counted = .true.
      associate (values => self%pairs%values)
         ! Ritz values at rounding level are infinite eigenvalues.
         associate (finite => pack(values, abs(values) > epsilon(1.0_wp)*maxval([0.0_wp, abs(values)])))
            needed = selection%needed(finite(order_by_preference(selection, finite)))
            converged = min(needed, size(finite))
         end associate
         if (needed > converged) ritz%statistics%reason = reason_fewer_modes
         allocate (chosen, source=order_by_preference(selection, values))
         chosen = chosen(:converged)
         allocate (ritz%mu(converged), source=values(chosen))
      end associate
      call expand(self, chosen, ritz%vectors)
      proceed = .true.
      if (present(monitor)) call monitor%report(0, converged, needed, 0.0_wp, proceed)
      if (is_stopped(monitor)) proceed = .false.
      if (.not. proceed) ritz%statistics%reason = reason_cancelled
      associate (statistics => ritz%statistics)
         statistics%history = history_type([converged], [statistics%operator_applications], [0.0_wp])
      end associate
   end subroutine iterate

   ! Computes selected eigenvectors, as states (x, v).
   subroutine expand(self, chosen, vectors)
      class(complex_dense_transform_type), intent(in) :: self
      integer, intent(in) :: chosen(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      complex(wp), allocatable :: y(:, :)
      integer :: n, p

      n = size(self%motions, 1)
      p = size(self%motions, 2)
      allocate (y, source=self%pairs%vectors(chosen))
      allocate (vectors(2*n, size(chosen)))
      vectors(:n, :) = matmul(self%motions, y(:p, :))
      vectors(n + 1:, :) = matmul(self%motions, y(p + 1:, :))
   end subroutine expand

   subroutine recover(self, ritz, pairs, error)
      class(complex_dense_transform_type), intent(inout) :: self
      type(ritz_pairs_type), intent(inout) :: ritz
      type(eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error

      call self%form%recover(ritz, pairs, error)
   end subroutine recover

   subroutine transposed(self, problem, deflation, solver, adjoint, error)
      class(complex_dense_transform_type), target, intent(in) :: self
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(complex_linear_solver_type), intent(in) :: solver
      class(transform_type), allocatable, intent(out) :: adjoint
      type(error_type), allocatable, intent(out) :: error

      ! The transposed form is iterated, not solved densely.
      call self%form%transposed(problem, deflation, solver, adjoint, error)
   end subroutine transposed

   subroutine hand_over(self, spare)
      class(complex_dense_transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      call self%form%hand_over(spare)
   end subroutine hand_over

   function linear_solver(self) result(solver)
      class(complex_dense_transform_type), target, intent(in) :: self
      class(linear_solver_type), pointer :: solver

      solver => self%form%linear_solver()
   end function linear_solver

   integer function order(self)
      class(complex_dense_transform_type), intent(in) :: self

      order = self%form%order()
   end function order
end module kschur_complex_dense_transform
