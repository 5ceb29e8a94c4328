!> Estimates of the lowest undamped frequencies, from the factors computed for rigid motions.
module kschur_lowest
   use kschur_deflation, only: deflation_type
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type
   use kschur_examination, only: examination_type
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_krylov_real, only: krylov_schur
   use kschur_modal_selection, only: modal_selection_type
   use kschur_null_space, only: null_space_type
   use kschur_operator, only: real_operator_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_spectral_map, only: spectral_map_type
   implicit none
   private
   public :: estimate_lowest_frequency, find_lowest_frequencies

   !> K^{-1} M on the null space of the constraints, rigid motions deflated.
   type, extends(real_operator_type) :: flexibility_type
      type(modal_problem_type), pointer :: problem => null()
      type(deflation_type), pointer :: deflation => null()
      type(null_space_type), pointer :: stiffness => null()
   contains
      procedure :: order
      procedure :: apply
   end type flexibility_type

contains

   !> Estimates the lowest frequencies of the undamped problem, at most `modes`: those that have converged to a relative residual of
   !> 0.1 in a Krylov space of twenty vectors.
   subroutine find_lowest_frequencies(problem, examination, modes, seed, processes, frequencies, effort, error)
      type(modal_problem_type), target, intent(in) :: problem
      !> Its rigid motions and factored stiffness.
      type(examination_type), target, intent(inout) :: examination
      integer, intent(in) :: modes, seed
      !> Processes that may share the rows of vectors; not associated: one.
      type(processes_type), pointer, intent(in) :: processes
      !> In 1/s, those that converged; without rigid motions.
      real(wp), allocatable, intent(out) :: frequencies(:)
      class(effort_type), intent(inout) :: effort
      !> Effort, also if the solver fails.
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: tolerance = 0.1_wp
      ! A block costs a third of as many single solves with MUMPS. Infinite eigenvalues have Jordan blocks of size 2 at most.
      integer, parameter :: block = 4, filter = 2
      type(flexibility_type) :: flexibility
      type(krylov_statistics_type) :: statistics
      complex(wp), allocatable :: mu(:), none(:, :)

      flexibility%problem => problem
      flexibility%deflation => examination%deflation
      flexibility%stiffness => examination%stiffness
      call krylov_schur(flexibility, modal_selection_type(modes, spectral_map_type(oscillator=.true.), &
         known=examination%deflation%eigenvalues()), krylov_options_type(tolerance=tolerance, max_restarts=1, seed=seed, &
         filter=filter, block=block, verify=.false., vectors=.false., processes=processes), mu, none, statistics, error)
      effort%operator_applications = effort%operator_applications + statistics%operator_applications
      if (allocated(error)) return
      effort%seconds%orthogonalize = effort%seconds%orthogonalize + statistics%orthogonalize_seconds
      allocate (frequencies, source=1/sqrt(pack(abs(mu), abs(mu) > tiny(1.0_wp))))
   end subroutine find_lowest_frequencies

   !> Estimates the lowest frequency of the undamped problem, mostly from above, by two steps of the power method.
   subroutine estimate_lowest_frequency(problem, examination, seed, frequency, effort, error)
      type(modal_problem_type), target, intent(in) :: problem
      !> Its rigid motions and factored stiffness.
      type(examination_type), target, intent(inout) :: examination
      integer, intent(in) :: seed
      !> In 1/s, without rigid motions; unchanged if there is no mass.
      real(wp), intent(inout) :: frequency
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      type(flexibility_type) :: flexibility
      real(wp) :: x(problem%unknowns(), 1), y(problem%unknowns(), 1), length
      integer(long) :: state

      flexibility%problem => problem
      flexibility%deflation => examination%deflation
      flexibility%stiffness => examination%stiffness
      state = state_of_seed(seed)
      call random_vector(state, x(:, 1))
      call flexibility%apply(x, y, error)
      if (.not. allocated(error)) call flexibility%apply(y, x, error)
      if (allocated(error)) return
      effort%operator_applications = effort%operator_applications + 2
      length = norm2(x)
      if (length > 0 .and. norm2(y) > 0) frequency = sqrt(norm2(y)/length)
   end subroutine estimate_lowest_frequency

   integer function order(self)
      class(flexibility_type), intent(in) :: self

      order = self%problem%unknowns()
   end function order

   subroutine apply(self, x, y, error)
      class(flexibility_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: rhs(:, :)
      integer :: n, j

      n = size(x, 1)
      y = 0
      call self%problem%mass%add_product(1.0_wp, x, y)
      call self%deflation%project_forces(y)
      allocate (rhs(n + self%problem%multipliers(), size(x, 2)), source=0.0_wp)
      do j = 1, size(x, 2)
         rhs(:n, j) = self%stiffness%row_scaling(:n)*y(:, j)
      end do
      call self%stiffness%solver%solve(rhs, error)
      if (allocated(error)) return
      do j = 1, size(x, 2)
         y(:, j) = self%stiffness%column_scaling(:n)*rhs(:n, j)
      end do
      call self%deflation%project(y)
   end subroutine apply
end module kschur_lowest
