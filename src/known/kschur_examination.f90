!> What is known of a problem before it is iterated: its rigid motions as modes, with the decay that damping gives
!> them, what of them is deflated, the root spaces of zero and infinity where that cannot be done, and how many
!> eigenvalues it has.
module kschur_examination
   use kschur_deflation, only: deflation_type, new_deflation
   use kschur_effort, only: effort_type, for_mass, for_rigid_motions
   use kschur_eigenpairs, only: append_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: eigenvalue_count_type
   use kschur_error, only: error_type, error_singular, new_error
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: add_magnitudes
   use kschur_mass, only: is_definite
   use kschur_monitor, only: ask_monitor, monitor_type
   use kschur_null_space, only: find_null_space, null_space_type
   use kschur_options, only: formulation_damped, formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_low_rank, formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped
   use kschur_problem, only: modal_problem_type
   use kschur_rigid_decays, only: find_rigid_decays
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   use kschur_staircase, only: find_root_space, most_null_vectors, root_space_type
   use kschur_tolerances, only: cancelled, root_epsilon, rounding_of_row
   implicit none
   private
   public :: examination_type, find_rigid, suppose_none

   ! With more motions without mass than this the iteration is left to filter infinite eigenvalues, which costs less.
   integer, parameter :: most_massless = 64
   ! A symmetric form needs the infinite eigenvalue only where more than this part of the unknowns, as modes, is wanted.
   integer, parameter :: most_part = 4

   !> What is known beforehand.
   type :: examination_type
      !> Constraints that follow from others.
      integer :: redundant = 0
      type(deflation_type) :: deflation
      !> All rigid motions and their decays.
      type(eigenpairs_type) :: rigid
      !> Whether one of them may be a mode that rounding of the stiffness hides.
      logical :: doubtful = .false.
      !> Rigid motions whose chains were not followed, as there are too many of them.
      integer :: unfollowed = 0
      !> Motions without stiffness in which H loses energy: they are no rigid ones.
      integer :: lossy = 0
      !> A motion with neither mass, damping nor stiffness, n; not allocated: none was met.
      real(wp), allocatable :: nothing(:)
      !> The null space of the stiffness and its factors, whose solves are not accounted for yet; not allocated where it was
      !> not looked for rigid motions.
      type(null_space_type), allocatable :: stiffness
      type(eigenvalue_count_type) :: total
   contains
      !> The rigid motions without the decays.
      procedure :: rigid_motions
   end type examination_type

contains

   !> Finds the eigenvalue zero, and what can be deflated or locked with it.
   subroutine find_rigid(problem, formulation, modes, inner, known, effort, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: formulation
      !> How many modes are wanted: a symmetric form needs the eigenvalue infinity only where that is nearly all.
      integer, intent(in) :: modes
      type(inner_solvers_type), intent(in) :: inner
      type(examination_type), intent(inout) :: known
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      !> Asked before and after each step that is dense.
      class(monitor_type), optional, intent(inout) :: monitor
      type(null_space_type), allocatable :: rigid
      logical :: follows

      allocate (rigid)
      call find_null_space(rigid, problem, problem%stiffness, inner, for_rigid_motions, effort, error)
      if (.not. allocated(error)) call ask_monitor(monitor, error)
      if (.not. allocated(error)) call check_inertia(problem, rigid%motions, known%nothing, error)
      if (.not. allocated(error)) call ask_monitor(monitor, error)
      if (allocated(error)) return
      known%doubtful = rigid%doubtful
      ! Of H = g K the null space is that of K.
      if (allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) &
         call leave_lossy_out(problem, rigid, known%lossy, error)
      if (allocated(error)) return
      call set_rigid(problem, rigid, known)
      follows = modes > (problem%unknowns() - problem%multipliers())/most_part .or. &
         all(formulation /= [formulation_symmetric, formulation_proportional])
      ! Chains of zero and infinity are known of M, R and K only.
      if (allocated(problem%loss) .and. formulation == formulation_quadratic) follows = .false.
      if (follows) call find_root_spaces(problem, formulation, inner, rigid, known, effort, error, monitor)
      ! Factors whose null space is larger tell no scale.
      if (.not. allocated(error) .and. known%lossy == 0) call move_alloc(rigid, known%stiffness)
   end subroutine find_rigid

   ! Leaves the motions N in the null space with H N = 0: N is known to the rounding of K, and N^T H N to its square.
   subroutine leave_lossy_out(problem, null_space, lossy, error)
      type(modal_problem_type), intent(in) :: problem
      type(null_space_type), intent(inout) :: null_space
      !> So many were left out.
      integer, intent(out) :: lossy
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: forces(:, :), sizes(:), rotation(:, :), rotated(:, :)
      logical, allocatable :: keeps(:)
      integer, allocatable :: lossless(:)
      integer :: k, j

      k = size(null_space%motions, 2)
      lossy = 0
      if (k == 0) return
      allocate (forces(problem%unknowns(), k), source=0.0_wp)
      call problem%loss%add_product(1.0_wp, null_space%motions, forces)
      call right_singular_vectors(forces, sizes, rotation, error)
      if (allocated(error)) return
      forces = matmul(forces, rotation)
      rotated = matmul(null_space%motions, rotation)
      allocate (keeps(k))
      do j = 1, k
         associate (most => problem%loss%infinity_norm()*norm2(rotated(:, j)))
            keeps(j) = norm2(forces(:, j)) <= root_epsilon*most .and. &
               abs(dot_product(rotated(:, j), forces(:, j))) <= cancelled*most*norm2(rotated(:, j))
         end associate
      end do
      allocate (lossless, source=pack([(j, j=1, k)], keeps))
      lossy = k - size(lossless)
      if (lossy == 0) return
      null_space%motions = rotated(:, lossless)
      null_space%multipliers = matmul(null_space%multipliers, rotation(:, lossless))
   end subroutine leave_lossy_out

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

   ! Fails where a rigid motion has neither mass nor damping: then the problem is singular for every lambda.
   subroutine check_inertia(problem, motions, nothing, error)
      type(modal_problem_type), intent(in) :: problem
      !> A basis of all rigid motions, n x k.
      real(wp), intent(in) :: motions(:, :)
      !> That motion, n.
      real(wp), allocatable, intent(out) :: nothing(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: forces(:, :), force(:), rotation(:, :), least(:, :)
      logical :: vanish(2)
      integer :: n, k

      n = size(motions, 1)
      k = size(motions, 2)
      if (k == 0) return
      allocate (forces(2*n, k), source=0.0_wp)
      if (.not. problem%mass%is_zero()) &
         call problem%mass%add_product(1/problem%mass%infinity_norm(), motions, forces(:n, :))
      if (.not. problem%damping%is_zero()) &
         call problem%damping%add_product(1/problem%damping%infinity_norm(), motions, forces(n + 1:, :))
      call right_singular_vectors(forces, force, rotation, error)
      if (allocated(error)) return
      least = matmul(motions, rotation(:, k:))
      vanish = [vanishes(problem%mass), vanishes(problem%damping)]
      if (.not. all(vanish)) return
      allocate (nothing, source=least(:, 1))
      call new_error(error, error_singular, &
         "the problem is singular for every lambda: some motion has neither mass, damping nor stiffness; give it one of them, "// &
         "or a constraint that holds it")

   contains

      ! Whether A times the least motion is rounding: small beside its terms, or in each row beside that of A, as units of other
      ! rows may be far larger.
      logical function vanishes(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp), dimension(n, 1) :: product, terms

         product = 0
         terms = 0
         call matrix%add_product(1.0_wp, least, product)
         call add_magnitudes(matrix, abs(least), terms)
         vanishes = maxval(abs(product)) <= cancelled*maxval(terms) .or. &
            all(abs(product(:, 1)) <= rounding_of_row*matrix%row_maxima()*maxval(abs(least)))
      end function vanishes
   end subroutine check_inertia

   ! That of infinity belongs to the reversed polynomial, that of zero to what is not deflated.
   subroutine find_root_spaces(problem, formulation, inner, rigid, known, effort, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      !> Of the stiffness.
      type(null_space_type), intent(inout) :: rigid
      type(examination_type), intent(inout) :: known
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      type(null_space_type) :: massless

      associate (deflation => known%deflation)
         deflation%oscillator = all(formulation /= [formulation_quadratic, formulation_low_rank, formulation_damped, &
            formulation_damped_constrained, formulation_damped_constrained_zero])
         if (deflation%not_deflated > most_null_vectors) then
            known%unfollowed = deflation%not_deflated
         else if (deflation%not_deflated > 0) then
            call complete(deflation%zero, rigid, problem%mass)
            if (.not. allocated(error) .and. problem%symmetric .and. .not. deflation%oscillator) &
               call add_decays(problem, rigid, known, error)
            if (allocated(error)) return
         end if
         if (count(.not. problem%mass%row_maxima() > 0) > most_massless) return
         deflation%infinite_is_known = problem%symmetric
         if (problem%symmetric) deflation%infinite_is_known = is_definite(problem%mass, inner)
         if (deflation%infinite_is_known) return
         call find_null_space(massless, problem, problem%mass, inner, for_mass, effort, error)
         if (allocated(error)) return
         call complete(deflation%infinite, massless, problem%stiffness)
         deflation%infinite_is_known = .not. allocated(error)
         call effort%add_solves(massless%solver)
      end associate

   contains

      subroutine complete(space, null_space, last)
         type(root_space_type), intent(out) :: space
         type(null_space_type), intent(inout) :: null_space
         !> Of the coefficients that are not the one of the null space.
         type(csr_matrix_type), intent(in) :: last

         if (known%deflation%oscillator) then
            call find_root_space(space, null_space, signed(last, formulation), empty_csr_matrix(last%rows, last%rows), &
               error, monitor)
         else
            call find_root_space(space, null_space, problem%damping, last, error, monitor)
         end if
      end subroutine complete
   end subroutine find_root_spaces

   ! Decays that rounding of the stiffness would hide from an iteration become known.
   subroutine add_decays(problem, rigid, known, error)
      type(modal_problem_type), intent(in) :: problem
      type(null_space_type), intent(inout) :: rigid
      type(examination_type), intent(inout) :: known
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: lambda(:), x(:, :)
      type(eigenpairs_type) :: pairs
      integer :: n

      n = problem%unknowns()
      associate (deflation => known%deflation)
         call find_rigid_decays(problem, rigid, 2*deflation%not_deflated - deflation%zero%multiplicity(), &
            deflation%zero_noise, lambda, x, error)
         if (allocated(error) .or. size(lambda) == 0) return
         call deflation%zero%add_eigenpairs(cmplx(lambda, kind=wp), cmplx(x(:n, :), kind=wp))
      end associate
      allocate (pairs%lambda, source=cmplx(lambda, 0, wp))
      allocate (pairs%real_phi, source=x(:n, :))
      allocate (pairs%xi, source=cmplx(x(n + 1:, :), 0, wp))
      call append_pairs(known%rigid, pairs)
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
