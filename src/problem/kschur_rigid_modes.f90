!> The rigid motions of a problem as modes, with the decay that damping gives them, what of them is deflated, and
!> the root spaces of zero and infinity where that cannot be done.
module kschur_rigid_modes
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type, error_convergence, error_singular
   use kschur_inner_solvers, only: inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped
   use kschur_problem, only: modal_problem_type
   use kschur_rigid, only: check_inertia, find_rigid_motions
   use kschur_root_space, only: find_root_space, root_space_type
   use kschur_scaled_stiffness, only: new_scaled_stiffness, scaled_stiffness_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   implicit none
   private
   public :: find_rigid

   ! With more motions without mass than this the iteration is left to filter infinite eigenvalues.
   integer, parameter :: most_massless = 64
   ! More than this part of the unknowns is nearly all.
   integer, parameter :: most_part = 4

contains

   !> The eigenvalue zero, and what can be deflated or locked with it.
   subroutine find_rigid(problem, formulation, possible, redundant, inner, deflation, rigid, effort, error, factored, modes)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: formulation
      !> Whether to look at all.
      logical, intent(in) :: possible
      !> Constraints that follow from others.
      integer, intent(in) :: redundant
      type(inner_solvers_type), intent(in) :: inner
      type(deflation_type), intent(out) :: deflation
      type(eigenpairs_type), intent(out) :: rigid
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      !> The stiffness that was factored; only where it was looked.
      type(scaled_stiffness_type), allocatable, optional, intent(out) :: factored
      !> How many modes are wanted: a symmetric form needs the eigenvalue infinity only where that is nearly all.
      integer, optional, intent(in) :: modes
      type(scaled_stiffness_type), allocatable :: stiffness
      logical :: nearly_all
      real(wp), allocatable :: motions(:, :), multipliers(:, :)
      integer, allocatable :: decaying(:)
      integer :: k, l, j

      if (possible) then
         call find_null_motions(problem, problem%stiffness, inner, redundant, stiffness, motions, multipliers, effort, error)
         if (.not. allocated(error)) call check_inertia(problem, motions, error)
         if (allocated(error)) return
      else
         allocate (motions(problem%unknowns(), 0), multipliers(problem%multipliers(), 0))
      end if
      call new_deflation(deflation, problem, motions, multipliers)
      nearly_all = .false.
      if (present(modes)) nearly_all = modes > (problem%unknowns() - problem%multipliers())/most_part
      if (possible .and. (nearly_all .or. all(formulation /= [formulation_symmetric, formulation_proportional]))) &
         call find_root_spaces(problem, formulation, motions, inner, redundant, stiffness, deflation, effort, error)
      if (allocated(error)) return
      if (possible .and. present(factored)) call move_alloc(stiffness, factored)
      allocate (decaying, source=pack([(j, j=1, size(deflation%decay))], abs(deflation%decay) > 0))
      k = size(motions, 2)
      l = size(decaying)
      allocate (rigid%lambda(k + l), source=(0.0_wp, 0.0_wp))
      allocate (rigid%phi(problem%unknowns(), k + l), rigid%xi(problem%multipliers(), k + l), source=(0.0_wp, 0.0_wp))
      rigid%lambda(k + 1:) = -deflation%decay(decaying)
      rigid%phi(:, :k) = motions
      rigid%phi(:, k + 1:) = deflation%shapes(:, decaying)
      rigid%xi(:, :k) = multipliers
      rigid%xi(:, k + 1:) = deflation%reactions(:, decaying)
   end subroutine find_rigid

   ! The null space of a matrix of the problem on the motions that the constraints allow.
   subroutine find_null_motions(problem, matrix, inner, redundant, factored, motions, multipliers, effort, error)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrix
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: redundant
      type(scaled_stiffness_type), allocatable, intent(out) :: factored
      real(wp), allocatable, intent(out) :: motions(:, :), multipliers(:, :)
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      class(real_linear_solver_type), allocatable :: solver
      integer :: attempt

      do attempt = 1, attempts
         if (allocated(factored)) deallocate (factored)
         allocate (factored)
         allocate (solver, source=inner%unshifted)
         call new_scaled_stiffness(factored, problem, solver, error, matrix, attempt)
         if (allocated(error)) exit
         ! A null pivot that is not that of a redundant constraint hides a motion.
         if (.not. factored%too_singular .and. factored%solver%null_pivots <= redundant) exit
         if (attempt == attempts) exit
         call effort%add_solver(factored%solver)
         effort%factorizations = effort%factorizations + 1
      end do
      if (.not. allocated(error)) call find_rigid_motions(problem, factored, motions, multipliers, error)
      if (allocated(error)) then
         ! The matrix may be nearer to singular than the problem is at any shift.
         if (all(error%code /= [error_convergence, error_singular])) return
         deallocate (error)
         allocate (solver, source=direct_real_type(quasi_definite=.false.))
         call new_scaled_stiffness(factored, problem, solver, error, matrix)
         if (.not. allocated(error)) call find_rigid_motions(problem, factored, motions, multipliers, error)
         effort%factorizations = effort%factorizations + 1
      end if
      if (allocated(error)) return
      call effort%add_solver(factored%solver)
      effort%factorizations = effort%factorizations + 1
   end subroutine find_null_motions

   ! Whether each positive diagonal entry is larger than all others of its row together: of a symmetric matrix that
   ! is definite then.
   pure logical function is_dominant(matrix)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), parameter :: clearly = 1.01_wp
      real(wp) :: diagonal(matrix%rows)
      integer :: i

      diagonal = matrix%diagonal()
      do i = 1, matrix%rows
         associate (row => matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1))
            is_dominant = diagonal(i) > 0 .and. 2*diagonal(i) > clearly*sum(abs(row))
         end associate
         if (.not. is_dominant) return
      end do
   end function is_dominant

   ! That of infinity belongs to the reversed polynomial, that of zero to what is not deflated.
   subroutine find_root_spaces(problem, formulation, motions, inner, redundant, stiffness, deflation, effort, error)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      real(wp), intent(in) :: motions(:, :)
      type(inner_solvers_type), intent(in) :: inner
      integer, intent(in) :: redundant
      type(scaled_stiffness_type), intent(inout) :: stiffness
      type(deflation_type), intent(inout) :: deflation
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      type(scaled_stiffness_type), allocatable :: mass
      type(csr_matrix_type) :: nothing
      real(wp), allocatable :: massless(:, :), multipliers(:, :)

      nothing = empty_csr_matrix(problem%unknowns(), problem%unknowns())
      deflation%oscillator = all(formulation /= [formulation_quadratic, formulation_damped, &
         formulation_damped_constrained, formulation_damped_constrained_zero])
      if (deflation%others > 0) then
         if (deflation%oscillator) then
            call complete(deflation%zero, stiffness, motions, signed(problem%mass), nothing)
         else
            call complete(deflation%zero, stiffness, motions, problem%damping, problem%mass)
         end if
         if (allocated(error)) return
      end if
      if (count(.not. problem%mass%row_maxima() > 0) > most_massless) return
      if (problem%symmetric .and. is_dominant(problem%mass)) then
         deflation%infinite_is_known = .true.
         return
      end if
      call find_null_motions(problem, problem%mass, inner, redundant, mass, massless, multipliers, effort, error)
      if (allocated(error)) return
      if (deflation%oscillator) then
         call complete(deflation%infinite, mass, massless, signed(problem%stiffness), nothing)
      else
         call complete(deflation%infinite, mass, massless, problem%damping, problem%stiffness)
      end if
      deflation%infinite_is_known = .not. allocated(error)

   contains

      subroutine complete(space, factored, null_motions, first, second)
         type(root_space_type), intent(out) :: space
         type(scaled_stiffness_type), intent(inout) :: factored
         real(wp), intent(in) :: null_motions(:, :)
         type(csr_matrix_type), intent(in) :: first, second
         real(wp), allocatable :: left(:, :), unused(:, :)

         if (problem%symmetric .or. size(null_motions, 2) == 0) then
            allocate (left, source=null_motions)
         else
            call find_rigid_motions(problem, factored, left, unused, error, left=.true.)
            if (allocated(error)) return
         end if
         call find_root_space(space, factored, first, second, null_motions, left, error)
      end subroutine complete

      ! The second coefficient of A - theta B, or of B - A/theta, where A is K or -K.
      function signed(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         type(csr_matrix_type) :: signed

         signed = matrix
         if (formulation == formulation_undamped) signed%value = -signed%value
      end function signed
   end subroutine find_root_spaces
end module kschur_rigid_modes
