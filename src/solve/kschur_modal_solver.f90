!> A solver that keeps what it finds out about a problem for its next solves, with other targets and bands or with other values of
!> the matrices (docs/theory.md, section 15).
module kschur_modal_solver
   use kschur_band, only: band_options, prepare_band, solve_band_prepared
   use kschur_band_groups, only: band_groups_type
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

   ! Inverse of the largest fraction of the unknowns, as modes, that influences no choice of the preparation.
   integer, parameter :: few_modes_part = 4

   !> Created by `new_modal_solver`. Only one thread at a time may use it; copies, made by assignment, are independent. The last
   !> factors of MUMPS stay in memory with the analysis of their pattern, until other factors are made or the solver is deallocated.
   type :: modal_solver_type
      private
      type(modal_problem_type), allocatable :: problem
      type(inner_solvers_type), allocatable :: solvers
      ! Prepared context, and the options and notes of its preparation; not allocated: nothing is prepared.
      type(solve_context_type), allocatable :: context
      ! Solvers with their analysis of the pattern, between solves.
      type(spare_solvers_type) :: spare
      type(modal_options_type) :: options
      character(len=note_length), allocatable :: notes(:)
      ! Whether it was prepared for bands.
      logical :: for_band = .false.
      ! Whether the values of the matrices have changed since the preparation.
      logical :: changed = .false.
   contains
      !> Computes the modes nearest to a target, as `solve_modes`.
      procedure :: solve
      !> Computes all modes of a band, as `solve_band`.
      procedure :: solve_band
      !> Replaces the matrices.
      procedure :: update_values
      !> Returns a copy of the problem with its current matrices.
      procedure :: current_problem
      !> Copies the solver without its analyses of patterns.
      generic :: assignment(=) => copy
      procedure, private :: copy
   end type modal_solver_type

contains

   !> Creates a solver for a problem, of which it keeps a copy.
   subroutine new_modal_solver(solver, problem, solvers)
      type(modal_solver_type), intent(out) :: solver
      type(modal_problem_type), intent(in) :: problem
      !> Linear solvers of the caller, as for `solve_modes`.
      type(inner_solvers_type), intent(in), optional :: solvers

      allocate (solver%problem, source=problem)
      if (present(solvers)) allocate (solver%solvers, source=solvers)
   end subroutine new_modal_solver

   !> Computes the modes nearest to a target, as `solve_modes`. Reuses from earlier solves what does not depend on the target:
   !> presolve, elimination order, rank of the constraints, rigid motions, scale of the modes. After `update_values`, prepares anew
   !> and solves once more if the search does not converge or a mode may be a new rigid motion.
   subroutine solve(self, options, result, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      integer :: threads_before
      integer(long) :: started
      logical :: is_outdated, dense_tells

      call enter_solve(options%threads, self%problem%unknowns(), threads_before, error)
      if (allocated(error)) then
         call leave_solve(threads_before)
         return
      end if
      started = clock()
      dense_tells = .false.
      do
         call make_ready(self, options, .false., is_outdated, error, monitor)
         if (.not. allocated(error)) dense_tells = dense_may_tell(self%context)
         if (.not. allocated(error)) call solve_prepared(self%context, options, result, error)
         if (allocated(error)) exit
         if (.not. is_outdated) exit
         if (result%reason == reason_cancelled) exit
         if (result%reason /= reason_converged .or. seems_rigid(self%context, result)) then
            ! The preparation may be invalid for the new values: there may be rigid motions now. Solve once more without it.
            deallocate (self%context)
         else
            exit
         end if
      end do
      if (.not. allocated(error) .and. dense_tells) call solve_again_dense(self%context, options, result)
      if (.not. allocated(error)) call keep_modes(self%context, result)
      call end_context(self, options, result, error)
      call result%set_total(seconds_since(started))
      call leave_solve(threads_before)
   end subroutine solve

   !> Computes all modes with first <= frequency_hz <= last, as `solve_band`. Prepares anew after `update_values`, as a band needs
   !> the exact number of zeros.
   subroutine solve_band(self, first, last, options, result, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      !> The edges (Hz), 0 <= first < last.
      real(wp), intent(in) :: first, last
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_options_type) :: settings
      type(band_groups_type) :: alone
      integer :: threads_before
      integer(long) :: started
      logical :: is_outdated

      call enter_solve(options%threads, self%problem%unknowns(), threads_before, error)
      if (allocated(error)) then
         call leave_solve(threads_before)
         return
      end if
      started = clock()
      call band_options(first, last, options, settings, error)
      ! A band needs the exact number of zeros, which new values may change.
      if (self%changed .and. allocated(self%context)) deallocate (self%context)
      if (.not. allocated(error)) call make_ready(self, settings, .true., is_outdated, error, monitor)
      if (.not. allocated(error)) call solve_band_prepared(self%context, first, last, settings, result, error, alone)
      call end_context(self, settings, result, error)
      call result%set_total(seconds_since(started))
      call leave_solve(threads_before)
   end subroutine solve_band

   ! Ends a solve. After a success the solvers with their analyses are moved out of the context, so that copies do not take them.
   ! After a failure the context is discarded; a solve cancelled before any mode was found succeeds with an empty result.
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

   !> Replaces the matrices of the problem. The preparation is kept if mass, constraints and kind of damping are the same, there is
   !> no loss matrix, no rigid motion, no redundant constraint, and no motion without mass. Fails as `new_modal_problem`, and on
   !> other numbers of unknowns or constraints; the problem is unchanged then.
   subroutine update_values(self, mass, stiffness, error, damping, constraints, symmetric, loss, mesh)
      class(modal_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: mass, stiffness
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type), intent(in), optional :: damping, constraints
      !> As for `new_modal_problem`.
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
         if (stays_valid(self%context, self%problem, problem)) then
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

   ! Copies all but the spare solvers: memory that MUMPS has allocated cannot be copied.
   subroutine copy(self, from)
      class(modal_solver_type), intent(inout) :: self
      type(modal_solver_type), intent(in) :: from
      type(modal_solver_type), allocatable :: copied

      allocate (copied)
      if (allocated(from%problem)) allocate (copied%problem, source=from%problem)
      if (allocated(from%solvers)) allocate (copied%solvers, source=from%solvers)
      if (allocated(from%context)) allocate (copied%context, source=from%context)
      if (allocated(from%notes)) allocate (copied%notes, source=from%notes)
      call move_alloc(copied%problem, self%problem)
      call move_alloc(copied%solvers, self%solvers)
      call move_alloc(copied%context, self%context)
      call move_alloc(copied%notes, self%notes)
      call self%spare%clear()
      self%options = from%options
      self%for_band = from%for_band
      self%changed = from%changed
   end subroutine copy

   ! Whether new damping is taken as general, as before, without a test for proportionality: the quadratic form is exact for any.
   logical function stays_general(self, damping)
      class(modal_solver_type), intent(in) :: self
      type(csr_matrix_type), intent(in), optional :: damping

      stays_general = allocated(self%context) .and. present(damping) .and. self%problem%damping_kind == damping_general
      if (stays_general) stays_general = self%context%formulation == formulation_quadratic .and. .not. damping%is_zero()
   end function stays_general

   ! Whether the preparation of a problem is valid for one with other values.
   logical function stays_valid(s, before, now)
      type(solve_context_type), intent(in) :: s
      type(modal_problem_type), intent(in) :: before, now

      associate (known => s%known)
         stays_valid = (before%symmetric .eqv. now%symmetric) .and. .not. (allocated(before%loss) .or. allocated(now%loss))
         stays_valid = stays_valid .and. before%damping_kind == now%damping_kind .and. s%formulation /= formulation_low_rank .and. &
            same_matrix(before%mass, now%mass) .and. same_matrix(before%constraints, now%constraints) .and. &
            s%plan%unknowns_after > 0 .and. known%redundant == 0 .and. .not. allocated(s%plan%replaced) .and. &
            size(known%rigid%lambda) == 0 .and. &
            known%deflation%not_deflated == 0 .and. known%deflation%infinite%multiplicity() == 0 .and. &
            (known%deflation%infinite_is_known .or. any(s%formulation == [formulation_symmetric, formulation_proportional]))
      end associate
   end function stays_valid

   ! Whether two matrices have the same pattern and values.
   pure logical function same_matrix(a, b)
      type(csr_matrix_type), intent(in) :: a, b

      same_matrix = same_pattern(a, b)
      if (same_matrix) same_matrix = all(.not. abs(a%value - b%value) > 0)
   end function same_matrix

   ! Makes the context ready for a solve with these options: reuses the preparation if it is valid for them, else begins anew. Fails
   ! on options that a solver that remembers does not support.
   subroutine make_ready(self, options, for_band, is_outdated, error, monitor)
      class(modal_solver_type), target, intent(inout) :: self
      type(modal_options_type), intent(in) :: options
      logical, intent(in) :: for_band
      !> Whether the preparation was made for other values of the matrices.
      logical, intent(out) :: is_outdated
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor

      is_outdated = .false.
      if (allocated(options%communicator)) then
         call new_error(error, error_usage, "a solver that remembers works in one process: leave out the communicator")
      else if (allocated(options%checkpoint) .or. allocated(options%resume)) then
         call new_error(error, error_usage, "a solver that remembers keeps no checkpoint: a solve of its own does")
      end if
      if (allocated(error)) return
      if (allocated(self%context)) then
         if (.not. is_prepared_for(self, options, for_band)) deallocate (self%context)
      end if
      if (allocated(self%context)) then
         is_outdated = self%changed
         self%context%problem => self%problem
         if (.not. (is_outdated .and. same_target(self%context%options, options)) .and. allocated(self%context%last)) &
            deallocate (self%context%last)
         if (options%modes /= self%context%options%modes) self%context%dimension = 0
         call resume(self%context, options, error, monitor)
         if (.not. allocated(error)) allocate (self%context%notes, source=self%notes)
         if (is_outdated .and. .not. allocated(error)) call reduce_again(self%context, error)
      else
         ! Spare solvers share an analysis with the solvers of the discarded context.
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

   ! Whether both targets are the same.
   pure logical function same_target(before, now)
      type(modal_options_type), intent(in) :: before, now

      same_target = .not. abs(before%target - now%target) > 0
   end function same_target

   ! Whether the preparation is valid for these options.
   logical function is_prepared_for(self, options, for_band)
      class(modal_solver_type), intent(in) :: self
      type(modal_options_type), intent(in) :: options
      logical, intent(in) :: for_band
      integer :: most_modes

      associate (s => self%context, o => self%options)
         is_prepared_for = self%for_band .eqv. for_band
         is_prepared_for = is_prepared_for .and. o%formulation == options%formulation .and. o%method == options%method .and. &
            o%arpack == options%arpack .and. o%inner == options%inner .and. (o%presolve .eqv. options%presolve) .and. &
            o%subspace == options%subspace .and. o%block == options%block .and. o%memory == options%memory .and. &
            (allocated(o%shift) .eqv. allocated(options%shift))
         ! The limit of memory may have chosen the inner solver for the options of before.
         is_prepared_for = is_prepared_for .and. s%options%inner == options%inner
         if (.not. is_prepared_for .or. o%modes == options%modes) return
         ! No choice of the preparation depended on the number of modes, if both are few.
         most_modes = max(o%modes, options%modes)
         is_prepared_for = .not. s%dense .and. s%formulation /= formulation_low_rank .and. &
            2*most_modes*few_modes_part < s%work%unknowns() - s%work%multipliers()
      end associate
   end function is_prepared_for

   ! Keeps the modes found for the start of the next iteration, if values change, and their scale for the next shift.
   subroutine keep_modes(s, result)
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
   end subroutine keep_modes

   ! Whether a mode is so low that it may be the zero of a rigid motion that was not searched for.
   pure logical function seems_rigid(s, result)
      type(solve_context_type), intent(in) :: s
      type(modal_result_type), intent(in) :: result

      seems_rigid = any(abs(result%eigenvalues) < seems_zero*s%reference())
   end function seems_rigid
end module kschur_modal_solver
