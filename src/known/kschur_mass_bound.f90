!> Bounds of the smallest eigenvalue of a mass matrix, or of another symmetric matrix, without factors.
module kschur_mass_bound
   use kschur_kinds, only: long, wp
   use kschur_magnitudes, only: terms_of
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, improbable, least_of_mass
   implicit none
   private
   public :: bound_smallest_eigenvalue, is_definite

contains

   !> Whether a symmetric matrix, scaled to unit diagonal, is proved to have no eigenvalue below a positive number; false: not
   !> known.
   logical function is_definite(matrix, least)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: least
      logical :: seems_definite, poor

      is_definite = .false.
      if (all(matrix%row_maxima() > 0)) call bound_smallest_eigenvalue(matrix, least, is_definite, seems_definite, poor)
   end function is_definite

   !> Bounds the smallest eigenvalue of M on the unknowns that have mass, scaled to unit diagonal, by its diagonal dominance
   !> (Gershgorin), or by k Lanczos steps from a random vector: the smallest Ritz value exceeds it by more than epsilon times the
   !> spread of the spectrum with a probability of at most 1.648 sqrt(n) exp(-(2 k - 1) sqrt(epsilon)) (Kuczynski, Wozniakowski,
   !> SIAM J. Matrix Anal. Appl. 13 (1992), theorem 4.1). Masses of finite elements have it far from zero (Wathen, IMA J. Numer.
   !> Anal. 7 (1987)), so that few steps suffice.
   subroutine bound_smallest_eigenvalue(mass, least, proved, seems_definite, poor)
      type(csr_matrix_type), intent(in) :: mass
      real(wp), intent(in) :: least
      !> Whether it is above `least`, up to a probability of `improbable`.
      logical, intent(out) :: proved
      !> Whether no Ritz value is below `least_of_mass`.
      logical, intent(out) :: seems_definite
      !> Whether a Ritz value is too small for `most_steps` to prove that. False where the iteration ends early, as on a small
      !> matrix: the steps are too few for a proof, not M too poor.
      logical, intent(out) :: poor
      ! The first is about the cost of a factorization; the second is when to estimate whether that many steps will do.
      integer, parameter :: most_steps = 200, few_steps = 60
      type(csr_matrix_type) :: scaled
      real(wp), allocatable :: scaling(:), previous(:, :), x(:, :), y(:, :)
      real(wp) :: alpha(most_steps), beta(0:most_steps), spread_bound, needed, provable
      integer(long) :: state
      integer :: k

      proved = .false.
      poor = .true.
      allocate (scaling, source=mass%diagonal())
      seems_definite = all(scaling > 0 .or. (abs(scaling) <= 0 .and. .not. mass%row_maxima() > 0))
      if (.not. seems_definite .or. .not. any(scaling > 0)) return
      where (scaling > 0) scaling = 1/sqrt(scaling)
      allocate (previous(mass%rows, 1), x(mass%rows, 1), y(mass%rows, 1), source=0.0_wp)
      ! Gershgorin's bound of the largest eigenvalue, and with the unit diagonal of the smallest one.
      spread_bound = maxval(scaling*sum(terms_of(mass, spread(scaling, 2, 1)), 2))
      proved = 2 - spread_bound > least
      poor = .not. proved
      if (proved) return
      needed = log(1.648_wp*sqrt(real(count(scaling > 0), wp))/improbable)
      provable = least + spread_bound*(needed/(2*most_steps - 1))**2
      state = 1
      call random_vector(state, x(:, 1))
      where (.not. scaling > 0) x(:, 1) = 0
      x = x/norm2(x)
      scaled = mass
      call scaled%scale_entries(scaling, scaling)
      beta(0) = 0
      do k = 1, min(most_steps, mass%rows)
         y = scaled%product(x) - beta(k - 1)*previous
         alpha(k) = dot_product(x(:, 1), y(:, 1))
         proved = ritz_values_exceed(least + spread_bound*min(1.0_wp, (needed/(2*k - 1))**2), k)
         seems_definite = ritz_values_exceed(least_of_mass, k)
         poor = .not. (seems_definite .and. ritz_values_exceed(provable, k))
         if (proved .or. .not. seems_definite) return
         ! Gives up if `most_steps` cannot prove it either, given the present Ritz values.
         if (k >= few_steps .and. poor) return
         y = y - alpha(k)*x
         beta(k) = norm2(y)
         if (beta(k) <= cancelled) return
         call move_alloc(x, previous)
         x = y/beta(k)
      end do

   contains

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
