!> Direct solver for complex symmetric matrices (A = A^T, no conjugation) whose numerical range lies in a half plane, by
!> multifrontal LDL^T without pivoting.
!>
!> P(sigma) = sigma^2 M + sigma R + K + i H of positive semidefinite matrices is mostly such a matrix where Re sigma > 0: x^* P x
!> is a sum of numbers in the directions sigma^2, sigma, 1 and i. Then exp(-i theta) P has a positive definite real part for some
!> theta, and so have all Schur complements; their diagonal entries, pivots among them, stay in the sector of the numerical range
!> and grow by 1/cos^2 of half its angle at most (N. J. Higham, Math. Comp. 67 (1998); C.-K. Li, N.-S. Sze, J. Math. Anal. Appl.
!> 410 (2014)). The pivot of a multiplier is minus the conjugate of a number of the sector, as [exp(-i theta) P, Cq^T; -Cq, 0]
!> has no other real part. Pivots in the sector are necessary; a trial solution shows that they were enough.
module kschur_ldl_complex
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_singular, error_usage
   use kschur_fronts_complex, only: supernodal_factors_type
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: analyze_once, last_analysis_type
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_monitor, only: ask_monitor
   use kschur_permuted_sides_complex, only: substitute_sides
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_subtrees, only: cut_subtrees, subtrees_type
   use kschur_supernodal_complex, only: eliminate
   use kschur_symbolic, only: analyze, symbolic_type
   use kschur_text, only: text
   use kschur_tolerances, only: cancelled, narrowest_cosine, rounding_of_sums
   implicit none
   private
   public :: ldl_complex_type

   !> Rejects, with the reason as the error's message, unsymmetric matrices (error_usage), pivots beyond a sector (error_library)
   !> and pivots that are zero to rounding (error_singular).
   type, extends(complex_linear_solver_type) :: ldl_complex_type
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      ! Whether factors are available.
      logical, private :: factored = .false.
      type(symbolic_type), private :: symbolic
      type(subtrees_type), private :: subtrees
      type(supernodal_factors_type), private :: factors
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: estimate
      procedure :: forget_factors
   end type ldl_complex_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(ldl_complex_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      ! Right-hand sides allowed for in the memory check.
      integer, parameter :: right_hand_sides = 16
      integer(long) :: started

      call release(self)
      if (matrix%rows /= matrix%columns) then
         call new_error(error, error_usage, "only a square matrix can be factored")
      else if (.not. structure%symmetric) then
         call new_error(error, error_usage, "the matrix is unsymmetric")
      end if
      if (allocated(error)) return

      call require_memory(3*matrix%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call ask_monitor(self%monitor, error)
      if (allocated(error)) return
      started = clock()
      call analyze_once(self%last, matrix%magnitudes(), structure, huge(1), self%symbolic, error)
      if (.not. allocated(error)) self%subtrees = cut_subtrees(self%symbolic)
      self%analyze_seconds = seconds_since(started)
      if (.not. allocated(error)) then
         started = clock()
         call eliminate(matrix, self%symbolic, self%subtrees, 0, self%factors, error, self%monitor)
         if (.not. allocated(error)) call examine_pivots(self, matrix, structure%multipliers, error)
         call require_memory(right_hand_sides*complex_bytes*matrix%rows, "right-hand sides", error)
         self%factorize_seconds = seconds_since(started)
      end if
      if (allocated(error)) call release(self)
      self%factored = .not. allocated(error)
   end subroutine factorize

   subroutine estimate(self, pattern, structure, bytes, error)
      class(ldl_complex_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(symbolic_type) :: symbolic

      associate (unused => self)
      end associate
      bytes = 0
      call require_memory(3*pattern%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call analyze(pattern, structure, huge(1), symbolic, error)
      if (.not. allocated(error)) bytes = symbolic%bytes(complex_bytes)
   end subroutine estimate

   ! Checks directions and sizes of the pivots.
   subroutine examine_pivots(self, matrix, multipliers, error)
      class(ldl_complex_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: multipliers
      type(error_type), allocatable, intent(out) :: error
      ! A pivot smaller than this fraction of its diagonal entry is a rounding error.
      real(wp), allocatable :: size_of_diagonal(:)

      associate (pivot => self%factors%pivot, order => self%symbolic%order)
         allocate (size_of_diagonal, source=abs(matrix%diagonal()))
         if (.not. all(abs(pivot) > merge(cancelled, rounding_of_sums, multipliers > 0)*size_of_diagonal(order))) then
            call new_error(error, error_singular, "a pivot of the matrix is zero")
         else if (cosine_of_sector(pivot, order > matrix%rows - multipliers) < narrowest_cosine) then
            call new_error(error, error_library, "the numerical range is too wide for factors without pivoting")
         end if
         if (allocated(error)) return
         self%factor_entries = self%symbolic%factor_entries
         self%factor_bytes = int(complex_bytes, long)*size(self%factors%lower, kind=long)
         self%null_pivots = 0
      end associate
      self%description = "ldl: complex symmetric, "//text(self%symbolic%entries_a_column())//" entries a column"
   end subroutine examine_pivots

   ! The cosine of half the angle of the smallest sector with all pivots of unknowns, and minus the conjugates of those of
   ! multipliers; -1 if they lie in no half plane.
   pure real(wp) function cosine_of_sector(pivot, is_multiplier) result(cosine)
      complex(wp), intent(in) :: pivot(:)
      logical, intent(in) :: is_multiplier(:)
      real(wp), parameter :: pi = acos(-1.0_wp)
      complex(wp) :: turned
      real(wp) :: angle, least, most
      integer :: k

      least = 0
      most = 0
      do k = 1, size(pivot)
         turned = merge(-conjg(pivot(k)), pivot(k), is_multiplier(k))*conjg(merge(-conjg(pivot(1)), pivot(1), is_multiplier(1)))
         angle = atan2(aimag(turned), real(turned, wp))
         least = min(least, angle)
         most = max(most, angle)
      end do
      cosine = -1
      if (most - least < pi) cosine = cos((most - least)/2)
   end function cosine_of_sector

   ! The analysis is kept in `last`.
   subroutine forget_factors(self, kept)
      class(ldl_complex_type), intent(inout) :: self
      logical, intent(out) :: kept

      kept = .false.
      call release(self)
   end subroutine forget_factors

   subroutine release(self)
      class(ldl_complex_type), intent(inout) :: self

      self%factored = .false.
      self%symbolic = symbolic_type()
      self%subtrees = subtrees_type()
      self%factors = supernodal_factors_type()
   end subroutine release

   subroutine solve(self, x, error)
      class(ldl_complex_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: started

      if (.not. self%factored) then
         call new_error(error, error_usage, "a matrix must be factored before it can be solved with")
      else if (size(x, 1) /= size(self%symbolic%order)) then
         call new_error(error, error_usage, "the right-hand sides do not fit the factored matrix")
      end if
      if (allocated(error)) return
      started = clock()
      call substitute_sides(self%symbolic, self%subtrees, self%factors, x, error)
      self%solve_seconds = self%solve_seconds + seconds_since(started)
   end subroutine solve

   ! A^{-*} b is the conjugate of A^{-1} conj(b), as A = A^T.
   subroutine solve_adjoint(self, x, error)
      class(ldl_complex_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      x = conjg(x)
      call self%solve(x, error)
      x = conjg(x)
   end subroutine solve_adjoint
end module kschur_ldl_complex
