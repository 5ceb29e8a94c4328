!> Pencils of Table 1 as transforms: complex Krylov-Schur, or ARPACK, on (A - sigma B)^{-1} B.
module kschur_pencil_transform
   use kschur_arpack, only: arpack
   use kschur_arpack_options, only: arpack_options_type
   use kschur_deflation, only: deflation_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_complex, only: krylov_schur
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_pencil, only: pencil_type, new_pencil
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_quadratic_transform_complex, only: new_quadratic_transform, quadratic_transform_type
   use kschur_shift_invert, only: shift_invert_type, new_shift_invert
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_staircase, only: zero_and_infinite
   use kschur_transform, only: transform_type
   use kschur_transposed_solver, only: transposed_complex_type
   implicit none
   private
   public :: pencil_transform_type, new_pencil_transform

   !> A pencil, factored.
   type, extends(transform_type) :: pencil_transform_type
      type(shift_invert_type), allocatable :: operator
      ! Shift as lambda (1/s); `shift` is its theta.
      complex(wp), private :: lambda = (0.0_wp, 0.0_wp)
   contains
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: hand_over
      procedure :: order
      procedure :: transposed
   end type pencil_transform_type

contains

   !> Builds the pencil and factors it.
   subroutine new_pencil_transform(transform, problem, deflation, placement, solver, error)
      type(pencil_transform_type), intent(out) :: transform
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(placement_type), intent(in) :: placement
      class(complex_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      type(pencil_type) :: pencil

      call new_pencil(pencil, problem, placement%formulation, placement%factors, placement%unit, error)
      if (allocated(error)) return
      transform%map = pencil%map
      transform%shift = pencil%theta(placement%lambda)
      allocate (transform%operator)
      call new_shift_invert(transform%operator, pencil, transform%shift, solver, error, deflation)
      transform%lambda = placement%lambda
      transform%operator%with_multipliers = placement%raw
      transform%recover_applies = .not. placement%raw
   end subroutine new_pencil_transform

   ! Transposed damped pencils do not have the form of Table 1: the structured quadratic form is used, with its own factors.
   subroutine transposed(self, problem, deflation, solver, adjoint, error)
      class(pencil_transform_type), target, intent(in) :: self
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(complex_linear_solver_type), intent(in) :: solver
      class(transform_type), allocatable, intent(out) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(pencil_transform_type), allocatable :: pencil
      type(quadratic_transform_type), allocatable :: quadratic
      type(transposed_complex_type), allocatable :: borrowed
      class(complex_linear_solver_type), allocatable :: factors
      type(placement_type) :: placement

      associate (given => self%operator%pencil)
         placement%formulation = given%formulation
         placement%lambda = self%lambda
         placement%unit = given%unit
         allocate (placement%factors, source=given%factors)
         if (given%is_damped()) then
            allocate (quadratic)
            allocate (factors, source=solver)
            call new_quadratic_transform(quadratic, problem, deflation, placement, factors, error)
            call move_alloc(quadratic, adjoint)
         else
            allocate (pencil, borrowed)
            borrowed%original => self%operator%solver
            call move_alloc(borrowed, factors)
            call new_pencil_transform(pencil, problem, deflation, placement, factors, error)
            pencil%borrows = .true.
            call move_alloc(pencil, adjoint)
         end if
      end associate
   end subroutine transposed

   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(pencil_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      select type (options)
      type is (arpack_options_type)
         call arpack(self%operator, selection, options, ritz%mu, ritz%vectors, ritz%statistics, error, monitor)
      class default
         associate (deflation => self%operator%deflation, pencil => self%operator%pencil)
            call krylov_schur(self%operator, selection, options, ritz%mu, ritz%vectors, ritz%statistics, error, monitor, &
               zero_and_infinite(deflation%zero, deflation%infinite, self%operator%order(), self%shift, pencil%unit, &
               pencil%map%oscillator))
         end associate
      end select
   end subroutine iterate

   subroutine recover(self, ritz, pairs, error)
      class(pencil_transform_type), intent(inout) :: self
      type(ritz_pairs_type), intent(inout) :: ritz
      type(eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: purified(:, :)
      complex(wp) :: theta(size(ritz%mu)), lambda(size(ritz%mu))
      integer :: j

      do j = 1, size(theta)
         theta(j) = self%theta(ritz%mu(j))
         lambda(j) = self%operator%pencil%lambda(theta(j))
      end do
      if (.not. self%recover_applies) then
         call self%operator%pencil%split(ritz%vectors, lambda, theta, pairs%phi, pairs%xi)
         return
      end if
      allocate (purified(size(ritz%vectors, 1), size(theta)))
      call self%operator%apply_with_multipliers(ritz%vectors, purified, error)
      if (allocated(error)) return
      ritz%statistics%operator_applications = ritz%statistics%operator_applications + size(theta)
      deallocate (ritz%vectors)
      do j = 1, size(theta)
         purified(:, j) = purified(:, j)/dznrm2(size(purified, 1), purified(:, j), 1)
      end do
      call self%operator%pencil%split(purified, lambda, spread(self%shift, 1, size(theta)), pairs%phi, pairs%xi)
   end subroutine recover

   subroutine hand_over(self, spare)
      class(pencil_transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      call move_alloc(self%operator%solver, spare%complex)
   end subroutine hand_over

   function linear_solver(self) result(solver)
      class(pencil_transform_type), target, intent(in) :: self
      class(linear_solver_type), pointer :: solver

      solver => self%operator%solver
   end function linear_solver

   integer function order(self)
      class(pencil_transform_type), intent(in) :: self

      order = self%operator%order()
   end function order
end module kschur_pencil_transform
