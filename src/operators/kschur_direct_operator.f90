!> Operator B^{-1} A of a pencil without shift-invert: its eigenvalues of largest magnitude are those of the pencil.
module kschur_direct_operator
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_operator, only: complex_operator_type
   use kschur_options, only: formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_undamped_constrained, formulation_undamped_constrained_zero
   use kschur_pencil, only: pencil_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type, complex_combination, new_csr_from_triplets
   use kschur_tolerances, only: blurred_value
   implicit none
   private
   public :: direct_operator_type, new_direct_operator

   !> C = B^{-1} A with eigenvalues theta. If the pencil has infinite spurious eigenvalues, B is singular: then C belongs to the
   !> pencil with the same modes and spurious zeros instead, which differ from rigid modes only in Cq phi /= 0.
   type, extends(complex_operator_type) :: direct_operator_type
      !> The pencil with nonsingular B, which splits the eigenvectors of C.
      type(pencil_type) :: pencil
      class(complex_linear_solver_type), allocatable :: solver
   contains
      procedure :: order => direct_order
      procedure :: apply => direct_apply
   end type direct_operator_type

contains

   !> Factors B, or [M Cq^T; Cq 0] if B is singular. Fails if a motion that satisfies the constraints has no mass: then no
   !> largest eigenvalue exists. Redundant constraints are allowed.
   subroutine new_direct_operator(operator, pencil, solver, error)
      type(direct_operator_type), intent(out) :: operator
      type(pencil_type), intent(in) :: pencil
      class(complex_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error

      operator%pencil = pencil
      call move_alloc(solver, operator%solver)
      if (any(pencil%formulation == [formulation_undamped_constrained, formulation_damped_constrained])) &
         call move_constraints(operator%pencil, error)
      if (.not. allocated(error)) call operator%solver%factorize(complex_combination([(1.0_wp, 0.0_wp)], &
         [operator%pencil%b]), operator%pencil%structure, error)
      if (.not. allocated(error)) call check_mass(operator, error)
   end subroutine new_direct_operator

   ! Moves the constraints from A to B: pencil (20) or (33) becomes (22) or (34).
   subroutine move_constraints(pencil, error)
      type(pencil_type), intent(inout) :: pencil
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      logical, allocatable :: moved(:)
      real(wp), allocatable :: value(:)
      type(csr_matrix_type) :: a, b
      integer :: order, last

      order = pencil%a%rows
      last = order - pencil%multipliers
      pencil%formulation = merge(formulation_damped_constrained_zero, formulation_undamped_constrained_zero, &
         pencil%is_damped())
      allocate (row(pencil%a%nonzeros()), source=pencil%a%row_indices())
      allocate (column(size(row)), source=pencil%a%column)
      allocate (value(size(row)), source=pencil%a%value)
      allocate (moved(size(row)), source=row > last .or. column > last)
      call new_csr_from_triplets(a, order, order, pack(row, .not. moved), pack(column, .not. moved), &
         pack(value, .not. moved), error)
      if (allocated(error)) return
      where (row > last) column = column + last - pencil%unknowns
      value = -value/pencil%multiplier_unit()
      call new_csr_from_triplets(b, order, order, [pencil%b%row_indices(), pack(row, moved)], &
         [pencil%b%column, pack(column, moved)], [pencil%b%value, pack(value, moved)], error)
      pencil%a = a
      pencil%b = b
   end subroutine move_constraints

   ! Checks that B x determines the motion in x; redundant constraints leave the multipliers undetermined.
   subroutine check_mass(operator, error)
      type(direct_operator_type), intent(inout) :: operator
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: x(:, :), y(:, :)
      real(wp), allocatable :: random(:)
      integer(long) :: state
      integer :: order, last

      order = operator%order()
      last = order - operator%pencil%multipliers
      allocate (random(order), x(order, 1), y(order, 1))
      state = 1
      call random_vector(state, random)
      x(:, 1) = random
      y = 0
      call operator%pencil%b%add_product((1.0_wp, 0.0_wp), x, y)
      call operator%solver%solve(y, error)
      if (allocated(error)) return
      if (.not. maxval(abs(y(:last, 1) - x(:last, 1))) <= blurred_value*maxval(abs(random))) &
         call new_error(error, error_singular, &
         "the mass matrix has no inverse on the motions that the constraints allow: there is no largest eigenvalue")
   end subroutine check_mass

   integer function direct_order(self) result(order)
      class(direct_operator_type), intent(in) :: self

      order = self%pencil%a%rows
   end function direct_order

   subroutine direct_apply(self, x, y, error)
      class(direct_operator_type), intent(inout) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      y = 0
      call self%pencil%a%add_product((1.0_wp, 0.0_wp), x, y)
      if (allocated(self%pencil%loss)) call self%pencil%loss%add_product((0.0_wp, 1.0_wp), x, y)
      call self%solver%solve(y, error)
   end subroutine direct_apply
end module kschur_direct_operator
