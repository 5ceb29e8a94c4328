!> The rigid motions of a problem as modes, with the decay that damping gives them, and what of them is deflated.
module kschur_rigid_modes
   use kschur_backward_error, only: eigenpairs_type
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_direct_solver, only: direct_real_type
   use kschur_error, only: error_type, error_convergence, error_singular
   use kschur_inner_solvers, only: inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type, account
   use kschur_rigid, only: check_inertia, find_rigid_motions
   use kschur_scaled_stiffness, only: new_scaled_stiffness, scaled_stiffness_type
   use kschur_zero_space, only: find_zero_space
   implicit none
   private
   public :: find_rigid

contains

   !> The eigenvalue zero, and what can be deflated with it.
   subroutine find_rigid(problem, possible, inner, deflation, rigid, result, error, factored)
      type(modal_problem_type), intent(in) :: problem
      !> Whether to look at all.
      logical, intent(in) :: possible
      type(inner_solvers_type), intent(in) :: inner
      type(deflation_type), intent(out) :: deflation
      type(eigenpairs_type), intent(out) :: rigid
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> The stiffness that was factored; only where it was looked.
      type(scaled_stiffness_type), allocatable, optional, intent(out) :: factored
      class(real_linear_solver_type), allocatable :: solver
      type(scaled_stiffness_type), allocatable :: stiffness
      real(wp), allocatable :: motions(:, :), multipliers(:, :), others(:, :)
      integer, allocatable :: decaying(:)
      integer :: k, l, j

      if (possible) then
         allocate (stiffness)
         allocate (solver, source=inner%unshifted)
         call new_scaled_stiffness(stiffness, problem, solver, error)
         if (.not. allocated(error)) call find_rigid_motions(problem, stiffness, motions, multipliers, error)
         if (allocated(error)) then
            ! The stiffness may be nearer to singular than the problem is at any shift.
            if (all(error%code /= [error_convergence, error_singular])) return
            deallocate (error)
            allocate (solver, source=direct_real_type(quasi_definite=.false.))
            call new_scaled_stiffness(stiffness, problem, solver, error)
            if (.not. allocated(error)) call find_rigid_motions(problem, stiffness, motions, multipliers, error)
            result%factorizations = result%factorizations + 1
         end if
         if (.not. allocated(error)) call check_inertia(problem, motions, error)
         if (allocated(error)) return
         call account(stiffness%solver, result)
         result%factorizations = result%factorizations + 1
         call new_deflation(deflation, problem, motions, multipliers, others)
         call find_zeros(problem, stiffness, others, deflation, error)
         if (allocated(error)) return
         if (present(factored)) call move_alloc(stiffness, factored)
      else
         allocate (motions(problem%unknowns(), 0), multipliers(problem%multipliers(), 0))
         call new_deflation(deflation, problem, motions, multipliers)
      end if
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

   ! The zero space of the motions that cannot be deflated.
   subroutine find_zeros(problem, stiffness, motions, deflation, error)
      type(modal_problem_type), intent(in) :: problem
      type(scaled_stiffness_type), intent(inout) :: stiffness
      real(wp), intent(in) :: motions(:, :)
      type(deflation_type), intent(inout) :: deflation
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: left(:, :), multipliers(:, :)

      if (problem%symmetric .or. size(motions, 2) == 0) then
         allocate (left, source=motions)
      else
         call find_rigid_motions(problem, stiffness, left, multipliers, error, left=.true.)
         if (allocated(error)) return
      end if
      call find_zero_space(deflation%zeros, problem, stiffness, motions, left, error)
   end subroutine find_zeros
end module kschur_rigid_modes
