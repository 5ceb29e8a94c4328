!> The stiffness of a constrained structure without its units, regularised and factored.
module kschur_scaled_stiffness
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   implicit none
   private
   public :: scaled_stiffness_type, new_scaled_stiffness

   !> [D K D + delta I, D Cq^T S; S Cq D, 0] with diagonal D and S such that the rows of both blocks are of
   !> size one: what is zero does not depend on units, or on heavy and light parts.
   type :: scaled_stiffness_type
      !> D, n numbers, and S, m numbers: powers of two.
      real(wp), allocatable :: scaling(:), constraint_scaling(:)
      !> delta
      real(wp) :: regularization = 0
      type(csr_matrix_type) :: matrix
      !> Holds the factors.
      class(real_linear_solver_type), allocatable :: solver
   end type scaled_stiffness_type

   ! delta, in units of what the solver makes of rounding: just above it.
   real(wp), parameter :: above_rounding = 16

contains

   !> Factors the scaled stiffness of a problem with n unknowns and m constraints.
   subroutine new_scaled_stiffness(self, problem, solver, error)
      type(scaled_stiffness_type), intent(out) :: self
      type(modal_problem_type), intent(in) :: problem
      !> Moved into it.
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      type(matrix_structure_type) :: structure
      real(wp), allocatable :: level(:), borders(:)
      integer, allocatable :: row(:), constraint(:)
      integer :: n, m, i

      n = problem%unknowns()
      m = problem%multipliers()
      call move_alloc(solver, self%solver)
      self%regularization = above_rounding*self%solver%accuracy
      associate (k => problem%stiffness, cq => problem%constraints)
         allocate (level(n), source=k%row_maxima())
         if (all(.not. level > 0)) level = 1
         where (.not. level > 0) level = maxval(level)
         ! Powers of two: scaling rounds nothing.
         allocate (self%scaling(n), source=scale(1.0_wp, -exponent(level)/2))
         allocate (row(k%nonzeros()), source=k%row_indices())
         allocate (constraint(cq%nonzeros()), source=cq%row_indices())
         allocate (borders(cq%nonzeros()), source=cq%value*self%scaling(cq%column))
         allocate (self%constraint_scaling(m))
         do i = 1, m
            associate (border => borders(cq%row_start(i):cq%row_start(i + 1) - 1))
               self%constraint_scaling(i) = scale(1.0_wp, -exponent(maxval(abs(border))))
               border = self%constraint_scaling(i)*border
            end associate
         end do
         call new_csr_from_triplets(self%matrix, n + m, n + m, &
            [row, [(i, i=1, n)], n + constraint, cq%column], [k%column, [(i, i=1, n)], cq%column, n + constraint], &
            [self%scaling(row)*k%value*self%scaling(k%column), spread(self%regularization, 1, n), borders, borders], error)
      end associate
      if (allocated(error)) return
      structure%symmetric = problem%symmetric
      if (.not. problem%symmetric) structure%symmetric = problem%stiffness%is_symmetric()
      structure%multipliers = m
      allocate (structure%node(n), source=[(i, i=1, n)])
      call self%solver%factorize(self%matrix, structure, error)
   end subroutine new_scaled_stiffness
end module kschur_scaled_stiffness
