!> The pencils of Table 1 as a transform: complex Krylov-Schur, or ARPACK, on
!> (A - sigma B)^{-1} B.
module kschur_pencil_transform
   use kschur_arpack, only: arpack
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_root_invariant, only: zero_and_infinite
   use kschur_kinds, only: wp
   use kschur_krylov_complex, only: krylov_schur
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: method_arpack
   use kschur_pencil, only: pencil_type, new_pencil
   use kschur_problem, only: modal_problem_type
   use kschur_shift_invert, only: shift_invert_type, new_shift_invert
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: pencil_transform_type, new_pencil_transform

   type, extends(transform_type) :: pencil_transform_type
      type(shift_invert_type), allocatable :: operator
   contains
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: order
   end type pencil_transform_type

contains

   !> Builds the pencil and factors it at a lambda.
   subroutine new_pencil_transform(transform, problem, deflation, formulation, factors, unit, lambda, solver, error, raw)
      type(pencil_transform_type), intent(out) :: transform
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      integer, intent(in) :: formulation
      real(wp), intent(in) :: factors(:), unit
      complex(wp), intent(in) :: lambda
      class(complex_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> Whether vectors carry multipliers, and are taken as they come from the iteration.
      logical, optional, intent(in) :: raw
      type(pencil_type) :: pencil

      call new_pencil(pencil, problem, formulation, factors, unit, error)
      if (allocated(error)) return
      transform%map = pencil%map
      transform%shift = pencil%theta(lambda)
      allocate (transform%operator)
      call new_shift_invert(transform%operator, pencil, transform%shift, solver, error, deflation)
      if (present(raw)) transform%operator%with_multipliers = raw
      transform%recover_applies = .not. transform%operator%with_multipliers
   end subroutine new_pencil_transform

   subroutine iterate(self, selection, options, mu, vectors, statistics, error, monitor)
      class(pencil_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor

      if (options%method == method_arpack) then
         call arpack(self%operator, selection, options, mu, vectors, statistics, error, monitor)
         return
      end if
      if (self%operator%with_multipliers) then
         call krylov_schur(self%operator, selection, options, mu, vectors, statistics, error, monitor)
      else
         associate (deflation => self%operator%deflation, pencil => self%operator%pencil)
            call krylov_schur(self%operator, selection, options, mu, vectors, statistics, error, monitor, &
               zero_and_infinite(deflation%zero, deflation%infinite, self%operator%order(), self%shift, pencil%unit, &
               pencil%map%oscillator))
         end associate
      end if
   end subroutine iterate

   subroutine recover(self, mu, vectors, phi, xi, error)
      class(pencil_transform_type), intent(inout) :: self
      complex(wp), intent(in) :: mu(:)
      complex(wp), allocatable, intent(inout) :: vectors(:, :)
      complex(wp), allocatable, intent(out) :: phi(:, :), xi(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: purified(:, :), lambda(:)
      integer :: j

      allocate (lambda(size(mu)), source=[(self%operator%pencil%lambda(self%theta(mu(j))), j=1, size(mu))])
      if (.not. self%recover_applies) then
         call self%operator%pencil%split(vectors, lambda, [(self%theta(mu(j)), j=1, size(mu))], phi, xi)
         return
      end if
      allocate (purified(size(vectors, 1), size(mu)))
      call self%operator%apply_with_multipliers(vectors, purified, error)
      if (allocated(error)) return
      deallocate (vectors)
      do j = 1, size(mu)
         purified(:, j) = purified(:, j)/norm2(abs(purified(:, j)))
      end do
      call self%operator%pencil%split(purified, lambda, spread(self%shift, 1, size(mu)), phi, xi)
   end subroutine recover

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
