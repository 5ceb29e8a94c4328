!> Direct solver for complex matrices: LDL^T for symmetric ones whose numerical range lies in a half plane, MUMPS for all others.
module kschur_direct_complex
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, add_context, error_cancelled, error_library, error_memory, error_usage
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: last_analysis_type
   use kschur_ldl_complex, only: ldl_complex_type
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_options, only: inner_auto, inner_ldl
   use kschur_processes, only: are_several, processes_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_tolerances, only: above_all_rounding
   use kschur_trial_solution_complex, only: try_solver
   implicit none
   private
   public :: direct_complex_type

   !> Uses LDL or MUMPS; `description` says which one and why.
   type, extends(complex_linear_solver_type) :: direct_complex_type
      !> One of `inner_*`. `inner_ldl` fails, with the reason, on a matrix that LDL does not handle.
      integer :: inner = inner_auto
      !> Processes that may factor jointly, by MUMPS; not associated: this one alone.
      type(processes_type), pointer :: processes => null()
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      class(complex_linear_solver_type), allocatable, private :: solver
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: solve_rows
      procedure :: shared_as
      procedure :: estimate
      procedure :: forget_factors
      procedure, private :: fits_ldl
   end type direct_complex_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(direct_complex_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: previous
      character(len=len(self%description)) :: reason
      real(wp) :: spent
      integer(long) :: started
      logical :: kept

      call move_alloc(self%solver, previous)
      started = clock()
      reason = ""
      if (self%fits_ldl(matrix%rows, structure)) then
         ! Frees the memory of earlier factors.
         if (allocated(previous)) then
            call previous%forget_factors(kept)
            deallocate (previous)
         end if
         call try_ldl(self, matrix, structure, error)
         if (.not. allocated(error)) then
            call report(self, 0.0_wp, self%solver%description)
            return
         else if (self%inner == inner_ldl) then
            call add_context(error, "the inner solver ldl does not fit, take auto or mumps")
            return
         else if (any(error%code == [error_memory, error_cancelled])) then
            return
         end if
         reason = error%message
      end if
      spent = seconds_since(started)
      call factor_by_mumps(self, matrix, structure, previous, error)
      if (allocated(error)) return
      if (reason == "") then
         call report(self, spent, self%solver%description)
      else
         call report(self, spent, "mumps: "//reason)
      end if
   end subroutine factorize

   ! Whether LDL is tried. Several processes have it for real matrices only.
   logical function fits_ldl(self, rows, structure)
      class(direct_complex_type), intent(in) :: self
      integer, intent(in) :: rows
      type(matrix_structure_type), intent(in) :: structure

      fits_ldl = self%inner == inner_ldl .or. (self%inner == inner_auto .and. structure%symmetric .and. structure%in_half_plane &
         .and. .not. are_several(self%processes, rows))
   end function fits_ldl

   ! Factors by LDL; keeps the factors in `solver` if a trial solution is accurate, else fails with the reason.
   subroutine try_ldl(self, matrix, structure, error)
      class(direct_complex_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: ldl
      real(wp) :: backward_error

      allocate (ldl, source=ldl_complex_type(last=self%last))
      ldl%monitor => self%monitor
      call ldl%factorize(matrix, structure, error)
      if (.not. allocated(error)) call try_solver(ldl, matrix, structure%multipliers, backward_error, error)
      if (allocated(error)) return
      if (backward_error > above_all_rounding) then
         call new_error(error, error_library, "a trial solution has a large residual")
      else
         call move_alloc(ldl, self%solver)
      end if
   end subroutine try_ldl

   ! Estimate for the solver that is tried first.
   subroutine estimate(self, pattern, structure, bytes, error)
      class(direct_complex_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(ldl_complex_type) :: ldl
      type(mumps_complex_type) :: mumps

      if (self%fits_ldl(pattern%rows, structure)) then
         call ldl%estimate(pattern, structure, bytes, error)
      else
         mumps%processes => self%processes
         call mumps%estimate(pattern, structure, bytes, error)
      end if
   end subroutine estimate

   subroutine solve(self, x, error)
      class(direct_complex_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: previous

      call check_factored(self, error)
      if (allocated(error)) return
      previous = self%solver%solve_seconds
      call self%solver%solve(x, error)
      self%solve_seconds = self%solve_seconds + (self%solver%solve_seconds - previous)
   end subroutine solve

#define SCALAR complex(wp)
#define MATRIX_TYPE complex_csr_matrix_type
#define SOLVER_TYPE complex_linear_solver_type
#define DIRECT_TYPE direct_complex_type
#define MUMPS_TYPE mumps_complex_type
#include "kschur_direct.inc"
end module kschur_direct_complex
