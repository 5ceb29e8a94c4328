!> Factors of real matrices in single precision, with which solutions are refined: half of the memory.
module kschur_single_factors
   use kschur_error, only: error_type, new_error, error_cancelled, error_library, error_memory, error_usage
   use kschur_kinds, only: wp
   use kschur_last_analysis, only: last_analysis_type
   use kschur_ldl, only: ldl_real_type
   use kschur_linear_solver, only: real_linear_solver_type, matrix_structure_type
   use kschur_mumps_single_real, only: mumps_single_real_type
   use kschur_processes, only: are_several, processes_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: above_all_single_rounding
   use kschur_trial_solution, only: try_solver
   implicit none
   private
   public :: single_factors_type

   !> LDL^T, computed in double precision and rounded, of symmetric matrices that are definite but for multipliers, with the
   !> inertia; of all others MUMPS in single precision, without. `description` says which.
   type, extends(real_linear_solver_type) :: single_factors_type
      !> Processes that may factor jointly; not associated: this one alone.
      type(processes_type), pointer :: processes => null()
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      type(ldl_real_type), private :: ldl
      type(mumps_single_real_type), private :: mumps
      logical, private :: by_ldl = .false.
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: estimate
   end type single_factors_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(single_factors_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      logical :: kept

      self%mumps = mumps_single_real_type()
      call try_ldl(self, matrix, structure, error)
      self%by_ldl = .not. allocated(error)
      if (allocated(error)) then
         call self%ldl%forget_factors(kept)
         ! MUMPS would take other pivots than those of a singular matrix.
         if (structure%singular .or. any(error%code == [error_memory, error_cancelled])) return
         deallocate (error)
         self%mumps%processes => self%processes
         self%mumps%monitor => self%monitor
         call self%mumps%factorize(matrix, structure, error)
         call report(self, self%mumps)
         self%analyze_seconds = self%analyze_seconds + self%ldl%analyze_seconds
         self%factorize_seconds = self%factorize_seconds + self%ldl%factorize_seconds
      else
         call report(self, self%ldl)
      end if
   end subroutine factorize

   ! Factors by LDL; fails with the reason if that does not fit. No zero pivots are replaced: rounding would hide what they stand
   ! for.
   subroutine try_ldl(self, matrix, structure, error)
      class(single_factors_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(matrix_structure_type) :: regular
      real(wp) :: backward_error

      self%ldl%analyze_seconds = 0
      self%ldl%factorize_seconds = 0
      if (are_several(self%processes, matrix%rows)) then
         call new_error(error, error_usage, "several processes factor the matrix")
         return
      end if
      self%ldl%rounded = .true.
      self%ldl%quasi_definite = structure%multipliers > 0
      self%ldl%last => self%last
      self%ldl%monitor => self%monitor
      regular = structure
      regular%singular = .false.
      call self%ldl%factorize(matrix, regular, error)
      if (allocated(error) .or. structure%multipliers == 0) return
      ! Pivots of multipliers may grow, and lose digits and signs.
      call try_solver(self%ldl, matrix, structure%multipliers, backward_error, error)
      if (.not. allocated(error) .and. .not. backward_error <= above_all_single_rounding) &
         call new_error(error, error_library, "a trial solution has a large residual")
   end subroutine try_ldl

   ! Copies statistics of the factors.
   subroutine report(self, solver)
      class(single_factors_type), intent(inout) :: self
      class(real_linear_solver_type), intent(in) :: solver

      self%analyze_seconds = solver%analyze_seconds
      self%factorize_seconds = solver%factorize_seconds
      self%factor_entries = solver%factor_entries
      self%factor_bytes = solver%factor_bytes
      self%null_pivots = solver%null_pivots
      self%negative_pivots = solver%negative_pivots
      self%description = solver%description
   end subroutine report

   ! Estimate for the factors that are tried first.
   subroutine estimate(self, pattern, structure, bytes, error)
      class(single_factors_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(ldl_real_type) :: ldl
      type(mumps_single_real_type) :: mumps

      if (structure%symmetric .and. .not. are_several(self%processes, pattern%rows)) then
         ldl%rounded = .true.
         call ldl%estimate(pattern, structure, bytes, error)
      else
         mumps%processes => self%processes
         call mumps%estimate(pattern, structure, bytes, error)
      end if
   end subroutine estimate

   subroutine solve(self, x, error)
      class(single_factors_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (self%by_ldl) then
         call self%ldl%solve(x, error)
      else
         call self%mumps%solve(x, error)
      end if
   end subroutine solve

   subroutine solve_adjoint(self, x, error)
      class(single_factors_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (self%by_ldl) then
         call self%ldl%solve_adjoint(x, error)
      else
         call self%mumps%solve_adjoint(x, error)
      end if
   end subroutine solve_adjoint
end module kschur_single_factors
