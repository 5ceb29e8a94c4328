!> Motions that are known, kept out of an iteration.
module kschur_deflation
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dsygv
   use kschur_magnitudes, only: add_magnitudes, magnitudes
   use kschur_orthonormal, only: subtract
   use kschur_problem, only: modal_problem_type, damping_proportional
   use kschur_row_sums, only: row_sums_type
   use kschur_staircase, only: root_space_type
   use kschur_tall_products_real, only: column_length
   use kschur_tolerances, only: cancelled, hidden_inertia, root_epsilon, rounding_of_sums
   implicit none
   private
   public :: deflation_type, new_deflation, separate_by_damping

   !> Rigid motions N with R N = M N diag(decay): they have the eigenvalues 0 and
   !> -decay, and the motions M-orthogonal to them are a problem of their own. Without
   !> this a decay of zero is a Jordan block, that an iteration sees as a ring of
   !> radius sqrt(epsilon).
   type :: deflation_type
      !> N, n x k, N^T M N = I, and M N.
      real(wp), allocatable :: shapes(:, :), images(:, :)
      !> The multipliers of N, m x k: K N + Cq^T reactions = 0.
      real(wp), allocatable :: reactions(:, :)
      !> k numbers (1/s).
      real(wp), allocatable :: decay(:)
      !> Rounding of K hides an eigenvalue below this (1/s): motions that are not deflated have zeros there.
      real(wp) :: zero_noise = 0
      !> How many rigid motions cannot be deflated so: all or none; what is known of the eigenvalues zero, with these
      !> motions first, and infinity.
      integer :: not_deflated = 0
      type(root_space_type) :: zero, infinite
      logical :: infinite_is_known = .false.
      !> Whether these are root spaces in theta, the square of lambda.
      logical :: oscillator = .false.
      !> Eigenpairs that were accepted, with complex shapes: the quadratic form does not look for them again. Not allocated: none.
      type(eigenpairs_type) :: locked
      !> Where several processes have rows of N and of vectors each, their sums.
      type(row_sums_type) :: sums
   contains
      !> All eigenvalues (1/s).
      procedure :: eigenvalues
      !> Multiplicity of the eigenvalue lambda = 0.
      procedure :: zeros => count_zeros
      !> How many rigid motions nothing damps.
      procedure :: coasting
      procedure, private :: project_real, project_complex, project_real_forces, project_complex_forces
      !> Makes each column of a block M-orthogonal to N; zero where nothing but rounding is left.
      generic :: project => project_real, project_complex
      !> Makes each column of a block of forces orthogonal to N: those that move nothing of it.
      generic :: project_forces => project_real_forces, project_complex_forces
   end type deflation_type

contains

   !> The rigid motions of a symmetric problem, if all of them can be deflated; none
   !> where the problem is unsymmetric.
   subroutine new_deflation(deflation, problem, motions, multipliers)
      type(deflation_type), intent(out) :: deflation
      type(modal_problem_type), intent(in) :: problem
      !> A basis, n x k.
      real(wp), intent(in) :: motions(:, :)
      !> Their multipliers xi, K phi + Cq^T xi = 0, m x k.
      real(wp), intent(in) :: multipliers(:, :)
      real(wp), allocatable :: both(:, :), masses(:, :), dampers(:, :), decay(:), terms(:, :), level(:)
      logical :: separate
      integer :: n, m, k, i

      n = problem%unknowns()
      m = problem%multipliers()
      k = merge(size(motions, 2), 0, problem%symmetric)
      allocate (both(n + m, k))
      both(:n, :) = motions(:, :k)
      both(n + 1:, :) = multipliers(:, :k)
      call separate_by_damping(problem, both, decay, separate)
      if (problem%damping_kind == damping_proportional) decay = problem%alpha
      allocate (masses(n, k), dampers(n, k), terms(n, k), source=0.0_wp)
      call problem%mass%add_product(1.0_wp, both(:n, :), masses)
      call problem%damping%add_product(1.0_wp, both(:n, :), dampers)
      call add_magnitudes(problem%damping, magnitudes(both(:n, :)), terms)
      allocate (level, source=cancelled*problem%damping%infinity_norm()*maxval(abs(both(:n, :)), 1))
      do i = 1, k
         ! A row of large units hides what others have.
         if (problem%damping_kind /= damping_proportional .and. maxval(abs(dampers(:, i))) <= level(i) .and. &
            all(abs(dampers(:, i)) <= root_epsilon*terms(:, i))) decay(i) = 0
         separate = separate .and. maxval(abs(dampers(:, i) - decay(i)*masses(:, i))) <= level(i)
      end do
      if (.not. separate) k = 0
      deflation%not_deflated = size(motions, 2) - k
      allocate (deflation%shapes, source=both(:n, :k))
      allocate (deflation%reactions, source=both(n + 1:, :k))
      allocate (deflation%images, source=masses(:, :k))
      allocate (deflation%decay, source=decay(:k))
      if (k < size(motions, 2)) deflation%zero_noise = zero_noise(problem, motions)
   end subroutine new_deflation

   !> Makes motions M-orthonormal such that damping couples none of them with another.
   subroutine separate_by_damping(problem, x, rates, done)
      type(modal_problem_type), intent(in) :: problem
      !> Motions above their multipliers, (n + m) x k.
      real(wp), intent(inout) :: x(:, :)
      !> Of their decays, k numbers (1/s).
      real(wp), allocatable, intent(out) :: rates(:)
      !> Not where a motion has no mass, which leaves no inner product.
      logical, intent(out) :: done
      real(wp), allocatable :: masses(:, :), dampers(:, :), mass(:, :), damping(:, :), work(:)
      integer :: n, k, info

      n = problem%unknowns()
      k = size(x, 2)
      allocate (masses(n, k), dampers(n, k), source=0.0_wp)
      call problem%mass%add_product(1.0_wp, x(:n, :), masses)
      call problem%damping%add_product(1.0_wp, x(:n, :), dampers)
      mass = matmul(transpose(x(:n, :)), masses)
      damping = matmul(transpose(x(:n, :)), dampers)
      allocate (rates(k), work(10*k + 1))
      call dsygv(1, "V", "U", k, damping, max(k, 1), mass, max(k, 1), rates, work, size(work), info)
      done = info == 0
      x = matmul(x, damping)
   end subroutine separate_by_damping

   ! lambda^2 phi^T M phi a million times the rounding of phi^T K phi. A motion whose inertia is rounding has none: its zero
   ! is not double, and rounding of K moves it little.
   real(wp) function zero_noise(problem, motions)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: motions(:, :)
      real(wp), dimension(size(motions, 1), size(motions, 2)) :: forces, of_masses, of_springs
      real(wp) :: inertia
      integer :: j

      forces = 0
      of_masses = 0
      of_springs = 0
      call problem%mass%add_product(1.0_wp, motions, forces)
      call add_magnitudes(problem%mass, abs(motions), of_masses)
      call add_magnitudes(problem%stiffness, abs(motions), of_springs)
      zero_noise = 0
      do j = 1, size(motions, 2)
         inertia = dot_product(motions(:, j), forces(:, j))
         if (inertia > cancelled*dot_product(abs(motions(:, j)), of_masses(:, j))) zero_noise = max(zero_noise, &
            sqrt(hidden_inertia*epsilon(1.0_wp)*dot_product(abs(motions(:, j)), of_springs(:, j))/inertia))
      end do
   end function zero_noise

   pure function eigenvalues(self)
      class(deflation_type), intent(in) :: self
      complex(wp), allocatable :: eigenvalues(:)

      allocate (eigenvalues, source=cmplx([0*self%decay, -pack(self%decay, abs(self%decay) > 0), &
         spread(0.0_wp, 1, self%not_deflated)], 0, wp))
      if (allocated(self%zero%beside)) eigenvalues = [eigenvalues, self%zero%beside]
   end function eigenvalues

   pure integer function count_zeros(self)
      class(deflation_type), intent(in) :: self

      count_zeros = size(self%decay) + count(.not. abs(self%decay) > 0) + &
         merge(2, 1, self%oscillator)*self%zero%multiplicity()
   end function count_zeros

   pure integer function coasting(self)
      class(deflation_type), intent(in) :: self

      coasting = count(.not. abs(self%decay) > 0)
      if (self%not_deflated == 0) return
      coasting = merge(self%not_deflated, max(self%zero%multiplicity() - self%not_deflated, 0), self%oscillator)
   end function coasting

   subroutine project_real(self, x)
      class(deflation_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp) :: before(size(x, 2))
      integer :: j

      if (size(self%decay) == 0) return
      do j = 1, size(x, 2)
         before(j) = column_length(x(:, j:j), sums=self%sums)
      end do
      call subtract(self%images, self%shapes, x, sums=self%sums)
      do j = 1, size(x, 2)
         if (column_length(x(:, j:j), sums=self%sums) <= rounding_of_sums*before(j)) x(:, j) = 0
      end do
   end subroutine project_real

   subroutine project_complex(self, x)
      class(deflation_type), intent(in) :: self
      complex(wp), intent(inout) :: x(:, :)
      real(wp), allocatable :: parts(:, :, :)

      if (size(self%decay) == 0) return
      allocate (parts(size(x, 1), size(x, 2), 2))
      parts(:, :, 1) = real(x, wp)
      parts(:, :, 2) = aimag(x)
      call project_real(self, parts(:, :, 1))
      call project_real(self, parts(:, :, 2))
      x = cmplx(parts(:, :, 1), parts(:, :, 2), wp)
   end subroutine project_complex

   subroutine project_real_forces(self, f)
      class(deflation_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: f(:, :)

      call subtract(self%shapes, self%images, f, sums=self%sums)
   end subroutine project_real_forces

   subroutine project_complex_forces(self, f)
      class(deflation_type), intent(in) :: self
      complex(wp), intent(inout) :: f(:, :)
      real(wp), allocatable :: parts(:, :, :)

      if (size(self%decay) == 0) return
      allocate (parts(size(f, 1), size(f, 2), 2))
      parts(:, :, 1) = real(f, wp)
      parts(:, :, 2) = aimag(f)
      call project_real_forces(self, parts(:, :, 1))
      call project_real_forces(self, parts(:, :, 2))
      f = cmplx(parts(:, :, 1), parts(:, :, 2), wp)
   end subroutine project_complex_forces
end module kschur_deflation
