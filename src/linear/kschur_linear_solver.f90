!> Abstract linear solvers for real and complex matrices. Extend one of the types to supply your own.
module kschur_linear_solver
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_monitor, only: monitor_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_tolerances, only: root_epsilon, visible_pivot
   implicit none
   private
   public :: linear_solver_type, real_linear_solver_type, complex_linear_solver_type
   public :: determinant_type, matrix_structure_type

   !> Properties of a matrix beyond its entries.
   type :: matrix_structure_type
      !> Whether the matrix equals its transpose (not its adjoint).
      logical :: symmetric = .false.
      !> Unknown i belongs to node(i), 1-based: unknowns of a node are best
      !> eliminated together. Not allocated: every unknown is its own node.
      integer, allocatable :: node(:)
      !> A complex symmetric matrix is likely to have a numerical range in an open half plane: P(sigma) of a passive system, sigma
      !> in the right one. Then it has factors without pivoting (theory in kschur_ldl_complex).
      logical :: in_half_plane = .false.
      !> Number of Lagrange multipliers, the last unknowns: their diagonal is zero, so each must be eliminated after the
      !> unknowns it constrains.
      integer :: multipliers = 0
      !> Elimination order: unknown i is eliminated as number position(i). Not allocated: not computed yet.
      integer, allocatable :: position(:)
      !> Lower bound, proved before, of the number of negative eigenvalues of a symmetric matrix: a count need only show that
      !> there are no more.
      integer :: least_negative = 0
      !> The matrix, scaled to unit rows, is symmetric positive semidefinite to rounding and may be singular: zero pivots are
      !> replaced by small ones (soft springs), which do not change solutions if the forces are orthogonal to the null space.
      !> Solvers that cannot do so fail.
      logical :: singular = .false.
      !> The matrix is regular: no pivot is taken as null because it is small beside the whole matrix, as units may differ by rows.
      !> One that is zero is an error then; solvers may ignore it.
      logical :: regular = .false.
   contains
      !> Node of each of n unknowns; arbitrary for multipliers.
      procedure :: nodes
      !> What replaces a smaller pivot of a singular matrix; 0 if it need not be singular.
      procedure :: least_pivot
   end type matrix_structure_type

   !> A determinant as mantissa 2^exponent, to avoid over- and underflow.
   type :: determinant_type
      logical :: known = .false.
      complex(wp) :: mantissa = (1.0_wp, 0.0_wp)
      integer :: exponent = 0
   contains
      !> Its logarithm; the imaginary part, the phase, is in (-pi, pi].
      procedure :: logarithm
   end type determinant_type

   !> Common part of real and complex solvers.
   type, abstract :: linear_solver_type
      !> Seconds of analysis and factorisation, and of all solves.
      real(wp) :: analyze_seconds = 0, factorize_seconds = 0, solve_seconds = 0
      !> Number of entries of the factors.
      integer(long) :: factor_entries = 0
      !> Peak memory of the factorisation in the process that needs most; -1 if unknown.
      integer(long) :: factor_bytes = -1
      !> Number of zero pivots, which the factorisation skipped.
      integer :: null_pivots = 0
      !> Number of pivots of a singular matrix that small ones replaced.
      integer :: replaced_pivots = 0
      !> Number of negative eigenvalues of a real symmetric matrix; -1 if unknown.
      integer :: negative_pivots = -1
      !> Determinant of the last factored matrix; if a solver does not set it, nothing is proved by determinants.
      type(determinant_type) :: determinant = determinant_type()
      !> Normwise backward error of solutions; rounding for a direct solver.
      real(wp) :: accuracy = epsilon(1.0_wp)
      !> Which solver factored the matrix and why: "ldl: symmetric definite, 19 entries a column".
      character(len=80) :: description = ""
      !> Monitor polled during factorisation, which fails with error_cancelled if it cancels; not associated: none.
      class(monitor_type), pointer :: monitor => null()
   contains
      !> Estimates the memory in bytes of factorisation and factors of a matrix, by the analysis of its pattern. 0 if a solver
      !> cannot tell.
      procedure :: estimate
      !> Frees the factors, at the latest at the next factorisation; keeps the analysis.
      procedure :: forget_factors
      !> Identification number of factors that several processes hold jointly; 0 if this process has all of them.
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
      !> x := A^{-1} x, x distributed by rows (`joint_ranges_type`): collective over all processes that share the factors.
      procedure :: solve_rows => solve_rows_real
      !> From now on solves x = D A^{-1} D b, with vectors distributed by rows too, if the solver can do so.
      procedure :: absorb_scaling
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
      !> x := A^{-1} x, x distributed by rows (`joint_ranges_type`): collective over all processes that share the factors.
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
      !> Only the pattern is used.
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
      !> False: the solver keeps nothing of use.
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

   subroutine absorb_scaling(self, scaling, is_absorbed)
      class(real_linear_solver_type), intent(inout) :: self
      !> D.
      real(wp), intent(in) :: scaling(:)
      !> False: the solver cannot.
      logical, intent(out) :: is_absorbed

      associate (unused => self, also => scaling)
      end associate
      is_absorbed = .false.
   end subroutine absorb_scaling

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

   ! Rounding of the pivots that follow those of multipliers grows with the flexibility of what these hold.
   pure real(wp) function least_pivot(self)
      class(matrix_structure_type), intent(in) :: self

      least_pivot = 0
      if (self%singular) least_pivot = merge(root_epsilon, visible_pivot, self%multipliers > 0)
   end function least_pivot
end module kschur_linear_solver
