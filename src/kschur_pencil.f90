!> The paper's Table 1: the modal problem as a pencil A x = theta B x of real
!> sparse matrices, and its shift-invert operator.
module kschur_pencil
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_singular, error_usage
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_operator, only: complex_operator_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_names, &
      formulation_undamped, formulation_undamped_constrained, formulation_undamped_negative
   use kschur_problem, only: modal_problem_type, damping_none
   use kschur_random, only: random_vector
   use kschur_spectral_map, only: spectral_map_type
   use kschur_sparse, only: csr_matrix_type, complex_csr_matrix_type, new_csr_from_triplets, &
      identity_csr_matrix, complex_combination
   implicit none
   private
   public :: check_fit, pencil_type, new_pencil, shift_invert_type, new_shift_invert

   !> A x = theta B x. The damped forms have x = (phi, lambda/unit phi, xi) and
   !> theta = lambda, the undamped ones x = (phi, xi) and theta = -+ lambda^2.
   type :: pencil_type
      !> One of `formulation_*`.
      integer :: formulation
      !> How theta and lambda belong together.
      type(spectral_map_type) :: map
      type(csr_matrix_type) :: a, b
      !> Numbers of unknowns n and multipliers m of the problem.
      integer :: unknowns, multipliers
      !> Factor of each constraint: xi as given is `factors` times the xi of the pencil.
      real(wp), allocatable :: factors(:)
      !> Unit of lambda in the second part of x (1/s).
      real(wp) :: unit
      !> What a linear solver may use of A - sigma B.
      type(matrix_structure_type) :: structure
   contains
      !> Whether the pencil is in lambda; otherwise it is in its square.
      procedure :: is_damped
      !> theta of a lambda.
      procedure :: theta
      !> A lambda of a theta, in the upper half-plane; where the pencil is
      !> undamped its negative is another.
      procedure :: lambda
      !> Mode shapes and multipliers of eigenvectors.
      procedure :: split
   end type pencil_type

   !> C = (A - sigma B)^{-1} B, eqs. (41), (46a), (46b), the paper's Algorithm 3.
   type, extends(complex_operator_type) :: shift_invert_type
      type(pencil_type) :: pencil
      !> sigma, a value of theta.
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      class(complex_linear_solver_type), allocatable :: solver
      type(deflation_type), pointer :: deflation => null()
   contains
      procedure :: order => shift_invert_order
      procedure :: apply => shift_invert_apply
      !> theta of an eigenvalue mu of C, eq. (42).
      procedure :: theta => theta_of_ritz_value
   end type shift_invert_type

   ! Block rows and columns while a pencil is put together.
   type :: blocks_type
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
   contains
      procedure :: add
   end type blocks_type

contains

   !> The pencil of a formulation. Fails where the formulation does not fit
   !> the problem. The equations of the damped forms stand in the order
   !> (second, first, third) of eqs. (30) and (33): that puts the stiffness on
   !> the diagonal of A - sigma B and changes no eigenvalue.
   subroutine new_pencil(pencil, problem, formulation, factors, unit, error)
      type(pencil_type), intent(out) :: pencil
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`, not `formulation_auto`.
      integer, intent(in) :: formulation
      !> Factor of each constraint, m numbers.
      real(wp), intent(in) :: factors(:)
      !> Unit of lambda (1/s) in the second part of x, lambda/unit phi: the size
      !> of the wanted ones keeps both parts alike.
      real(wp), intent(in) :: unit
      type(error_type), allocatable, intent(out) :: error
      type(blocks_type) :: a, b
      type(csr_matrix_type) :: cq
      real(wp) :: sign
      integer :: n, m, order, i

      call check_fit(problem, formulation, error)
      if (allocated(error)) return
      n = problem%unknowns()
      m = problem%multipliers()
      pencil%formulation = formulation
      pencil%map%oscillator = .not. (formulation == formulation_damped .or. formulation == formulation_damped_constrained)
      pencil%map%sign = merge(1.0_wp, -1.0_wp, formulation == formulation_undamped)
      pencil%unknowns = n
      pencil%multipliers = m
      pencil%unit = unit
      allocate (pencil%factors(m), source=factors)
      cq = problem%constraints
      do i = 1, m
         associate (first => cq%row_start(i), last => cq%row_start(i + 1) - 1)
            cq%value(first:last) = factors(i)*cq%value(first:last)
         end associate
      end do

      allocate (a%row(0), a%column(0), a%value(0), b%row(0), b%column(0), b%value(0))
      if (pencil%is_damped()) then
         order = 2*n + m
         call a%add(0, 0, -1.0_wp, problem%stiffness)
         call a%add(0, n, -unit, problem%damping)
         call a%add(0, 2*n, -1.0_wp, cq, transposed=.true.)
         call a%add(n, n, unit, identity_csr_matrix(n))
         call a%add(2*n, 0, -1.0_wp, cq)
         call b%add(0, n, unit, problem%mass)
         call b%add(n, 0, 1.0_wp, identity_csr_matrix(n))
         allocate (pencil%structure%node(2*n), source=[(i, i=1, n), (i, i=1, n)])
      else
         order = n + m
         sign = merge(1.0_wp, -1.0_wp, formulation == formulation_undamped)
         call a%add(0, 0, sign, problem%stiffness)
         call a%add(0, n, -1.0_wp, cq, transposed=.true.)
         call a%add(n, 0, -1.0_wp, cq)
         call b%add(0, 0, 1.0_wp, problem%mass)
         pencil%structure%symmetric = problem%symmetric
         allocate (pencil%structure%node(n), source=[(i, i=1, n)])
      end if
      pencil%structure%multipliers = m
      call new_csr_from_triplets(pencil%a, order, order, a%row, a%column, a%value, error)
      if (.not. allocated(error)) call new_csr_from_triplets(pencil%b, order, order, b%row, b%column, b%value, error)
   end subroutine new_pencil

   !> Fails where a pencil of Table 1 does not fit a problem.
   subroutine check_fit(problem, formulation, error)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name

      name = "the formulation "//trim(formulation_names(formulation))//" does not fit the problem: "
      select case (formulation)
      case (formulation_undamped, formulation_undamped_negative, formulation_undamped_constrained)
         if (problem%damping_kind /= damping_none) call new_error(error, error_usage, name//"it has damping")
      case (formulation_damped, formulation_damped_constrained)
         continue
      case default
         call new_error(error, error_usage, "this is not a pencil")
      end select
      if (allocated(error)) return
      select case (formulation)
      case (formulation_undamped, formulation_undamped_negative, formulation_damped)
         if (problem%multipliers() > 0) call new_error(error, error_usage, name//"it has constraints")
      end select
   end subroutine check_fit

   ! Puts coefficient * block, or its transpose, behind `rows` rows and `columns` columns.
   subroutine add(self, rows, columns, coefficient, block, transposed)
      class(blocks_type), intent(inout) :: self
      integer, intent(in) :: rows, columns
      real(wp), intent(in) :: coefficient
      type(csr_matrix_type), intent(in) :: block
      logical, intent(in), optional :: transposed
      logical :: flip

      flip = .false.
      if (present(transposed)) flip = transposed
      if (flip) then
         self%row = [self%row, rows + block%column]
         self%column = [self%column, columns + block%row_indices()]
      else
         self%row = [self%row, rows + block%row_indices()]
         self%column = [self%column, columns + block%column]
      end if
      self%value = [self%value, coefficient*block%value]
   end subroutine add

   pure logical function is_damped(self)
      class(pencil_type), intent(in) :: self

      is_damped = .not. self%map%oscillator
   end function is_damped

   pure complex(wp) function theta(self, lambda)
      class(pencil_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      theta = self%map%theta(lambda)
   end function theta

   pure complex(wp) function lambda(self, theta)
      class(pencil_type), intent(in) :: self
      complex(wp), intent(in) :: theta
      complex(wp) :: roots(2)

      roots = self%map%lambdas(theta)
      lambda = merge(roots(2), roots(1), aimag(roots(1)) < 0 .and. self%map%oscillator)
   end function lambda

   !> phi (n x k) and xi (m x k) of eigenvectors x; xi belongs to the
   !> constraints as given. Of the two copies of phi in a damped form it takes
   !> the larger one: the other is a small difference.
   subroutine split(self, x, lambda, phi, xi)
      class(pencil_type), intent(in) :: self
      complex(wp), intent(in) :: x(:, :)
      !> The eigenvalue of each column.
      complex(wp), intent(in) :: lambda(:)
      complex(wp), allocatable, intent(out) :: phi(:, :), xi(:, :)
      integer :: n, j

      n = self%unknowns
      allocate (phi(n, size(x, 2)), xi(self%multipliers, size(x, 2)))
      do j = 1, size(x, 2)
         phi(:, j) = x(:n, j)
         if (self%is_damped()) then
            if (norm2(abs(x(n + 1:2*n, j))) > norm2(abs(phi(:, j)))) phi(:, j) = x(n + 1:2*n, j)*(self%unit/lambda(j))
         end if
         xi(:, j) = self%factors*x(size(x, 1) - self%multipliers + 1:, j)
      end do
   end subroutine split

   !> Factors A - sigma B. Fails where it is singular, that is where sigma is
   !> an eigenvalue; redundant constraints do no harm.
   subroutine new_shift_invert(operator, pencil, shift, solver, error, deflation)
      type(shift_invert_type), intent(out) :: operator
      type(pencil_type), intent(in) :: pencil
      !> sigma, a value of theta.
      complex(wp), intent(in) :: shift
      class(complex_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> Motions to be kept out of the iteration.
      type(deflation_type), target, optional, intent(in) :: deflation
      type(complex_csr_matrix_type) :: shifted

      operator%pencil = pencil
      if (present(deflation)) operator%deflation => deflation
      operator%shift = shift
      call move_alloc(solver, operator%solver)
      shifted = complex_combination([(1.0_wp, 0.0_wp), -shift], [csr_matrix_type :: pencil%a, pencil%b])
      call operator%solver%factorize(shifted, pencil%structure, error)
      if (.not. allocated(error)) call check_regular(operator, shifted, error)
   end subroutine new_shift_invert

   ! The shift is an eigenvalue where a system with a consistent right-hand side
   ! has no solution (null pivots alone may come from redundant constraints), or
   ! where C has an eigenvalue that puts theta at sigma to rounding.
   subroutine check_regular(operator, shifted, error)
      type(shift_invert_type), intent(inout) :: operator
      type(complex_csr_matrix_type), intent(in) :: shifted
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: acceptable = 1.0e-6_wp, rounding = 16*epsilon(1.0_wp)
      complex(wp), allocatable :: x(:, :), y(:, :), b(:)
      real(wp), allocatable :: random(:)
      real(wp) :: size_of_b
      logical :: singular
      integer(long) :: state
      integer :: n, i, k

      n = operator%order()
      allocate (random(n), x(n, 1), y(n, 1), b(n))
      state = 1
      call random_vector(state, random)
      x(:, 1) = random
      y = 0
      call operator%pencil%b%add_product((1.0_wp, 0.0_wp), x, y)
      b = y(:, 1)
      size_of_b = maxval(abs(b))
      call operator%solver%solve(y, error)
      if (allocated(error)) return
      do i = 1, n
         do k = shifted%row_start(i), shifted%row_start(i + 1) - 1
            b(i) = b(i) - shifted%value(k)*y(shifted%column(k), 1)
         end do
      end do
      singular = operator%solver%null_pivots > 0 .and. .not. maxval(abs(b)) <= acceptable*size_of_b
      if (.not. singular .and. norm2(abs(y)) > 0) then
         x = y/norm2(abs(y))
         call operator%apply(x, y, error)
         if (allocated(error)) return
         singular = .not. abs(operator%shift)*norm2(abs(y))*rounding <= 1
      end if
      if (singular) call new_error(error, error_singular, &
         "the shifted problem is singular: the shift is an eigenvalue; move it a little")
   end subroutine check_regular

   integer function shift_invert_order(self) result(order)
      class(shift_invert_type), intent(in) :: self

      order = self%pencil%a%rows
   end function shift_invert_order

   subroutine shift_invert_apply(self, x, y, error)
      class(shift_invert_type), intent(inout) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      y = 0
      call self%pencil%b%add_product((1.0_wp, 0.0_wp), x, y)
      call self%solver%solve(y, error)
      if (allocated(error) .or. .not. associated(self%deflation)) return
      associate (n => self%pencil%unknowns)
         call self%deflation%project(y(:n, :))
         if (self%pencil%is_damped()) call self%deflation%project(y(n + 1:2*n, :))
      end associate
   end subroutine shift_invert_apply

   pure complex(wp) function theta_of_ritz_value(self, mu) result(theta)
      class(shift_invert_type), intent(in) :: self
      complex(wp), intent(in) :: mu

      theta = huge(1.0_wp)
      if (abs(mu) > tiny(1.0_wp)) theta = self%shift + 1/mu
   end function theta_of_ritz_value
end module kschur_pencil
