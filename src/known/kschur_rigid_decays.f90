!> How fast damping stops rigid motions that it couples with others: eigenvalues so far below all frequencies that the rounding
!> of the stiffness hides them.
module kschur_rigid_decays
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesv, dsygv
   use kschur_problem, only: modal_problem_type
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   implicit none
   private
   public :: find_rigid_decays, rigid_decays_type

   !> Eigenpairs P(lambda) x + Cq^T xi = 0, Cq x = 0, with real eigenvalues.
   type :: rigid_decays_type
      !> p numbers (1/s).
      real(wp), allocatable :: lambda(:)
      !> n x p and m x p.
      real(wp), allocatable :: x(:, :), xi(:, :)
   end type rigid_decays_type

   ! Rigid motions that damping separates, M-orthonormal: N A1 that decay, and N A2 that do not.
   type :: separated_type
      !> n x p and n x (k - p).
      real(wp), allocatable :: decaying(:, :), coasting(:, :)
      !> Their multipliers.
      real(wp), allocatable :: of_decaying(:, :), of_coasting(:, :)
      !> The least rate of a decay (1/s).
      real(wp) :: slowest = 0
   end type separated_type

contains

   !> The eigenvalues beside zero that the rigid motions N of a symmetric problem have where damping of them is weak. States
   !> X = N A + W with M X S^2 + R X S + K X + Cq^T Xi = 0 and a regular S satisfy N^T (M X S + R X) = 0, which the stiffness
   !> has no part in, and K W + Cq^T Xi = -(M X S + R X) S, which is small: solved in turns. None where that does not
   !> converge fast, and where none is hidden.
   subroutine find_rigid_decays(decays, problem, factored, motions, multipliers, number, blur, error)
      type(rigid_decays_type), intent(out) :: decays
      type(modal_problem_type), intent(in) :: problem
      !> The stiffness.
      type(scaled_stiffness_type), intent(inout) :: factored
      !> N, n x k, and its multipliers, m x k.
      real(wp), intent(in) :: motions(:, :), multipliers(:, :)
      !> So many there are: p.
      integer, intent(in) :: number
      !> Rounding of the stiffness hides what is below (1/s).
      real(wp), intent(in) :: blur
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_turns = 20
      ! Of the length of a state, what solves leave of changes; of a change, the next one.
      real(wp), parameter :: settled = 1.0e-12_wp, fast = 0.1_wp
      type(separated_type) :: rigid
      real(wp), allocatable :: w(:, :), reactions(:, :), x(:, :), xi(:, :), s(:, :), forces(:, :), before(:, :)
      real(wp) :: change, change_before
      integer :: turn
      logical :: done

      allocate (decays%lambda(0), decays%x(size(motions, 1), 0), decays%xi(size(multipliers, 1), 0))
      if (number <= 0) return
      call separate(problem, motions, multipliers, number, rigid, done)
      if (.not. done .or. rigid%slowest > blur) return
      allocate (w(size(motions, 1), number), reactions(size(multipliers, 1), number), source=0.0_wp)
      allocate (before, source=w)
      change_before = huge(1.0_wp)
      do turn = 1, most_turns
         call combine(problem, rigid, w, reactions, x, xi, s, forces, done)
         if (.not. done) return
         before = w
         call factored%pseudo_solve(motions, -forces, w, error, reactions)
         if (allocated(error)) return
         change = maxval(norm2(w - before, 1)/norm2(x, 1))
         done = change <= settled
         if (done .or. .not. change <= fast*change_before) exit
         change_before = change
      end do
      if (done) call combine(problem, rigid, w, reactions, x, xi, s, forces, done)
      if (done) call diagonalize(problem, x, xi, s, decays)
   end subroutine find_rigid_decays

   ! Not done: the motions have no inertia each, or it is not clear which of them decay.
   subroutine separate(problem, motions, multipliers, number, rigid, done)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: motions(:, :), multipliers(:, :)
      integer, intent(in) :: number
      type(separated_type), intent(out) :: rigid
      logical, intent(out) :: done
      ! Beside the rate of a decay.
      real(wp), parameter :: nothing = 1.0e-10_wp
      real(wp), allocatable :: damping(:, :), mass(:, :), rates(:), work(:)
      logical, allocatable :: decays(:)
      integer :: k, info, i, j

      k = size(motions, 2)
      allocate (mass, source=form(motions, product_of(problem, motions, damped=.false.)))
      allocate (damping, source=form(motions, product_of(problem, motions, damped=.true.)))
      allocate (rates(k), work(10*k + 1))
      call dsygv(1, "V", "U", k, damping, k, mass, k, rates, work, size(work), info)
      done = info == 0
      if (.not. done) return
      allocate (decays(k), source=.false.)
      do i = 1, number
         decays(maxloc(abs(rates), 1, .not. decays)) = .true.
      end do
      rigid%slowest = minval(abs(rates), decays)
      done = maxval([0.0_wp, abs(pack(rates, .not. decays))]) <= nothing*rigid%slowest
      associate (some => pack([(j, j=1, k)], decays), others => pack([(j, j=1, k)], .not. decays))
         allocate (rigid%decaying, source=matmul(motions, damping(:, some)))
         allocate (rigid%coasting, source=matmul(motions, damping(:, others)))
         allocate (rigid%of_decaying, source=matmul(multipliers, damping(:, some)))
         allocate (rigid%of_coasting, source=matmul(multipliers, damping(:, others)))
      end associate
   end subroutine separate

   ! The states and S that belong to W, and the forces that W should answer to.
   subroutine combine(problem, rigid, w, reactions, x, xi, s, forces, done)
      type(modal_problem_type), intent(in) :: problem
      type(separated_type), intent(in) :: rigid
      real(wp), intent(in) :: w(:, :), reactions(:, :)
      real(wp), allocatable, intent(inout) :: x(:, :), xi(:, :), s(:, :), forces(:, :)
      logical, intent(out) :: done
      real(wp), allocatable :: masses(:, :), dampers(:, :), b(:, :)

      x = rigid%decaying + w
      xi = rigid%of_decaying + reactions
      masses = product_of(problem, x, damped=.false.)
      dampers = product_of(problem, x, damped=.true.)
      s = solution(form(rigid%decaying, masses), -form(rigid%decaying, dampers), done)
      if (.not. done) return
      if (size(rigid%coasting, 2) > 0) then
         ! B S = -N2^T (M X S + R X), as those motions are of unit inertia and undamped.
         b = transpose(solution(transpose(s), -transpose(form(rigid%coasting, matmul(masses, s) + dampers)), done))
         if (.not. done) return
         x = x + matmul(rigid%coasting, b)
         xi = xi + matmul(rigid%of_coasting, b)
         masses = product_of(problem, x, damped=.false.)
         dampers = product_of(problem, x, damped=.true.)
      end if
      forces = matmul(matmul(masses, s) + dampers, s)
   end subroutine combine

   ! Eigenpairs of X S: for the form X^T M X S + S^T X^T M X + X^T R X, S is self-adjoint. None where that is not definite.
   subroutine diagonalize(problem, x, xi, s, decays)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: x(:, :), xi(:, :), s(:, :)
      type(rigid_decays_type), intent(inout) :: decays
      real(wp), allocatable :: mass(:, :), metric(:, :), h(:, :), values(:), work(:)
      integer :: p, info

      p = size(s, 1)
      allocate (mass, source=form(x, product_of(problem, x, damped=.false.)))
      allocate (h, source=matmul(mass, s))
      allocate (metric, source=form(x, product_of(problem, x, damped=.true.)))
      metric = -(metric + h + transpose(h))
      h = matmul(metric, s)
      h = (h + transpose(h))/2
      allocate (values(p), work(10*p + 1))
      call dsygv(1, "V", "U", p, h, p, metric, p, values, work, size(work), info)
      if (info /= 0) return
      decays%lambda = values
      decays%x = matmul(x, h)
      decays%xi = matmul(xi, h)
   end subroutine diagonalize

   function product_of(problem, x, damped) result(y)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: x(:, :)
      !> R x in place of M x.
      logical, intent(in) :: damped
      real(wp), allocatable :: y(:, :)

      allocate (y(size(x, 1), size(x, 2)), source=0.0_wp)
      if (damped) then
         call problem%damping%add_product(1.0_wp, x, y)
      else
         call problem%mass%add_product(1.0_wp, x, y)
      end if
   end function product_of

   ! A^T B.
   pure function form(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: form(size(a, 2), size(b, 2))

      form = matmul(transpose(a), b)
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
