!> Examination of a problem before the iteration: its rigid motions and the decays that damping gives them, which of them are
!> deflated, the root spaces of the eigenvalues zero and infinity where deflation is impossible, and the eigenvalue count.
module kschur_examination
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_effort, only: effort_type, for_mass, for_rigid_motions
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: eigenvalue_count_type
   use kschur_error, only: error_type, error_singular, new_error
   use kschur_held_bodies, only: are_held
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: terms_of
   use kschur_mass_bound, only: is_definite
   use kschur_monitor, only: ask_monitor, monitor_type
   use kschur_null_space, only: find_null_space, null_space_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_low_rank, formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped
   use kschur_problem, only: modal_problem_type
   use kschur_rigid_decays, only: find_rigid_decays
   use kschur_row_problem, only: all_three, row_problem_type
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   use kschur_staircase, only: find_root_space, most_null_vectors, root_space_type
   use kschur_tolerances, only: cancelled, least_of_mass, root_epsilon, rounding_of_row
   implicit none
   private
   public :: examination_type, find_rigid_motions, assume_no_rigid_motions

   ! With more unknowns without mass than this, and than modes, no root space of infinity is computed: filtering infinite
   ! eigenvalues in the iteration costs less.
   integer, parameter :: most_massless = 64
   ! A symmetric form needs the root spaces only if more than one in this many motions is asked for as a mode.
   integer, parameter :: most_part = 4

   !> What the examination found.
   type :: examination_type
      !> Number of constraints that depend linearly on others.
      integer :: redundant = 0
      type(deflation_type) :: deflation
      !> Eigenpairs of all rigid motions, lambda = 0, and behind them their decays, lambda < 0.
      type(eigenpairs_type) :: rigid
      !> Whether a rigid motion may be a flexible mode whose stiffness is below the rounding of K.
      logical :: doubtful = .false.
      !> Of an unsymmetric problem: what is taken as zero may lie so far from it (1/s); huge: not known.
      real(wp) :: radius_of_zeros = 0
      !> Number of rigid motions whose Jordan chains were not computed, as they exceed `most_null_vectors`.
      integer :: chains_skipped = 0
      !> Number of null vectors of K in which H dissipates energy: they are no rigid motions.
      integer :: lossy = 0
      !> A motion with neither mass, damping nor stiffness, n numbers, that makes P(lambda) singular for every lambda; not
      !> allocated: none was found.
      real(wp), allocatable :: singular_motion(:)
      !> The null space of K and its factors, whose solves `effort` does not have yet; not allocated if rigid motions were not
      !> searched for, or H reduced them.
      type(null_space_type), allocatable :: stiffness
      !> Lower bound of the eigenvalues of M, scaled to unit diagonal; zero: none was proved.
      real(wp) :: mass_bound = 0
      !> Number of unknowns without mass.
      integer :: massless = 0
      !> Number of finite eigenvalues.
      type(eigenvalue_count_type) :: total
   contains
      !> Returns the shapes of the rigid motions.
      procedure :: rigid_motions
   end type examination_type

contains

   !> Finds the rigid motions (null vectors of K that satisfy the constraints), deflates them or computes the root space of zero,
   !> and computes the root space of infinity where the formulation needs it.
   subroutine find_rigid_motions(problem, formulation, modes, inner, examination, effort, error, monitor, &
      matrices)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: formulation
      !> Number of modes asked for, `huge` of a dense solve: a symmetric form needs the root spaces only if many of all modes are.
      integer, intent(in) :: modes
      !> Solvers for the factorizations.
      type(inner_solvers_type), intent(in) :: inner
      type(examination_type), intent(inout) :: examination
      class(effort_type), intent(inout) :: effort
      !> Where the problem is singular for every lambda, or a factorization fails.
      type(error_type), allocatable, intent(out) :: error
      !> Asked before and after each dense step whether to go on.
      class(monitor_type), optional, intent(inout) :: monitor
      !> The matrices of the problem, distributed: they are put away while K is factored. Absent: they are not.
      type(row_problem_type), optional, intent(inout) :: matrices
      type(null_space_type), allocatable :: rigid
      logical :: needs_root_spaces

      allocate (rigid)
      call find_null_space(rigid, problem, problem%stiffness, are_held(problem), inner, for_rigid_motions, effort, error, matrices)
      if (present(matrices) .and. .not. allocated(error)) call matrices%bring_back(all_three, error)
      if (.not. allocated(error)) call ask_monitor(monitor, error)
      if (.not. allocated(error)) call check_inertia(problem, rigid%motions, examination%singular_motion, error)
      if (.not. allocated(error)) call ask_monitor(monitor, error)
      if (allocated(error)) return
      examination%doubtful = rigid%doubtful
      examination%radius_of_zeros = rigid%radius
      ! If H = g K its null space is that of K.
      if (allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) call drop_lossy()
      if (allocated(error)) return
      call set_rigid_motions(problem, rigid, examination)
      needs_root_spaces = modes > (problem%unknowns() - problem%multipliers())/most_part .or. &
         all(formulation /= [formulation_symmetric, formulation_proportional])
      if (needs_root_spaces) call find_root_spaces()
      ! The factors serve a shift at zero only if their null space is that of the rigid motions.
      if (.not. allocated(error) .and. examination%lossy == 0) call move_alloc(rigid, examination%stiffness)

   contains

      ! Computes the root space of zero if rigid motions are not deflated, and that of infinity unless M is definite: infinity is
      ! the eigenvalue zero of the reversed polynomial lambda^2 K + lambda R + M. Skips zero with more than `most_null_vectors`
      ! motions, and infinity with more unknowns without mass than modes and than `most_massless`, or if by rounding its chains have
      ! no end.
      subroutine find_root_spaces()
         type(null_space_type) :: massless
         logical :: lossy

         lossy = allocated(problem%loss) .and. formulation /= formulation_proportional
         associate (deflation => examination%deflation)
            deflation%oscillator = all(formulation /= [formulation_quadratic, formulation_low_rank, formulation_damped, &
               formulation_damped_constrained, formulation_damped_constrained_zero])
            if (lossy .and. deflation%oscillator) then
               ! The quadratic form that observes the scale has other root spaces.
               deflation%oscillator = .false.
               return
            end if
            if (deflation%not_deflated > most_null_vectors) then
               examination%chains_skipped = deflation%not_deflated
            else if (deflation%not_deflated > 0) then
               call find_chains(deflation%zero, rigid, problem%mass)
               if (lossy) call drop_complex_chains(deflation%zero)
               if (.not. (allocated(error) .or. lossy) .and. problem%symmetric .and. .not. deflation%oscillator) &
                  call add_decays()
               if (allocated(error)) return
            end if
            ! With losses the chains of infinity are complex.
            if (lossy .or. count(.not. problem%mass%row_maxima() > 0) > max(most_massless, modes)) return
            deflation%infinite_is_known = examination%mass_bound > 0
            if (.not. deflation%infinite_is_known .and. (problem%symmetric .or. problem%mass%is_symmetric())) &
               deflation%infinite_is_known = is_definite(problem%mass, least_of_mass)
            if (deflation%infinite_is_known) return
            call find_null_space(massless, problem, problem%mass, .false., inner, for_mass, effort, error)
            if (allocated(error)) return
            call find_chains(deflation%infinite, massless, problem%stiffness)
            deflation%infinite_is_known = .not. allocated(error)
            call effort%add_solves(massless%solver)
            if (.not. allocated(error)) return
            if (error%code /= error_singular .or. examination%chains_skipped > 0) return
            ! The chains of zero have ended, if there are any: the problem is regular, and those of infinity have no end by
            ! rounding.
            deallocate (error)
            deflation%infinite = root_space_type()
         end associate
      end subroutine find_root_spaces

      ! Computes the Jordan chains that begin with null vectors of M or K.
      subroutine find_chains(space, null_space, other_end)
         type(root_space_type), intent(out) :: space
         type(null_space_type), intent(inout) :: null_space
         !> The coefficient at the other end of the polynomial: M for null vectors of K, K for those of M.
         type(csr_matrix_type), intent(in) :: other_end
         type(csr_matrix_type) :: a1

         if (examination%deflation%oscillator) then
            ! The coefficient of theta, or of 1/theta: in the undamped formulation theta is omega^2 = -lambda^2.
            a1 = other_end
            if (formulation == formulation_undamped) a1%value = -a1%value
            call find_root_space(space, null_space, a1, empty_csr_matrix(a1%rows, a1%rows), error, monitor)
         else
            call find_root_space(space, null_space, problem%damping, other_end, error, monitor)
         end if
      end subroutine find_chains

      ! Drops the null vectors of K in which H dissipates energy: keeps the combinations N with H N = 0, by singular vectors of H N.
      ! N has errors of the rounding of K: accepts forces H N below the square root of epsilon, and energies N^T H N below rounding.
      subroutine drop_lossy()
         real(wp), allocatable :: forces(:, :), singular(:), rotation(:, :), rotated(:, :), most(:)
         logical, allocatable :: is_lossless(:)
         integer, allocatable :: lossless(:)
         integer :: k, j

         examination%lossy = 0
         k = size(rigid%motions, 2)
         if (k == 0) return
         call right_singular_vectors(problem%loss%product(rigid%motions), singular, rotation, error)
         if (allocated(error)) return
         rotated = matmul(rigid%motions, rotation)
         forces = problem%loss%product(rotated)
         most = problem%loss%infinity_norm()*norm2(rotated, 1)
         is_lossless = norm2(forces, 1) <= root_epsilon*most .and. &
            abs(sum(rotated*forces, 1)) <= cancelled*most*norm2(rotated, 1)
         lossless = pack([(j, j=1, k)], is_lossless)
         examination%lossy = k - size(lossless)
         if (examination%lossy == 0) return
         rigid%motions = rotated(:, lossless)
         rigid%multipliers = matmul(rigid%multipliers, rotation(:, lossless))
      end subroutine drop_lossy

      ! Drops a root space of zero that was computed from K in the place of K + i H, unless it is known to be the same: K and H are
      ! symmetric, so that their left null vectors are the right ones, and no state behind these was solved for. Otherwise its
      ! chains are complex, and an iteration finds them. Without those known an iteration for a few zeros alone does not converge.
      subroutine drop_complex_chains(space)
         type(root_space_type), intent(inout) :: space
         logical :: same

         same = .not. allocated(error)
         if (same) then
            same = problem%stiffness%is_symmetric() .and. problem%loss%is_symmetric() .and. &
               .not. any(abs(space%x(:, size(rigid%motions, 2) + 1:)) > 0)
         else if (error%code == error_singular) then
            ! Chains of K have no end.
            deallocate (error)
         end if
         if (.not. same) space = root_space_type()
      end subroutine drop_complex_chains

      ! Adds the decays of rigid motions that are below the rounding of the stiffness, so that no iteration could resolve them, to
      ! the root space of zero and to the rigid motions.
      subroutine add_decays()
         real(wp), allocatable :: lambda(:), x(:, :)
         type(eigenpairs_type) :: pairs
         integer :: n

         n = problem%unknowns()
         associate (deflation => examination%deflation)
            call find_rigid_decays(problem, rigid, 2*deflation%not_deflated - deflation%zero%multiplicity(), &
               deflation%zero_noise, lambda, x, error)
            if (allocated(error) .or. size(lambda) == 0) return
            call deflation%zero%add_eigenpairs(cmplx(lambda, kind=wp), cmplx(x(:n, :), kind=wp))
         end associate
         allocate (pairs%lambda, source=cmplx(lambda, 0, wp))
         allocate (pairs%real_phi, source=x(:n, :))
         allocate (pairs%xi, source=cmplx(x(n + 1:, :), 0, wp))
         call append_pairs(examination%rigid, pairs)
      end subroutine add_decays
   end subroutine find_rigid_motions

   !> Sets the examination of a problem without rigid motions, where they are not searched for.
   subroutine assume_no_rigid_motions(problem, examination)
      type(modal_problem_type), intent(in) :: problem
      type(examination_type), intent(inout) :: examination
      type(null_space_type) :: no_motions

      allocate (no_motions%motions(problem%unknowns(), 0), no_motions%multipliers(problem%multipliers(), 0))
      call set_rigid_motions(problem, no_motions, examination)
   end subroutine assume_no_rigid_motions

   ! Sets the deflation, and the rigid motions as eigenpairs: lambda = 0 of all null vectors of K, behind them lambda = -decay of
   ! those that are deflated and damped.
   subroutine set_rigid_motions(problem, null_space, examination)
      type(modal_problem_type), intent(in) :: problem
      type(null_space_type), intent(in) :: null_space
      type(examination_type), intent(inout) :: examination
      integer, allocatable :: decaying(:)
      integer :: k, j

      associate (motions => null_space%motions, deflation => examination%deflation, rigid => examination%rigid)
         call new_deflation(deflation, problem, motions, null_space%multipliers)
         allocate (decaying, source=pack([(j, j=1, size(deflation%decay))], abs(deflation%decay) > 0))
         k = size(motions, 2) + size(decaying)
         rigid%lambda = cmplx([spread(0.0_wp, 1, size(motions, 2)), -deflation%decay(decaying)], kind=wp)
         rigid%real_phi = reshape([motions, deflation%shapes(:, decaying)], [problem%unknowns(), k])
         rigid%xi = cmplx(reshape([null_space%multipliers, deflation%reactions(:, decaying)], [problem%multipliers(), k]), kind=wp)
      end associate
   end subroutine set_rigid_motions

   !> Returns the shapes of the pairs with lambda = 0, n x k.
   subroutine rigid_motions(self, motions)
      class(examination_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: motions(:, :)
      integer :: j

      associate (rigid => self%rigid)
         motions = rigid%real_phi(:, pack([(j, j=1, size(rigid%lambda))], .not. abs(rigid%lambda) > 0))
      end associate
   end subroutine rigid_motions

   ! Fails if a rigid motion has neither mass nor damping: P(lambda) is singular for every lambda then. The candidate is the last
   ! right singular vector of [M/||M||; R/||R||] N.
   subroutine check_inertia(problem, motions, singular_motion, error)
      type(modal_problem_type), intent(in) :: problem
      !> A basis of all rigid motions, n x k.
      real(wp), intent(in) :: motions(:, :)
      !> That motion, n numbers; not allocated: there is none.
      real(wp), allocatable, intent(out) :: singular_motion(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: forces(:, :), singular(:), rotation(:, :), candidate(:, :)
      logical :: vanish(2)
      integer :: n, k

      n = size(motions, 1)
      k = size(motions, 2)
      if (k == 0) return
      allocate (forces(2*n, k))
      forces(:n, :) = problem%mass%product(motions)/max(problem%mass%infinity_norm(), tiny(1.0_wp))
      forces(n + 1:, :) = problem%damping%product(motions)/max(problem%damping%infinity_norm(), tiny(1.0_wp))
      call right_singular_vectors(forces, singular, rotation, error)
      if (allocated(error)) return
      candidate = matmul(motions, rotation(:, k:))
      vanish = [vanishes(problem%mass), vanishes(problem%damping)]
      if (.not. all(vanish)) return
      allocate (singular_motion, source=candidate(:, 1))
      call new_error(error, error_singular, &
         "the problem is singular for every lambda: some motion has neither mass, damping nor stiffness; give it one of them, "// &
         "or a constraint that holds it")

   contains

      ! Whether A times the candidate is a rounding error: relative to the largest terms, or in each row relative to the largest
      ! entry of that row, as units of other rows may be far larger.
      logical function vanishes(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp) :: product(n, 1)

         product = matrix%product(candidate)
         vanishes = maxval(abs(product)) <= cancelled*maxval(terms_of(matrix, abs(candidate))) .or. &
            all(abs(product(:, 1)) <= rounding_of_row*matrix%row_maxima()*maxval(abs(candidate)))
      end function vanishes
   end subroutine check_inertia
end module kschur_examination
