!> Bounds of the smallest eigenvalue of a mass matrix, or of another symmetric matrix, without factors.
module kschur_mass_bound
   use kschur_kinds, only: long, wp
   use kschur_magnitudes, only: terms_of
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, improbable, least_of_mass, usual_least_of_mass
   implicit none
   private
   public :: bound_smallest_eigenvalue, is_definite

contains

   !> Whether a symmetric matrix, scaled to unit diagonal, is proved to have no eigenvalue below a positive number; false: not
   !> known.
   logical function is_definite(matrix, least)
      type(csr_matrix_type), intent(in) :: matrix
      !> `least_of_mass` or `usual_least_of_mass`.
      real(wp), intent(in) :: least
      real(wp) :: smallest
      logical :: seems_definite, poor

      is_definite = all(matrix%row_maxima() > 0)
      if (.not. is_definite) return
      call bound_smallest_eigenvalue(matrix, least, smallest, seems_definite, poor)
      is_definite = smallest >= least
   end function is_definite

   !> Bounds the smallest eigenvalue of M on the unknowns that have mass, scaled to unit diagonal, by its diagonal dominance
   !> (Gershgorin), or by k Lanczos steps from a random vector: the smallest Ritz value exceeds it by more than epsilon times the
   !> spread of the spectrum with a probability of at most 1.648 sqrt(n) exp(-(2 k - 1) sqrt(epsilon)) (Kuczynski, Wozniakowski,
   !> SIAM J. Matrix Anal. Appl. 13 (1992), theorem 4.1). Masses of finite elements have it far from zero (Wathen, IMA J. Numer.
   !> Anal. 7 (1987)), so that few steps suffice.
   subroutine bound_smallest_eigenvalue(mass, enough, smallest, seems_definite, poor)
      type(csr_matrix_type), intent(in) :: mass
      !> The bound that ends the iteration: `least_of_mass` or `usual_least_of_mass`.
      real(wp), intent(in) :: enough
      !> A lower bound of at least `least_of_mass`, up to a probability of `improbable`; zero: none was proved.
      real(wp), intent(out) :: smallest
      !> Whether no Ritz value is below `least_of_mass`.
      logical, intent(out) :: seems_definite
      !> Whether a Ritz value is too small for `most_steps` to prove that. False where the iteration ends early, as on a small
      !> matrix: the steps are too few for a proof, not M too poor.
      logical, intent(out) :: poor
      ! The first is about the cost of a factorization; the second is when to estimate whether that many steps will do.
      integer, parameter :: most_steps = 200, few_steps = 60
      real(wp), parameter :: bounds(2) = [least_of_mass, usual_least_of_mass]
      real(wp), allocatable :: scaling(:), previous(:, :), x(:, :), y(:, :)
      real(wp) :: alpha(most_steps), beta(0:most_steps), spread_bound, needed, last_margin
      integer(long) :: state
      integer :: k, i

      smallest = 0
      poor = .true.
      allocate (scaling, source=mass%diagonal())
      seems_definite = all(scaling > 0 .or. (abs(scaling) <= 0 .and. .not. mass%row_maxima() > 0))
      if (.not. seems_definite .or. .not. any(scaling > 0)) return
      where (scaling > 0) scaling = 1/sqrt(scaling)
      allocate (previous(mass%rows, 1), x(mass%rows, 1), y(mass%rows, 1), source=0.0_wp)
      ! Gershgorin's bound of the largest eigenvalue, and with the unit diagonal of the smallest one.
      spread_bound = maxval(scaling*sum(terms_of(mass, spread(scaling, 2, 1)), 2))
      smallest = 2 - spread_bound
      ! It may be rounding.
      if (.not. smallest > least_of_mass) smallest = 0
      poor = .not. smallest > 0
      if (smallest > enough) return
      needed = log(1.648_wp*sqrt(real(count(scaling > 0), wp))/improbable)
      last_margin = margin(most_steps)
      state = 1
      call random_vector(state, x(:, 1))
      where (.not. scaling > 0) x(:, 1) = 0
      x = x/norm2(x)
      beta(0) = 0
      do k = 1, min(most_steps, mass%rows)
         y(:, 1) = scaling*x(:, 1)
         y = mass%product(y)
         y(:, 1) = scaling*y(:, 1) - beta(k - 1)*previous(:, 1)
         alpha(k) = dot_product(x(:, 1), y(:, 1))
         do i = 1, size(bounds)
            if (ritz_values_exceed(bounds(i) + margin(k), k)) smallest = max(bounds(i), smallest)
         end do
         seems_definite = ritz_values_exceed(least_of_mass, k)
         poor = .not. (smallest > 0 .or. (seems_definite .and. ritz_values_exceed(least_of_mass + last_margin, k)))
         if (smallest >= enough .or. .not. seems_definite) return
         ! Gives up if `most_steps` cannot prove the next bound either, given the present Ritz values.
         if (k >= few_steps .and. .not. ritz_values_exceed(minval(bounds, bounds > smallest) + last_margin, k)) return
         y = y - alpha(k)*x
         beta(k) = norm2(y)
         if (beta(k) <= cancelled) return
         call move_alloc(x, previous)
         x = y/beta(k)
      end do

   contains

      ! By how much the smallest Ritz value of so many steps may exceed the smallest eigenvalue.
      pure real(wp) function margin(steps)
         integer, intent(in) :: steps

         margin = spread_bound*min(1.0_wp, (needed/(2*steps - 1))**2)
      end function margin

      ! Whether all Ritz values exceed a bound: the pivots of T - bound I are positive (Sturm sequence).
      pure logical function ritz_values_exceed(bound, steps)
         real(wp), intent(in) :: bound
         integer, intent(in) :: steps
         real(wp) :: pivot
         integer :: i

         ritz_values_exceed = .true.
         pivot = 1
         do i = 1, steps
            pivot = alpha(i) - bound - beta(i - 1)**2/pivot
            ritz_values_exceed = pivot > 0
            if (.not. ritz_values_exceed) return
         end do
      end function ritz_values_exceed
   end subroutine bound_smallest_eigenvalue
end module kschur_mass_bound
