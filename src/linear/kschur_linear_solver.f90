!> What the library asks of a linear solver, for real and for complex matrices.
!> Extend one of the types to bring your own.
module kschur_linear_solver
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_monitor, only: monitor_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   implicit none
   private
   public :: linear_solver_type, real_linear_solver_type, complex_linear_solver_type
   public :: determinant_type, matrix_structure_type

   !> What is known of a matrix beyond its entries.
   type :: matrix_structure_type
      !> Whether the matrix equals its transpose (not its adjoint).
      logical :: symmetric = .false.
      !> Unknown i belongs to node(i), 1-based: unknowns of a node are best
      !> eliminated together. Not allocated: every unknown is its own node.
      integer, allocatable :: node(:)
      !> The last so many unknowns are Lagrange multipliers: their diagonal
      !> is zero, so each must follow the unknowns it touches.
      integer :: multipliers = 0
      !> Unknown i is best eliminated as number position(i). Not allocated: not known yet.
      integer, allocatable :: position(:)
      !> So many eigenvalues of a symmetric matrix are known to be negative: who counts them need only show that there
      !> are no more.
      integer :: least_negative = 0
      !> The matrix, with rows of size one, is symmetric and semidefinite but for rounding, and factored though it may be singular: the
      !> error is tiny springs at some unknowns, which push nothing where no null vector feels the forces. Solvers
      !> that cannot do so fail.
      logical :: singular = .false.
   contains
      !> The node of each of n unknowns; those of multipliers mean nothing.
      procedure :: nodes
   end type matrix_structure_type

   !> A determinant, mantissa 2^exponent: it may be larger or smaller than any number of the machine.
   type :: determinant_type
      logical :: known = .false.
      complex(wp) :: mantissa = (1.0_wp, 0.0_wp)
      integer :: exponent = 0
   contains
      !> Its logarithm; the imaginary part, the phase, is in (-pi, pi].
      procedure :: logarithm
   end type determinant_type

   !> What real and complex solvers have in common.
   type, abstract :: linear_solver_type
      !> Seconds of the last factorisation's two phases, and of all solves.
      real(wp) :: analyze_seconds = 0, factorize_seconds = 0, solve_seconds = 0
      !> Number of entries of the factors.
      integer(long) :: factor_entries = 0
      !> Memory of the factors and of their making in the process that has most of them; -1 where not known.
      integer(long) :: factor_bytes = -1
      !> Number of pivots that were found to be zero; the factorisation goes on without them.
      integer :: null_pivots = 0
      !> Number of negative eigenvalues of a real symmetric matrix; -1 where not known.
      integer :: negative_pivots = -1
      !> The determinant of the matrix that was factored last. A solver that does not tell it leaves it unknown,
      !> and nothing is proved by it.
      type(determinant_type) :: determinant = determinant_type()
      !> Normwise backward error of its solutions; that of a direct solver is rounding.
      real(wp) :: accuracy = epsilon(1.0_wp)
      !> Which solver factored the matrix, and why this one: "ldl: symmetric definite, 19 entries a column".
      character(len=80) :: description = ""
      !> Asked while it factors, which fails with error_cancelled where it ends the computation; not associated: nobody.
      class(monitor_type), pointer :: monitor => null()
   contains
      !> Bytes that the factors of a matrix of some pattern take, with what their making takes, known by analysis alone. A
      !> solver that does not tell says 0.
      procedure :: estimate
      !> Leaves the factors, at the latest with the next matrix, and keeps what it knows of their pattern for one that has it.
      procedure :: forget_factors
      !> The number that several processes know its factors by; 0 where this one has them.
      procedure :: shared_as
   end type linear_solver_type

   !> A solver for real matrices.
   type, abstract, extends(linear_solver_type) :: real_linear_solver_type
   contains
      !> Factors a matrix; may be called again with another one.
      procedure(factorize_real), deferred :: factorize
      !> x := A^{-1} x for a block of right-hand sides.
      procedure(solve_real), deferred :: solve
      !> x := A^{-T} x for a block of right-hand sides.
      procedure(solve_real), deferred :: solve_adjoint
      !> x := A^{-1} x, of which each process has its rows (`joint_ranges_type`): all that have factors together call it.
      procedure :: solve_rows => solve_rows_real
   end type real_linear_solver_type

   !> A solver for complex matrices.
   type, abstract, extends(linear_solver_type) :: complex_linear_solver_type
   contains
      !> Factors a matrix; may be called again with another one.
      procedure(factorize_complex), deferred :: factorize
      !> x := A^{-1} x for a block of right-hand sides.
      procedure(solve_complex), deferred :: solve
      !> x := A^{-*} x (conjugate transpose) for a block of right-hand sides.
      procedure(solve_complex), deferred :: solve_adjoint
      !> x := A^{-1} x, of which each process has its rows (`joint_ranges_type`): all that have factors together call it.
      procedure :: solve_rows => solve_rows_complex
   end type complex_linear_solver_type

   abstract interface
      subroutine factorize_real(self, matrix, structure, error)
         import :: real_linear_solver_type, csr_matrix_type, matrix_structure_type, error_type
         class(real_linear_solver_type), intent(inout) :: self
         type(csr_matrix_type), intent(in) :: matrix
         type(matrix_structure_type), intent(in) :: structure
         type(error_type), allocatable, intent(out) :: error
      end subroutine factorize_real

      subroutine factorize_complex(self, matrix, structure, error)
         import :: complex_linear_solver_type, complex_csr_matrix_type, matrix_structure_type, error_type
         class(complex_linear_solver_type), intent(inout) :: self
         type(complex_csr_matrix_type), intent(in) :: matrix
         type(matrix_structure_type), intent(in) :: structure
         type(error_type), allocatable, intent(out) :: error
      end subroutine factorize_complex

      subroutine solve_real(self, x, error)
         import :: real_linear_solver_type, wp, error_type
         class(real_linear_solver_type), intent(inout) :: self
         real(wp), contiguous, intent(inout) :: x(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine solve_real

      subroutine solve_complex(self, x, error)
         import :: complex_linear_solver_type, wp, error_type
         class(complex_linear_solver_type), intent(inout) :: self
         complex(wp), contiguous, intent(inout) :: x(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine solve_complex
   end interface

contains

   subroutine estimate(self, pattern, structure, bytes, error)
      class(linear_solver_type), intent(in) :: self
      !> Its values mean nothing.
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, also => pattern, too => structure)
      end associate
      bytes = 0
   end subroutine estimate

   subroutine forget_factors(self, kept)
      class(linear_solver_type), intent(inout) :: self
      !> False: nothing is kept.
      logical, intent(out) :: kept

      associate (unused => self)
      end associate
      kept = .false.
   end subroutine forget_factors

   integer function shared_as(self)
      class(linear_solver_type), intent(in) :: self

      associate (unused => self)
      end associate
      shared_as = 0
   end function shared_as

   subroutine solve_rows_real(self, x, error)
      class(real_linear_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%solve(x, error)
   end subroutine solve_rows_real

   subroutine solve_rows_complex(self, x, error)
      class(complex_linear_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%solve(x, error)
   end subroutine solve_rows_complex

   elemental complex(wp) function logarithm(self)
      class(determinant_type), intent(in) :: self

      logarithm = log(self%mantissa) + self%exponent*log(2.0_wp)
   end function logarithm

   pure function nodes(self, n)
      class(matrix_structure_type), intent(in) :: self
      integer, intent(in) :: n
      integer :: nodes(n)
      integer :: i

      nodes = [(i, i=1, n)]
      if (allocated(self%node)) nodes(:size(self%node)) = self%node
   end function nodes
end module kschur_linear_solver
