!> The eigenpairs of one cluster, by iteration of their space with factors beside it.
module kschur_polish
   use kschur_backward_error, only: backward_errors
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, keep_pairs, normalize
   use kschur_error, only: error_type
   use kschur_gram_schmidt_complex, only: orthonormalize
   use kschur_kinds, only: long, wp
   use kschur_lapack, only: zgesvd
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_memory, only: require_memory
   use kschur_outcome, only: inaccurate_above
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: independent_eigenvectors, schur_form
   use kschur_random, only: random_vector, state_of_seed
   use kschur_saddle, only: saddle_blocks, saddle_structure, shifted_saddle
   use kschur_sparse, only: csr_matrix_type
   use kschur_split, only: cluster_type
   use kschur_tolerances, only: above_all_rounding, cancelled
   implicit none
   private
   public :: polished_type, polisher_type

   ! Steps without progress.
   integer, parameter :: steps = 5

   !> Polishes clusters of one problem, each with factors of its own.
   type :: polisher_type
      !> The backward error that is good enough.
      real(wp) :: above = 0
      !> Where a cluster is factored, from its centre and relative to it: near, but not singular.
      real(wp) :: offset = 1.0e-6_wp
      !> What that is relative to where the centre is zero: a size of eigenvalues (1/s).
      real(wp) :: reference = 0
      class(complex_linear_solver_type), allocatable :: solver
      ! Factor of each constraint.
      real(wp), allocatable, private :: factors(:)
      ! M, R and K, the latter with constraints; not allocated before the first cluster.
      type(csr_matrix_type), allocatable, private :: blocks(:)
   contains
      procedure :: begin
      procedure :: factor_beside
      procedure :: polish
   end type polisher_type

   !> What is known of a cluster after that.
   type :: polished_type
      !> All eigenpairs where the cluster is, of a conjugate pair one, `paired` where its conjugate is known to be another.
      type(eigenpairs_type) :: pairs
      !> Their backward errors.
      real(wp), allocatable :: errors(:)
      !> Eigenvalues among them, both of a conjugate pair counted where the cluster meets the real axis.
      integer :: eigenvalues = 0
      !> Whether all Ritz values where the cluster is are good enough: then there are no others.
      logical :: complete = .false.
   contains
      !> The largest backward error.
      procedure :: worst
   end type polished_type

contains

   subroutine begin(self, factors, above, solver)
      class(polisher_type), intent(out) :: self
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      real(wp), intent(in) :: above
      !> A prototype.
      class(complex_linear_solver_type), intent(in) :: solver

      self%above = above
      allocate (self%factors, source=factors)
      allocate (self%solver, source=solver)
   end subroutine begin

   !> Factors the problem beside a cluster. One eigenvalue converges the faster the nearer. Several: further off than they are
   !> spread, so that all of them converge alike, and than the roots of a defective one are split, whose chain would be lost
   !> behind its eigenvector; as far as other eigenvalues let the space converge. So is a zero that nothing damps.
   subroutine factor_beside(self, problem, cluster, shift, error)
      class(polisher_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      type(cluster_type), intent(in) :: cluster
      complex(wp), intent(out) :: shift
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: beyond = 1.5_wp, furthest = 1.0e-3_wp, of_gap = 1/30.0_wp
      real(wp) :: distance, unit

      if (.not. allocated(self%blocks)) then
         allocate (self%blocks(3))
         call saddle_blocks(problem, self%factors, self%blocks, error)
         if (allocated(error)) return
      end if
      unit = merge(abs(cluster%centre), self%reference, abs(cluster%centre) > 0)
      distance = max(self%offset*unit, beyond*cluster%spread)
      if (size(cluster%members) > 1 .or. .not. abs(cluster%centre) > 0) &
         distance = max(distance, min(furthest*unit, of_gap*cluster%gap))
      shift = cluster%centre + distance
      call self%solver%factorize(shifted_saddle(problem, self%blocks, shift), saddle_structure(problem), error)
   end subroutine factor_beside

   !> Iterates the space of the states [x; lambda x/u] of a cluster, and of random vectors for what it lacks, by
   !>
   !>     [P(s) Cq^T; Cq 0] [x'; xi] = -[M v + (R + s M) x; 0],  v' = x + s x',
   !>
   !> and takes the Ritz pairs that lie where the cluster does, until they stay where they are. A cluster on the real axis has a
   !> real space: two real eigenvalues and a conjugate pair beside the axis are the same until its Schur form tells. Copies,
   !> and the roots of a defective eigenvalue, are as many as the space holds. Where eigenvalues are given, it is shapes of
   !> these that are found, one for each, whatever the Ritz values are.
   subroutine polish(self, problem, cluster, shift, members, worst, guards, polished, error, lambda)
      class(polisher_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      type(cluster_type), intent(in) :: cluster
      !> Where the factors are.
      complex(wp), intent(in) :: shift
      !> The members, with complex shapes.
      type(eigenpairs_type), intent(in) :: members
      !> Their largest backward error.
      real(wp), intent(in) :: worst
      !> Random vectors beside them.
      integer, intent(in) :: guards
      type(polished_type), intent(out) :: polished
      type(error_type), allocatable, intent(out) :: error
      !> Eigenvalues (1/s) that are known.
      complex(wp), optional, intent(in) :: lambda(:)
      ! The space becomes no larger than this.
      integer, parameter :: largest = 200
      complex(wp), allocatable :: states(:, :), images(:, :), solutions(:, :)
      type(polished_type) :: now
      real(wp) :: limit, least
      integer(long) :: random_state
      integer :: step, inside, filled
      logical :: settled

      random_state = state_of_seed(0)
      limit = max(self%above, min(10*worst, inaccurate_above))
      polished%pairs = chosen_pairs(members, spread(.false., 1, size(members%lambda)))
      allocate (polished%pairs%paired(0), polished%errors(0))
      call begin_states(members, cluster, abs(shift), guards, random_state, states, error)
      if (allocated(error)) return
      step = 0
      filled = 0
      least = huge(1.0_wp)
      do while (step < steps .and. size(states, 2) > 0)
         step = step + 1
         call apply(self, problem, shift, states, images, solutions, error)
         if (.not. allocated(error)) call find_pairs(cluster, shift, states, images, solutions, now%pairs, error, lambda)
         if (allocated(error)) return
         if (.not. present(lambda)) call keep_pairs(now%pairs, cluster%holds(now%pairs%lambda))
         inside = count_of(cluster, now%pairs%lambda)
         if (allocated(now%errors)) deallocate (now%errors)
         allocate (now%errors, source=backward_errors(problem, now%pairs))
         if (size(now%errors) > 0 .and. 2*now%worst() < least) then
            least = now%worst()
            step = 0
         end if
         now%complete = size(now%errors) > 0 .and. now%worst() <= self%above .and. &
            (guards == 0 .or. inside < size(states, 2))
         if (.not. present(lambda)) then
            call keep_pairs(now%pairs, now%errors <= limit)
            now%errors = pack(now%errors, now%errors <= limit)
         end if
         now%eigenvalues = count_of(cluster, now%pairs%lambda)
         settled = is_settled(now, polished)
         if (is_better(now, polished)) then
            polished = now
            if (settled) exit
         end if
         call move_alloc(images, states)
         ! Where no random vector stays outside, the space may be too small, unless there are no more motions.
         if (guards > 0 .and. inside == size(states, 2) .and. inside > filled .and. inside < largest) then
            call add_random(guards, random_state, states)
            filled = inside
            step = 0
         end if
         call make_orthonormal(states)
      end do

   contains

      ! Nothing more is to be learned from another step: alone at once, others where they stay where they were.
      logical function is_settled(now, before) result(settled)
         type(polished_type), intent(in) :: now, before
         integer :: i

         settled = now%complete .and. now%eigenvalues >= size(members%lambda)
         if (.not. settled) return
         if (size(members%lambda) == 1 .and. now%eigenvalues == 1) return
         settled = now%eigenvalues == before%eigenvalues .and. all([(any(abs(before%pairs%lambda - now%pairs%lambda(i)) <= &
            cancelled*abs(cluster%centre)), i=1, size(now%errors))])
      end function is_settled
   end subroutine polish

   pure integer function count_of(cluster, lambda)
      type(cluster_type), intent(in) :: cluster
      complex(wp), intent(in) :: lambda(:)

      count_of = size(lambda)
      if (cluster%on_axis) count_of = count_of + count(abs(aimag(lambda)) > 0)
   end function count_of

   pure real(wp) function worst(self)
      class(polished_type), intent(in) :: self

      worst = maxval([0.0_wp, self%errors])
   end function worst

   ! What is complete before what is not; of that what has more, of this what is known best.
   pure logical function is_better(now, before)
      type(polished_type), intent(in) :: now, before

      if (now%complete .neqv. before%complete) then
         is_better = now%complete
      else if (now%complete .and. now%eigenvalues /= before%eigenvalues) then
         is_better = now%eigenvalues > before%eigenvalues
      else
         is_better = now%eigenvalues > 0 .and. (before%eigenvalues == 0 .or. now%worst() < before%worst())
      end if
   end function is_better

   ! On the real axis the real and, of complex ones, the imaginary parts.
   subroutine begin_states(members, cluster, unit, guards, random_state, states, error)
      type(eigenpairs_type), intent(in) :: members
      type(cluster_type), intent(in) :: cluster
      real(wp), intent(in) :: unit
      integer, intent(in) :: guards
      integer(long), intent(inout) :: random_state
      !> 2 n x p, orthonormal.
      complex(wp), allocatable, intent(out) :: states(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: state(2*members%rows())
      integer :: j, k, n, p

      n = members%rows()
      p = size(members%lambda)
      if (cluster%on_axis) p = p + count(abs(aimag(members%lambda)) > 0)
      call require_memory(16.0_wp*(p + guards)*(9*n + 2*size(members%xi, 1)), "mode shapes", error)
      if (allocated(error)) return
      allocate (states(2*n, p))
      k = 0
      do j = 1, size(members%lambda)
         k = k + 1
         state(:n) = members%column(j)
         state(n + 1:) = members%lambda(j)/unit*state(:n)
         states(:, k) = state
         if (.not. cluster%on_axis) cycle
         states(:, k) = real(state, wp)
         if (.not. abs(aimag(members%lambda(j))) > 0) cycle
         k = k + 1
         states(:, k) = aimag(state)
      end do
      call add_random(guards, random_state, states)
      call make_orthonormal(states)
   end subroutine begin_states

   ! Random vectors behind all there is.
   subroutine add_random(guards, random_state, states)
      integer, intent(in) :: guards
      integer(long), intent(inout) :: random_state
      complex(wp), allocatable, intent(inout) :: states(:, :)
      complex(wp), allocatable :: more(:, :)
      real(wp) :: random(size(states, 1))
      integer :: k, p

      p = size(states, 2)
      allocate (more(size(states, 1), p + guards))
      more(:, :p) = states
      do k = p + 1, p + guards
         call random_vector(random_state, random)
         more(:, k) = random
      end do
      call move_alloc(more, states)
   end subroutine add_random

   ! As many as are independent.
   subroutine make_orthonormal(states)
      complex(wp), allocatable, intent(inout) :: states(:, :)
      complex(wp) :: coefficients(size(states, 2), size(states, 2))
      integer :: kept

      call orthonormalize(states, 1, coefficients, kept)
      if (kept < size(states, 2)) states = states(:, :kept)
   end subroutine make_orthonormal

   ! The operator on orthonormal states.
   subroutine apply(self, problem, shift, states, images, solutions, error)
      class(polisher_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: shift, states(:, :)
      !> 2 n x p, and [x'; xi], (n + m) x p.
      complex(wp), allocatable, intent(out) :: images(:, :), solutions(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: x(:, :), force(:, :)
      real(wp) :: unit
      integer :: n, p, j

      n = problem%unknowns()
      p = size(states, 2)
      unit = abs(shift)
      allocate (images(2*n, p))
      allocate (x, source=states(:n, :))
      allocate (solutions(n + size(self%factors), p), force(n, p), source=(0.0_wp, 0.0_wp))
      call problem%damping%add_product((-1.0_wp, 0.0_wp), x, force)
      x = unit*states(n + 1:, :) + shift*x
      call problem%mass%add_product((-1.0_wp, 0.0_wp), x, force)
      solutions(:n, :) = force
      call self%solver%solve(solutions, error)
      if (allocated(error)) return
      images(:n, :) = solutions(:n, :)
      images(n + 1:, :) = (states(:n, :) + shift*solutions(:n, :))/unit
      do j = 1, p
         solutions(n + 1:, j) = self%factors*solutions(n + 1:, j)
      end do
   end subroutine apply

   ! The Ritz pairs, on the real axis one of each conjugate pair; or what comes nearest to an eigenvector of each given lambda.
   subroutine find_pairs(cluster, shift, states, images, solutions, found, error, lambda)
      type(cluster_type), intent(in) :: cluster
      complex(wp), intent(in) :: shift, states(:, :), images(:, :), solutions(:, :)
      type(eigenpairs_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      complex(wp), optional, intent(in) :: lambda(:)
      complex(wp), dimension(size(images, 2), size(images, 2)) :: t, u
      complex(wp), allocatable :: y(:, :), taken(:, :)
      real(wp), dimension(size(images, 2), size(images, 2)) :: real_t, real_u
      complex(wp) :: mu(size(images, 2))
      integer, allocatable :: chosen(:)
      real(wp) :: noise
      integer :: n, p, j

      noise = cancelled*abs(shift)/abs(shift - cluster%centre)
      n = size(images, 1)/2
      p = size(images, 2)
      t = matmul(conjg(transpose(states)), images)
      if (present(lambda)) then
         allocate (found%lambda, source=lambda)
         allocate (y, source=fitted(t, 1/(lambda - shift), above_all_rounding*abs(shift)))
      else if (cluster%on_axis) then
         real_t = real(t, wp)
         call schur_form(real_t, real_u, mu, error)
         if (allocated(error)) return
         ! That of mu with a negative imaginary part has a positive one.
         chosen = pack([(j, j=1, p)], aimag(mu) <= 0 .and. abs(mu) > 0)
         call independent_eigenvectors(real_t, noise, chosen, y)
         y = matmul(real_u, y)
      else
         call schur_form(t, u, mu, error)
         if (allocated(error)) return
         chosen = pack([(j, j=1, p)], abs(mu) > 0)
         call independent_eigenvectors(t, noise, chosen, y)
         y = matmul(u, y)
      end if
      if (.not. present(lambda)) allocate (found%lambda, source=shift + 1/mu(chosen))
      allocate (taken, source=matmul(solutions, y))
      allocate (found%phi, source=taken(:n, :))
      allocate (found%xi, source=taken(n + 1:, :))
      allocate (found%paired, source=abs(aimag(found%lambda)) > 0)
      do j = 1, size(found%lambda)
         call normalize(found, j)
      end do
   end subroutine find_pairs

   ! The combinations y of states of least ||(T - mu) y||. An eigenvector of T would have an eigenvalue of its own: roots of a
   ! defective one are split by rounding. Of copies each is orthogonal to those before it, where that costs no more than noise.
   function fitted(t, mu, noise) result(y)
      complex(wp), intent(in) :: t(:, :), mu(:)
      !> Of T, relative to mu^2.
      real(wp), intent(in) :: noise
      complex(wp) :: y(size(t, 1), size(mu)), vt(size(t, 1), size(t, 1)), a(size(t, 1) + size(mu), size(t, 1)), no_u(1, 1), &
         work(8*size(a, 1))
      real(wp) :: singular(size(t, 1)), rwork(5*size(t, 1))
      integer :: i, j, p, info

      p = size(t, 1)
      y = 0
      do j = 1, size(mu)
         a(:p, :) = t
         do i = 1, p
            a(i, i) = t(i, i) - mu(j)
         end do
         a(p + 1:, :) = noise*abs(mu(j))**2*conjg(transpose(y))
         call zgesvd("N", "A", size(a, 1), p, a, size(a, 1), singular, no_u, 1, vt, p, work, size(work), rwork, info)
         if (info == 0) y(:, j) = conjg(vt(p, :))
      end do
   end function fitted
end module kschur_polish
