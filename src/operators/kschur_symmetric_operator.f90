!> C = (K - s M)^{-1} M on the motions that the constraints allow, self-adjoint in the inner product of M.
module kschur_symmetric_operator
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_row_matrix, only: row_matrix_type
   use kschur_row_sums, only: row_sums_type
   use kschur_tolerances, only: root_epsilon
   implicit none
   private
   public :: symmetric_shift_invert_type

   !> C = (K - s M)^{-1} M on the motions that the constraints allow.
   type, extends(symmetric_operator_type) :: symmetric_shift_invert_type
      type(modal_problem_type), pointer :: problem => null()
      type(row_matrix_type) :: mass, constraints
      type(deflation_type), pointer :: deflation => null()
      class(real_linear_solver_type), allocatable :: solver
      !> Factor of each constraint.
      real(wp), allocatable :: factors(:)
      !> Length in M of what violates the constraints by one, at most about.
      real(wp) :: weight_of_violations = 0
      !> The same on rows of vectors, who has the others, and sums over all of them; not associated: this process has all rows.
      type(symmetric_shift_invert_type), pointer :: part => null()
      type(processes_type), pointer :: shared_with => null()
      type(row_sums_type) :: sums
   contains
      procedure :: order
      procedure :: apply
      procedure :: apply_metric
      procedure :: restrict
      procedure :: by_rows
      procedure :: apply_with_multipliers
      !> The motions and multipliers that forces make, C without M.
      procedure :: respond
   end type symmetric_shift_invert_type

contains

   integer function order(self)
      class(symmetric_shift_invert_type), intent(in) :: self

      order = self%problem%unknowns()
   end function order

   function by_rows(self) result(part)
      class(symmetric_shift_invert_type), target, intent(in) :: self
      class(symmetric_operator_type), pointer :: part

      nullify (part)
      if (associated(self%part)) part => self%part
   end function by_rows

   subroutine apply(self, x, y, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: xi(:, :)

      allocate (xi(size(self%factors), size(x, 2)))
      call self%apply_with_multipliers(x, y, xi, error)
   end subroutine apply

   subroutine apply_metric(self, x, y, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      y = 0
      call self%mass%add_product(1.0_wp, x, y, error)
   end subroutine apply_metric

   ! What violates constraints may be heavy where the motions that they allow are light: C loses it, but the basis would
   ! have a vector that is no motion, and be said to be complete. What is left of it is as uncertain as the violations that
   ! the vectors of the basis, beside which it was found, may have.
   subroutine restrict(self, x, noise, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), intent(out) :: noise
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: violations(size(self%factors), size(x, 2))

      noise = 0
      if (.not. self%weight_of_violations > 0) return
      violations = 0
      call self%constraints%add_product(1.0_wp, x, violations, error)
      if (allocated(error)) return
      if (.not. self%sums%length(norm2(violations))*self%weight_of_violations > root_epsilon) return
      noise = root_epsilon
      call take_out(self, violations, x, error)
   end subroutine restrict

   ! x := x - y, Cq y the violations.
   subroutine take_out(self, violations, x, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), intent(in) :: violations(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: rhs(size(x, 1) + size(violations, 1), size(x, 2))
      integer :: n, j

      n = size(x, 1)
      rhs(:n, :) = 0
      do j = 1, size(x, 2)
         rhs(n + 1:, j) = self%factors*violations(:, j)
      end do
      call self%solver%solve(rhs, error)
      if (.not. allocated(error)) x = x - rhs(:n, :)
   end subroutine take_out

   subroutine apply_with_multipliers(self, x, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :), xi(:, :)
      type(error_type), allocatable, intent(out) :: error

      y = 0
      call self%mass%add_product(1.0_wp, x, y, error)
      if (.not. allocated(error)) call self%respond(y, xi, error)
   end subroutine apply_with_multipliers

   ! (K - s M)^{-1} f.
   subroutine respond(self, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      !> Forces, and the motions that they make.
      real(wp), contiguous, intent(inout) :: y(:, :)
      real(wp), contiguous, intent(out) :: xi(:, :)
      type(error_type), allocatable, intent(out) :: error

      ! What rounding left of deflated motions would be magnified, and C no longer self-adjoint.
      call self%deflation%project_forces(y)
      if (size(self%factors) == 0) then
         call self%solver%solve(y, error)
      else
         call solve_constrained(self, y, xi, error)
      end if
      if (.not. allocated(error)) call self%deflation%project(y)
   end subroutine respond

   subroutine solve_constrained(self, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: y(:, :)
      real(wp), contiguous, intent(out) :: xi(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: rhs(size(y, 1) + size(self%factors), size(y, 2))
      integer :: n, j

      n = size(y, 1)
      rhs(:n, :) = y
      rhs(n + 1:, :) = 0
      call self%solver%solve(rhs, error)
      if (allocated(error)) return
      y = rhs(:n, :)
      do j = 1, size(y, 2)
         xi(:, j) = self%factors*rhs(n + 1:, j)
      end do
   end subroutine solve_constrained
end module kschur_symmetric_operator
