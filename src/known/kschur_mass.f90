!> What keeps a mass matrix from being an inner product: negative eigenvalues,
!> and motions without mass.
module kschur_mass
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: effort_type, for_mass
   use kschur_error, only: error_type
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_magnitudes, only: add_magnitudes
   use kschur_processes, only: may_be_several
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, improbable, least_of_mass
   implicit none
   private
   public :: examine_mass, is_definite

contains

   !> By a bound of Lanczos, which shows a mass of finite elements to be definite at the price of some dozens of products; where
   !> it does not, by the signs of the pivots of a factorisation, which prove it; where no solver tells
   !> them, by the least Ritz value, to which a matrix with eigenvalues next to zero is
   !> not semidefinite either.
   subroutine examine_mass(mass, inner, semidefinite, nullity, poor, error, effort)
      !> Symmetric.
      type(csr_matrix_type), intent(in) :: mass
      type(inner_solvers_type), intent(in) :: inner
      !> Whether no eigenvalue is negative.
      logical, intent(out) :: semidefinite
      !> How many are zero.
      integer, intent(out) :: nullity
      !> Whether the bound was not enough: then it is conditioned worse than masses are.
      logical, intent(out) :: poor
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), optional, intent(inout) :: effort
      class(real_linear_solver_type), allocatable :: solver
      type(matrix_structure_type) :: structure
      logical :: seems

      seems = .false.
      poor = .false.
      nullity = count(.not. mass%row_maxima() > 0)
      semidefinite = mass%is_zero()
      if (semidefinite) return
      if (works_alone(inner)) call bound_least(mass, semidefinite, seems)
      if (semidefinite) return
      poor = works_alone(inner)
      if (.not. allocated(inner%counting)) then
         semidefinite = seems
         return
      end if
      structure%symmetric = .true.
      allocate (solver, source=inner%unshifted)
      call solver%factorize(mass, structure, error)
      if (allocated(error)) return
      if (present(effort)) call effort%add_factors(solver, for_mass)
      if (solver%negative_pivots < 0) then
         deallocate (solver)
         allocate (solver, source=inner%counting)
         call solver%factorize(mass, structure, error)
         if (allocated(error)) return
         if (present(effort)) call effort%add_factors(solver, for_mass)
      end if
      semidefinite = solver%negative_pivots == 0
      nullity = solver%null_pivots
   end subroutine examine_mass

   !> Whether a symmetric matrix is definite, as far as diagonal dominance or the bound of Lanczos shows that.
   logical function is_definite(matrix, inner)
      type(csr_matrix_type), intent(in) :: matrix
      type(inner_solvers_type), intent(in) :: inner
      logical :: seems

      is_definite = is_dominant(matrix)
      if (is_definite .or. .not. (works_alone(inner) .and. all(matrix%row_maxima() > 0))) return
      call bound_least(matrix, is_definite, seems)
   end function is_definite

   ! Whether no other process has a part in the factors: those that share matrices factor the mass, each its part.
   pure logical function works_alone(inner)
      type(inner_solvers_type), intent(in) :: inner

      works_alone = .true.
      select type (solver => inner%unshifted)
      type is (direct_real_type)
         works_alone = .not. may_be_several(solver%processes)
      end select
   end function works_alone

   ! The least eigenvalue of M, on the unknowns that have a mass and scaled to a unit diagonal, from the Ritz values of k steps of
   ! Lanczos from a random vector: the least of them exceeds it by more than epsilon times the spread of the spectrum with a
   ! probability of at most 1.648 sqrt(n) exp(-(2 k - 1) sqrt(epsilon)) (Kuczynski, Wozniakowski, SIAM J. Matrix Anal. Appl. 13
   ! (1992), theorem 4.1). Those of finite elements are far from zero (Wathen, IMA J. Numer. Anal. 7 (1987)).
   subroutine bound_least(mass, proved, seems)
      type(csr_matrix_type), intent(in) :: mass
      !> Whether it is above zero, but for a probability of `improbable`.
      logical, intent(out) :: proved
      !> Whether no Ritz value is below `least_of_mass`.
      logical, intent(out) :: seems
      ! As many products cost what factors do; so many tell whether it seems so.
      integer, parameter :: most_steps = 200, few_steps = 60
      real(wp), allocatable :: scaling(:), before(:), x(:), y(:, :)
      real(wp) :: alpha(most_steps), beta(0:most_steps), spread_bound, needed
      integer(long) :: state
      integer :: k

      proved = .false.
      allocate (scaling, source=mass%diagonal())
      seems = all(scaling > 0 .or. (abs(scaling) <= 0 .and. .not. mass%row_maxima() > 0))
      if (.not. seems .or. .not. any(scaling > 0)) return
      where (scaling > 0) scaling = 1/sqrt(scaling)
      allocate (before(mass%rows), x(mass%rows), y(mass%rows, 1), source=0.0_wp)
      ! Gershgorin's.
      call add_magnitudes(mass, reshape(scaling, [mass%rows, 1]), y)
      spread_bound = maxval(scaling*y(:, 1))
      needed = log(1.648_wp*sqrt(real(count(scaling > 0), wp))/improbable)
      state = 1
      call random_vector(state, x)
      where (.not. scaling > 0) x = 0
      x = x/norm2(x)
      beta(0) = 0
      do k = 1, min(most_steps, mass%rows)
         y = 0
         call mass%add_product(1.0_wp, reshape(scaling*x, [mass%rows, 1]), y)
         y(:, 1) = scaling*y(:, 1) - beta(k - 1)*before
         alpha(k) = dot_product(x, y(:, 1))
         proved = are_above(spread_bound*min(1.0_wp, (needed/(2*k - 1))**2), k)
         seems = are_above(least_of_mass, k)
         if (proved .or. .not. seems) return
         ! More steps will not do.
         if (k >= few_steps .and. .not. are_above(spread_bound*(needed/(2*most_steps - 1))**2, k)) return
         y(:, 1) = y(:, 1) - alpha(k)*x
         beta(k) = norm2(y)
         if (beta(k) <= cancelled) return
         before = x
         x = y(:, 1)/beta(k)
      end do

   contains

      ! Whether all Ritz values are: the pivots of T - least I.
      pure logical function are_above(least, steps)
         real(wp), intent(in) :: least
         integer, intent(in) :: steps
         real(wp) :: pivot
         integer :: i

         are_above = .true.
         pivot = 1
         do i = 1, steps
            pivot = alpha(i) - least - beta(i - 1)**2/pivot
            are_above = pivot > 0
            if (.not. are_above) return
         end do
      end function are_above
   end subroutine bound_least

   ! Whether each positive diagonal entry is clearly larger than all others of its row together: then a symmetric matrix is
   !> definite (Gershgorin).
   pure logical function is_dominant(matrix)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp) :: diagonal(matrix%rows), sums(matrix%rows, 1)

      diagonal = matrix%diagonal()
      sums = 0
      call add_magnitudes(matrix, spread(spread(1.0_wp, 1, matrix%rows), 2, 1), sums)
      is_dominant = all(2*diagonal - sums(:, 1) > least_of_mass*diagonal .and. diagonal > 0)
   end function is_dominant
end module kschur_mass
