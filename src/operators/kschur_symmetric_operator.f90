!> C = (K - s M)^{-1} M on the null space of the constraints, self-adjoint in the inner product of M.
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
   use kschur_tolerances, only: root_epsilon, rounding_of_row
   implicit none
   private
   public :: symmetric_shift_invert_type

   !> The operator, with its factors.
   type, extends(symmetric_operator_type) :: symmetric_shift_invert_type
      type(modal_problem_type), pointer :: problem => null()
      type(row_matrix_type) :: mass, constraints
      type(deflation_type), pointer :: deflation => null()
      class(real_linear_solver_type), allocatable :: solver
      !> Factor of each constraint.
      real(wp), allocatable :: factors(:)
      !> Bound of the M-norm of a motion that violates the constraints by one.
      real(wp) :: weight_of_violations = 0
      !> Reciprocals of the diagonal of M, in which violations are removed at each step; not allocated: where they are large.
      real(wp), allocatable :: lightness(:)
      !> The operator on distributed vectors, its processes, and their sums; not associated: this process has all rows.
      type(symmetric_shift_invert_type), pointer :: part => null()
      type(processes_type), pointer :: shared_with => null()
      type(row_sums_type) :: sums
   contains
      procedure :: order
      procedure :: apply
      procedure :: apply_metric
      procedure :: restrict
      procedure :: clean
      procedure :: by_rows
      procedure :: apply_with_multipliers
      !> Solves for motions with given violations, and multipliers, caused by forces, with deflation.
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

   ! Projects x onto the null space of the constraints. A constraint violation may have a large M-norm where admissible motions
   ! are light: C maps it to zero, but it would enter the basis as a spurious vector, and the basis would seem complete. The
   ! result is as uncertain as violations in the basis vectors it was orthogonalised against.
   subroutine restrict(self, x, noise, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), intent(out) :: noise
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: violations(size(self%factors), size(x, 2)), y(size(x, 1), size(x, 2))

      noise = 0
      if (.not. self%weight_of_violations > 0) return
      violations = 0
      call self%constraints%add_product(1.0_wp, x, violations, error)
      if (allocated(error)) return
      if (.not. self%sums%length(norm2(violations))*self%weight_of_violations > root_epsilon) return
      noise = root_epsilon
      y = 0
      call self%respond(y, violations, error)
      if (.not. allocated(error)) x = x - y
   end subroutine restrict

   ! Projects onto the null space of one constraint after the other (Kaczmarz 1937), in the inner product of the diagonal of M,
   ! until violations are rounding errors. These would grow otherwise, as coefficients of the Lanczos recurrence decrease.
   subroutine clean(self, x)
      class(symmetric_shift_invert_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer, parameter :: sweeps = 8
      real(wp) :: violation, largest
      integer :: i, j, sweep
      logical :: is_clean

      if (.not. allocated(self%lightness)) return
      associate (c => self%problem%constraints)
         do j = 1, size(x, 2)
            largest = maxval(abs(x(:, j)))
            do sweep = 1, sweeps
               is_clean = .true.
               do i = 1, c%rows
                  associate (value => c%value(c%row_start(i):c%row_start(i + 1) - 1), &
                     column => c%column(c%row_start(i):c%row_start(i + 1) - 1))
                     violation = dot_product(value, x(column, j))
                     if (.not. abs(violation) > rounding_of_row*norm2(value)*largest) cycle
                     is_clean = .false.
                     x(column, j) = x(column, j) - violation/dot_product(value, self%lightness(column)*value)* &
                        self%lightness(column)*value
                  end associate
               end do
               if (is_clean) exit
            end do
         end do
      end associate
   end subroutine clean

   subroutine apply_with_multipliers(self, x, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :), xi(:, :)
      type(error_type), allocatable, intent(out) :: error

      y = 0
      xi = 0
      call self%mass%add_product(1.0_wp, x, y, error)
      if (.not. allocated(error)) call self%respond(y, xi, error)
   end subroutine apply_with_multipliers

   ! Solves [K - s M, Cq^T; Cq, 0] [y; xi] = [y; xi], with deflation.
   subroutine respond(self, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      !> Forces, and the motions that they make.
      real(wp), contiguous, intent(inout) :: y(:, :)
      !> Violations of these motions, and their multipliers.
      real(wp), contiguous, intent(inout) :: xi(:, :)
      type(error_type), allocatable, intent(out) :: error

      ! Removes rounding errors along deflated motions before and after the solve: they would be amplified, and C no longer
      ! self-adjoint.
      call self%deflation%project_forces(y)
      if (size(self%factors) == 0) then
         call self%solver%solve(y, error)
      else
         call solve_constrained(self, y, xi, error)
      end if
      if (.not. allocated(error)) call self%deflation%project(y)
   end subroutine respond

   ! Solves the saddle-point system; xi in terms of the constraints as given.
   subroutine solve_constrained(self, y, xi, error)
      class(symmetric_shift_invert_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: y(:, :)
      real(wp), contiguous, intent(inout) :: xi(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: rhs(size(y, 1) + size(self%factors), size(y, 2))
      integer :: n, j

      n = size(y, 1)
      rhs(:n, :) = y
      do j = 1, size(y, 2)
         rhs(n + 1:, j) = self%factors*xi(:, j)
      end do
      call self%solver%solve(rhs, error)
      if (allocated(error)) return
      y = rhs(:n, :)
      do j = 1, size(y, 2)
         xi(:, j) = self%factors*rhs(n + 1:, j)
      end do
   end subroutine solve_constrained
end module kschur_symmetric_operator
