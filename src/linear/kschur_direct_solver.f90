!> The direct solver for real matrices: looks at the matrix and takes LDL where
!> it is symmetric and definite, but for multipliers, else MUMPS, as for
!> what several processes factor together.
module kschur_direct_solver
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, add_context, error_cancelled, error_library, error_memory, &
      error_usage
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

   !> LDL or MUMPS; `description` says which and why.
   type, extends(real_linear_solver_type) :: direct_real_type
      !> One of `inner_*`. `inner_ldl` fails, with the reason, on a matrix that LDL is not made for.
      integer :: inner = inner_auto
      !> So many steps of refinement are taken by those who solve with it. Where some are, LDL may be less exact, as with a
      !> matrix that is nearly singular, and refines nothing itself.
      integer :: refinements = 0
      !> Who may factor a matrix together; not associated: this process alone.
      type(processes_type), pointer :: processes => null()
      !> What solvers share that factor one after the other; not associated: this one analyses each matrix.
      type(last_analysis_type), pointer :: last => null()
      class(real_linear_solver_type), allocatable, private :: solver
      ! The matrix, where solutions are refined; not allocated: they are not.
      type(csr_matrix_type), allocatable, private :: matrix
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint
      procedure :: solve_rows
      procedure :: shared_as
      procedure :: estimate
      procedure :: forget_factors
   end type direct_real_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(direct_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(mumps_real_type) :: mumps
      class(real_linear_solver_type), allocatable :: before
      type(matrix_structure_type) :: ordered
      character(len=len(self%description)) :: reason
      real(wp) :: spent
      integer(long) :: started
      logical :: kept

      call move_alloc(self%solver, before)
      if (allocated(self%matrix)) deallocate (self%matrix)
      started = clock()
      reason = "as asked"
      ordered = structure
      if (structure%singular .and. (self%inner == inner_mumps .or. are_several(self%processes, matrix%rows))) then
         call new_error(error, error_usage, "MUMPS would take other pivots")
         return
      else if (self%inner == inner_auto .and. are_several(self%processes, matrix%rows)) then
         reason = text(self%processes%number)//" processes factor it"
      else if (self%inner /= inner_mumps) then
         ! LDL may need the memory of other factors.
         if (structure%symmetric .and. allocated(before)) then
            call before%forget_factors(kept)
            deallocate (before)
         end if
         ! What LDL refuses MUMPS takes in the same order.
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
      if (associated(self%last)) call self%last%drop_room()
      spent = seconds_since(started)
      ! MUMPS may know the pattern.
      if (allocated(before)) then
         if (.not. same_type_as(before, mumps)) deallocate (before)
      end if
      if (.not. allocated(before)) then
         mumps%processes => self%processes
         allocate (before, source=mumps)
      end if
      before%monitor => self%monitor
      call before%factorize(matrix, ordered, error)
      if (allocated(error)) return
      call move_alloc(before, self%solver)
      call weigh_refinement(self, matrix, ordered, error)
      call report(self, spent, "mumps: "//reason)
   end subroutine factorize

   ! Constraints that are independent only just, as a choice of redundant ones, lose digits in rows that pivots mix.
   subroutine weigh_refinement(self, matrix, structure, error)
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
      ! Their signs are no better known.
      self%solver%negative_pivots = -1
   end subroutine weigh_refinement

   ! Leaves the solver allocated where LDL did it.
   subroutine try_ldl(self, matrix, structure, error)
      class(direct_real_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      class(real_linear_solver_type), allocatable :: ldl
      type(quasi_definite_type) :: compliant
      type(ldl_real_type) :: plain
      real(wp) :: backward_error

      if (structure%multipliers > 0 .and. self%refinements == 0) then
         if (self%inner == inner_auto) compliant%most_entries = low_fill
         compliant%last => self%last
         allocate (ldl, source=compliant)
      else
         plain%quasi_definite = structure%multipliers > 0
         plain%last => self%last
         allocate (ldl, source=plain)
      end if
      ldl%monitor => self%monitor
      call ldl%factorize(matrix, structure, error)
      if (.not. allocated(error)) &
         call try_solver(ldl, matrix, structure%multipliers, backward_error, error, self%refinements)
      if (allocated(error)) return
      if (backward_error > accepted_backward_error) then
         call new_error(error, error_library, "a trial solution has a large residual")
      else
         call move_alloc(ldl, self%solver)
      end if
   end subroutine try_ldl

   ! What LDL knows is elsewhere.
   subroutine forget_factors(self, kept)
      class(direct_real_type), intent(inout) :: self
      logical, intent(out) :: kept

      kept = allocated(self%solver)
      if (.not. kept) return
      call self%solver%forget_factors(kept)
      self%solver%solve_seconds = 0
   end subroutine forget_factors

   ! Of the solver that is tried first, as it does it as a rule.
   subroutine estimate(self, pattern, structure, bytes, error)
      class(direct_real_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(ldl_real_type) :: ldl
      type(quasi_definite_type) :: quasi_definite
      type(mumps_real_type) :: mumps

      if (self%inner == inner_mumps .or. .not. structure%symmetric .or. are_several(self%processes, pattern%rows)) then
         mumps%processes => self%processes
         call mumps%estimate(pattern, structure, bytes, error)
      else if (structure%multipliers > 0 .and. self%refinements == 0) then
         call quasi_definite%estimate(pattern, structure, bytes, error)
      else
         call ldl%estimate(pattern, structure, bytes, error)
      end if
   end subroutine estimate

   ! What is known of the factors; `spent` seconds went into the order or an attempt before.
   subroutine report(self, spent, description)
      class(direct_real_type), intent(inout) :: self
      real(wp), intent(in) :: spent
      character(len=*), intent(in) :: description

      self%analyze_seconds = spent + self%solver%analyze_seconds
      self%factorize_seconds = self%solver%factorize_seconds
      self%solve_seconds = self%solve_seconds + self%solver%solve_seconds
      self%factor_entries = self%solver%factor_entries
      self%factor_bytes = self%solver%factor_bytes
      self%null_pivots = self%solver%null_pivots
      self%negative_pivots = self%solver%negative_pivots
      self%determinant = self%solver%determinant
      self%description = description
   end subroutine report

   subroutine solve(self, x, error)
      class(direct_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: before

      call check_factored(self, error)
      if (allocated(error)) return
      before = self%solver%solve_seconds
      if (allocated(self%matrix)) then
         call solve_and_refine(self%solver, self%matrix, x, error)
      else
         call self%solver%solve(x, error)
      end if
      self%solve_seconds = self%solve_seconds + (self%solver%solve_seconds - before)
   end subroutine solve

   subroutine solve_adjoint(self, x, error)
      class(direct_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: before

      call check_factored(self, error)
      if (allocated(error)) return
      before = self%solver%solve_seconds
      call self%solver%solve_adjoint(x, error)
      self%solve_seconds = self%solve_seconds + (self%solver%solve_seconds - before)
   end subroutine solve_adjoint

   subroutine solve_rows(self, x, error)
      class(direct_real_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: before

      call check_factored(self, error)
      if (allocated(error)) return
      before = self%solver%solve_seconds
      call self%solver%solve_rows(x, error)
      self%solve_seconds = self%solve_seconds + (self%solver%solve_seconds - before)
   end subroutine solve_rows

   integer function shared_as(self)
      class(direct_real_type), intent(in) :: self

      shared_as = 0
      if (allocated(self%solver)) shared_as = self%solver%shared_as()
   end function shared_as

   subroutine check_factored(self, error)
      class(direct_real_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error

      if (.not. allocated(self%solver)) call new_error(error, error_usage, &
         "a matrix must be factored before it can be solved with")
   end subroutine check_factored
end module kschur_direct_solver
