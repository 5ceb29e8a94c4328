!> Direct solver for real symmetric matrices, definite or without growth, by LDL^T over several processes. The first process calls
!> it; the others are in `kschur_joint_ldl_worker`.
module kschur_joint_ldl
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_singular, error_usage
   use kschur_joint_factors, only: joint_factors_type, pivot_counts_type
   use kschur_kinds, only: wp, long
   use kschur_last_analysis, only: analyze_once, last_analysis_type
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_memory, only: require_memory
   use kschur_monitor, only: ask_monitor
   use kschur_processes, only: processes_type, request_ldl
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: analyze, symbolic_type
   use kschur_text, only: text
   use kschur_tolerances, only: cancelled, rounding_of_sums
   use kschur_tree_shares, only: largest_share
   implicit none
   private
   public :: joint_ldl_type

   !> What is requested of the other processes.
   integer, parameter, public :: job_share = 1, job_factor = 2, job_count = 3, job_keep = 4, job_solve = 5, job_scale = 6, &
      job_end = 7

   !> Rejects what `ldl_real_type` rejects, with the same errors; accepts multipliers, whose pivots must be negative.
   type, extends(real_linear_solver_type) :: joint_ldl_type
      !> Several.
      type(processes_type), pointer :: processes => null()
      !> Analysis shared by successive solvers; not associated: each matrix is analysed.
      type(last_analysis_type), pointer :: last => null()
      integer, private :: number = 0
      type(joint_factors_type), allocatable, private :: part
      ! Target of `part` at its creation: a copy of this object has no factors.
      type(joint_factors_type), pointer, private :: made => null()
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
      procedure :: solve_rows
      procedure :: shared_as
      procedure :: absorb_scaling
      procedure :: estimate
      procedure :: forget_factors
      !> Bounds the number of negative eigenvalues, as `bound_negative_eigenvalues`; keeps no factors.
      procedure :: bound_negative
      final :: finalize
   end type joint_ldl_type

contains

   subroutine factorize(self, matrix, structure, error)
      class(joint_ldl_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(pivot_counts_type) :: counts
      integer(long) :: started

      call begin(self, matrix, structure, error)
      if (allocated(error)) return
      started = clock()
      call factor(self, 0, structure%singular, error)
      if (.not. allocated(error)) then
         call count_pivots(self, structure%multipliers > 0 .and. .not. structure%singular, counts)
         call examine_counts(counts, structure, error)
      end if
      self%factorize_seconds = seconds_since(started)
      if (allocated(error)) then
         call release(self)
         return
      end if
      call self%processes%send_request([request_ldl, self%number, job_keep])
      call self%part%drop_matrix()
      self%factor_bytes = counts%bytes
      self%null_pivots = 0
      self%replaced_pivots = counts%replaced
      self%negative_pivots = counts%negative
      self%description = "ldl: "//trim(kind_of(counts, structure))//", "// &
         text(int(self%factor_entries/max(matrix%rows, 1)))//" entries a column, on "//text(self%processes%number)//" processes"
   end subroutine factorize

   pure function kind_of(counts, structure) result(kind)
      type(pivot_counts_type), intent(in) :: counts
      type(matrix_structure_type), intent(in) :: structure
      character(len=20) :: kind

      kind = "symmetric definite"
      if (structure%multipliers > 0) then
         kind = "quasi-definite"
      else if (.not. structure%singular .and. counts%negative > 0 .and. counts%negative < counts%all) then
         kind = "symmetric indefinite"
      end if
   end function kind_of

   ! Checks signs and sizes of the pivots as `ldl_real_type` does.
   subroutine examine_counts(counts, structure, error)
      type(pivot_counts_type), intent(in) :: counts
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(inout) :: error

      associate (quasi_definite => structure%multipliers > 0)
         if (counts%zero > 0) then
            call new_error(error, error_singular, "a pivot of the matrix is zero")
         else if (structure%singular .and. quasi_definite .and. .not. counts%nulls_last) then
            call new_error(error, error_singular, "a pivot before one of a multiplier is zero")
         else if (quasi_definite .and. counts%negative_unknowns > 0) then
            call new_error(error, error_library, "the matrix is not quasi-definite")
         else if (quasi_definite .and. counts%positive_multipliers > 0) then
            call new_error(error, error_singular, "a pivot of the matrix is zero to rounding")
         else if (.not. (quasi_definite .or. structure%singular) .and. counts%have_grown) then
            call new_error(error, error_library, "the matrix is indefinite")
         end if
      end associate
   end subroutine examine_counts

   subroutine bound_negative(self, matrix, structure, least, most, error)
      class(joint_ldl_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(out) :: least, most
      type(error_type), allocatable, intent(out) :: error
      type(pivot_counts_type) :: counts
      integer(long) :: started

      least = 0
      most = matrix%rows
      call begin(self, matrix, structure, error)
      if (allocated(error)) return
      started = clock()
      call factor(self, -1, .false., error)
      if (.not. allocated(error)) then
         call count_pivots(self, .false., counts)
         if (counts%not_finite == 0) most = counts%not_positive
         if (most == structure%least_negative) then
            least = most
         else
            call factor(self, 1, .false., error)
            if (.not. allocated(error)) call count_pivots(self, .false., counts)
            if (.not. allocated(error) .and. counts%not_finite == 0) least = counts%negative
         end if
      end if
      self%factorize_seconds = seconds_since(started)
      call release(self)
   end subroutine bound_negative

   ! Analyses the matrix and shares it.
   subroutine begin(self, matrix, structure, error)
      class(joint_ldl_type), target, intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      type(symbolic_type) :: symbolic
      integer(long) :: started

      call release(self)
      if (matrix%rows /= matrix%columns) then
         call new_error(error, error_usage, "only a square matrix can be factored")
      else if (.not. structure%symmetric) then
         call new_error(error, error_usage, "the matrix is unsymmetric")
      end if
      call require_memory(3*matrix%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call ask_monitor(self%monitor, error)
      if (allocated(error)) return
      started = clock()
      call analyze_once(self%last, matrix, structure, huge(1), symbolic, error)
      if (.not. allocated(error)) then
         self%factor_entries = symbolic%factor_entries
         allocate (self%part)
         self%made => self%part
         self%processes%factorizations = self%processes%factorizations + 1
         self%number = self%processes%factorizations
         call self%processes%send_request([request_ldl, self%number, job_share])
         call self%part%share(self%processes, error, matrix, symbolic, structure%multipliers)
         if (allocated(error)) call release(self)
      end if
      self%analyze_seconds = seconds_since(started)
   end subroutine begin

   subroutine factor(self, side, singular, error)
      class(joint_ldl_type), intent(inout) :: self
      integer, intent(in) :: side
      !> As in `matrix_structure_type`.
      logical, intent(in) :: singular
      type(error_type), allocatable, intent(out) :: error

      call self%processes%send_request([request_ldl, self%number, job_factor, side, merge(1, 0, singular)])
      call self%part%factor(side, singular, error, self%monitor)
   end subroutine factor

   subroutine count_pivots(self, strict, counts)
      class(joint_ldl_type), intent(inout) :: self
      !> Whether pivots must be as large as those of quasi-definite factors, which grow with the reciprocal of the smallest one.
      logical, intent(in) :: strict
      type(pivot_counts_type), intent(out) :: counts

      call self%processes%send_request([request_ldl, self%number, job_count, merge(1, 0, strict)])
      call self%part%count_pivots(merge(cancelled, rounding_of_sums, strict), counts)
   end subroutine count_pivots

   subroutine solve(self, x, error)
      class(joint_ldl_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: started

      if (.not. owns(self)) then
         call new_error(error, error_usage, "a matrix must be factored before it can be solved with")
      else if (size(x, 1) /= self%part%n) then
         call new_error(error, error_usage, "the right-hand sides do not fit the factored matrix")
      end if
      if (allocated(error) .or. size(x, 2) == 0) return
      started = clock()
      call self%processes%send_request([request_ldl, self%number, job_solve, size(x, 2)])
      call self%part%solve(x, .false., error)
      self%solve_seconds = self%solve_seconds + seconds_since(started)
   end subroutine solve

   subroutine solve_rows(self, x, error)
      class(joint_ldl_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: started

      started = clock()
      call self%part%solve(x, .true., error)
      self%solve_seconds = self%solve_seconds + seconds_since(started)
   end subroutine solve_rows

   integer function shared_as(self)
      class(joint_ldl_type), intent(in) :: self

      shared_as = 0
      if (owns(self)) shared_as = self%number
   end function shared_as

   subroutine absorb_scaling(self, scaling, is_absorbed)
      class(joint_ldl_type), intent(inout) :: self
      real(wp), intent(in) :: scaling(:)
      logical, intent(out) :: is_absorbed

      is_absorbed = owns(self)
      if (.not. is_absorbed) return
      call self%processes%send_request([request_ldl, self%number, job_scale])
      call self%part%scale(scaling)
   end subroutine absorb_scaling

   subroutine estimate(self, pattern, structure, bytes, error)
      class(joint_ldl_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: pattern
      type(matrix_structure_type), intent(in) :: structure
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(symbolic_type) :: symbolic

      bytes = 0
      call require_memory(3*pattern%bytes(), "the elimination order", error)
      if (.not. allocated(error)) call analyze(pattern, structure, huge(1), symbolic, error)
      if (.not. allocated(error)) bytes = largest_share(symbolic, self%processes%number)
   end subroutine estimate

   ! Keeps nothing but what `last` has.
   subroutine forget_factors(self, kept)
      class(joint_ldl_type), intent(inout) :: self
      logical, intent(out) :: kept

      kept = .false.
      call release(self)
   end subroutine forget_factors

   ! Whether the factors are those of this object, not of one that it is a copy of.
   logical function owns(self)
      class(joint_ldl_type), target, intent(in) :: self

      owns = allocated(self%part)
      if (owns) owns = associated(self%made, self%part)
   end function owns

   ! Frees the factors in all processes.
   subroutine release(self)
      class(joint_ldl_type), intent(inout) :: self

      if (owns(self)) call self%processes%send_request([request_ldl, self%number, job_end])
      if (allocated(self%part)) deallocate (self%part)
      nullify (self%made)
   end subroutine release

   impure elemental subroutine finalize(self)
      type(joint_ldl_type), intent(inout) :: self

      call release(self)
   end subroutine finalize
end module kschur_joint_ldl
