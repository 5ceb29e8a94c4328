!> What is known of a problem before it is iterated: its rigid motions as modes, with the decay that damping gives
!> them, what of them is deflated, the root spaces of zero and infinity where that cannot be done, and how many
!> eigenvalues it has.
module kschur_examination
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: eigenvalue_count_type
   use kschur_error, only: error_type, error_convergence, error_singular
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_low_rank, formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped, &
      inner_mumps
   use kschur_problem, only: modal_problem_type
   use kschur_rigid, only: check_inertia, find_rigid_motions
   use kschur_rigid_decays, only: find_rigid_decays, rigid_decays_type
   use kschur_root_space, only: find_root_space, root_space_type
   use kschur_scaled_stiffness, only: new_scaled_stiffness, scaled_stiffness_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   implicit none
   private
   public :: examination_type, find_rigid, suppose_none

   ! With more motions without mass than this the iteration is left to filter infinite eigenvalues.
   integer, parameter :: most_massless = 64
   ! More than this part of the unknowns is nearly all.
   integer, parameter :: most_part = 4

   !> What is known beforehand.
   type :: examination_type
      !> Constraints that follow from others.
      integer :: redundant = 0
      type(deflation_type) :: deflation
      !> All rigid motions and their decays.
      type(eigenpairs_type) :: rigid
      !> The stiffness, factored, whose solves are not accounted for yet; not allocated where it was not looked for rigid motions.
      type(scaled_stiffness_type), allocatable :: stiffness
      type(eigenvalue_count_type) :: total
   contains
      !> The rigid motions without the decays.
      procedure :: rigid_motions
   end type examination_type

   ! A matrix of the problem, factored, and the motions that it does not see.
   type :: null_space_type
      type(scaled_stiffness_type), allocatable :: matrix
      real(wp), allocatable :: motions(:, :), multipliers(:, :)
   end type null_space_type

contains

   !> Finds the eigenvalue zero, and what can be deflated or locked with it.
   subroutine find_rigid(problem, formulation, modes, inner, known, effort, error)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: formulation
      !> How many modes are wanted: a symmetric form needs the eigenvalue infinity only where that is nearly all.
      integer, intent(in) :: modes
      type(inner_solvers_type), intent(in) :: inner
      type(examination_type), intent(inout) :: known
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      type(null_space_type) :: null_space
      logical :: nearly_all

      call find_null_space(problem, problem%stiffness, inner, null_space, effort, error)
      if (.not. allocated(error)) call check_inertia(problem, null_space%motions, error)
      if (allocated(error)) return
      call set_rigid(problem, null_space, known)
      nearly_all = modes > (problem%unknowns() - problem%multipliers())/most_part
      if (nearly_all .or. all(formulation /= [formulation_symmetric, formulation_proportional])) &
         call find_root_spaces(problem, formulation, inner, null_space, known, effort, error)
      if (.not. allocated(error)) call move_alloc(null_space%matrix, known%stiffness)
   end subroutine find_rigid

   !> Where it is not looked for rigid motions there are none.
   subroutine suppose_none(problem, known)
      type(modal_problem_type), intent(in) :: problem
      type(examination_type), intent(inout) :: known
      type(null_space_type) :: none

      allocate (none%motions(problem%unknowns(), 0), none%multipliers(problem%multipliers(), 0))
      call set_rigid(problem, none, known)
   end subroutine suppose_none

   ! Zeros, and behind them the decays that damping gives to motions without stiffness.
   subroutine set_rigid(problem, null_space, known)
      type(modal_problem_type), intent(in) :: problem
      type(null_space_type), intent(in) :: null_space
      type(examination_type), intent(inout) :: known
      integer, allocatable :: decaying(:)
      integer :: k, l, j

      associate (motions => null_space%motions, deflation => known%deflation, rigid => known%rigid)
         call new_deflation(deflation, problem, motions, null_space%multipliers)
         allocate (decaying, source=pack([(j, j=1, size(deflation%decay))], abs(deflation%decay) > 0))
         k = size(motions, 2)
         l = size(decaying)
         allocate (rigid%lambda(k + l), source=(0.0_wp, 0.0_wp))
         allocate (rigid%real_phi(problem%unknowns(), k + l), rigid%xi(problem%multipliers(), k + l))
         rigid%lambda(k + 1:) = -deflation%decay(decaying)
         rigid%real_phi(:, :k) = motions
         rigid%real_phi(:, k + 1:) = deflation%shapes(:, decaying)
         rigid%xi(:, :k) = null_space%multipliers
         rigid%xi(:, k + 1:) = deflation%reactions(:, decaying)
      end associate
   end subroutine set_rigid

   !> n x k.
   subroutine rigid_motions(self, motions)
      class(examination_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: motions(:, :)
      integer, allocatable :: zeros(:)
      integer :: i, j

      associate (rigid => self%rigid)
         allocate (zeros, source=pack([(j, j=1, size(rigid%lambda))], .not. abs(rigid%lambda) > 0))
         allocate (motions(rigid%rows(), size(zeros)), source=reshape([(real(rigid%column(zeros(i)), wp), i=1, size(zeros))], &
            [rigid%rows(), size(zeros)]))
      end associate
   end subroutine rigid_motions

   ! The null space of a matrix of the problem on the motions that the constraints allow.
   subroutine find_null_space(problem, matrix, inner, null_space, effort, error)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrix
      type(inner_solvers_type), intent(in) :: inner
      type(null_space_type), intent(out) :: null_space
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      class(real_linear_solver_type), allocatable :: solver
      integer :: attempt

      do attempt = 1, attempts
         call start_again(null_space, effort)
         allocate (solver, source=inner%unshifted)
         call new_scaled_stiffness(null_space%matrix, problem, solver, error, matrix, attempt)
         if (allocated(error)) exit
         associate (factored => null_space%matrix)
            call effort%add_factors(factored%solver)
            ! A null pivot hides a motion.
            if (.not. factored%too_singular .and. factored%solver%null_pivots == 0) exit
         end associate
      end do
      if (.not. allocated(error)) &
         call find_rigid_motions(problem, null_space%matrix, null_space%motions, null_space%multipliers, error)
      if (.not. allocated(error)) return
      ! The matrix may be nearer to singular than the problem is at any shift.
      if (all(error%code /= [error_convergence, error_singular])) return
      deallocate (error)
      call start_again(null_space, effort)
      allocate (solver, source=direct_real_type(inner=inner_mumps))
      call new_scaled_stiffness(null_space%matrix, problem, solver, error, matrix)
      if (allocated(error)) return
      call effort%add_factors(null_space%matrix%solver)
      call find_rigid_motions(problem, null_space%matrix, null_space%motions, null_space%multipliers, error)
   end subroutine find_null_space

   subroutine start_again(null_space, effort)
      type(null_space_type), intent(inout) :: null_space
      class(effort_type), intent(inout) :: effort

      if (allocated(null_space%matrix)) then
         if (allocated(null_space%matrix%solver)) call effort%add_solves(null_space%matrix%solver)
         deallocate (null_space%matrix)
      end if
      allocate (null_space%matrix)
   end subroutine start_again

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
   subroutine find_root_spaces(problem, formulation, inner, rigid, known, effort, error)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      !> Of the stiffness.
      type(null_space_type), intent(inout) :: rigid
      type(examination_type), target, intent(inout) :: known
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      type(null_space_type) :: massless
      type(csr_matrix_type) :: nothing
      type(deflation_type), pointer :: deflation

      deflation => known%deflation
      nothing = empty_csr_matrix(problem%unknowns(), problem%unknowns())
      deflation%oscillator = all(formulation /= [formulation_quadratic, formulation_low_rank, formulation_damped, &
         formulation_damped_constrained, formulation_damped_constrained_zero])
      if (deflation%others > 0) then
         if (deflation%oscillator) then
            call complete(deflation%zero, rigid, signed(problem%mass, formulation), nothing)
         else
            call complete(deflation%zero, rigid, problem%damping, problem%mass)
            if (.not. allocated(error) .and. problem%symmetric) call add_decays(problem, rigid, known, error)
         end if
         if (allocated(error)) return
      end if
      if (count(.not. problem%mass%row_maxima() > 0) > most_massless) return
      if (problem%symmetric .and. is_dominant(problem%mass)) then
         deflation%infinite_is_known = .true.
         return
      end if
      call find_null_space(problem, problem%mass, inner, massless, effort, error)
      if (allocated(error)) return
      if (deflation%oscillator) then
         call complete(deflation%infinite, massless, signed(problem%stiffness, formulation), nothing)
      else
         call complete(deflation%infinite, massless, problem%damping, problem%stiffness)
      end if
      deflation%infinite_is_known = .not. allocated(error)
      call effort%add_solves(massless%matrix%solver)

   contains

      subroutine complete(space, null_space, first, second)
         type(root_space_type), intent(out) :: space
         type(null_space_type), intent(inout) :: null_space
         type(csr_matrix_type), intent(in) :: first, second
         real(wp), allocatable :: left(:, :), unused(:, :)

         if (problem%symmetric .or. size(null_space%motions, 2) == 0) then
            allocate (left, source=null_space%motions)
         else
            call find_rigid_motions(problem, null_space%matrix, left, unused, error, left=.true.)
            if (allocated(error)) return
         end if
         call find_root_space(space, null_space%matrix, first, second, null_space%motions, left, error)
      end subroutine complete
   end subroutine find_root_spaces

   ! Decays that rounding of the stiffness would hide from an iteration become known.
   subroutine add_decays(problem, rigid, known, error)
      type(modal_problem_type), intent(in) :: problem
      type(null_space_type), intent(inout) :: rigid
      type(examination_type), intent(inout) :: known
      type(error_type), allocatable, intent(out) :: error
      type(rigid_decays_type) :: decays
      type(eigenpairs_type) :: pairs

      associate (deflation => known%deflation)
         call find_rigid_decays(decays, problem, rigid%matrix, rigid%motions, rigid%multipliers, &
            2*deflation%others - deflation%zero%multiplicity(), deflation%blur, error)
         if (allocated(error) .or. size(decays%lambda) == 0) return
         call deflation%zero%add_eigenpairs(decays%lambda, decays%x)
         allocate (pairs%lambda, source=cmplx(decays%lambda, 0, wp))
         allocate (pairs%real_phi, source=decays%x)
         allocate (pairs%xi, source=cmplx(decays%xi, 0, wp))
         call append_pairs(known%rigid, pairs)
      end associate
   end subroutine add_decays

   ! The second coefficient of A - theta B, or of B - A/theta, where A is K or -K.
   function signed(matrix, formulation)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: formulation
      type(csr_matrix_type) :: signed

      signed = matrix
      if (formulation == formulation_undamped) signed%value = -signed%value
   end function signed
end module kschur_examination
