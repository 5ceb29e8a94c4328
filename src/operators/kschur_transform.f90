!> A formulation of the problem, factored at a shift and ready to be iterated: the common interface of pencils and structured
!> operators.
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
      !> Certificate of the last iteration.
      type(certificate_type) :: certificate
      !> Whether the factors belong to another transform.
      logical :: borrows = .false.
   contains
      !> Computes the wanted Ritz pairs.
      procedure(iterate_interface), deferred :: iterate
      !> Computes shapes and multipliers from Ritz vectors, purified of infinite eigenvalues, by one more application if needed.
      procedure(recover_interface), deferred :: recover
      !> The solver that holds the factors.
      procedure(solver_interface), deferred :: linear_solver
      !> Order of the factored matrix.
      procedure(order_interface), deferred :: order
      !> The transform of the transposed problem, on the factors of this one, which must outlive it.
      procedure(transposed_interface), deferred :: transposed
      !> theta of a Ritz value, eq. (42).
      procedure :: theta
      !> Moves its linear solver to the spare ones, which reuse its analysis; call before deallocating the transform.
      procedure :: hand_over
      !> Makes start vectors of an iteration from approximate pairs; not allocated if a formulation does not override this.
      procedure :: begin_with
   end type transform_type

   abstract interface
      subroutine iterate_interface(self, selection, options, ritz, error, monitor)
         import :: transform_type, modal_selection_type, krylov_options_type, ritz_pairs_type, error_type, monitor_type
         class(transform_type), target, intent(inout) :: self
         type(modal_selection_type), intent(in) :: selection
         !> Their type selects the method.
         class(krylov_options_type), intent(in) :: options
         type(ritz_pairs_type), intent(out) :: ritz
         type(error_type), allocatable, intent(out) :: error
         class(monitor_type), intent(inout), optional :: monitor
      end subroutine iterate_interface

      subroutine recover_interface(self, ritz, pairs, error)
         import :: transform_type, ritz_pairs_type, eigenpairs_type, error_type
         class(transform_type), intent(inout) :: self
         !> Its vectors are overwritten; applications of the operator are added to its statistics.
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
         !> Its motions to be deflated.
         type(deflation_type), target, intent(in) :: deflation
         !> A prototype for transforms that cannot use the transposed factors.
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
      !> Approximations of the wanted pairs.
      type(eigenpairs_type), intent(in) :: pairs
      !> Number of vectors.
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
