!> The paper's Table 1: the modal problem as a pencil A x = theta B x of sparse matrices, real but for losses in A.
module kschur_pencil
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_names, formulation_undamped, formulation_undamped_constrained, &
      formulation_undamped_constrained_zero, formulation_undamped_negative
   use kschur_problem, only: modal_problem_type, damping_none
   use kschur_saddle, only: saddle_structure
   use kschur_spectral_map, only: spectral_map_type
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets, identity_csr_matrix
   implicit none
   private
   public :: check_fit, pencil_type, new_pencil

   !> A x = theta B x. The damped forms have x = (phi, lambda/unit phi, zeta) and theta = lambda, the undamped ones x = (phi,
   !> zeta) and theta = -+ lambda^2. With constraints in A, zeta is xi and the spurious eigenvalues are infinite. With
   !> constraints in B, zeta is xi integrated once or twice, theta zeta = unit xi or unit^2 xi, and the spurious ones are zeros:
   !> 2m in (22); 3m in (34), whose third block row of B is [0 Cq 0] here, because the paper's [Cq 0 0] makes B singular. B is
   !> nonsingular if M is on the null space of the constraints.
   type :: pencil_type
      !> One of `formulation_*`.
      integer :: formulation
      !> Map between theta and lambda.
      type(spectral_map_type) :: map
      type(csr_matrix_type) :: a, b
      !> Imaginary part of A, from the loss matrix H beside K; not allocated: none.
      type(csr_matrix_type), allocatable :: loss
      !> Numbers of unknowns n and multipliers m of the problem.
      integer :: unknowns, multipliers
      !> Factor of each constraint: xi as given is `factors` times the xi of the pencil.
      real(wp), allocatable :: factors(:)
      !> Unit of lambda in the second and third part of x (1/s).
      real(wp) :: unit
      !> Structure of A - sigma B for linear solvers.
      type(matrix_structure_type) :: structure
   contains
      !> Whether the pencil is in lambda; otherwise it is in its square.
      procedure :: is_damped
      !> Whether the constraints are in B.
      procedure :: has_spurious_zeros
      !> theta of a lambda.
      procedure :: theta
      !> A lambda of a theta, in the upper half-plane; where the pencil is
      !> undamped its negative is another.
      procedure :: lambda
      !> unit or unit^2, as theta is lambda or its square.
      procedure :: multiplier_unit
      !> Mode shapes and multipliers of eigenvectors.
      procedure :: split
   end type pencil_type

   ! Triplets of a block matrix during assembly.
   type :: blocks_type
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
   contains
      procedure :: add
   end type blocks_type

contains

   !> Builds the pencil of a formulation. Fails if the formulation does not fit the problem. The equations of the damped forms
   !> are in the order (second, first, third) of eqs. (30) and (33): this puts the stiffness on the diagonal of A - sigma B and
   !> changes no eigenvalue.
   subroutine new_pencil(pencil, problem, formulation, factors, unit, error)
      type(pencil_type), intent(out) :: pencil
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`, not `formulation_auto`.
      integer, intent(in) :: formulation
      !> Factor of each constraint, m numbers.
      real(wp), intent(in) :: factors(:)
      !> Unit of lambda (1/s) in the second and third part of x: the size of the
      !> wanted ones keeps all parts alike.
      real(wp), intent(in) :: unit
      type(error_type), allocatable, intent(out) :: error
      type(blocks_type) :: a, b, loss
      type(csr_matrix_type) :: cq
      integer :: n, m, order, i

      call check_fit(problem, formulation, error)
      if (allocated(error)) return
      n = problem%unknowns()
      m = problem%multipliers()
      pencil%formulation = formulation
      pencil%map%oscillator = all(formulation /= [formulation_damped, formulation_damped_constrained, &
         formulation_damped_constrained_zero])
      pencil%map%sign = merge(1.0_wp, -1.0_wp, formulation == formulation_undamped)
      pencil%map%upper = allocated(problem%loss)
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
         call a%add(n, n, unit, identity_csr_matrix(n))
         call b%add(0, n, unit, problem%mass)
         call b%add(n, 0, 1.0_wp, identity_csr_matrix(n))
         pencil%structure%multipliers = m
         allocate (pencil%structure%node(2*n), source=[(i, i=1, n), (i, i=1, n)])
      else
         order = n + m
         call a%add(0, 0, pencil%map%sign, problem%stiffness)
         call b%add(0, 0, 1.0_wp, problem%mass)
         pencil%structure = saddle_structure(problem)
      end if
      if (pencil%has_spurious_zeros()) then
         call b%add(0, order - m, 1/pencil%multiplier_unit(), cq, transposed=.true.)
         call b%add(order - m, order - m - n, 1/pencil%multiplier_unit(), cq)
      else
         call a%add(0, order - m, -1.0_wp, cq, transposed=.true.)
         call a%add(order - m, 0, -1.0_wp, cq)
      end if
      call new_csr_from_triplets(pencil%a, order, order, a%row, a%column, a%value, error)
      if (.not. allocated(error)) call new_csr_from_triplets(pencil%b, order, order, b%row, b%column, b%value, error)
      if (allocated(error) .or. .not. allocated(problem%loss)) return
      allocate (loss%row(0), loss%column(0), loss%value(0), pencil%loss)
      call loss%add(0, 0, merge(-1.0_wp, pencil%map%sign, pencil%is_damped()), problem%loss)
      call new_csr_from_triplets(pencil%loss, order, order, loss%row, loss%column, loss%value, error)
   end subroutine new_pencil

   !> Fails if a formulation is not a pencil of Table 1, or does not fit the damping and constraints of a problem.
   subroutine check_fit(problem, formulation, error)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(error_type), allocatable, intent(out) :: error

      select case (formulation)
      case (formulation_undamped, formulation_undamped_negative, formulation_undamped_constrained, &
         formulation_undamped_constrained_zero)
         if (problem%damping_kind /= damping_none) call refuse("it has damping")
      case (formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero)
         continue
      case default
         call refuse("it is not a pencil of Table 1")
      end select
      if (allocated(error)) return
      select case (formulation)
      case (formulation_undamped, formulation_undamped_negative, formulation_damped)
         if (problem%multipliers() > 0) call refuse("it has constraints")
      end select

   contains

      subroutine refuse(why)
         character(len=*), intent(in) :: why

         call new_error(error, error_usage, "the formulation "//trim(formulation_names(formulation))// &
            " does not fit the problem: "//why)
      end subroutine refuse
   end subroutine check_fit

   ! Adds coefficient * block, or its transpose, at an offset of `rows` rows and `columns` columns.
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

   pure logical function has_spurious_zeros(self)
      class(pencil_type), intent(in) :: self

      has_spurious_zeros = any(self%formulation == [formulation_undamped_constrained_zero, &
         formulation_damped_constrained_zero])
   end function has_spurious_zeros

   pure real(wp) function multiplier_unit(self)
      class(pencil_type), intent(in) :: self

      multiplier_unit = self%unit**merge(1, 2, self%is_damped())
   end function multiplier_unit

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

   !> Extracts phi (n x k) and xi (m x k), xi in terms of the constraints as given, from eigenvectors x. A damped form has two
   !> copies of phi; the larger one is taken, as the other suffers cancellation.
   subroutine split(self, x, lambda, theta, phi, xi)
      class(pencil_type), intent(in) :: self
      complex(wp), intent(in) :: x(:, :)
      !> The eigenvalue of each column.
      complex(wp), intent(in) :: lambda(:)
      !> theta of each column, to convert zeta to xi; the shift if zeta comes from shift-invert.
      complex(wp), intent(in) :: theta(:)
      complex(wp), allocatable, intent(out) :: phi(:, :), xi(:, :)
      integer :: n, j

      n = self%unknowns
      allocate (phi(n, size(x, 2)), xi(self%multipliers, size(x, 2)))
      do j = 1, size(x, 2)
         phi(:, j) = x(:n, j)
         if (self%is_damped()) then
            if (dznrm2(n, x(n + 1:2*n, j), 1) > dznrm2(n, phi(:, j), 1)) phi(:, j) = x(n + 1:2*n, j)*(self%unit/lambda(j))
         end if
         xi(:, j) = self%factors*x(size(x, 1) - self%multipliers + 1:, j)
         if (self%has_spurious_zeros()) xi(:, j) = theta(j)/self%multiplier_unit()*xi(:, j)
      end do
   end subroutine split
end module kschur_pencil
