!> Polishing of modes whose backward error is larger than it need be, as of modes
!> far from the shift or with a massless part.
module kschur_refine
   use kschur_clusters, only: cluster_of, cluster_type, new_cluster, offset, polish_cluster, steps
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, normalize
   use kschur_error, only: error_cancelled, error_type, error_convergence, error_singular
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_backward_error, only: backward_errors
   use kschur_problem, only: damping_general, damping_none, modal_problem_type
   use kschur_outcome, only: inaccurate_above
   use kschur_saddle, only: saddle_blocks, saddle_structure
   use kschur_scaling, only: constraint_factors
   use kschur_settling, only: settle_pairs
   use kschur_shapes, only: depends
   use kschur_sparse, only: complex_combination, csr_matrix_type
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: confirm, factor_beside, refine, step_from

   ! The same as `offset` of a pair on the real axis or nearly so, relative to its imaginary part.
   real(wp), parameter :: of_imaginary = 0.1_wp
   ! A shape further from the one it began with, by the cosine of the angle, is that of another mode, unless its eigenvalue
   ! moved by no more than the backward error.
   real(wp), parameter :: same_shape = 0.9_wp

contains

   !> Inverse iteration on each pair above a backward error, with a factorisation of its
   !> own: with s close to lambda,
   !>
   !>     [P(s) Cq^T; Cq 0] [y; eta] = [((s + lambda) M + R) phi; 0]
   !>
   !> is solved by y = phi/(s - lambda), eta = xi/(s - lambda) if the pair is exact (the
   !> divided difference of P: Ruhe, SIAM J. Numer. Anal. 10 (1973)). What gets no better, or
   !> turns into a neighbour, which is there already, is left as it was: next to a defective eigenvalue all do. Those with
   !> neighbours that such a step cannot tell apart are polished together before.
   subroutine refine(problem, factors, above, solver, pairs, errors, effort, merged, more, error, monitor, fixed)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> The backward error that is good enough.
      real(wp), intent(in) :: above
      class(complex_linear_solver_type), intent(inout) :: solver
      type(eigenpairs_type), intent(inout) :: pairs
      !> The backward error of each pair.
      real(wp), intent(inout) :: errors(:)
      class(effort_type), intent(inout) :: effort
      !> Those that became one of a conjugate pair, whose other one is listed.
      logical, intent(out) :: merged(:)
      !> What was found beside those that were polished together; it may be known.
      type(eigenpairs_type), intent(out) :: more
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      !> Those that are not polished with others. Absent: none.
      logical, optional, intent(in) :: fixed(:)
      type(csr_matrix_type) :: blocks(3)
      type(eigenpairs_type) :: before, same
      complex(wp) :: s
      real(wp) :: error_before, error_same
      integer :: i, j, step
      logical :: one_by_one, better, undone

      merged = .false.
      more = chosen_pairs(pairs, spread(.false., 1, size(errors)))
      allocate (more%paired(0))
      if (.not. any(errors > above)) return
      ! Real shapes are orthogonal, as Lanczos has them.
      one_by_one = pairs%is_real()
      call pairs%make_complex()
      call saddle_blocks(problem, factors, blocks, error)
      if (.not. (allocated(error) .or. one_by_one)) call refine_clusters(problem, factors, blocks, above, solver, pairs, &
         errors, effort, merged, more, error, monitor, fixed)
      if (allocated(error)) return
      do j = 1, size(errors)
         if (.not. errors(j) > above .or. .not. abs(pairs%lambda(j)) > 0) cycle
         if (is_stopped(monitor)) return
         call factor_beside(problem, blocks, pairs%lambda(j), solver, s, error)
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_cancelled])) return
            deallocate (error)
            cycle
         end if
         call effort%add_factors(solver)
         before = chosen_pairs(pairs, [(i == j, i=1, size(errors))])
         error_before = errors(j)
         same = before
         error_same = error_before
         do step = 1, steps
            call improve(problem, factors, solver, s, j, pairs, errors(j), better, error)
            if (allocated(error)) then
               if (error%code /= error_convergence) return
               deallocate (error)
               exit
            end if
            if (is_same(before, error_before, j, pairs)) then
               same = chosen_pairs(pairs, [(i == j, i=1, size(errors))])
               error_same = errors(j)
            end if
            if (.not. better .or. errors(j) <= above) exit
         end do
         call put(same, pairs, j)
         errors(j) = error_same
         if (error_before > inaccurate_above) cycle
         call stay_apart(before, j, pairs, undone)
         if (undone) errors(j) = error_before
      end do
   end subroutine refine

   ! Of those above the backward error each that has neighbours, with them.
   subroutine refine_clusters(problem, factors, blocks, above, solver, pairs, errors, effort, merged, more, error, monitor, fixed)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: factors(:), above
      type(csr_matrix_type), intent(in) :: blocks(3)
      class(complex_linear_solver_type), intent(inout) :: solver
      type(eigenpairs_type), intent(inout) :: pairs
      real(wp), intent(inout) :: errors(:)
      class(effort_type), intent(inout) :: effort
      logical, intent(inout) :: merged(:)
      type(eigenpairs_type), intent(inout) :: more
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      logical, optional, intent(in) :: fixed(:)
      type(cluster_type) :: cluster
      type(eigenpairs_type) :: before, found
      real(wp) :: errors_before(size(errors))
      logical :: pending(size(errors))
      integer :: j

      pending = abs(pairs%lambda) > 0
      if (present(fixed)) pending = pending .and. .not. fixed
      do j = 1, size(errors)
         if (.not. (errors(j) > above .and. pending(j))) cycle
         if (is_stopped(monitor)) exit
         cluster = new_cluster(pairs, cluster_of(pairs%lambda, j, pending))
         pending(cluster%members) = .false.
         ! Shapes of oscillators are real, and copies would be mixed.
         if (problem%damping_kind == damping_none .or. &
            (problem%damping_kind /= damping_general .and. .not. cluster%closed)) cycle
         if (size(cluster%members) == 1) cycle
         call factor_at(problem, blocks, cluster%shift, solver, error)
         if (.not. allocated(error)) then
            call effort%add_factors(solver)
            before = pairs
            errors_before = errors
            found = more
            call polish_cluster(problem, factors, cluster, above, solver, pairs, errors, merged, found, error)
            if (any_became_another(before, cluster%members, merged, pairs)) then
               pairs = before
               errors = errors_before
               merged(cluster%members) = .false.
            else
               more = found
            end if
         end if
         if (.not. allocated(error)) cycle
         if (all(error%code /= [error_singular, error_convergence, error_cancelled])) return
         deallocate (error)
      end do
   end subroutine refine_clusters

   ! Whether one of the members has the shape of others that it did not have before.
   logical function any_became_another(before, members, merged, pairs) result(became)
      type(eigenpairs_type), intent(in) :: before, pairs
      integer, intent(in) :: members(:)
      logical, intent(in) :: merged(:)
      logical :: others(size(merged))
      integer :: i

      became = .false.
      do i = 1, size(members)
         if (merged(members(i))) cycle
         others = .not. merged
         others(members(i)) = .false.
         became = depends(pairs, others, members(i))
         if (became) became = .not. depends(before, others, members(i))
         if (became) return
      end do
   end function any_became_another

   ! Whether pair j is the mode that it was.
   pure logical function is_same(before, error_before, j, pairs)
      type(eigenpairs_type), intent(in) :: before, pairs
      real(wp), intent(in) :: error_before
      integer, intent(in) :: j

      associate (lambda => before%lambda(1), shape => before%phi(:, 1))
         is_same = abs(pairs%lambda(j) - lambda) <= error_before*abs(lambda) .or. &
            abs(dot_product(shape, pairs%phi(:, j))) >= same_shape*norm2(abs(shape))
      end associate
   end function is_same

   ! Makes pair j again what it was, where it has become one of the others.
   subroutine stay_apart(before, j, pairs, undone)
      type(eigenpairs_type), intent(in) :: before
      integer, intent(in) :: j
      type(eigenpairs_type), intent(inout) :: pairs
      logical, intent(out) :: undone
      type(eigenpairs_type) :: after
      logical :: others(size(pairs%lambda))

      others = .true.
      others(j) = .false.
      undone = depends(pairs, others, j)
      if (.not. undone) return
      after = chosen_pairs(pairs, .not. others)
      call put(before, pairs, j)
      undone = .not. depends(pairs, others, j)
      if (.not. undone) call put(after, pairs, j)
   end subroutine stay_apart

   subroutine put(one, pairs, j)
      type(eigenpairs_type), intent(in) :: one
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j

      pairs%lambda(j) = one%lambda(1)
      pairs%phi(:, j) = one%phi(:, 1)
      pairs%xi(:, j) = one%xi(:, 1)
   end subroutine put

   !> Which of the doubtful pairs are eigenpairs: one step of inverse iteration beside them comes back to the eigenvalue,
   !> or to a shape that has it, as where the stiffness of a fine mesh rounds low eigenvalues away, and is none of the others.
   !> Where the matrices hardly see a shape, as that of an infinite eigenvalue, its backward error is small wherever
   !> rounding put it.
   subroutine confirm(problem, scaling, solver, pairs, doubtful, confirmed, effort, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> Of the constraints: one of `scaling_*`.
      integer, intent(in) :: scaling
      class(complex_linear_solver_type), intent(inout) :: solver
      type(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: doubtful(:)
      !> Also those that are not doubtful.
      logical, intent(out) :: confirmed(:)
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      ! So far beside it, relative to it: rounding of the factors must not hide how near it is.
      real(wp), parameter :: beside = 5.0e-4_wp
      type(csr_matrix_type) :: blocks(3)
      real(wp) :: factors(problem%multipliers())
      complex(wp), allocatable :: y(:, :)
      complex(wp) :: s, returned
      ! Confirmed, or not yet looked at: of two that are one mode, the worse may come first.
      logical :: possible(size(doubtful))
      integer :: j

      confirmed = .not. doubtful
      possible = .true.
      do j = 1, size(doubtful)
         if (confirmed(j)) cycle
         if (is_stopped(monitor)) return
         s = pairs%lambda(j)*(1 + beside)
         factors = constraint_factors(problem, scaling, s)
         call saddle_blocks(problem, factors, blocks, error)
         if (allocated(error)) return
         call factor_at(problem, blocks, s, solver, error)
         if (.not. allocated(error)) then
            call effort%add_factors(solver)
            call step_from(problem, solver, s, pairs, j, y, returned, error)
         end if
         if (.not. allocated(error)) then
            confirmed(j) = any(abs([returned, settled(problem, s, y, factors)] - pairs%lambda(j)) <= &
               same_value*abs(pairs%lambda(j)))
            if (confirmed(j)) confirmed(j) = .not. turns_into_another(pairs, possible, j, y)
         else if (any(error%code == [error_singular, error_convergence, error_cancelled])) then
            deallocate (error)
         else
            return
         end if
         possible(j) = confirmed(j)
      end do
   end subroutine confirm

   ! Whether the shape y at the end of a step is one of those with the eigenvalue of pair j, as its own was not.
   logical function turns_into_another(pairs, possible, j, y)
      type(eigenpairs_type), intent(in) :: pairs
      !> Which of the others count.
      logical, intent(in) :: possible(:)
      integer, intent(in) :: j
      complex(wp), intent(in) :: y(:, :)
      type(eigenpairs_type) :: neighbours
      logical :: chosen(size(possible))
      logical, allocatable :: others(:)
      integer :: i

      chosen = possible .and. abs(pairs%lambda - pairs%lambda(j)) <= same_value*abs(pairs%lambda(j))
      chosen(j) = .true.
      neighbours = chosen_pairs(pairs, chosen)
      call neighbours%make_complex()
      i = count(chosen(:j))
      allocate (others(count(chosen)), source=.true.)
      others(i) = .false.
      turns_into_another = .not. depends(neighbours, others, i)
      neighbours%phi(:, i) = y(:pairs%rows(), 1)
      if (turns_into_another) turns_into_another = depends(neighbours, others, i)
   end function turns_into_another

   ! The eigenvalue of the shape y at the end of a step, where it is near s; else s.
   complex(wp) function settled(problem, s, y, factors)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: s, y(:, :)
      real(wp), intent(in) :: factors(:)
      type(eigenpairs_type) :: pair
      real(wp), allocatable :: errors(:), bounds(:), uncertainty(:)
      integer :: n

      n = problem%unknowns()
      allocate (pair%lambda(1), source=s)
      allocate (pair%phi, source=y(:n, :)/norm2(abs(y(:n, :))))
      allocate (pair%xi(size(factors), 1))
      pair%xi(:, 1) = factors*y(n + 1:, 1)/norm2(abs(y(:n, :)))
      call settle_pairs(problem, pair, 0, errors, bounds, uncertainty)
      settled = pair%lambda(1)
   end function settled

   !> Factors where inverse iteration goes to an eigenvalue.
   subroutine factor_beside(problem, blocks, lambda, solver, s, error)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: blocks(3)
      complex(wp), intent(in) :: lambda
      class(complex_linear_solver_type), intent(inout) :: solver
      complex(wp), intent(out) :: s
      type(error_type), allocatable, intent(out) :: error

      s = lambda + offset*abs(lambda)
      ! The conjugate must not be as near.
      if (abs(aimag(lambda)) > 0 .and. abs(aimag(lambda)) < offset*abs(lambda)) &
         s = cmplx(real(lambda, wp), aimag(lambda)*(1 + of_imaginary), wp)
      call factor_at(problem, blocks, s, solver, error)
   end subroutine factor_beside

   subroutine factor_at(problem, blocks, s, solver, error)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: blocks(3)
      complex(wp), intent(in) :: s
      class(complex_linear_solver_type), intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error

      call solver%factorize(complex_combination([s**2, s, (1.0_wp, 0.0_wp)], blocks), saddle_structure(problem), error)
   end subroutine factor_at

   !> [y; eta] of pair j, and the eigenvalue that it tells.
   subroutine step_from(problem, solver, s, pairs, j, y, lambda, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factored at s.
      class(complex_linear_solver_type), intent(inout) :: solver
      complex(wp), intent(in) :: s
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      complex(wp), allocatable, intent(out) :: y(:, :)
      !> `huge` where it tells none.
      complex(wp), intent(out) :: lambda
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: phi(:, :), force(:, :)
      complex(wp) :: factor
      integer :: n

      n = problem%unknowns()
      lambda = huge(1.0_wp)
      allocate (y(n + problem%multipliers(), 1), phi(n, 1), force(n, 1), source=(0.0_wp, 0.0_wp))
      phi(:, 1) = pairs%column(j)
      call problem%mass%add_product(s + pairs%lambda(j), phi, force)
      call problem%damping%add_product((1.0_wp, 0.0_wp), phi, force)
      y(:n, :) = force
      call solver%solve(y, error)
      if (allocated(error)) return
      factor = dot_product(phi(:, 1), y(:n, 1))
      if (abs(factor) > 0) lambda = s - dznrm2(n, phi, 1)**2/factor
   end subroutine step_from

   ! One step on pair j.
   subroutine improve(problem, factors, solver, s, j, pairs, error_before, better, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: factors(:)
      class(complex_linear_solver_type), intent(inout) :: solver
      complex(wp), intent(in) :: s
      integer, intent(in) :: j
      type(eigenpairs_type), intent(inout) :: pairs
      real(wp), intent(inout) :: error_before
      logical, intent(out) :: better
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: pair
      complex(wp), allocatable :: rhs(:, :)
      real(wp) :: errors(1)
      integer :: n

      n = problem%unknowns()
      better = .false.
      allocate (pair%lambda(1))
      call step_from(problem, solver, s, pairs, j, rhs, pair%lambda(1), error)
      if (allocated(error) .or. abs(pair%lambda(1)) >= huge(1.0_wp)) return
      allocate (pair%phi(n, 1), source=rhs(:n, :))
      allocate (pair%xi(size(factors), 1))
      pair%xi(:, 1) = factors*rhs(n + 1:, 1)
      call normalize(pair, 1)
      errors = backward_errors(problem, pair)
      if (.not. errors(1) < error_before) then
         ! From a poor shape a step tells a better one, but no eigenvalue.
         pair%lambda(1) = pairs%lambda(j)
         errors = backward_errors(problem, pair)
      end if
      better = errors(1) < error_before
      if (.not. better) return
      error_before = errors(1)
      call put(pair, pairs, j)
   end subroutine improve
end module kschur_refine
