!> Direct solver for real matrices: uses LDL^T for symmetric matrices that are definite, also with multipliers, or indefinite
!> without growth, and MUMPS for all others; both by one process or by several.
module kschur_direct_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, add_context, error_cancelled, error_library, error_memory, &
      error_usage
   use kschur_joint_ldl, only: joint_ldl_type
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: last_analysis_type
   use kschur_ldl, only: ldl_real_type
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_options, only: inner_auto, inner_ldl, inner_mumps
   use kschur_ordering, only: elimination_order
   use kschur_processes, only: are_several, processes_type
   use kschur_quasi_definite, only: low_fill, quasi_definite_type
   use kschur_refinement, only: solve_and_refine
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: text
   use kschur_tolerances, only: above_all_rounding, accepted_backward_error
   use kschur_trial_solution, only: try_solver
   implicit none
   private
   public :: direct_real_type

   !> Uses LDL or MUMPS; `description` says which one and why.
   type, extends(real_linear_solver_type) :: direct_real_type
      !> One of `inner_*`. `inner_ldl` fails, with the reason, on a matrix that LDL does not handle.
      integer :: inner = inner_auto
      !> Number of refinement steps that the caller makes. If positive, LDL need not be accurate by itself, as for a nearly
      !> singular matrix, and makes no refinement.
      integer :: refinements = 0
      !> Processes that may factor jointly; not associated: this one alone.
      type(processes_type), pointer :: processes => null()
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      class(real_linear_solver_type), allocatable, private :: solver
      ! The matrix, if solutions are refined; else not allocated.
      type(csr_matrix_type), allocatable, private :: matrix
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: solve_rows
      procedure :: shared_as
      procedure :: absorb_scaling
      procedure :: estimate
      procedure :: forget_factors
   end type direct_real_type

   ! Indefinite matrices with fewer rows are factored with pivoting, which takes them no time and keeps more digits. Chosen.
   integer, parameter :: least_unpivoted = 500

contains

   subroutine factorize(self, matrix, structure, error)
      class(direct_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      class(real_linear_solver_type), allocatable :: previous
      type(matrix_structure_type) :: ordered
      character(len=len(self%description)) :: reason
      real(wp) :: spent
      integer(long) :: started
      logical :: kept

      call move_alloc(self%solver, previous)
      if (allocated(self%matrix)) deallocate (self%matrix)
      started = clock()
      reason = "as asked"
      ordered = structure
      if (structure%singular .and. self%inner == inner_mumps) then
         call new_error(error, error_usage, "MUMPS would take other pivots")
         return
      else if (self%inner /= inner_mumps) then
         ! Frees the memory of earlier factors for LDL.
         if (structure%symmetric .and. allocated(previous)) then
            call previous%forget_factors(kept)
            deallocate (previous)
         end if
         ! One order for LDL and, if it refuses the matrix, MUMPS.
         if (structure%symmetric .and. structure%multipliers > 0) &
            call elimination_order(matrix%row_start, matrix%column, structure, ordered%position, error)
         if (allocated(error)) return
         spent = seconds_since(started)
         call try_ldl(self, matrix, ordered, error)
         if (allocated(error) .and. structure%singular) return
         if (.not. allocated(error)) then
            call report(self, spent, self%solver%description)
            return
         else if (self%inner == inner_ldl) then
            call add_context(error, "the inner solver ldl does not fit, take auto or mumps")
            return
         else if (any(error%code == [error_memory, error_cancelled])) then
            return
         end if
         reason = error%message
      end if
      if (self%inner /= inner_mumps .and. are_several(self%processes, matrix%rows)) &
         reason = trim(reason)//", "//text(self%processes%number)//" processes factor it"
      if (associated(self%last)) call self%last%drop_room()
      spent = seconds_since(started)
      call factor_by_mumps(self, matrix, ordered, previous, error)
      if (allocated(error)) return
      call choose_refinement(self, matrix, ordered, error)
      call report(self, spent, "mumps: "//reason)
   end subroutine factorize

   ! Turns refinement on if a trial solution is inaccurate: nearly dependent constraints lose digits in rows that pivots
   ! combine.
   subroutine choose_refinement(self, matrix, structure, error)
      class(direct_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: backward_error

      if (structure%multipliers == 0 .or. self%refinements > 0 .or. self%solver%null_pivots > 0) return
      call try_solver(self%solver, matrix, structure%multipliers, backward_error, error)
      if (allocated(error)) return
      if (.not. backward_error > above_all_rounding) return
      allocate (self%matrix, source=matrix)
      ! The inertia is then unreliable too.
      self%solver%negative_pivots = -1
   end subroutine choose_refinement

   ! Factors by LDL; keeps the factors in `solver` if a trial solution is accurate, else fails with the reason.
   subroutine try_ldl(self, matrix, structure, error)
      class(direct_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      class(real_linear_solver_type), allocatable :: ldl
      type(joint_ldl_type) :: joint
      type(quasi_definite_type) :: saddle
      type(ldl_real_type) :: plain
      logical :: is_joint
      real(wp) :: backward_error

      is_joint = self%inner == inner_auto .and. are_several(self%processes, matrix%rows)
      if (is_joint) then
         joint%processes => self%processes
         joint%last => self%last
         allocate (ldl, source=joint)
      else if (structure%multipliers > 0 .and. self%refinements == 0 .and. .not. structure%singular) then
         if (self%inner == inner_auto) saddle%most_entries = low_fill
         saddle%last => self%last
         allocate (ldl, source=saddle)
      else
         plain%quasi_definite = structure%multipliers > 0
         plain%last => self%last
         allocate (ldl, source=plain)
      end if
      ldl%monitor => self%monitor
      call ldl%factorize(matrix, structure, error)
      ! A random side would excite null vectors, whose size hides what else is inaccurate: the caller tries one that does not.
      backward_error = 0
      if (.not. (allocated(error) .or. (structure%singular .and. structure%multipliers > 0))) &
         call try_solver(ldl, matrix, structure%multipliers, backward_error, error, self%refinements)
      if (allocated(error)) return
      ! Several processes do not refine the solutions with factors that have lost digits.
      if (backward_error > merge(above_all_rounding, accepted_backward_error, is_joint .and. structure%multipliers > 0 .and. &
         self%refinements == 0)) then
         call new_error(error, error_library, "a trial solution has a large residual")
      else if (self%inner == inner_auto .and. matrix%rows < least_unpivoted .and. structure%multipliers == 0 .and. &
         .not. structure%singular .and. ldl%negative_pivots > 0 .and. ldl%negative_pivots < matrix%rows) then
         call new_error(error, error_library, "the matrix is indefinite")
      else
         ! As for a definite matrix with constraints.
         if (structure%singular .and. structure%multipliers > 0 .and. .not. is_joint .and. &
            ldl%factor_entries <= int(low_fill, long)*matrix%rows) allocate (self%matrix, source=matrix)
         call move_alloc(ldl, self%solver)
      end if
   end subroutine try_ldl

   ! Estimate for the solver that is tried first.
   subroutine estimate(self, pattern, structure, bytes, error)
      class(direct_real_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(joint_ldl_type) :: joint
      type(ldl_real_type) :: ldl
      type(quasi_definite_type) :: quasi_definite
      type(mumps_real_type) :: mumps

      if (self%inner == inner_mumps .or. .not. structure%symmetric) then
         mumps%processes => self%processes
         call mumps%estimate(pattern, structure, bytes, error)
      else if (self%inner == inner_auto .and. are_several(self%processes, pattern%rows)) then
         joint%processes => self%processes
         call joint%estimate(pattern, structure, bytes, error)
      else if (structure%multipliers > 0 .and. self%refinements == 0 .and. .not. structure%singular) then
         call quasi_definite%estimate(pattern, structure, bytes, error)
      else
         call ldl%estimate(pattern, structure, bytes, error)
      end if
   end subroutine estimate

   subroutine solve(self, x, error)
      class(direct_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: previous

      call check_factored(self, error)
      if (allocated(error)) return
      previous = self%solver%solve_seconds
      if (allocated(self%matrix)) then
         call solve_and_refine(self%solver, self%matrix, x, error)
      else
         call self%solver%solve(x, error)
      end if
      self%solve_seconds = self%solve_seconds + (self%solver%solve_seconds - previous)
   end subroutine solve

   subroutine absorb_scaling(self, scaling, is_absorbed)
      class(direct_real_type), intent(inout) :: self
      real(wp), intent(in) :: scaling(:)
      logical, intent(out) :: is_absorbed

      is_absorbed = allocated(self%solver) .and. .not. allocated(self%matrix)
      if (is_absorbed) call self%solver%absorb_scaling(scaling, is_absorbed)
   end subroutine absorb_scaling

#define SCALAR real(wp)
#define MATRIX_TYPE csr_matrix_type
#define SOLVER_TYPE real_linear_solver_type
#define DIRECT_TYPE direct_real_type
#define MUMPS_TYPE mumps_real_type
#include "kschur_direct.inc"
end module kschur_direct_solver
