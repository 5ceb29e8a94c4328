!> Counts and times of a computation.
module kschur_effort
   use kschur_clock, only: clock, seconds_since
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: linear_solver_type
   implicit none
   private
   public :: effort_type, timings_type
   !> The phases of `timings_type`, without total and other.
   integer, parameter, public :: phase_analyze = 1, phase_factorize = 2, phase_solve = 3, phase_orthogonalize = 4, &
      phase_examine = 5, phase_place = 6, phase_iterate = 7, phase_recover = 8, phase_judge = 9, phase_left = 10
   !> Names of the phases in output.
   character(len=*), parameter, public :: phase_names(10) = [character(len=13) :: "analyze", "factorize", "solve", &
      "orthogonalize", "examine", "place", "iterate", "recover", "judge", "left"]
   !> Purposes of factorisations: to test whether the mass is definite; for rigid motions, possibly reused by the iteration; for
   !> the iteration; for refinement of single modes; to count eigenvalues; for left vectors.
   integer, parameter, public :: for_mass = 1, for_rigid_motions = 2, for_iteration = 3, for_refinement = 4, for_count = 5, &
      for_left = 6
   !> Names of the purposes in output.
   character(len=*), parameter, public :: purpose_names(6) = [character(len=13) :: "mass", "rigid_motions", "iteration", &
      "refinement", "count", "left"]

   !> Wall-clock seconds of each phase.
   type :: timings_type
      real(wp) :: total = 0
      !> Ordering and symbolic factorisation.
      real(wp) :: analyze = 0
      real(wp) :: factorize = 0
      !> Forward and backward substitutions.
      real(wp) :: solve = 0
      !> Orthogonalisation of the Krylov basis and its rotation at a restart.
      real(wp) :: orthogonalize = 0
      !> The steps of a solve without these four. Before the iteration: presolve, balance, constraints, rigid motions.
      real(wp) :: examine = 0
      !> Choice of the shift, and assembly of the shifted matrix.
      real(wp) :: place = 0
      !> Products with matrices, projected problems.
      real(wp) :: iterate = 0
      !> Shapes and multipliers, of the problem as given.
      real(wp) :: recover = 0
      !> Backward errors, error bounds, refinement, proofs, what is noted.
      real(wp) :: judge = 0
      !> Left vectors.
      real(wp) :: left = 0
      !> The rest: the phases sum to the total.
      real(wp) :: other = 0
   contains
      !> The seconds of the phases, in the order of `phase_names`.
      procedure :: of_phases
      procedure :: set_phases
   end type timings_type

   !> Counts and seconds.
   type :: effort_type
      integer :: operator_applications = 0
      integer :: restarts = 0
      integer :: factorizations = 0
      !> Factorisations by purpose, in the order of `purpose_names`.
      integer :: factorizations_for(size(purpose_names)) = 0
      type(timings_type) :: seconds = timings_type()
      ! Start of the current step, and time accounted for before it.
      integer(long), private :: began = 0
      real(wp), private :: accounted = 0
   contains
      !> Adds a factorisation and its seconds.
      procedure :: add_factors
      !> Adds the time of all solves of a solver that is no longer used.
      procedure :: add_solves
      !> Adds the effort of a part of this computation.
      procedure :: add_effort
      !> Starts the clock of a step.
      procedure :: begin_step
      !> Ends the current step, if any, and begins the next: adds its time to a phase, without what other phases of the same step
      !> have already counted.
      procedure :: end_step
      !> Sets the total time; `other` becomes what no phase has counted.
      procedure :: set_total
   end type effort_type

contains

   pure function of_phases(self) result(seconds)
      class(timings_type), intent(in) :: self
      real(wp) :: seconds(size(phase_names))

      seconds = [self%analyze, self%factorize, self%solve, self%orthogonalize, self%examine, self%place, self%iterate, &
         self%recover, self%judge, self%left]
   end function of_phases

   subroutine set_phases(self, seconds)
      class(timings_type), intent(inout) :: self
      real(wp), intent(in) :: seconds(:)

      self%analyze = seconds(phase_analyze)
      self%factorize = seconds(phase_factorize)
      self%solve = seconds(phase_solve)
      self%orthogonalize = seconds(phase_orthogonalize)
      self%examine = seconds(phase_examine)
      self%place = seconds(phase_place)
      self%iterate = seconds(phase_iterate)
      self%recover = seconds(phase_recover)
      self%judge = seconds(phase_judge)
      self%left = seconds(phase_left)
   end subroutine set_phases

   subroutine add_factors(self, solver, purpose)
      class(effort_type), intent(inout) :: self
      class(linear_solver_type), intent(in) :: solver
      !> One of `for_*`.
      integer, intent(in) :: purpose

      self%factorizations = self%factorizations + 1
      self%factorizations_for(purpose) = self%factorizations_for(purpose) + 1
      self%seconds%analyze = self%seconds%analyze + solver%analyze_seconds
      self%seconds%factorize = self%seconds%factorize + solver%factorize_seconds
   end subroutine add_factors

   subroutine add_solves(self, solver)
      class(effort_type), intent(inout) :: self
      class(linear_solver_type), intent(in) :: solver

      self%seconds%solve = self%seconds%solve + solver%solve_seconds
   end subroutine add_solves

   subroutine add_effort(self, part)
      class(effort_type), intent(inout) :: self
      class(effort_type), intent(in) :: part

      self%operator_applications = self%operator_applications + part%operator_applications
      self%restarts = self%restarts + part%restarts
      self%factorizations = self%factorizations + part%factorizations
      self%factorizations_for = self%factorizations_for + part%factorizations_for
      call self%seconds%set_phases(self%seconds%of_phases() + part%seconds%of_phases())
   end subroutine add_effort

   subroutine begin_step(self, unadded)
      class(effort_type), intent(inout) :: self
      !> Time of solvers in use, which `add_solves` will add later.
      real(wp), intent(in) :: unadded

      self%began = clock()
      self%accounted = sum(self%seconds%of_phases()) + unadded
   end subroutine begin_step

   subroutine end_step(self, phase, unadded)
      class(effort_type), intent(inout) :: self
      !> One of `phase_*`.
      integer, intent(in) :: phase
      !> As for `begin_step`.
      real(wp), intent(in) :: unadded
      real(wp) :: seconds(size(phase_names)), beside

      if (self%began == 0) return
      seconds = self%seconds%of_phases()
      beside = seconds_since(self%began) - (sum(seconds) + unadded - self%accounted)
      seconds(phase) = seconds(phase) + max(beside, 0.0_wp)
      call self%seconds%set_phases(seconds)
      call self%begin_step(unadded)
   end subroutine end_step

   subroutine set_total(self, seconds)
      class(effort_type), intent(inout) :: self
      real(wp), intent(in) :: seconds

      self%seconds%total = seconds
      self%seconds%other = max(seconds - sum(self%seconds%of_phases()), 0.0_wp)
   end subroutine set_total
end module kschur_effort
