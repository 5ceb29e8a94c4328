!> A formulation of a problem, factored at a shift and ready to be iterated:
!> what the solver asks of pencils and structured operators alike.
module kschur_transform
   use kschur_certificate, only: certificate_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_deflation, only: deflation_type
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_problem, only: modal_problem_type
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_spectral_map, only: spectral_map_type
   implicit none
   private
   public :: transform_type

   !> Extended by each formulation.
   type, abstract :: transform_type
      type(spectral_map_type) :: map
      !> sigma, a value of theta: Ritz values are mu = 1/(theta - sigma).
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      !> Whether `recover` applies the operator once to every vector.
      logical :: recover_applies = .true.
      !> What the last iteration proved of its completeness.
      type(certificate_type) :: certificate
      !> Whether the factors are those of another transform.
      logical :: borrows = .false.
      !> Whether `iterate` wants no matrix of the problem but to multiply with what `placement_type` has of it by rows.
      logical :: by_rows = .false.
   contains
      !> The wanted Ritz pairs.
      procedure(iterate_interface), deferred :: iterate
      !> Shapes and multipliers of Ritz vectors, without what rounding left of
      !> infinite eigenvalues; by one more application where it takes one.
      procedure(recover_interface), deferred :: recover
      !> The solver that holds the factors.
      procedure(solver_interface), deferred :: linear_solver
      !> Order of the factored matrix.
      procedure(order_interface), deferred :: order
      !> The same of the transposed problem, on the factors of this one: it must live as long.
      procedure(transposed_interface), deferred :: transposed
      !> theta of a Ritz value, eq. (42).
      procedure :: theta
      !> Gives its solver away, before it is left.
      procedure :: hand_over
      !> What an iteration may begin with; not allocated unless overridden.
      procedure :: begin_with
   end type transform_type

   abstract interface
      subroutine iterate_interface(self, selection, options, ritz, error, monitor)
         import :: transform_type, modal_selection_type, krylov_options_type, ritz_pairs_type, error_type, monitor_type
         class(transform_type), target, intent(inout) :: self
         type(modal_selection_type), intent(in) :: selection
         !> Of which method: that is its type.
         class(krylov_options_type), intent(in) :: options
         type(ritz_pairs_type), intent(out) :: ritz
         type(error_type), allocatable, intent(out) :: error
         class(monitor_type), intent(inout), optional :: monitor
      end subroutine iterate_interface

      subroutine recover_interface(self, ritz, pairs, error)
         import :: transform_type, ritz_pairs_type, eigenpairs_type, error_type
         class(transform_type), intent(inout) :: self
         !> Its vectors are used up.
         type(ritz_pairs_type), intent(inout) :: ritz
         !> Without eigenvalues.
         type(eigenpairs_type), intent(out) :: pairs
         type(error_type), allocatable, intent(out) :: error
      end subroutine recover_interface

      function solver_interface(self) result(solver)
         import :: transform_type, linear_solver_type
         class(transform_type), target, intent(in) :: self
         class(linear_solver_type), pointer :: solver
      end function solver_interface

      subroutine transposed_interface(self, problem, deflation, solver, adjoint, error)
         import :: transform_type, modal_problem_type, deflation_type, complex_linear_solver_type, error_type
         class(transform_type), target, intent(in) :: self
         !> The transposed problem.
         type(modal_problem_type), target, intent(in) :: problem
         !> Its motions to be kept out of the iteration.
         type(deflation_type), target, intent(in) :: deflation
         !> A prototype for the transforms that cannot borrow factors.
         class(complex_linear_solver_type), intent(in) :: solver
         class(transform_type), allocatable, intent(out) :: adjoint
         type(error_type), allocatable, intent(out) :: error
      end subroutine transposed_interface

      integer function order_interface(self)
         import :: transform_type
         class(transform_type), intent(in) :: self
      end function order_interface
   end interface

contains

   subroutine hand_over(self, spare)
      class(transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      associate (unused => self, untouched => spare)
      end associate
   end subroutine hand_over

   subroutine begin_with(self, pairs, block, start)
      class(transform_type), intent(in) :: self
      !> Approximations of what is wanted.
      type(eigenpairs_type), intent(in) :: pairs
      !> So many vectors.
      integer, intent(in) :: block
      real(wp), allocatable, intent(out) :: start(:, :)

      associate (unused => self, neither => pairs, nor => block)
      end associate
      if (allocated(start)) deallocate (start)
   end subroutine begin_with

   pure complex(wp) function theta(self, mu)
      class(transform_type), intent(in) :: self
      complex(wp), intent(in) :: mu

      theta = huge(1.0_wp)
      if (abs(mu) > tiny(1.0_wp)) theta = self%shift + 1/mu
   end function theta
end module kschur_transform
