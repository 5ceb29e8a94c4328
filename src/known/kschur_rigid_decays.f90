!> How fast damping stops rigid motions that it couples with others: eigenvalues so far below all frequencies that the rounding
!> of the stiffness hides them.
module kschur_rigid_decays
   use kschur_deflation, only: separate_by_damping
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesv, dsygv
   use kschur_null_space, only: null_space_type
   use kschur_problem, only: modal_problem_type
   use kschur_tolerances, only: cancelled, contraction, dependent
   implicit none
   private
   public :: find_rigid_decays

   !> Motions above their multipliers, and products with the former.
   type :: states_type
      !> (n + m) x p, and twice n x p.
      real(wp), allocatable :: x(:, :), masses(:, :), dampers(:, :)
   end type states_type

contains

   !> The eigenvalues beside zero that the rigid motions N of a symmetric problem have where damping of them is weak. States
   !> X = N A + W with M X S^2 + R X S + K X + Cq^T Xi = 0 and a regular S satisfy N^T (M X S + R X) = 0, which the stiffness
   !> has no part in, and K W + Cq^T Xi = -(M X S + R X) S, which is small: solved in turns. None where that does not
   !> converge fast, and where none is hidden.
   subroutine find_rigid_decays(problem, rigid, number, zero_noise, lambda, x, error)
      type(modal_problem_type), intent(in) :: problem
      !> N, the null space of the stiffness.
      type(null_space_type), intent(inout) :: rigid
      !> So many there are: p.
      integer, intent(in) :: number
      !> Rounding of the stiffness hides what is below (1/s).
      real(wp), intent(in) :: zero_noise
      !> p numbers (1/s), real, and motions above multipliers, (n + m) x p; none: p = 0.
      real(wp), allocatable, intent(out) :: lambda(:), x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_turns = 20
      type(states_type) :: decaying, coasting, states
      real(wp), allocatable :: all(:, :), rates(:), w(:, :), before(:, :), s(:, :)
      logical, allocatable :: decays(:)
      real(wp) :: change, change_before, slowest
      integer :: n, turn, i
      logical :: done

      n = problem%unknowns()
      allocate (lambda(0), x(n + problem%multipliers(), 0))
      if (number <= 0) return
      allocate (all(size(x, 1), size(rigid%motions, 2)))
      all(:n, :) = rigid%motions
      all(n + 1:, :) = rigid%multipliers
      call separate_by_damping(problem, all, rates, done)
      if (.not. done) return
      allocate (decays(size(rates)), source=.false.)
      do i = 1, number
         decays(maxloc(abs(rates), 1, .not. decays)) = .true.
      end do
      slowest = minval(abs(rates), decays)
      ! It has to be clear which of them decay.
      if (slowest > zero_noise .or. any(abs(rates) > dependent*slowest .and. .not. decays)) return
      decaying = states_of(problem, all(:, pack([(i, i=1, size(rates))], decays)))
      coasting = states_of(problem, all(:, pack([(i, i=1, size(rates))], .not. decays)))
      allocate (w(size(x, 1), number), source=0.0_wp)
      change_before = huge(1.0_wp)
      do turn = 1, most_turns
         call combine(problem, decaying, coasting, w, states, s, done)
         if (.not. done) return
         before = w
         call rigid%pseudo_solve(-matmul(matmul(states%masses, s) + states%dampers, s), w, error)
         if (allocated(error)) return
         change = maxval(norm2(w(:n, :) - before(:n, :), 1)/norm2(states%x(:n, :), 1))
         done = change <= cancelled
         if (done .or. .not. change <= contraction*change_before) exit
         change_before = change
      end do
      if (done) call combine(problem, decaying, coasting, w, states, s, done)
      if (done) call diagonalize(states, s, lambda, x)
   end subroutine find_rigid_decays

   ! The states and S that belong to W.
   subroutine combine(problem, decaying, coasting, w, states, s, done)
      type(modal_problem_type), intent(in) :: problem
      type(states_type), intent(in) :: decaying, coasting
      real(wp), intent(in) :: w(:, :)
      type(states_type), intent(out) :: states
      real(wp), allocatable, intent(out) :: s(:, :)
      logical, intent(out) :: done
      real(wp), allocatable :: b(:, :)

      states = states_of(problem, decaying%x + w)
      s = solution(form(decaying, states%masses), -form(decaying, states%dampers), done)
      if (.not. done .or. size(coasting%x, 2) == 0) return
      ! B S = -N2^T (M X S + R X), as the motions N2 that coast are of unit inertia and undamped.
      b = transpose(solution(transpose(s), -transpose(form(coasting, matmul(states%masses, s) + states%dampers)), done))
      states%x = states%x + matmul(coasting%x, b)
      states%masses = states%masses + matmul(coasting%masses, b)
      states%dampers = states%dampers + matmul(coasting%dampers, b)
   end subroutine combine

   ! Eigenpairs of X S: for the form X^T M X S + S^T X^T M X + X^T R X, S is self-adjoint. None where that is not definite.
   subroutine diagonalize(states, s, lambda, x)
      type(states_type), intent(in) :: states
      real(wp), intent(in) :: s(:, :)
      real(wp), allocatable, intent(inout) :: lambda(:), x(:, :)
      real(wp) :: metric(size(s, 1), size(s, 1)), h(size(s, 1), size(s, 1)), values(size(s, 1)), work(10*size(s, 1) + 1)
      integer :: p, info

      p = size(s, 1)
      h = matmul(form(states, states%masses), s)
      metric = -(form(states, states%dampers) + h + transpose(h))
      h = matmul(metric, s)
      h = (h + transpose(h))/2
      call dsygv(1, "V", "U", p, h, p, metric, p, values, work, size(work), info)
      if (info /= 0) return
      lambda = values
      x = matmul(states%x, h)
   end subroutine diagonalize

   function states_of(problem, x) result(states)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: x(:, :)
      type(states_type) :: states
      integer :: n

      n = problem%unknowns()
      allocate (states%x, source=x)
      allocate (states%masses(n, size(x, 2)), states%dampers(n, size(x, 2)), source=0.0_wp)
      call problem%mass%add_product(1.0_wp, x(:n, :), states%masses)
      call problem%damping%add_product(1.0_wp, x(:n, :), states%dampers)
   end function states_of

   ! X^T F.
   pure function form(states, forces)
      type(states_type), intent(in) :: states
      real(wp), intent(in) :: forces(:, :)
      real(wp) :: form(size(states%x, 2), size(forces, 2))

      form = matmul(transpose(states%x(:size(forces, 1), :)), forces)
   end function form

   ! A^{-1} B.
   function solution(a, b, done)
      real(wp), intent(in) :: a(:, :), b(:, :)
      !> Whether A is regular.
      logical, intent(out) :: done
      real(wp) :: solution(size(b, 1), size(b, 2)), factors(size(a, 1), size(a, 2))
      integer :: pivots(size(a, 1)), info

      factors = a
      solution = b
      call dgesv(size(a, 1), size(b, 2), factors, size(a, 1), pivots, solution, size(b, 1), info)
      done = info == 0
   end function solution
end module kschur_rigid_decays
