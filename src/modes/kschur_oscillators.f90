!> Damped modes from undamped ones of a symmetric problem: with R = alpha M + beta K these have the same shapes (docs/theory.md,
!> eq. (4)).
module kschur_oscillators
   use kschur_backward_error, only: judge_as_given
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_problem, only: modal_problem_type
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: rounding_of_row
   implicit none
   private
   public :: damp_modes, judge_damped

contains

   !> Computes the backward errors and error bounds that undamped modes have in the damped problem: of an overdamped mode those of
   !> its root nearer to zero.
   subroutine judge_damped(problem, modes)
      !> The damped problem.
      type(modal_problem_type), intent(in) :: problem
      !> Undamped modes, but for these errors.
      class(modes_type), intent(inout) :: modes
      complex(wp), allocatable :: lambda(:), xi(:, :)

      allocate (lambda, source=modes%lambda)
      allocate (xi, source=modes%xi)
      call take_root(problem, 1, modes)
      call judge_as_given(problem, modes%eigenpairs_type, modes%motion > 0, modes%backward_error, modes%error_bound)
      call move_alloc(lambda, modes%lambda)
      call move_alloc(xi, modes%xi)
   end subroutine judge_damped

   !> Makes damped modes of undamped ones that `judge_damped` has judged: one of a conjugate pair, or both real roots. Judges the
   !> roots further from zero, which come last.
   subroutine damp_modes(problem, modes)
      !> The damped problem.
      type(modal_problem_type), intent(in) :: problem
      !> Undamped, without zeros.
      class(modes_type), intent(inout) :: modes
      type(modes_type) :: further
      integer :: j, k

      further%eigenpairs_type = chosen_pairs(modes, [(is_overdamped(problem, modes%lambda(j)), j=1, size(modes%lambda))])
      call take_root(problem, 1, modes)
      k = size(further%lambda)
      if (k == 0) return
      call take_root(problem, 2, further)
      allocate (further%backward_error(k), further%error_bound(k), further%motion(k))
      further%motion = 0
      call judge_as_given(problem, further%eigenpairs_type, further%motion > 0, further%backward_error, further%error_bound)
      further%uncertainty = further%error_bound
      call modes%append(further)
   end subroutine damp_modes

   ! Replaces undamped eigenvalues by one of their roots, the first one in the upper half plane or nearer to zero, and their
   ! multipliers by those of the damped problem.
   subroutine take_root(problem, which, pairs)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: which
      class(eigenpairs_type), intent(inout) :: pairs
      type(spectral_map_type) :: map
      complex(wp) :: roots(2)
      integer :: j

      map = map_of(problem)
      do j = 1, size(pairs%lambda)
         roots = roots_of(map, pairs%lambda(j))
         pairs%lambda(j) = roots(which)
         pairs%xi(:, j) = map%reaction(roots(which))*pairs%xi(:, j)
      end do
   end subroutine take_root

   ! Whether both roots of an undamped eigenvalue are real.
   pure logical function is_overdamped(problem, lambda)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda

      is_overdamped = .not. any(abs(aimag(roots_of(map_of(problem), lambda))) > 0)
   end function is_overdamped

   ! The two roots of an undamped eigenvalue: first the one above the real axis, or of two real ones the one nearer to zero. A
   ! discriminant within rounding is taken as zero: of critical damping.
   pure function roots_of(map, lambda) result(roots)
      type(spectral_map_type), intent(in) :: map
      complex(wp), intent(in) :: lambda
      complex(wp) :: roots(2)

      roots = map%lambdas(cmplx(-real(lambda**2, wp), 0, wp))
      if (aimag(roots(1))**2 <= 2*rounding_of_row*abs(roots(1))**2) roots = cmplx(real(roots, wp), 0, wp)
      if (aimag(roots(1)) < 0 .or. abs(roots(1)) > abs(roots(2))) roots = roots(2:1:-1)
   end function roots_of

   ! The map from theta = omega^2 to the roots.
   pure type(spectral_map_type) function map_of(problem)
      type(modal_problem_type), intent(in) :: problem

      map_of = spectral_map_type(oscillator=.true., alpha=problem%alpha, beta=problem%beta)
   end function map_of
end module kschur_oscillators
