!> Polishing of the eigenpairs of one cluster: shift-and-invert subspace iteration with a shift next to it.
module kschur_polish
   use kschur_backward_error, only: backward_errors
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, keep_pairs, normalize
   use kschur_error, only: error_convergence, error_type, new_error
   use kschur_extended_residual, only: residual_of, violations_of
   use kschur_gram_schmidt_complex, only: orthonormalize
   use kschur_kinds, only: long, wp, xp
   use kschur_lapack, only: zgesvd
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type
   use kschur_memory, only: require_memory
   use kschur_outcome, only: inaccurate_above
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: independent_eigenvectors, schur_form
   use kschur_random, only: random_vector, state_of_seed
   use kschur_saddle, only: saddle_blocks, saddle_structure, shifted_saddle
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_split, only: cluster_type
   use kschur_tolerances, only: above_all_rounding, accepted_backward_error, cancelled, largest_offset, least_offset, &
      rounding_of_sums, slow_refinement
   implicit none
   private
   public :: polished_type, polisher_type

   ! Steps without progress after which the iteration ends.
   integer, parameter :: max_stagnant_steps = 5

   !> Polishes clusters of one problem, each with a factorization of its own.
   type :: polisher_type
      !> Backward error to reach.
      real(wp) :: tolerance = 0
      !> Size of eigenvalues (1/s) that takes the place of the centre where that is zero.
      real(wp) :: reference = 0
      !> Whether clusters are refined: iterated until their space is invariant to rounding, however small backward errors are. What
      !> leads out of the radius was no eigenvalue.
      logical :: refines = .false.
      !> The factors at the present shift.
      class(complex_linear_solver_type), allocatable :: solver
      ! Whether no constraint follows from others, so that the matrix is regular beside eigenvalues.
      logical, private :: regular = .false.
      ! Scale factor of each constraint.
      real(wp), allocatable, private :: factors(:)
      ! M, R and K, the latter with constraints; not allocated before the first cluster.
      type(csr_matrix_type), allocatable, private :: blocks(:)
      ! Cq^T.
      type(csr_matrix_type), private :: transposed
   contains
      !> Sets the tolerance and the solver.
      procedure :: begin
      !> Factors the problem at a shift next to a cluster.
      procedure :: factor_beside
      !> Computes the eigenpairs of the cluster with these factors.
      procedure :: polish
   end type polisher_type

   !> The polished eigenpairs of a cluster.
   type :: polished_type
      !> All eigenpairs within the radius of the cluster, one of each conjugate pair, `paired` if it stands for its conjugate too.
      type(eigenpairs_type) :: pairs
      !> Their backward errors.
      real(wp), allocatable :: errors(:)
      !> Number of eigenvalues, both of a conjugate pair counted if the cluster meets the real axis.
      integer :: eigenvalues = 0
      !> Norm of the part of the images of the space that is orthogonal to it, relative to the images.
      real(wp) :: residual = huge(1.0_wp)
      !> Whether all Ritz values within the cluster are accurate, and the space has room for more: there are no others then.
      logical :: complete = .false.
   contains
      !> The largest backward error.
      procedure :: worst
   end type polished_type

contains

   !> Sets the tolerance and the solver.
   subroutine begin(self, factors, redundant, tolerance, solver)
      class(polisher_type), intent(out) :: self
      !> Scale factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> Number of constraints that follow from others.
      integer, intent(in) :: redundant
      !> Backward error to reach.
      real(wp), intent(in) :: tolerance
      !> A prototype, of which a copy factors.
      class(complex_linear_solver_type), intent(in) :: solver

      self%tolerance = tolerance
      self%regular = redundant == 0
      allocate (self%factors, source=factors)
      allocate (self%solver, source=solver)
   end subroutine begin

   !> Factors the problem at a shift next to a cluster. A simple eigenvalue converges the faster the nearer the shift is. For
   !> several the distance exceeds their spread, so that all converge at one rate, and the splitting of a defective eigenvalue,
   !> whose chain would be lost next to its eigenvector otherwise; it is at most a fraction of the gap, so that the space converges.
   !> A zero is treated as several, as it may be an undamped double one. The shift is outside the discs, within which the matrix is
   !> singular to rounding.
   subroutine factor_beside(self, problem, cluster, shift, error)
      class(polisher_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      type(cluster_type), intent(in) :: cluster
      !> Where the problem was factored (1/s).
      complex(wp), intent(out) :: shift
      type(error_type), allocatable, intent(out) :: error
      ! Factors of the spread, and of the disc, within which the matrix is singular to rounding; and the largest part of the gap, by
      ! which a step reduces what lies beyond it.
      real(wp), parameter :: spread_factor = 1.5_wp, disc_factor = 10, gap_fraction = 1/30.0_wp
      type(matrix_structure_type) :: structure
      real(wp) :: distance, unit

      if (.not. allocated(self%blocks)) then
         allocate (self%blocks(3))
         self%transposed = transpose_csr(problem%constraints)
         call saddle_blocks(problem, self%factors, self%blocks, error)
         if (allocated(error)) return
      end if
      unit = merge(abs(cluster%centre), self%reference, abs(cluster%centre) > 0)
      distance = max(least_offset*unit, spread_factor*cluster%spread)
      if (size(cluster%members) > 1 .or. .not. abs(cluster%centre) > 0) &
         distance = max(distance, min(largest_offset*unit, gap_fraction*cluster%gap))
      distance = max(distance, min(disc_factor*cluster%disc, gap_fraction*cluster%gap))
      shift = cluster%centre + distance
      structure = saddle_structure(problem)
      structure%regular = self%regular
      call self%solver%factorize(shifted_saddle(problem, self%blocks, shift), structure, error)
   end subroutine factor_beside

   !> Computes the eigenpairs of a cluster by subspace iteration, from the states [x; lambda x/u], u = |s|, of its members, and from
   !> random vectors for members that are missing. Each step solves at the shift s
   !>
   !>     [P(s) Cq^T; Cq 0] [x'; xi] = -[M v + (R + s M) x; 0],  v' = x + s x',
   !>
   !> and selects the Ritz pairs within the radius of the cluster, until they are accurate and no longer change. A cluster on the
   !> real axis is iterated with a real space, whose real Schur form tells two real eigenvalues from a conjugate pair. Copies of a
   !> multiple eigenvalue, and the roots of a defective one, are found as many as the space holds. If eigenvalues are given,
   !> computes one shape for each of these instead.
   subroutine polish(self, problem, cluster, shift, members, worst, n_random, polished, error, lambda)
      class(polisher_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      type(cluster_type), intent(in) :: cluster
      !> Shift of the factors (1/s).
      complex(wp), intent(in) :: shift
      !> The members, with complex shapes.
      type(eigenpairs_type), intent(in) :: members
      !> Their largest backward error.
      real(wp), intent(in) :: worst
      !> Number of random vectors behind the members.
      integer, intent(in) :: n_random
      type(polished_type), intent(out) :: polished
      type(error_type), allocatable, intent(out) :: error
      !> Known eigenvalues (1/s) whose shapes are computed. Absent: Ritz values are taken.
      complex(wp), optional, intent(in) :: lambda(:)
      ! Largest dimension of the space.
      integer, parameter :: largest = 200
      ! Orthonormal states and their images, 2 n x p, the projection of these on the states, p x p, and the solutions [x'; xi],
      ! (n + m) x p.
      complex(wp), allocatable :: states(:, :), images(:, :), projected(:, :), solutions(:, :)
      type(polished_type) :: current, previous
      real(wp) :: limit, least, progress
      integer(long) :: random_state
      integer :: n, step, inside, filled
      logical :: settled, others_left, accurate, accurate_before

      n = problem%unknowns()
      random_state = state_of_seed(0)
      limit = max(self%tolerance, min(10*worst, inaccurate_above))
      ! Only what leads out of the cluster was no eigenvalue.
      if (self%refines) limit = max(limit, accepted_backward_error)
      polished%pairs = chosen_pairs(members, spread(.false., 1, size(members%lambda)))
      allocate (polished%pairs%paired(0), polished%errors(0))
      previous = polished
      call begin_states()
      if (allocated(error)) return
      step = 0
      filled = 0
      accurate_before = .false.
      least = huge(1.0_wp)
      do while (step < max_stagnant_steps .and. size(states, 2) > 0)
         step = step + 1
         call apply_shift_invert()
         if (allocated(error)) return
         projected = matmul(conjg(transpose(states)), images)
         call find_ritz_pairs(current%pairs)
         if (allocated(error)) return
         if (.not. present(lambda)) &
            call keep_pairs(current%pairs, abs(current%pairs%lambda - cluster%centre) <= cluster%radius)
         inside = cluster%count_eigenvalues(current%pairs%lambda)
         if (allocated(current%errors)) deallocate (current%errors)
         allocate (current%errors, source=backward_errors(problem, current%pairs))
         current%residual = norm2(abs(images - matmul(states, projected)))/norm2(abs(images))
         progress = merge(current%residual, current%worst(), self%refines)
         if (size(current%errors) > 0 .and. 2*progress < least) then
            least = progress
            step = 0
         end if
         accurate = size(current%errors) > 0 .and. current%worst() <= self%tolerance .and. &
            (n_random == 0 .or. inside < size(states, 2))
         ! One step may lead Ritz values out of the cluster that come back: fewer than the members must stay for another step.
         current%complete = accurate .and. (accurate_before .or. inside >= cluster%count_eigenvalues(members%lambda))
         accurate_before = accurate
         if (.not. present(lambda)) then
            call keep_pairs(current%pairs, current%errors <= limit)
            current%errors = pack(current%errors, current%errors <= limit)
         end if
         current%eigenvalues = cluster%count_eigenvalues(current%pairs%lambda)
         ! What settles is preferred to what had more Ritz values within the cluster: one that leaves is no eigenvalue there.
         others_left = is_settled(current, previous) .and. current%eigenvalues < polished%eigenvalues
         settled = others_left .or. is_settled(current, polished)
         if (self%refines .or. others_left .or. is_better(current, polished)) then
            polished = current
            if (settled) exit
         end if
         previous = current
         call move_alloc(images, states)
         ! If all Ritz values are within the cluster the space may be too small: adds random vectors, unless the last ones found
         ! nothing.
         if (n_random > 0 .and. inside == size(states, 2) .and. inside > filled .and. inside < largest) then
            call add_random()
            filled = inside
            step = 0
         end if
         call make_orthonormal(states)
      end do

   contains

      ! Whether another step can change nothing: a complete single eigenvalue next to the shift at once, others if they stayed where
      ! they were.
      logical function is_settled(current, before) result(settled)
         type(polished_type), intent(in) :: current, before
         integer :: i

         settled = current%complete .and. current%eigenvalues >= size(members%lambda)
         if (.not. settled) return
         if (self%refines) then
            settled = current%residual <= rounding_of_sums
         else if (size(members%lambda) /= 1 .or. current%eigenvalues > 1 .or. cluster%disc > 0) then
            settled = current%eigenvalues == before%eigenvalues .and. all([(any(abs(before%pairs%lambda - &
               current%pairs%lambda(i)) <= cancelled*abs(cluster%centre)), i=1, size(current%errors))])
         end if
      end function is_settled

      ! Sets orthonormal start states from the members and random vectors: of a cluster on the real axis the real and imaginary
      ! parts.
      subroutine begin_states()
         complex(wp) :: state(2*n)
         integer :: j, k, p

         p = cluster%count_eigenvalues(members%lambda)
         call require_memory(16.0_wp*(p + n_random)*(9*n + 2*size(members%xi, 1)), "mode shapes", error)
         if (allocated(error)) return
         allocate (states(2*n, p))
         k = 0
         do j = 1, size(members%lambda)
            k = k + 1
            state = [members%phi(:, j), members%lambda(j)/abs(shift)*members%phi(:, j)]
            states(:, k) = state
            if (.not. cluster%on_axis) cycle
            states(:, k) = real(state, wp)
            if (.not. abs(aimag(members%lambda(j))) > 0) cycle
            k = k + 1
            states(:, k) = aimag(state)
         end do
         call add_random()
         call make_orthonormal(states)
      end subroutine begin_states

      ! Appends random vectors.
      subroutine add_random()
         real(wp) :: random(size(states, 1), n_random)
         integer :: k

         if (n_random == 0) return
         do k = 1, n_random
            call random_vector(random_state, random(:, k))
         end do
         states = reshape([states, cmplx(random, kind=wp)], [size(states, 1), size(states, 2) + n_random])
      end subroutine add_random

      ! Applies the shift-invert operator to orthonormal states [x; w]. The solutions are refined (Higham 2002, section 12.1) by
      ! residuals in extended precision,
      !
      !     M (s v' + u w) + R v' + K x' + Cq^T xi,  v' = x + s x',
      !
      ! so that errors of Ritz values lambda = s + 1/mu are those of mu, times the small distance from the shift.
      subroutine apply_shift_invert()
         complex(wp), allocatable :: corrections(:, :)
         complex(xp) :: x(n), velocity(n), sigma
         real(wp) :: unit, change, last, rounding
         integer :: p, j

         p = size(states, 2)
         if (allocated(images)) deallocate (images)
         if (allocated(solutions)) deallocate (solutions)
         unit = abs(shift)
         sigma = shift
         allocate (images(2*n, p))
         allocate (solutions(n + size(self%factors), p), corrections(n + size(self%factors), p), source=(0.0_wp, 0.0_wp))
         last = huge(1.0_wp)
         do
            do j = 1, p
               x = solutions(:n, j)
               velocity = states(:n, j) + sigma*x
               corrections(:n, j) = -residual_of(problem, self%transposed, x, velocity, sigma*velocity + unit*states(n + 1:, j), &
                  solutions(n + 1:, j))
               corrections(n + 1:, j) = -self%factors*violations_of(problem%constraints, solutions(:n, j))
            end do
            call self%solver%solve(corrections, error)
            if (allocated(error)) return
            change = norm2(abs(corrections(:n, :)))
            if (.not. change <= huge(change)) call new_error(error, error_convergence, "a solution is not finite")
            if (allocated(error)) return
            rounding = epsilon(1.0_wp)*norm2(abs(solutions(:n, :)))
            if (.not. change <= max(slow_refinement*last, rounding)) exit
            do j = 1, p
               solutions(:n, j) = solutions(:n, j) + corrections(:n, j)
               solutions(n + 1:, j) = solutions(n + 1:, j) + self%factors*corrections(n + 1:, j)
            end do
            ! One more for entries below the rounding of the largest ones.
            if (last <= rounding) exit
            last = change
         end do
         images(:n, :) = solutions(:n, :)
         images(n + 1:, :) = (states(:n, :) + shift*solutions(:n, :))/unit
      end subroutine apply_shift_invert

      ! Computes the Ritz pairs of a space, on the real axis one of each conjugate pair; or for each given lambda the vector nearest
      ! to an eigenvector.
      subroutine find_ritz_pairs(found)
         type(eigenpairs_type), intent(out) :: found
         complex(wp), dimension(size(images, 2), size(images, 2)) :: t, u
         complex(wp), allocatable :: y(:, :), combined(:, :)
         real(wp), dimension(size(images, 2), size(images, 2)) :: real_t, real_u
         complex(wp) :: mu(size(images, 2))
         integer, allocatable :: chosen(:)
         real(wp) :: noise
         integer :: p, j

         noise = cancelled*abs(shift)/abs(shift - cluster%centre)
         p = size(images, 2)
         t = projected
         if (present(lambda)) then
            allocate (found%lambda, source=lambda)
            allocate (y, source=nearest_eigenvectors(t, 1/(lambda - shift), above_all_rounding*abs(shift)))
         else if (cluster%on_axis) then
            real_t = real(t, wp)
            call schur_form(real_t, real_u, mu, error)
            if (allocated(error)) return
            call split_pairs(noise, real_t, mu)
            ! Im lambda > 0 belongs to Im mu < 0.
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
         allocate (combined, source=matmul(solutions, y))
         allocate (found%phi, source=combined(:n, :))
         allocate (found%xi, source=combined(n + 1:, :))
         allocate (found%paired, source=abs(aimag(found%lambda)) > 0)
         do j = 1, size(found%lambda)
            call normalize(found, j)
         end do
      end subroutine find_ritz_pairs
   end subroutine polish

   ! Takes conjugate pairs of a real Schur form whose coupling is noise as two copies of a real eigenvalue: both Schur vectors are
   ! eigenvectors then.
   pure subroutine split_pairs(noise, t, values)
      !> Relative to the eigenvalue.
      real(wp), intent(in) :: noise
      real(wp), intent(inout) :: t(:, :)
      complex(wp), intent(inout) :: values(:)
      integer :: j

      do j = 1, size(values) - 1
         if (.not. abs(t(j + 1, j)) > 0 .or. max(abs(t(j, j + 1)), abs(t(j + 1, j))) > noise*abs(t(j, j))) cycle
         t(j + 1, j) = 0
         values(j:j + 1) = real(values(j:j + 1), wp)
      end do
   end subroutine split_pairs

   !> The largest backward error, 0 if there are no pairs.
   pure real(wp) function worst(self)
      class(polished_type), intent(in) :: self

      worst = maxval([0.0_wp, self%errors])
   end function worst

   ! Whether a result is better than the one before: complete rather than incomplete; of complete ones that with more eigenvalues,
   ! then that with the smaller backward error.
   pure logical function is_better(current, before)
      type(polished_type), intent(in) :: current, before

      if (current%complete .neqv. before%complete) then
         is_better = current%complete
      else if (current%complete .and. current%eigenvalues /= before%eigenvalues) then
         is_better = current%eigenvalues > before%eigenvalues
      else
         is_better = current%eigenvalues > 0 .and. (before%eigenvalues == 0 .or. current%worst() < before%worst())
      end if
   end function is_better

   ! Orthonormalizes states, and drops those that depend on others.
   subroutine make_orthonormal(states)
      complex(wp), allocatable, intent(inout) :: states(:, :)
      complex(wp) :: coefficients(size(states, 2), size(states, 2))
      integer :: kept

      call orthonormalize(states, 1, coefficients, kept)
      if (kept < size(states, 2)) states = states(:, :kept)
   end subroutine make_orthonormal

   ! Unit vectors y that minimize ||(T - mu) y|| for given mu, by singular vectors. Eigenvectors of T would belong to its own
   ! eigenvalues: the roots of a defective one are split by rounding. A term of the size of the noise makes the vectors of copies
   ! orthogonal to each other, as far as that costs no more than noise.
   function nearest_eigenvectors(t, mu, noise) result(y)
      complex(wp), intent(in) :: t(:, :), mu(:)
      !> Noise of T, relative to mu^2.
      real(wp), intent(in) :: noise
      ! One column more than there are: OpenBLAS reads a number beyond the end.
      complex(wp) :: y(size(t, 1), size(mu)), vt(size(t, 1), size(t, 1) + 1), a(size(t, 1) + size(mu), size(t, 1) + 1), &
         no_u(1, 1), work(8*size(a, 1))
      real(wp) :: singular(size(t, 1)), rwork(5*size(t, 1))
      integer :: i, j, p, info

      p = size(t, 1)
      y = 0
      do j = 1, size(mu)
         a(:p, :p) = t
         do i = 1, p
            a(i, i) = t(i, i) - mu(j)
         end do
         a(p + 1:, :p) = noise*abs(mu(j))**2*conjg(transpose(y))
         call zgesvd("N", "A", size(a, 1), p, a, size(a, 1), singular, no_u, 1, vt, p, work, size(work), rwork, info)
         if (info == 0) y(:, j) = conjg(vt(p, :p))
      end do
   end function nearest_eigenvectors
end module kschur_polish
