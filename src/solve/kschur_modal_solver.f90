!> A solver that remembers: what was found out about a problem serves the next solve, of other targets and bands or of
!> other values in the same matrices.
module kschur_modal_solver
   use kschur_band, only: band_options, prepare_band, solve_band_prepared
   use kschur_clock, only: clock, seconds_since
   use kschur_context, only: begin, resume, solve_context_type
   use kschur_dense_choice, only: dense_may_tell
   use kschur_error, only: error_type, new_error, error_input, error_usage, take_cancelled
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp, long
   use kschur_mesh, only: mesh_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_low_rank, formulation_proportional, &
      formulation_quadratic, formulation_symmetric
   use kschur_preparation, only: reduce_again
   use kschur_problem, only: modal_problem_type, new_modal_problem, damping_general
   use kschur_outcome, only: reason_cancelled, reason_converged
   use kschur_result, only: modal_result_type, note_length
   use kschur_shift, only: scale_of
   use kschur_solver, only: prepare, report_none, solve_again_dense, solve_prepared
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_sparse, only: csr_matrix_type, same_pattern
   use kschur_symmetric_storage, only: symmetric_check, symmetric_lower, symmetric_upper
   use kschur_threads, only: enter_solve, leave_solve
   use kschur_tolerances, only: seems_zero
   implicit none
   private
   public :: modal_solver_type, new_modal_solver

   ! Fewer modes than this part of the unknowns are few.
   integer, parameter :: few_part = 4

   !> Made by `new_modal_solver`. One thread at a time may use it; copies, made by assignment, remember for themselves.
   !> What MUMPS factored last stays in memory with the analysis of its pattern, until other factors are made or the solver
   !> goes.
   type :: modal_solver_type
      private
      type(modal_problem_type), allocatable :: problem
      type(inner_solvers_type), allocatable :: solvers
      ! What is prepared, with which options, and what was noted then; not allocated where nothing is.
      type(solve_context_type), allocatable :: context
      ! What its solvers know of the pattern, between solves.
      type(spare_solvers_type) :: spare
      type(modal_options_type) :: options
      character(len=note_length), allocatable :: notes(:)
      logical :: for_band = .false.
      ! Whether the values have changed since.
      logical :: changed = .false.
   contains
      !> The modes nearest to a target, as `solve_modes`.
      procedure :: solve
      !> All modes of a band, as `solve_band`.
      procedure :: solve_band
      !> Other values for the matrices.
      procedure :: update_values
      !> The problem as it is now.
      procedure :: current_problem
      !> A copy, without what its solvers know of the pattern.
      generic :: assignment(=) => copy
      procedure, private :: copy
   end type modal_solver_type

contains

   !> A solver for a problem, of which it keeps a copy.
   subroutine new_modal_solver(solver, problem, solvers)
      type(modal_solver_type), intent(out) :: solver
      type(modal_problem_type), intent(in) :: problem
      !> Linear solvers of the caller's own, as in `solve_modes`.
      type(inner_solvers_type), intent(in), optional :: solvers

      allocate (solver%problem, source=problem)
      if (present(solvers)) allocate (solver%solvers, source=solvers)
   end subroutine new_modal_solver

   !> The modes nearest to a target, as those of `solve_modes`. What does not depend on the target and is known from a
   !> solve before is not done again: presolve, order, rank of the constraints, rigid motions, the scale of the modes.
   subroutine solve(self, options, result, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      integer :: threads_before
      integer(long) :: started
      logical :: kept, dense_tells

      call enter_solve(options%threads, self%problem%unknowns(), threads_before, error)
      if (allocated(error)) then
         call leave_solve(threads_before)
         return
      end if
      started = clock()
      dense_tells = .false.
      do
         call make_ready(self, options, .false., kept, error, monitor)
         if (.not. allocated(error)) dense_tells = dense_may_tell(self%context)
         if (.not. allocated(error)) call solve_prepared(self%context, options, result, error)
         if (allocated(error)) exit
         if (.not. kept) exit
         if (result%reason == reason_cancelled) exit
         if (result%reason /= reason_converged .or. seems_rigid(self%context, result)) then
            ! What is kept may not hold any more: what had no rigid motions may have some now.
            deallocate (self%context)
         else
            exit
         end if
      end do
      if (.not. allocated(error) .and. dense_tells) call solve_again_dense(self%context, options, result)
      if (.not. allocated(error)) call remember(self%context, result)
      call end_context(self, options, result, error)
      call result%set_total(seconds_since(started))
      call leave_solve(threads_before)
   end subroutine solve

   !> All modes with first <= frequency_hz <= last, as those of `solve_band`.
   subroutine solve_band(self, first, last, options, result, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      !> The edges (Hz), 0 <= first < last.
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_options_type) :: own
      integer :: threads_before
      integer(long) :: started
      logical :: kept

      call enter_solve(options%threads, self%problem%unknowns(), threads_before, error)
      if (allocated(error)) then
         call leave_solve(threads_before)
         return
      end if
      started = clock()
      call band_options(first, last, options, own, error)
      ! Zeros are counted there.
      if (self%changed .and. allocated(self%context)) deallocate (self%context)
      if (.not. allocated(error)) call make_ready(self, own, .true., kept, error, monitor)
      if (.not. allocated(error)) call solve_band_prepared(self%context, first, last, own, result, error)
      call end_context(self, own, result, error)
      call result%set_total(seconds_since(started))
      call leave_solve(threads_before)
   end subroutine solve_band

   ! Nothing is kept of a solve that failed, or was ended before there was anything to be found. What solvers know goes where
   ! no copy takes it.
   subroutine end_context(self, options, result, error)
      class(modal_solver_type), intent(inout) :: self
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(inout) :: error
      logical :: cancelled

      if (.not. allocated(error)) then
         call self%context%spare%move_to(self%spare)
         return
      end if
      call take_cancelled(error, cancelled)
      if (cancelled) call report_none(self%context, options, result, error)
      if (allocated(self%context)) deallocate (self%context)
   end subroutine end_context

   !> Puts other matrices in the place of those of the problem. Where their patterns, mass and constraints are the same,
   !> there is no loss matrix, and nothing is rigid or without mass, what is known stays known. Fails as `new_modal_problem`,
   !> and on other numbers of unknowns or constraints; the problem stays as it was then.
   subroutine update_values(self, mass, stiffness, error, damping, constraints, symmetric, loss, mesh)
      class(modal_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: mass, stiffness
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type), intent(in), optional :: damping, constraints
      !> As that of `new_modal_problem`.
      integer, intent(in), optional :: symmetric
      type(csr_matrix_type), intent(in), optional :: loss
      !> Where the unknowns stand now, after `settle_mesh`; absent: as before.
      type(mesh_type), intent(in), optional :: mesh
      type(modal_problem_type), allocatable :: problem
      type(modal_problem_type) :: kind_of
      integer :: storage

      allocate (problem)
      storage = symmetric_check
      if (present(symmetric)) storage = symmetric
      if (stays_general(self, damping) .and. .not. (mass%is_zero() .or. present(loss))) then
         kind_of%damping_kind = damping_general
         kind_of%symmetric = any(storage == [symmetric_lower, symmetric_upper])
         if (.not. kind_of%symmetric) &
            kind_of%symmetric = mass%is_symmetric() .and. stiffness%is_symmetric() .and. damping%is_symmetric()
         call new_modal_problem(problem, mass, stiffness, error, damping, constraints, kind_of, storage)
      else
         call new_modal_problem(problem, mass, stiffness, error, damping, constraints, symmetric=storage, loss=loss)
      end if
      if (allocated(error)) return
      if (any([problem%unknowns(), problem%multipliers()] /= [self%problem%unknowns(), self%problem%multipliers()])) then
         call new_error(error, error_input, "the matrices have other numbers of unknowns or constraints than those before")
         return
      end if
      problem%index_base = self%problem%index_base
      if (present(mesh)) then
         allocate (problem%mesh, source=mesh)
      else if (allocated(self%problem%mesh)) then
         allocate (problem%mesh, source=self%problem%mesh)
      end if
      if (allocated(self%context)) then
         if (may_stay(self%context, self%problem, problem)) then
            self%changed = .true.
         else
            deallocate (self%context)
         end if
      end if
      call move_alloc(problem, self%problem)
   end subroutine update_values

   function current_problem(self) result(problem)
      class(modal_solver_type), intent(in) :: self
      type(modal_problem_type) :: problem

      problem = self%problem
   end function current_problem

   ! MUMPS has memory of its own, which nobody can copy.
   subroutine copy(self, from)
      class(modal_solver_type), intent(inout) :: self
      type(modal_solver_type), intent(in) :: from
      type(modal_solver_type), allocatable :: own

      allocate (own)
      if (allocated(from%problem)) allocate (own%problem, source=from%problem)
      if (allocated(from%solvers)) allocate (own%solvers, source=from%solvers)
      if (allocated(from%context)) allocate (own%context, source=from%context)
      if (allocated(from%notes)) allocate (own%notes, source=from%notes)
      call move_alloc(own%problem, self%problem)
      call move_alloc(own%solvers, self%solvers)
      call move_alloc(own%context, self%context)
      call move_alloc(own%notes, self%notes)
      call self%spare%clear()
      self%options = from%options
      self%for_band = from%for_band
      self%changed = from%changed
   end subroutine copy

   ! Whether the damping is taken for general, as it was: that is exact for any.
   logical function stays_general(self, damping)
      class(modal_solver_type), intent(in) :: self
      type(csr_matrix_type), intent(in), optional :: damping

      stays_general = allocated(self%context) .and. present(damping) .and. self%problem%damping_kind == damping_general
      if (stays_general) stays_general = self%context%formulation == formulation_quadratic .and. .not. damping%is_zero()
   end function stays_general

   ! Whether what was prepared of a problem holds for one with other values.
   logical function may_stay(s, before, now)
      type(solve_context_type), intent(in) :: s
      type(modal_problem_type), intent(in) :: before, now

      associate (known => s%known)
         may_stay = (before%symmetric .eqv. now%symmetric) .and. .not. (allocated(before%loss) .or. allocated(now%loss))
         may_stay = may_stay .and. before%damping_kind == now%damping_kind .and. s%formulation /= formulation_low_rank .and. &
            same_matrix(before%mass, now%mass) .and. same_matrix(before%constraints, now%constraints) .and. &
            s%plan%unknowns_after > 0 .and. known%redundant == 0 .and. .not. allocated(s%plan%replaced) .and. &
            size(known%rigid%lambda) == 0 .and. &
            known%deflation%not_deflated == 0 .and. known%deflation%infinite%multiplicity() == 0 .and. &
            (known%deflation%infinite_is_known .or. any(s%formulation == [formulation_symmetric, formulation_proportional]))
      end associate
   end function may_stay

   ! The same entries with the same values.
   pure logical function same_matrix(a, b)
      type(csr_matrix_type), intent(in) :: a, b

      same_matrix = same_pattern(a, b)
      if (same_matrix) same_matrix = all(.not. abs(a%value - b%value) > 0)
   end function same_matrix

   ! A context that is prepared for a solve with these options.
   subroutine make_ready(self, options, for_band, kept, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      type(modal_options_type), intent(in) :: options
      logical, intent(in) :: for_band
      !> Whether what is known is that of other values.
      logical, intent(out) :: kept
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor

      kept = .false.
      if (allocated(options%communicator)) then
         call new_error(error, error_usage, "a solver that remembers works in one process: leave out the communicator")
      else if (allocated(options%checkpoint) .or. allocated(options%resume)) then
         call new_error(error, error_usage, "a solver that remembers keeps no checkpoint: a solve of its own does")
      end if
      if (allocated(error)) return
      if (allocated(self%context)) then
         if (.not. serves(self, options, for_band)) deallocate (self%context)
      end if
      if (allocated(self%context)) then
         kept = self%changed
         self%context%problem => self%problem
         if (.not. (kept .and. same_target(self%context%options, options)) .and. allocated(self%context%last)) &
            deallocate (self%context%last)
         if (options%modes /= self%context%options%modes) self%context%dimension = 0
         call resume(self%context, options, error, monitor)
         if (.not. allocated(error)) allocate (self%context%notes, source=self%notes)
         if (kept .and. .not. allocated(error)) call reduce_again(self%context, error)
      else
         ! They share with others of the context before.
         call self%spare%clear()
         allocate (self%context)
         call begin(self%context, self%problem, options, error, monitor, self%solvers)
         self%context%remembers = .true.
         if (.not. allocated(error)) then
            if (for_band) then
               call prepare_band(self%context, error)
            else
               call prepare(self%context, error)
            end if
         end if
         if (allocated(error)) return
         self%notes = self%context%notes
         self%options = options
         self%for_band = for_band
      end if
      call self%spare%move_to(self%context%spare)
      self%changed = .false.
   end subroutine make_ready

   pure logical function same_target(before, now)
      type(modal_options_type), intent(in) :: before, now

      same_target = .not. abs(before%target - now%target) > 0
   end function same_target

   ! Whether what was prepared for other options is the same for these.
   logical function serves(self, options, for_band)
      class(modal_solver_type), intent(in) :: self
      type(modal_options_type), intent(in) :: options
      logical, intent(in) :: for_band
      integer :: most

      associate (s => self%context, o => self%options)
         serves = self%for_band .eqv. for_band
         serves = serves .and. o%formulation == options%formulation .and. o%method == options%method .and. &
            o%arpack == options%arpack .and. o%inner == options%inner .and. (o%presolve .eqv. options%presolve) .and. &
            o%subspace == options%subspace .and. o%block == options%block .and. &
            (allocated(o%shift) .eqv. allocated(options%shift))
         if (.not. serves .or. o%modes == options%modes) return
         ! Few enough that nothing was chosen by their number.
         most = max(o%modes, options%modes)
         serves = .not. s%dense .and. s%formulation /= formulation_low_rank .and. &
            2*most*few_part < s%work%unknowns() - s%work%multipliers()
      end associate
   end function serves

   ! The modes that were found, to begin with where the values change.
   subroutine remember(s, result)
      type(solve_context_type), intent(inout) :: s
      type(modal_result_type), intent(in) :: result
      type(eigenpairs_type) :: given

      if (allocated(s%last)) deallocate (s%last)
      if (size(result%eigenvalues) == 0 .or. s%plan%unknowns_after == 0) return
      s%scale = scale_of(result%eigenvalues, s%scale)
      allocate (given%lambda, source=result%eigenvalues)
      allocate (given%phi, source=result%eigenvectors)
      allocate (given%xi, source=result%multipliers)
      allocate (s%last, source=s%contract(given))
   end subroutine remember

   ! Whether a mode is so low that it may be a zero that nobody looked for.
   pure logical function seems_rigid(s, result)
      type(solve_context_type), intent(in) :: s
      type(modal_result_type), intent(in) :: result

      seems_rigid = any(abs(result%eigenvalues) < seems_zero*s%reference())
   end function seems_rigid
end module kschur_modal_solver
