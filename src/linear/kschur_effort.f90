!> What a computation took.
module kschur_effort
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: linear_solver_type
   implicit none
   private
   public :: effort_type, timings_type

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
      !> All else: with it the phases sum to the total.
      real(wp) :: other = 0
   end type timings_type

   !> Counts and seconds.
   type :: effort_type
      integer :: operator_applications = 0
      integer :: restarts = 0
      integer :: factorizations = 0
      type(timings_type) :: seconds
   contains
      !> Adds a factorisation and its seconds.
      procedure :: add_factors
      !> Adds the seconds that a linear solver solved, once it is no longer used.
      procedure :: add_solves
      !> Adds what another computation took as a part of this one.
      procedure :: add_effort
      !> Ends the account with the seconds of all.
      procedure :: set_total
   end type effort_type

contains

   subroutine add_factors(self, solver)
      class(effort_type), intent(inout) :: self
      class(linear_solver_type), intent(in) :: solver

      self%factorizations = self%factorizations + 1
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
      self%seconds%analyze = self%seconds%analyze + part%seconds%analyze
      self%seconds%factorize = self%seconds%factorize + part%seconds%factorize
      self%seconds%solve = self%seconds%solve + part%seconds%solve
      self%seconds%orthogonalize = self%seconds%orthogonalize + part%seconds%orthogonalize
   end subroutine add_effort

   subroutine set_total(self, seconds)
      class(effort_type), intent(inout) :: self
      real(wp), intent(in) :: seconds

      associate (s => self%seconds)
         s%total = seconds
         s%other = max(seconds - (s%analyze + s%factorize + s%solve + s%orthogonalize), 0.0_wp)
      end associate
   end subroutine set_total
end module kschur_effort
