!> State of one solve: all steps share it, and each changes its own part.
module kschur_context
   use kschur_checkpoint, only: checkpoint_type
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_eliminated_multipliers, only: expand_multipliers
   use kschur_error, only: error_type, error_memory, error_usage, new_error
   use kschur_examination, only: examination_type
   use kschur_formulation, only: choose_formulation
   use kschur_solver_choice, only: choose_inner_solvers, inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_last_analysis, only: last_analysis_type
   use kschur_linear_solver, only: linear_solver_type
   use kschur_memory, only: complex_bytes
   use kschur_memory_estimate, only: check_memory
   use kschur_monitor, only: ask_monitor, monitor_type
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, inner_auto, inner_iterative
   use kschur_presolve, only: presolve_type
   use kschur_problem, only: modal_problem_type, refuse_loss
   use kschur_processes, only: processes_type
   use kschur_result, only: append_note, note_length
   use kschur_row_problem, only: all_three, row_problem_type
   use kschur_shared_problem, only: shared_problem_type
   use kschur_scaling, only: first_scale
   use kschur_settings, only: check_options, settings_of
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: begin, resume, solve_context_type

   !> Which whole matrices the first process holds beside the rows that all processes have: those of the problem as given, those of
   !> the iterated problem, or both.
   integer, parameter, public :: whole_given = 1, whole_iterated = 2, whole_both = 3

   !> Its variables must be targets, because a transform points to their components.
   type :: solve_context_type
      !> The request: problem as given, options as the method sets them, linear solvers, monitor.
      type(modal_problem_type), pointer :: problem => null()
      !> Where that is an undamped problem whose modes are to be those of a damped one, this one; else not associated.
      type(modal_problem_type), pointer :: damped => null()
      !> Distributed owner of the problem, which can free its whole matrices; not associated: they stay.
      type(shared_problem_type), pointer :: shared => null()
      !> Norms of its matrices, by `norms_of`; not allocated unless it is distributed.
      real(wp), allocatable :: norms(:)
      type(modal_options_type) :: options
      type(inner_solvers_type) :: inner
      !> Symbolic analysis and memory that these solvers share.
      type(last_analysis_type) :: last_analysis
      class(monitor_type), pointer :: monitor => null()
      !> Checkpoint that saves the state of iterations; not associated: none.
      type(checkpoint_type), pointer :: checkpoint => null()
      !> Processes of the solve; not associated: this one alone.
      type(processes_type), pointer :: processes => null()
      !> One of `formulation_*`; `decision` says why it was chosen.
      integer :: formulation = formulation_auto
      !> Whether all eigenvalues are computed from its dense matrix, instead of some by iteration.
      logical :: dense = .false.
      !> Whether `formulation_auto` may choose that: the linear solvers are the library's, and no band is requested.
      logical :: may_be_dense = .false.
      character(len=:), allocatable :: decision
      !> The iterated problem, reduced by presolve and balanced; `plan` leads back to the problem as given.
      type(modal_problem_type) :: work
      !> Its matrices for products, distributed by rows; not allocated before they are examined or factored, nor at the end.
      type(row_problem_type), allocatable :: matrices
      type(presolve_type) :: plan
      !> What the examination found out; its rigid motions are those of the problem as given.
      type(examination_type) :: known
      !> The factored formulation, and the shift of the factors (1/s).
      class(transform_type), allocatable :: transform
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      !> Solvers of earlier transforms, for the next one.
      type(spare_solvers_type) :: spare
      !> Whether another solve may follow, so that these solvers are kept.
      logical :: remembers = .false.
      !> Block size of the last iteration.
      integer :: block = 1
      !> Observed scale of the lowest modes (1/s); 0: not yet observed.
      real(wp) :: scale = 0
      !> Modes of the iterated problem from a solve of a similar one, with which to start; not allocated: none.
      type(eigenpairs_type), allocatable :: last
      !> Dimension of the Krylov space at which an iteration that starts with them should converge; 0: not known.
      integer :: dimension = 0
      !> Effort of the whole solve.
      type(effort_type) :: effort
      character(len=note_length), allocatable :: notes(:)
   contains
      !> Appends a sentence to the notes.
      procedure :: add_note
      !> Memory of a number of complex shapes with their multipliers (bytes).
      procedure :: bytes_of_shapes
      !> Expands shapes and multipliers of the iterated problem to those of the problem as given. Restores its whole matrices if
      !> multipliers of eliminated constraints follow from them.
      procedure :: expand
      !> Restricts shapes and multipliers of the problem as given to those of the iterated problem.
      procedure :: contract
      !> Distributes M, R and K of the iterated problem to the processes, once for all shifts.
      procedure :: share_matrices
      !> Restores the selected whole matrices in the first process and frees the others. Does nothing with one process.
      procedure :: hold
      !> Tells the monitor the next phase, and holds the matrices that it needs.
      procedure :: announce_phase
      !> Likewise, but fails if the monitor cancels the solve.
      procedure :: enter_phase
      !> Whether the monitor cancels the solve.
      procedure :: is_stopped => is_solve_stopped
      !> Whether there are no modes but rigid motions and their decays, or no unknowns at all.
      procedure :: only_rigid
      !> Whether the problem has a loss matrix H: then eigenvalues below the real axis are no modes.
      procedure :: is_lossy
      !> Size of eigenvalues (1/s), relative to which zeros are recognised: the shift, else the observed scale, else an estimate.
      procedure :: reference
      !> Ends a step, and adds its time to a phase of the effort.
      procedure :: end_step
      !> Begins a step without ending one: for use after solvers whose times are still to be added have changed.
      procedure :: begin_step
      !> Frees the transform with its factors, and adds their effort; keeps the solver's analysis.
      procedure :: drop_transform
      !> Likewise for the factored stiffness of the examination.
      procedure :: drop_stiffness
   end type solve_context_type

contains

   !> Begins a solve: checks options and memory, and chooses solvers and formulation. If only factors in single precision stay below
   !> the limit of memory, chooses these.
   subroutine begin(s, problem, options, error, monitor, solvers, processes)
      type(solve_context_type), target, intent(out) :: s
      type(modal_problem_type), target, intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, optional, intent(inout) :: monitor
      !> Linear solvers of the caller.
      type(inner_solvers_type), intent(in), optional :: solvers
      !> Absent: this process works alone.
      type(processes_type), target, intent(in), optional :: processes

      call s%begin_step()
      allocate (s%notes(0))
      s%problem => problem
      if (present(processes)) s%processes => processes
      if (present(monitor)) s%monitor => monitor
      call check_options(options, error)
      if (.not. allocated(error) .and. problem%unknowns() == 0) &
         call new_error(error, error_usage, "the problem has no matrices")
      if (.not. allocated(error)) call choose_inner_solvers(options, s%inner, error, solvers, s%processes)
      if (allocated(error)) return
      s%options = settings_of(options)
      call check_memory(problem, options, s%inner, error)
      if (allocated(error) .and. options%inner == inner_auto .and. .not. (present(solvers) .or. allocated(problem%loss))) &
         call choose_single_factors(s, problem, options, error)
      if (allocated(error)) return
      call s%inner%set_monitor(s%monitor)
      call s%inner%set_last_analysis(s%last_analysis)
      if (s%is_lossy()) call check_lossy(s, options, error)
      if (allocated(error)) return
      call choose_formulation(problem, s%options%formulation, s%formulation, s%decision, error, s%inner, s%effort, &
         s%known%mass_bound)
      if (allocated(error)) return
      s%may_be_dense = .not. present(solvers)
      s%dense = options%formulation == formulation_dense
      if (s%options%formulation /= options%formulation) s%decision = "it is the one that plain ARPACK iterates"
   end subroutine begin

   ! Chooses factors in single precision if a solve with these stays below the limit of memory; clears the error then.
   subroutine choose_single_factors(s, problem, options, error)
      type(solve_context_type), intent(inout) :: s
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      !> Says that the estimate with other factors exceeds it.
      type(error_type), allocatable, intent(inout) :: error
      type(modal_options_type) :: changed
      type(error_type), allocatable :: failed

      if (error%code /= error_memory) return
      changed = options
      changed%inner = inner_iterative
      call choose_inner_solvers(changed, s%inner, failed, processes=s%processes)
      if (.not. allocated(failed)) call check_memory(problem, changed, s%inner, failed)
      if (allocated(failed)) return
      deallocate (error)
      s%options%inner = inner_iterative
      call s%add_note("the factors are in single precision, as by estimate those in double precision exceed the limit of "// &
         "memory; solutions are refined")
   end subroutine choose_single_factors

   ! Fails on options that do not support a loss matrix, and mirrors the target to above the real axis.
   subroutine check_lossy(s, options, error)
      type(solve_context_type), intent(inout) :: s
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(inout) :: error

      if (options%inner == inner_iterative) call refuse_loss(s%problem, "an iterative inner solver", error)
      if (allocated(error)) return
      ! The modes lie above the axis; their conjugates are as near to the mirrored target.
      s%options%target = cmplx(real(options%target, wp), abs(aimag(options%target)), wp)
   end subroutine check_lossy

   !> Begins another solve in a prepared context, with options for which the preparation is valid.
   subroutine resume(s, options, error, monitor)
      type(solve_context_type), target, intent(inout) :: s
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, optional, intent(inout) :: monitor

      call check_options(options, error)
      if (.not. allocated(error)) call check_memory(s%problem, options, s%inner, error)
      if (allocated(error)) return
      ! In a copied context they point to the matrices of the original.
      if (allocated(s%matrices)) deallocate (s%matrices)
      nullify (s%monitor)
      if (present(monitor)) s%monitor => monitor
      call s%inner%set_monitor(s%monitor)
      call s%inner%set_last_analysis(s%last_analysis)
      s%options = settings_of(options)
      s%effort = effort_type()
      call s%begin_step()
      s%shift = 0
   end subroutine resume

   subroutine add_note(self, sentence)
      class(solve_context_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      call append_note(self%notes, sentence)
   end subroutine add_note

   pure real(wp) function bytes_of_shapes(self, shapes)
      class(solve_context_type), intent(in) :: self
      integer, intent(in) :: shapes

      bytes_of_shapes = complex_bytes*shapes*(real(self%problem%unknowns(), wp) + self%problem%multipliers())
   end function bytes_of_shapes

   ! Maps pairs of the iterated problem to the problem as given, with their multipliers.
   subroutine expand(self, pairs, error)
      class(solve_context_type), intent(inout) :: self
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), allocatable :: xi(:, :)

      if (associated(self%shared) .and. self%plan%eliminated > 0 .and. size(pairs%lambda) > 0) &
         call self%shared%bring_back(self%processes, error)
      if (allocated(error)) return
      call self%plan%expand_shapes(pairs)
      call self%plan%expand_reactions(pairs%xi)
      allocate (xi(self%problem%multipliers(), size(pairs%lambda)))
      call expand_multipliers(self%plan, self%problem, pairs, xi)
      call move_alloc(xi, pairs%xi)
   end subroutine expand

   ! Restricts pairs of the problem as given to the iterated problem.
   function contract(self, given) result(pairs)
      class(solve_context_type), intent(in) :: self
      class(eigenpairs_type), intent(in) :: given
      type(eigenpairs_type) :: pairs
      integer :: j

      allocate (pairs%lambda, source=given%lambda)
      allocate (pairs%phi(self%plan%unknowns_after, size(pairs%lambda)), &
         pairs%xi(self%plan%constraints_after, size(pairs%lambda)))
      do j = 1, size(pairs%lambda)
         call self%plan%contract(given%column(j), given%xi(:, j), pairs%phi(:, j), pairs%xi(:, j))
      end do
      if (given%is_real()) call pairs%make_real()
   end function contract

   subroutine share_matrices(self, error)
      class(solve_context_type), target, intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      if (allocated(self%matrices)) return
      allocate (self%matrices)
      call self%matrices%share(self%work%mass, self%work%damping, self%work%stiffness, self%processes, error)
   end subroutine share_matrices

   ! Restores in the first process the whole matrices that `whole` names, and frees the others.
   subroutine hold(self, whole, error)
      class(solve_context_type), intent(inout) :: self
      !> One of `whole_*`.
      integer, intent(in) :: whole
      !> Set if memory is short.
      type(error_type), allocatable, intent(inout) :: error
      logical :: given

      given = any(whole == [whole_given, whole_both])
      if (associated(self%shared) .and. .not. given) call self%shared%put_away(self%processes)
      if (allocated(self%matrices)) then
         if (whole /= whole_given) then
            call self%matrices%bring_back(all_three, error)
         else if (associated(self%shared)) then
            call self%matrices%put_away(all_three)
         end if
      end if
      if (associated(self%shared) .and. given) call self%shared%bring_back(self%processes, error)
   end subroutine hold

   ! Tells the monitor the next phase, and holds the matrices that it needs.
   subroutine announce_phase(self, phase, whole, error)
      class(solve_context_type), intent(inout) :: self
      !> "factorisation", "iteration", ...
      character(len=*), intent(in) :: phase
      !> As for `hold`; absent: unchanged.
      integer, intent(in), optional :: whole
      type(error_type), allocatable, intent(inout), optional :: error

      if (associated(self%monitor)) call self%monitor%begins(phase)
      if (present(whole)) call self%hold(whole, error)
   end subroutine announce_phase

   ! Announces a phase, and fails if the monitor cancels the solve.
   subroutine enter_phase(self, phase, error, whole)
      class(solve_context_type), intent(inout) :: self
      character(len=*), intent(in) :: phase
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: whole

      call self%announce_phase(phase, whole, error)
      if (.not. allocated(error)) call ask_monitor(self%monitor, error)
   end subroutine enter_phase

   logical function is_solve_stopped(self)
      class(solve_context_type), intent(in) :: self

      is_solve_stopped = .false.
      if (associated(self%monitor)) is_solve_stopped = self%monitor%stops()
   end function is_solve_stopped

   pure logical function only_rigid(self)
      class(solve_context_type), intent(in) :: self

      only_rigid = self%plan%unknowns_after == 0 .or. &
         (self%known%total%number == size(self%known%rigid%lambda) .and. .not. self%options%is_plain())
   end function only_rigid

   pure logical function is_lossy(self)
      class(solve_context_type), intent(in) :: self

      is_lossy = allocated(self%problem%loss)
   end function is_lossy

   ! Size of eigenvalues (1/s): |shift|, or if that is zero the observed scale, or if unknown an estimate.
   pure real(wp) function reference(self)
      class(solve_context_type), intent(in) :: self

      reference = abs(self%shift)
      if (.not. reference > 0) reference = self%scale
      if (.not. reference > 0) reference = first_scale(self%work)
   end function reference

   subroutine begin_step(self)
      class(solve_context_type), intent(inout) :: self

      call self%effort%begin_step(seconds_in_use(self))
   end subroutine begin_step

   subroutine end_step(self, phase)
      class(solve_context_type), intent(inout) :: self
      !> One of `phase_*`.
      integer, intent(in) :: phase

      call self%effort%end_step(phase, seconds_in_use(self))
   end subroutine end_step

   ! Time of solvers in use, which is added to the effort only when they are dropped.
   real(wp) function seconds_in_use(self) result(seconds)
      class(solve_context_type), intent(in) :: self
      class(linear_solver_type), pointer :: solver

      seconds = 0
      if (allocated(self%known%stiffness)) seconds = seconds + self%known%stiffness%solver%solve_seconds
      if (.not. allocated(self%transform)) return
      solver => self%transform%linear_solver()
      seconds = seconds + solver%solve_seconds + sum(self%transform%certificate%seconds%of_phases())
   end function seconds_in_use

   subroutine drop_transform(self)
      class(solve_context_type), intent(inout) :: self

      if (.not. allocated(self%transform)) return
      call self%effort%add_solves(self%transform%linear_solver())
      call self%effort%add_effort(self%transform%certificate)
      call self%transform%hand_over(self%spare)
      call self%spare%forget_factors()
      deallocate (self%transform)
   end subroutine drop_transform

   subroutine drop_stiffness(self)
      class(solve_context_type), intent(inout) :: self
      logical :: kept

      if (.not. allocated(self%known%stiffness)) return
      call self%effort%add_solves(self%known%stiffness%solver)
      call self%known%stiffness%solver%forget_factors(kept)
      deallocate (self%known%stiffness)
   end subroutine drop_stiffness
end module kschur_context
