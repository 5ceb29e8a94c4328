!> Conjugate pairs that an iteration took for two real eigenvalues.
module kschur_real_pairs
   use kschur_backward_error, only: backward_errors
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_kinds, only: long, wp
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_refine, only: factor_beside, step_from
   use kschur_saddle, only: saddle_blocks
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: real_tolerance, same_value
   implicit none
   private
   public :: join_real_pairs

contains

   !> Two real eigenpairs that inverse iteration from the real axis made no better, of one eigenvalue or nearly so, may be a
   !> conjugate pair beside the axis: the space of both is iterated, and P projected on it. Where that has a pair with a
   !> tenth of the backward errors at most, both become its upper one. Where a list ends one of the two may be beyond its end:
   !> the last one is looked at alone, too, beside a random shape.
   subroutine join_real_pairs(problem, factors, above, is_cut, solver, pairs, errors, joined, gone, effort, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> The backward error that is good enough.
      real(wp), intent(in) :: above
      !> Whether there may be more pairs behind the last one.
      logical, intent(in) :: is_cut
      class(complex_linear_solver_type), intent(inout) :: solver
      type(eigenpairs_type), intent(inout) :: pairs
      !> The backward error of each pair.
      real(wp), intent(in) :: errors(:)
      !> Which became such a pair; which of these is the second of two.
      logical, intent(out) :: joined(:), gone(:)
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      type(csr_matrix_type) :: blocks(3)
      type(eigenpairs_type) :: both
      logical, dimension(size(errors)) :: poor, near
      complex(wp) :: s
      real(wp) :: new_errors(2)
      integer :: i, j

      joined = .false.
      gone = .false.
      poor = errors > above .and. abs(pairs%lambda) > 0 .and. .not. abs(aimag(pairs%lambda)) > 0
      do j = 1, size(errors)
         if (.not. poor(j)) cycle
         near = abs(pairs%lambda - pairs%lambda(j)) <= same_value*abs(pairs%lambda(j))
         i = findloc(poor(:j - 1) .and. .not. joined(:j - 1) .and. near(:j - 1), .true., 1)
         if (i == 0 .and. is_cut .and. j == size(errors) .and. count(near) == 1) i = j
         if (i == 0) cycle
         if (is_stopped(monitor)) return
         if (blocks(1)%rows == 0) call saddle_blocks(problem, factors, blocks, error)
         if (allocated(error)) return
         both = two_of(pairs, i, j)
         call factor_beside(problem, blocks, both%lambda(1), solver, s, error)
         if (.not. allocated(error)) then
            call effort%add_factors(solver)
            call iterate_both(problem, factors, solver, s, both, error)
         end if
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_convergence, error_cancelled])) return
            deallocate (error)
            cycle
         end if
         call project(problem, both)
         if (.not. aimag(both%lambda(1)) > real_tolerance*abs(both%lambda(1))) cycle
         new_errors = backward_errors(problem, both)
         if (.not. new_errors(1) <= 0.1_wp*min(errors(i), errors(j))) cycle
         call put(both, pairs, i)
         call put(both, pairs, j)
         joined([i, j]) = .true.
         gone(j) = i < j
      end do
   end subroutine join_real_pairs

   function two_of(pairs, i, j) result(both)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: i, j
      type(eigenpairs_type) :: both
      integer :: k

      both = chosen_pairs(pairs, [(k == i .or. k == j, k=1, size(pairs%lambda))])
      if (i == j) call append_pairs(both, random_beside(both))
   end function two_of

   ! A random shape for the eigenvalue of a pair.
   function random_beside(pair) result(other)
      type(eigenpairs_type), intent(in) :: pair
      type(eigenpairs_type) :: other
      integer(long) :: state
      real(wp) :: shape(pair%rows())

      state = state_of_seed(1)
      call random_vector(state, shape)
      other = pair
      other%phi(:, 1) = shape
      other%xi = 0
   end function random_beside

   subroutine put(both, pairs, j)
      type(eigenpairs_type), intent(in) :: both
      type(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j

      pairs%lambda(j) = both%lambda(1)
      pairs%phi(:, j) = both%phi(:, 1)
      pairs%xi(:, j) = both%xi(:, 1)
   end subroutine put

   ! Their shapes become an orthonormal basis of an invariant space.
   subroutine iterate_both(problem, factors, solver, s, both, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: factors(:)
      !> Factored at s.
      class(complex_linear_solver_type), intent(inout) :: solver
      complex(wp), intent(in) :: s
      type(eigenpairs_type), intent(inout) :: both
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 3
      complex(wp), allocatable :: y(:, :)
      complex(wp) :: unused, part
      real(wp) :: length
      integer :: n, j, pass, step

      n = both%rows()
      do step = 1, steps
         do j = 1, 2
            call step_from(problem, solver, s, both, j, y, unused, error)
            if (allocated(error)) return
            both%phi(:, j) = y(:n, 1)
            both%xi(:, j) = factors*y(n + 1:, 1)
         end do
         do j = 1, 2
            do pass = 1, 2
               if (j == 2) then
                  part = dot_product(both%phi(:, 1), both%phi(:, 2))
                  both%phi(:, 2) = both%phi(:, 2) - part*both%phi(:, 1)
                  both%xi(:, 2) = both%xi(:, 2) - part*both%xi(:, 1)
               end if
               length = max(dznrm2(n, both%phi(:, j), 1), tiny(1.0_wp))
               both%phi(:, j) = both%phi(:, j)/length
               both%xi(:, j) = both%xi(:, j)/length
            end do
         end do
      end do
   end subroutine iterate_both

   ! The first one becomes the upper one of the roots of Y^* P(lambda) Y beside its eigenvalue, by Newton's method: (A + d B) z = 0
   ! with A = Y^* P(lambda) Y, B = Y^* P'(lambda) Y.
   subroutine project(problem, both)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(inout) :: both
      integer, parameter :: steps = 2
      complex(wp), dimension(both%rows(), 2) :: force, slope
      complex(wp) :: a(2, 2), b(2, 2), g(2, 2), z(2), lambda, roots(2), root, determinant
      integer :: next, step

      lambda = both%lambda(1)
      do step = 1, steps
         force = 0
         slope = 0
         call problem%mass%add_product(lambda**2, both%phi, force)
         call problem%damping%add_product(lambda, both%phi, force)
         call problem%stiffness%add_product((1.0_wp, 0.0_wp), both%phi, force)
         call problem%mass%add_product(2*lambda, both%phi, slope)
         call problem%damping%add_product((1.0_wp, 0.0_wp), both%phi, slope)
         a = matmul(conjg(transpose(both%phi)), force)
         b = matmul(conjg(transpose(both%phi)), slope)
         determinant = b(1, 1)*b(2, 2) - b(1, 2)*b(2, 1)
         if (.not. abs(determinant) > 0) return
         g = -matmul(reshape([b(2, 2), -b(2, 1), -b(1, 2), b(1, 1)], [2, 2]), a)/determinant
         root = sqrt(((g(1, 1) - g(2, 2))/2)**2 + g(1, 2)*g(2, 1))
         roots = (g(1, 1) + g(2, 2))/2 + [root, -root]
         next = maxloc(aimag(lambda + roots), 1)
         z = [g(1, 2), roots(next) - g(1, 1)]
         if (maxval(abs(z)) < maxval(abs([roots(next) - g(2, 2), g(2, 1)]))) z = [roots(next) - g(2, 2), g(2, 1)]
         lambda = lambda + roots(next)
      end do
      both%lambda(1) = lambda
      both%phi(:, 1) = matmul(both%phi, z)
      both%xi(:, 1) = matmul(both%xi, z)
      call normalize(both, 1)
   end subroutine project
end module kschur_real_pairs
