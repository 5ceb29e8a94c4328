!> Solver that computes the inertia of real symmetric matrices only.
module kschur_inertia_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, error_cancelled, error_memory, new_error, error_usage
   use kschur_joint_ldl, only: joint_ldl_type
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: analyze_once, last_analysis_type
   use kschur_ldl, only: ldl_real_type
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_processes, only: are_several, processes_type
   use kschur_proved_inertia, only: bound_negative_eigenvalues
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: analyze, symbolic_type
   use kschur_tolerances, only: above_all_rounding
   use kschur_trial_solution, only: try_solver
   implicit none
   private
   public :: inertia_real_type

   !> Sets `negative_pivots`, proved by LDL^T without pivoting. If an eigenvalue near zero or growth of the factor prevents the
   !> proof, MUMPS counts; `description` says which. -1 if a trial solution shows that the
   !> pivots are rounding errors. Keeps no factors: solving is an error (error_usage).
   type, extends(real_linear_solver_type) :: inertia_real_type
      !> Processes that may factor jointly; not associated: this one alone.
      type(processes_type), pointer :: processes => null()
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      !> Whether MUMPS, whose factors take memory, must not count what LDL^T leaves unproved.
      logical :: by_proof_alone = .false.
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
      procedure :: estimate
   end type inertia_real_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(inertia_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(mumps_real_type) :: mumps
      logical :: proved
      real(wp) :: backward_error, spent

      self%analyze_seconds = 0
      self%factorize_seconds = 0
      call prove(self, matrix, structure, proved, error)
      if (proved .or. allocated(error)) return
      if (self%by_proof_alone) then
         self%negative_pivots = -1
         self%description = "ldl: the inertia is not proved"
         return
      end if
      spent = self%factorize_seconds
      mumps%processes => self%processes
      mumps%monitor => self%monitor
      call mumps%factorize(matrix, structure, error)
      self%description = mumps%description
      self%analyze_seconds = self%analyze_seconds + mumps%analyze_seconds
      self%factorize_seconds = spent + mumps%factorize_seconds
      self%factor_entries = mumps%factor_entries
      self%null_pivots = mumps%null_pivots
      self%negative_pivots = mumps%negative_pivots
      if (allocated(error) .or. structure%multipliers == 0 .or. are_several(self%processes, matrix%rows)) return
      ! Pivots of an inaccurate factorisation may have wrong signs.
      call try_solver(mumps, matrix, structure%multipliers, backward_error, error)
      if (.not. backward_error <= above_all_rounding) self%negative_pivots = -1
   end subroutine factorize

   ! Bounds the number of negative eigenvalues by LDL, of one process or of several jointly: `proved` if the bounds agree. Not
   ! proved, without an error, if LDL does not handle the matrix.
   subroutine prove(self, matrix, structure, proved, error)
      class(inertia_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      logical, intent(out) :: proved
      type(error_type), allocatable, intent(out) :: error
      type(joint_ldl_type) :: joint
      type(symbolic_type) :: symbolic
      integer(long) :: started, entries
      integer :: least, most

      proved = .false.
      if (are_several(self%processes, matrix%rows)) then
         joint%processes => self%processes
         joint%last => self%last
         joint%monitor => self%monitor
         call joint%bound_negative(matrix, structure, least, most, error)
         self%analyze_seconds = joint%analyze_seconds
         self%factorize_seconds = joint%factorize_seconds
         entries = joint%factor_entries
      else
         if (.not. structure%symmetric .or. matrix%rows /= matrix%columns) return
         started = clock()
         call analyze_once(self%last, matrix, structure, huge(1), symbolic, error)
         self%analyze_seconds = seconds_since(started)
         started = clock()
         if (.not. allocated(error)) call bound_negative_eigenvalues(matrix, symbolic, structure%least_negative, least, most, &
            error, self%monitor)
         self%factorize_seconds = seconds_since(started)
         entries = symbolic%factor_entries
      end if
      if (allocated(error)) then
         if (all(error%code /= [error_memory, error_cancelled])) deallocate (error)
         return
      end if
      proved = least == most
      self%description = "ldl: the inertia is proved"
      self%factor_entries = entries
      self%null_pivots = 0
      self%negative_pivots = least
   end subroutine prove

   subroutine estimate(self, pattern, structure, bytes, error)
      class(inertia_real_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(joint_ldl_type) :: joint
      type(ldl_real_type) :: ldl
      type(mumps_real_type) :: mumps
      type(symbolic_type) :: symbolic

      if (structure%symmetric .and. are_several(self%processes, pattern%rows)) then
         joint%processes => self%processes
         call joint%estimate(pattern, structure, bytes, error)
      else if (structure%symmetric .and. (self%by_proof_alone .or. structure%multipliers == 0)) then
         ! L is not stored, unless the bounds differ, which they rarely do without multipliers.
         bytes = 0
         call analyze(pattern, structure, huge(1), symbolic, error)
         if (.not. allocated(error)) bytes = symbolic%bytes(of_entry=0.0_wp)
      else if (structure%symmetric) then
         call ldl%estimate(pattern, structure, bytes, error)
      else
         mumps%processes => self%processes
         call mumps%estimate(pattern, structure, bytes, error)
      end if
   end subroutine estimate

   subroutine solve(self, x, error)
      class(inertia_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, untouched => x)
      end associate
      call new_error(error, error_usage, "a solver that only counts has no factors to solve with")
   end subroutine solve
end module kschur_inertia_solver
