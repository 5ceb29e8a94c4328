!> Direct solver for real symmetric matrices, definite or without growth, by multifrontal LDL^T in AMD or METIS order. Without
!> pivoting the work and memory are known in advance.
module kschur_ldl
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_singular, error_usage
   use kschur_fronts, only: supernodal_factors_type
   use kschur_growth, only: add_terms, has_grown
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: analyze_once, last_analysis_type
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_memory, only: real_bytes, require_memory, single_bytes
   use kschur_monitor, only: ask_monitor
   use kschur_permuted_sides, only: substitute_sides
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: cut_subtrees, subtrees_type
   use kschur_supernodal, only: eliminate
   use kschur_symbolic, only: analyze, symbolic_type
   use kschur_text, only: text
   use kschur_tolerances, only: cancelled, rounding_of_sums
   implicit none
   private
   public :: ldl_real_type

   !> Sparse LDL^T without pivoting. Rejects, with the reason as the error's message, unsymmetric matrices and multipliers
   !> (error_usage), indefinite ones with growth (error_library) and pivots that are zero to rounding (error_singular).
   type, extends(real_linear_solver_type) :: ldl_real_type
      !> Largest mean number of entries in a column of L; rejects matrices with more (error_library).
      integer :: most_entries = huge(1)
      !> Accepts multipliers: their pivots must be negative, all others positive.
      logical :: quasi_definite = .false.
      !> L is stored in single precision: solutions have its digits, pivots and inertia those of double precision.
      logical :: rounded = .false.
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
      procedure :: solve_adjoint => solve
      procedure :: estimate
      procedure :: forget_factors
   end type ldl_real_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(ldl_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
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
      else if (structure%multipliers > 0 .and. .not. self%quasi_definite) then
         call new_error(error, error_usage, "the matrix has "//text(structure%multipliers)//" multipliers")
      end if
      if (allocated(error)) return

      call require_memory(3*matrix%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call ask_monitor(self%monitor, error)
      if (allocated(error)) return
      started = clock()
      call analyze_once(self%last, matrix, structure, self%most_entries, self%symbolic, error)
      if (.not. allocated(error)) self%subtrees = cut_subtrees(self%symbolic)
      self%analyze_seconds = seconds_since(started)
      if (.not. allocated(error)) then
         started = clock()
         self%factors%rounds = self%rounded
         if (associated(self%last) .and. .not. self%rounded) call self%last%take_room(self%factors%lower)
         call eliminate(matrix, self%symbolic, self%subtrees, 0, self%factors, error, self%monitor, &
            structure%least_pivot())
         if (.not. allocated(error)) call examine_pivots(self, matrix, structure, error)
         call require_memory(right_hand_sides*real_bytes*matrix%rows, "right-hand sides", error)
         self%factorize_seconds = seconds_since(started)
      end if
      if (allocated(error)) call release(self)
      self%factored = .not. allocated(error)
   end subroutine factorize

   subroutine estimate(self, pattern, structure, bytes, error)
      class(ldl_real_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(symbolic_type) :: symbolic

      bytes = 0
      call require_memory(3*pattern%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call analyze(pattern, structure, self%most_entries, symbolic, error)
      if (.not. allocated(error)) bytes = symbolic%bytes(of_entry=merge(single_bytes, real_bytes, self%rounded))
   end subroutine estimate

   ! Checks signs and sizes of the pivots.
   subroutine examine_pivots(self, matrix, structure, error)
      class(ldl_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      ! A pivot smaller than this fraction of its diagonal entry is a rounding error. Quasi-definite factors grow with the
      ! reciprocal of the smallest pivot.
      real(wp), allocatable :: diagonal(:)

      associate (pivot => self%factors%pivot, order => self%symbolic%order, multipliers => structure%multipliers)
         allocate (diagonal, source=matrix%diagonal())
         if (.not. all(abs(pivot) > merge(cancelled, rounding_of_sums, self%quasi_definite .and. .not. structure%singular)* &
            abs(diagonal(order)))) then
            call new_error(error, error_singular, "a pivot of the matrix is zero")
         else if (structure%singular .and. multipliers > 0 .and. .not. last_are_null()) then
            call new_error(error, error_singular, "a pivot before one of a multiplier is zero")
         else if (self%quasi_definite .and. any(pivot < 0 .and. order <= matrix%rows - multipliers)) then
            call new_error(error, error_library, "the matrix is not quasi-definite")
         else if (self%quasi_definite .and. any(pivot > 0 .and. order > matrix%rows - multipliers)) then
            call new_error(error, error_singular, "a pivot of the matrix is zero to rounding")
         else if (.not. (self%quasi_definite .or. structure%singular) .and. any(pivot > 0) .and. any(pivot < 0)) then
            if (grows()) call new_error(error, error_library, "the matrix is indefinite")
         end if
         if (allocated(error)) return
         self%factor_entries = self%symbolic%factor_entries
         self%factor_bytes = int(merge(single_bytes, real_bytes, self%rounded), long)*(self%factors%offset(size( &
            self%factors%offset)) - 1)
         self%null_pivots = 0
         self%replaced_pivots = count(abs(pivot) <= structure%least_pivot())
         self%negative_pivots = count(pivot < 0)
      end associate
      self%description = "ldl: "//trim(kind_of_matrix())//", "// &
         text(self%symbolic%entries_a_column())//" entries a column"

   contains

      ! Whether rounding may be large; of factors in single precision it is not computed.
      pure logical function grows()
         real(wp) :: terms(size(diagonal))

         grows = self%rounded
         if (grows) return
         associate (symbolic => self%symbolic, factors => self%factors)
            terms = abs(factors%pivot)
            call add_terms(symbolic, factors, spread(.true., 1, size(symbolic%first) - 1), terms)
            grows = any(has_grown(terms, diagonal(symbolic%order)))
         end associate
      end function grows

      ! A singular one has pivots of rounding size, of either sign.
      pure function kind_of_matrix() result(kind)
         character(len=20) :: kind

         kind = "symmetric definite"
         if (self%quasi_definite) then
            kind = "quasi-definite"
         else if (.not. structure%singular .and. any(self%factors%pivot > 0) .and. self%negative_pivots > 0) then
            kind = "symmetric indefinite"
         end if
      end function kind_of_matrix

      ! Whether no multiplier follows a replaced pivot: it would hold what seems free.
      pure logical function last_are_null()
         integer :: i

         associate (pivot => self%factors%pivot, order => self%symbolic%order)
            i = findloc(order > matrix%rows - structure%multipliers, .true., 1, back=.true.)
            last_are_null = all(abs(pivot(:i)) > structure%least_pivot())
         end associate
      end function last_are_null
   end subroutine examine_pivots

   ! The memory is kept for later factors.
   subroutine forget_factors(self, kept)
      class(ldl_real_type), intent(inout) :: self
      logical, intent(out) :: kept

      kept = .false.
      call release(self)
   end subroutine forget_factors

   ! Drops the factors; their memory goes to `last`.
   subroutine release(self)
      class(ldl_real_type), intent(inout) :: self

      self%factored = .false.
      if (associated(self%last) .and. allocated(self%factors%lower)) call self%last%keep_room(self%factors%lower)
      self%symbolic = symbolic_type()
      self%subtrees = subtrees_type()
      self%factors = supernodal_factors_type()
   end subroutine release

   subroutine solve(self, x, error)
      class(ldl_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
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
end module kschur_ldl
