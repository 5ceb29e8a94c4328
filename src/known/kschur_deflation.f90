!> Deflation of known rigid motions, and of their eigenvalues, from an iteration.
module kschur_deflation
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dsygv
   use kschur_magnitudes, only: magnitudes, terms_of
   use kschur_orthonormal, only: subtract
   use kschur_problem, only: damping_general, damping_proportional, modal_problem_type
   use kschur_row_sums, only: row_sums_type
   use kschur_staircase, only: root_space_type, separate_motions
   use kschur_tall_products_real, only: column_length
   use kschur_tolerances, only: cancelled, hidden_inertia, root_epsilon, rounding_of_energy, rounding_of_sums
   implicit none
   private
   public :: deflation_type, new_deflation, diagonalize_damping

   !> Rigid motions N, K N + Cq^T Xi = 0, with R N = M N diag(decay): they have the eigenvalues 0 and -decay, and span an
   !> invariant subspace whose M-orthogonal complement is invariant, too. It is deflated, as a decay of zero is a Jordan block,
   !> whose computed eigenvalues lie on a circle of radius sqrt(epsilon).
   type :: deflation_type
      !> N, n x k, N^T M N = I, and M N.
      real(wp), allocatable :: shapes(:, :), images(:, :)
      !> The multipliers of N, m x k: K N + Cq^T reactions = 0.
      real(wp), allocatable :: reactions(:, :)
      !> Decay rates, k numbers (1/s).
      real(wp), allocatable :: decay(:)
      !> Eigenvalues below this (1/s) are rounding errors of K: the computed zeros of motions that are not deflated.
      real(wp) :: zero_noise = 0
      !> Number of rigid motions that are not deflated, all or none; root spaces of the eigenvalues zero, with these motions
      !> first, and infinity.
      integer :: not_deflated = 0
      type(root_space_type) :: zero, infinite
      !> Whether `infinite` is the whole root space.
      logical :: infinite_is_known = .false.
      !> Whether these are root spaces in theta, plus or minus lambda^2.
      logical :: oscillator = .false.
      !> Locked eigenpairs, with complex shapes: the quadratic form deflates them. Not allocated: none.
      type(eigenpairs_type) :: locked
      !> Sums over the processes that share the rows of N and of vectors.
      type(row_sums_type) :: sums
   contains
      !> Lists the known eigenvalues (1/s).
      procedure :: eigenvalues
      !> Counts the eigenvalue lambda = 0 with its multiplicity.
      procedure :: zeros => count_zeros
      !> Counts the undamped rigid motions: each is a Jordan block of lambda = 0.
      procedure :: count_undamped
      procedure, private :: project_real, project_complex, project_real_forces, project_complex_forces
      !> Makes the columns of a block M-orthogonal to N, x - N (M N)^T x; a column of which only rounding is left becomes zero.
      generic :: project => project_real, project_complex
      !> Makes forces, the columns of a block, orthogonal to N, f - M N N^T f, so that they do not excite N.
      generic :: project_forces => project_real_forces, project_complex_forces
   end type deflation_type

contains

   !> Deflates the rigid motions of a symmetric problem if damping couples none of them with another motion, R N = M N diag(decay)
   !> to rounding; otherwise none of them, and sets `zero_noise`. Deflates none of an unsymmetric problem.
   subroutine new_deflation(deflation, problem, motions, multipliers)
      type(deflation_type), intent(out) :: deflation
      type(modal_problem_type), intent(in) :: problem
      !> A basis of the rigid motions, n x k.
      real(wp), intent(in) :: motions(:, :)
      !> Their multipliers xi, K phi + Cq^T xi = 0, m x k.
      real(wp), intent(in) :: multipliers(:, :)
      real(wp), allocatable :: vectors(:, :), inertia(:, :), damping_forces(:, :), decay(:), level(:)
      logical :: separate
      integer :: n, m, k

      n = problem%unknowns()
      m = problem%multipliers()
      k = merge(size(motions, 2), 0, problem%symmetric)
      allocate (vectors(n + m, k))
      vectors(:n, :) = motions(:, :k)
      vectors(n + 1:, :) = multipliers(:, :k)
      call diagonalize_damping(problem, vectors, decay, separate)
      if (problem%damping_kind == damping_proportional) decay = problem%alpha
      inertia = problem%mass%product(vectors(:n, :))
      damping_forces = problem%damping%product(vectors(:n, :))
      allocate (level, source=cancelled*problem%damping%infinity_norm()*maxval(abs(vectors(:n, :)), 1))
      separate = separate .and. all(maxval(abs(damping_forces - spread(decay, 1, n)*inertia), 1) <= level)
      if (.not. separate) k = 0
      deflation%not_deflated = size(motions, 2) - k
      allocate (deflation%shapes, source=vectors(:n, :k))
      allocate (deflation%reactions, source=vectors(n + 1:, :k))
      allocate (deflation%images, source=inertia(:, :k))
      allocate (deflation%decay, source=decay(:k))
      if (k < size(motions, 2)) deflation%zero_noise = zero_noise(problem, motions)
   end subroutine new_deflation

   !> Diagonalizes damping on a space of motions: replaces the basis X by X Y with (X Y)^T M X Y = I, (X Y)^T R X Y = diag(rates),
   !> by LAPACK's dsygv, whose errors are those of the largest rate, and by Rayleigh quotients, whose errors are those of their own
   !> terms. Where some rates have lost half of their digits to others or to their own terms, does so from a basis of separate
   !> motions, whose null vectors are less accurate. A rate is zero if its energy is rounding, and if in each row, as the units of
   !> one row must not hide the forces of others, the forces of its motion, or those that a rate below this rounding makes, are
   !> small next to their terms.
   subroutine diagonalize_damping(problem, x, rates, done)
      type(modal_problem_type), intent(in) :: problem
      !> Motions above their multipliers, (n + m) x k.
      real(wp), intent(inout) :: x(:, :)
      !> Decay rates, k numbers (1/s).
      real(wp), allocatable, intent(out) :: rates(:)
      !> False where M is not definite on the space: X has lost its meaning then.
      logical, intent(out) :: done
      real(wp) :: given(size(x, 1), size(x, 2))
      real(wp), allocatable :: damping_forces(:, :), terms(:, :), energies(:), hidden(:, :)

      given = x
      call diagonalize()
      if (problem%damping_kind == damping_general .and. any(abs(rates) > 0) .and. &
         any(abs(rates) <= root_epsilon*max(energies, maxval(abs(rates))))) then
         x = given
         call separate_motions(x, problem%damping, problem%mass)
         call diagonalize()
      end if
      hidden = abs(problem%mass%product(x(:problem%unknowns(), :)))*spread(rounding_of_energy*energies, 1, problem%unknowns())
      where (all(min(abs(damping_forces), hidden) <= root_epsilon*terms, 1) .and. abs(rates) <= rounding_of_energy*energies) &
         rates = 0

   contains

      ! Diagonalizes damping by LAPACK's dsygv, and computes the forces R X, their terms |R| |X|, the rates as Rayleigh quotients,
      ! and the terms |X|^T |R| |X| of these.
      subroutine diagonalize()
         real(wp), allocatable :: mass(:, :), damping(:, :), work(:)
         integer :: n, k, info

         n = problem%unknowns()
         k = size(x, 2)
         damping_forces = problem%damping%product(x(:n, :))
         mass = matmul(transpose(x(:n, :)), problem%mass%product(x(:n, :)))
         damping = matmul(transpose(x(:n, :)), damping_forces)
         if (.not. allocated(rates)) allocate (rates(k))
         allocate (work(10*k + 1))
         call dsygv(1, "V", "U", k, damping, max(k, 1), mass, max(k, 1), rates, work, size(work), info)
         done = info == 0
         x = matmul(x, damping)
         damping_forces = matmul(damping_forces, damping)
         terms = terms_of(problem%damping, magnitudes(x(:n, :)))
         rates = sum(x(:n, :)*damping_forces, 1)
         energies = sum(magnitudes(x(:n, :))*terms, 1)
      end subroutine diagonalize
   end subroutine diagonalize_damping

   ! The largest lambda (1/s) at which lambda^2 phi^T M phi is at most `hidden_inertia` times the rounding of phi^T K phi, over the
   ! motions phi. A motion without inertia to rounding, of M or of its own entries, is skipped: its zero is not double, and rounding
   ! of K moves it little.
   real(wp) function zero_noise(problem, motions)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: motions(:, :)
      real(wp), dimension(size(motions, 2)) :: inertia, rounding
      ! Rounding errors of entries.
      real(wp) :: errors(size(motions, 1), size(motions, 2))
      logical :: has_inertia(size(motions, 2))

      inertia = sum(motions*problem%mass%product(motions), 1)
      errors = spread(rounding_of_sums*maxval(abs(motions), 1), 1, size(motions, 1))
      has_inertia = inertia > cancelled*sum(abs(motions)*terms_of(problem%mass, abs(motions)), 1) .and. &
         inertia > sum(errors*terms_of(problem%mass, errors), 1)
      rounding = epsilon(1.0_wp)*sum(abs(motions)*terms_of(problem%stiffness, abs(motions)), 1)
      zero_noise = maxval([0.0_wp, pack(sqrt(hidden_inertia*rounding/merge(inertia, 1.0_wp, has_inertia)), has_inertia)])
   end function zero_noise

   !> The known eigenvalues (1/s): a zero of each rigid motion, the decays of deflated ones, and nonzero eigenvalues known with the
   !> root space of zero.
   pure function eigenvalues(self)
      class(deflation_type), intent(in) :: self
      complex(wp), allocatable :: eigenvalues(:)

      allocate (eigenvalues, source=cmplx([0*self%decay, -pack(self%decay, abs(self%decay) > 0), &
         spread(0.0_wp, 1, self%not_deflated)], 0, wp))
      if (allocated(self%zero%nonzero)) eigenvalues = [eigenvalues, self%zero%nonzero]
   end function eigenvalues

   !> Multiplicity of lambda = 0: one of each deflated motion, two if nothing damps it, and that of the root space.
   pure integer function count_zeros(self)
      class(deflation_type), intent(in) :: self

      count_zeros = size(self%decay) + count(.not. abs(self%decay) > 0) + &
         merge(2, 1, self%oscillator)*self%zero%multiplicity()
   end function count_zeros

   !> Number of undamped rigid motions. Of deflated ones, counts those without decay. Of others, counts the states of the root space
   !> of zero beyond its null vectors, as only undamped motions have such successors; or all, if theta is plus or minus lambda^2.
   pure integer function count_undamped(self)
      class(deflation_type), intent(in) :: self

      count_undamped = count(.not. abs(self%decay) > 0)
      if (self%not_deflated == 0) return
      count_undamped = merge(self%not_deflated, max(self%zero%multiplicity() - self%not_deflated, 0), self%oscillator)
   end function count_undamped

   ! Makes real columns M-orthogonal to N; sets columns to zero of which only rounding is left.
   subroutine project_real(self, x)
      class(deflation_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp) :: length_before(size(x, 2))
      integer :: j

      if (size(self%decay) == 0) return
      do j = 1, size(x, 2)
         length_before(j) = column_length(x(:, j:j), sums=self%sums)
      end do
      call subtract(self%images, self%shapes, x, sums=self%sums)
      do j = 1, size(x, 2)
         if (column_length(x(:, j:j), sums=self%sums) <= rounding_of_sums*length_before(j)) x(:, j) = 0
      end do
   end subroutine project_real

   ! Makes the real and imaginary parts of complex columns M-orthogonal to N, as `project_real`.
   subroutine project_complex(self, x)
      class(deflation_type), intent(in) :: self
      complex(wp), intent(inout) :: x(:, :)

      call project_parts(self, project_real, x)
   end subroutine project_complex

   ! Makes real forces orthogonal to N.
   subroutine project_real_forces(self, f)
      class(deflation_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: f(:, :)

      call subtract(self%shapes, self%images, f, sums=self%sums)
   end subroutine project_real_forces

   ! Makes the real and imaginary parts of complex forces orthogonal to N.
   subroutine project_complex_forces(self, f)
      class(deflation_type), intent(in) :: self
      complex(wp), intent(inout) :: f(:, :)

      call project_parts(self, project_real_forces, f)
   end subroutine project_complex_forces

   ! Projects the real and the imaginary part of a complex block.
   subroutine project_parts(self, project, x)
      class(deflation_type), intent(in) :: self
      procedure(project_real) :: project
      complex(wp), intent(inout) :: x(:, :)
      real(wp), allocatable :: parts(:, :, :)

      if (size(self%decay) == 0) return
      allocate (parts(size(x, 1), size(x, 2), 2))
      parts(:, :, 1) = real(x, wp)
      parts(:, :, 2) = aimag(x)
      call project(self, parts(:, :, 1))
      call project(self, parts(:, :, 2))
      x = cmplx(parts(:, :, 1), parts(:, :, 2), wp)
   end subroutine project_parts
end module kschur_deflation
