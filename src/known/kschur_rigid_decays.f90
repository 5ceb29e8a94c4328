!> Decay rates of rigid motions that damping couples with flexible ones: real eigenvalues so far below all frequencies that the
!> rounding of the stiffness hides them from an iteration.
module kschur_rigid_decays
   use kschur_deflation, only: diagonalize_damping
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesv, dsygv
   use kschur_null_space, only: null_space_type
   use kschur_problem, only: modal_problem_type
   use kschur_tolerances, only: cancelled, contraction, dependent
   implicit none
   private
   public :: find_rigid_decays

contains

   !> Computes the nonzero eigenvalues of weakly damped rigid motions N of a symmetric problem, by a fixed-point iteration for the
   !> invariant pair (X, S), X = N A + W, M X S^2 + R X S + K X + Cq^T Xi = 0 with regular S. In turns it solves
   !> N^T (M X S + R X) = 0, in which the stiffness and its rounding do not enter, for S and A, and
   !> K W + Cq^T Xi = -(M X S + R X) S, which is small, for W. Returns none if that does not converge fast, or if the eigenvalues
   !> are above `zero_noise`, where an iteration finds them.
   subroutine find_rigid_decays(problem, rigid, n_decays, zero_noise, lambda, x, error)
      type(modal_problem_type), intent(in) :: problem
      !> N, the null space of the stiffness.
      type(null_space_type), intent(inout) :: rigid
      !> Number of these eigenvalues, p.
      integer, intent(in) :: n_decays
      !> Eigenvalues below this (1/s) are hidden by rounding of the stiffness.
      real(wp), intent(in) :: zero_noise
      !> The eigenvalues, p real numbers (1/s), and motions above multipliers, (n + m) x p; none found: empty.
      real(wp), allocatable, intent(out) :: lambda(:), x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_turns = 20
      ! Motions above their multipliers: the parts of N that decay and that do not, and X.
      real(wp), allocatable :: decaying(:, :), undamped(:, :), states(:, :)
      real(wp), allocatable :: vectors(:, :), rates(:), w(:, :), w_before(:, :), s(:, :)
      logical, allocatable :: decays(:)
      real(wp) :: change, previous_change, slowest
      integer :: n, turn, i
      logical :: done

      n = problem%unknowns()
      allocate (lambda(0), x(n + problem%multipliers(), 0))
      if (n_decays <= 0) return
      allocate (vectors(size(x, 1), size(rigid%motions, 2)))
      vectors(:n, :) = rigid%motions
      vectors(n + 1:, :) = rigid%multipliers
      call diagonalize_damping(problem, vectors, rates, done)
      if (.not. done) return
      allocate (decays(size(rates)), source=.false.)
      do i = 1, n_decays
         decays(maxloc(abs(rates), 1, .not. decays)) = .true.
      end do
      slowest = minval(abs(rates), decays)
      ! The p largest rates must be clearly above the others, which must be zero to rounding.
      if (slowest > zero_noise .or. any(abs(rates) > dependent*slowest .and. .not. decays)) return
      decaying = vectors(:, pack([(i, i=1, size(rates))], decays))
      undamped = vectors(:, pack([(i, i=1, size(rates))], .not. decays))
      allocate (w(size(x, 1), n_decays), source=0.0_wp)
      previous_change = huge(1.0_wp)
      do turn = 1, most_turns
         call set_states()
         if (.not. done) return
         w_before = w
         call rigid%pseudo_solve(-matmul(forces(), s), w, error)
         if (allocated(error)) return
         change = maxval(norm2(w(:n, :) - w_before(:n, :), 1)/norm2(states(:n, :), 1))
         done = change <= cancelled
         if (done .or. .not. change <= contraction*previous_change) exit
         previous_change = change
      end do
      if (done) call set_states()
      if (done) call diagonalize()

   contains

      ! Sets X = N A + W and S for a given W: the part of N that decays enters with the unit matrix, the undamped part N2 such that
      ! N2^T (M X S + R X) = 0.
      subroutine set_states()
         real(wp), allocatable :: b(:, :)

         states = decaying + w
         s = solve_dense(work_of(decaying, problem%mass%product(states(:n, :))), &
            -work_of(decaying, problem%damping%product(states(:n, :))), done)
         if (.not. done .or. size(undamped, 2) == 0) return
         ! B S = -N2^T (M X S + R X), as the undamped motions N2 have N2^T M N2 = I and R N2 = 0.
         b = transpose(solve_dense(transpose(s), -transpose(work_of(undamped, forces())), done))
         states = states + matmul(undamped, b)
      end subroutine set_states

      ! Computes the eigenpairs of (X, S): S is self-adjoint in the form X^T M X S + S^T X^T M X + X^T R X. Leaves none if that form
      ! is not definite.
      subroutine diagonalize()
         real(wp) :: metric(size(s, 1), size(s, 1)), h(size(s, 1), size(s, 1)), values(size(s, 1)), work(10*size(s, 1) + 1)
         integer :: p, info

         p = size(s, 1)
         h = matmul(work_of(states, problem%mass%product(states(:n, :))), s)
         metric = -(work_of(states, forces()) + transpose(h))
         h = matmul(metric, s)
         h = (h + transpose(h))/2
         call dsygv(1, "V", "U", p, h, p, metric, p, values, work, size(work), info)
         if (info /= 0) return
         lambda = values
         x = matmul(states, h)
      end subroutine diagonalize

      ! M X S + R X.
      function forces()
         real(wp) :: forces(n, n_decays)

         forces = matmul(problem%mass%product(states(:n, :)), s) + problem%damping%product(states(:n, :))
      end function forces
   end subroutine find_rigid_decays

   ! The work X^T F of a block of forces on motions X, which stand above their multipliers.
   pure function work_of(x, forces) result(work)
      real(wp), intent(in) :: x(:, :), forces(:, :)
      real(wp) :: work(size(x, 2), size(forces, 2))

      work = matmul(transpose(x(:size(forces, 1), :)), forces)
   end function work_of

   ! Solves A X = B by LAPACK's dgesv.
   function solve_dense(a, b, is_regular)
      real(wp), intent(in) :: a(:, :), b(:, :)
      !> Whether A is regular.
      logical, intent(out) :: is_regular
      real(wp) :: solve_dense(size(b, 1), size(b, 2)), factors(size(a, 1), size(a, 2))
      integer :: pivots(size(a, 1)), info

      factors = a
      solve_dense = b
      call dgesv(size(a, 1), size(b, 2), factors, size(a, 1), pivots, solve_dense, size(b, 1), info)
      is_regular = info == 0
   end function solve_dense
end module kschur_rigid_decays
