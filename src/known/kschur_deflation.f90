!> Motions that are known, kept out of an iteration.
module kschur_deflation
   use kschur_kinds, only: wp
   use kschur_lapack, only: dsygv
   use kschur_magnitudes, only: add_magnitudes, magnitudes
   use kschur_problem, only: modal_problem_type, damping_proportional
   use kschur_root_space, only: root_space_type
   use kschur_row_sums, only: row_sums_type
   use kschur_tall_products_complex, only: complex_length => column_length
   use kschur_tall_products_real, only: column_length, inner_products, subtract_combinations
   implicit none
   private
   public :: deflation_type, new_deflation

   ! What a projection leaves of a vector below this part of it is rounding.
   real(wp), parameter :: nothing_left = 100*epsilon(1.0_wp)

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
      real(wp) :: blur = 0
      !> How many rigid motions cannot be deflated so: all or none; what is known of the eigenvalues zero, with these
      !> motions first, and infinity.
      integer :: others = 0
      type(root_space_type) :: zero, infinite
      logical :: infinite_is_known = .false.
      !> Whether these are root spaces in theta, the square of lambda.
      logical :: oscillator = .false.
      !> Where several processes have rows of N and of vectors each, their sums.
      type(row_sums_type) :: sums
   contains
      !> All eigenvalues (1/s).
      procedure :: eigenvalues
      !> Multiplicity of the eigenvalue lambda = 0.
      procedure :: zeros => count_zeros
      !> How many rigid motions nothing damps.
      procedure :: coasting
      procedure, private :: project_real, project_complex
      !> Makes each column of a block M-orthogonal to N; zero where nothing but rounding is left.
      generic :: project => project_real, project_complex
      !> Makes each column of a block of forces orthogonal to N: those that move nothing of it.
      procedure :: project_forces
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
      ! Of all of R, and of the terms of a row.
      real(wp), parameter :: rounding = 1.0e-12_wp, clear = 1.0e-8_wp
      real(wp), allocatable :: shapes(:, :), masses(:, :), dampers(:, :), mass(:, :), damping(:, :), decay(:), work(:), &
         terms(:, :)
      logical, allocatable :: separate(:)
      real(wp) :: norm
      integer :: n, k, i, info

      n = problem%unknowns()
      k = merge(size(motions, 2), 0, problem%symmetric)
      allocate (masses(n, k), dampers(n, k), shapes(n, k), source=0.0_wp)
      allocate (separate(k), source=.true.)
      call problem%mass%add_product(1.0_wp, motions(:, :k), masses)
      call problem%damping%add_product(1.0_wp, motions(:, :k), dampers)
      allocate (mass(k, k), source=matmul(transpose(motions(:, :k)), masses))
      allocate (damping(k, k), source=matmul(transpose(motions(:, :k)), dampers))
      allocate (decay(k), work(10*k + 1))
      call dsygv(1, "V", "U", k, damping, max(k, 1), mass, max(k, 1), decay, work, size(work), info)
      ! A motion without mass leaves no inner product.
      if (info /= 0) separate = .false.
      shapes = matmul(motions(:, :k), damping)
      masses = matmul(masses, damping)
      dampers = matmul(dampers, damping)
      if (problem%damping_kind == damping_proportional) decay = problem%alpha
      norm = problem%damping%infinity_norm()
      allocate (terms(n, k), source=0.0_wp)
      call add_magnitudes(problem%damping, magnitudes(shapes), terms)
      do i = 1, k
         associate (level => norm*maxval(abs(shapes(:, i))))
            ! A row of large units hides what others have.
            if (problem%damping_kind /= damping_proportional .and. maxval(abs(dampers(:, i))) <= rounding*level .and. &
               all(abs(dampers(:, i)) <= clear*terms(:, i))) decay(i) = 0
            if (.not. maxval(abs(dampers(:, i) - decay(i)*masses(:, i))) <= rounding*level) separate(i) = .false.
         end associate
      end do
      allocate (deflation%reactions, source=matmul(multipliers(:, :k), damping))
      if (.not. all(separate)) then
         k = 0
         deallocate (shapes, masses, decay, deflation%reactions)
         allocate (shapes(n, k), masses(n, k), decay(k), deflation%reactions(size(multipliers, 1), k))
      end if
      deflation%others = size(motions, 2) - k
      call move_alloc(shapes, deflation%shapes)
      call move_alloc(masses, deflation%images)
      call move_alloc(decay, deflation%decay)
      if (k < size(motions, 2)) deflation%blur = blur(problem, motions)
   end subroutine new_deflation

   ! lambda^2 phi^T M phi a million times the rounding of phi^T K phi. A motion whose inertia is rounding has none: its zero
   ! is not double, and little blurred.
   pure real(wp) function blur(problem, motions)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: motions(:, :)
      real(wp), parameter :: visible = 1.0e6_wp, rounding = 1.0e-12_wp
      real(wp) :: inertia, of_masses, terms
      integer :: i, j, l

      blur = 0
      do j = 1, size(motions, 2)
         inertia = 0
         of_masses = 0
         terms = 0
         do i = 1, size(motions, 1)
            associate (m => problem%mass, k => problem%stiffness, phi => motions(:, j))
               do l = m%row_start(i), m%row_start(i + 1) - 1
                  inertia = inertia + phi(i)*m%value(l)*phi(m%column(l))
                  of_masses = of_masses + abs(phi(i)*m%value(l)*phi(m%column(l)))
               end do
               do l = k%row_start(i), k%row_start(i + 1) - 1
                  terms = terms + abs(phi(i)*k%value(l)*phi(k%column(l)))
               end do
            end associate
         end do
         if (inertia > rounding*of_masses) blur = max(blur, sqrt(visible*epsilon(1.0_wp)*terms/inertia))
      end do
   end function blur

   pure function eigenvalues(self)
      class(deflation_type), intent(in) :: self
      complex(wp), allocatable :: eigenvalues(:)

      allocate (eigenvalues, source=cmplx([0*self%decay, -pack(self%decay, abs(self%decay) > 0), &
         spread(0.0_wp, 1, self%others)], 0, wp))
      if (allocated(self%zero%beside)) eigenvalues = [eigenvalues, cmplx(self%zero%beside, 0, wp)]
   end function eigenvalues

   pure integer function count_zeros(self)
      class(deflation_type), intent(in) :: self

      count_zeros = size(self%decay) + count(.not. abs(self%decay) > 0) + &
         merge(2, 1, self%oscillator)*self%zero%multiplicity()
   end function count_zeros

   pure integer function coasting(self)
      class(deflation_type), intent(in) :: self

      coasting = count(.not. abs(self%decay) > 0)
      if (self%others == 0) return
      coasting = merge(self%others, max(self%zero%multiplicity() - self%others, 0), self%oscillator)
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
      call subtract(self%images, self%shapes, self%sums, x)
      do j = 1, size(x, 2)
         if (column_length(x(:, j:j), sums=self%sums) <= nothing_left*before(j)) x(:, j) = 0
      end do
   end subroutine project_real

   subroutine project_forces(self, f)
      class(deflation_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: f(:, :)

      call subtract(self%shapes, self%images, self%sums, f)
   end subroutine project_forces

   ! X := X - B A^T X.
   subroutine subtract(a, b, sums, x)
      real(wp), contiguous, intent(in) :: a(:, :), b(:, :)
      type(row_sums_type), intent(in) :: sums
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp) :: coefficients(size(a, 2), size(x, 2))

      if (size(a, 2) == 0) return
      call inner_products(a, x, coefficients, sums=sums)
      call subtract_combinations(b, coefficients, x)
   end subroutine subtract

   subroutine project_complex(self, x)
      class(deflation_type), intent(in) :: self
      complex(wp), intent(inout) :: x(:, :)
      complex(wp) :: coefficient(1, 1)
      real(wp) :: before
      integer :: i, j

      if (size(self%decay) == 0) return
      do j = 1, size(x, 2)
         before = complex_length(x(:, j:j), sums=self%sums)
         do i = 1, size(self%decay)
            coefficient = dot_product(self%images(:, i), x(:, j))
            call self%sums%add_up(coefficient)
            x(:, j) = x(:, j) - coefficient(1, 1)*self%shapes(:, i)
         end do
         if (complex_length(x(:, j:j), sums=self%sums) <= nothing_left*before) x(:, j) = 0
      end do
   end subroutine project_complex
end module kschur_deflation
