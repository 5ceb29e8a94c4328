!> What keeps a mass matrix from being an inner product: negative eigenvalues,
!> and motions without mass.
module kschur_mass
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_magnitudes, only: add_magnitudes
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, least_of_mass
   implicit none
   private
   public :: examine_mass, is_dominant

contains

   !> By the signs of the pivots of a factorisation, which prove it; where no solver tells
   !> them, by a few steps of Lanczos, to which a matrix with eigenvalues next to zero is
   !> not semidefinite either.
   subroutine examine_mass(mass, inner, semidefinite, nullity, error, effort)
      !> Symmetric.
      type(csr_matrix_type), intent(in) :: mass
      type(inner_solvers_type), intent(in) :: inner
      !> Whether no eigenvalue is negative.
      logical, intent(out) :: semidefinite
      !> How many are zero.
      integer, intent(out) :: nullity
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), optional, intent(inout) :: effort
      class(real_linear_solver_type), allocatable :: solver
      type(matrix_structure_type) :: structure

      nullity = count(.not. mass%row_maxima() > 0)
      semidefinite = mass%is_zero()
      if (semidefinite) return
      if (.not. allocated(inner%counting)) then
         semidefinite = seems_definite(mass)
         return
      end if
      structure%symmetric = .true.
      allocate (solver, source=inner%unshifted)
      call solver%factorize(mass, structure, error)
      if (allocated(error)) return
      if (present(effort)) call effort%add_factors(solver)
      if (solver%negative_pivots < 0) then
         deallocate (solver)
         allocate (solver, source=inner%counting)
         call solver%factorize(mass, structure, error)
         if (allocated(error)) return
         if (present(effort)) call effort%add_factors(solver)
      end if
      semidefinite = solver%negative_pivots == 0
      nullity = solver%null_pivots
   end subroutine examine_mass

   ! Whether M with a unit diagonal, on the unknowns that have a mass, has no Ritz value below a
   ! small number: those of finite elements are far from zero (Wathen, IMA J. Numer. Anal. 7
   ! (1987)), and the ends of a spectrum are what Lanczos finds first. The pivots of the
   ! tridiagonal matrix count them.
   logical function seems_definite(mass)
      type(csr_matrix_type), intent(in) :: mass
      integer, parameter :: steps = 60
      real(wp), allocatable :: scaling(:), before(:), x(:), y(:, :)
      real(wp) :: alpha, beta, pivot
      integer(long) :: state
      integer :: step

      allocate (scaling, source=mass%diagonal())
      seems_definite = all(scaling > 0 .or. (abs(scaling) <= 0 .and. .not. mass%row_maxima() > 0))
      if (.not. seems_definite .or. .not. any(scaling > 0)) return
      where (scaling > 0) scaling = 1/sqrt(scaling)
      allocate (before(mass%rows), x(mass%rows), y(mass%rows, 1), source=0.0_wp)
      state = 1
      call random_vector(state, x)
      where (.not. scaling > 0) x = 0
      x = x/norm2(x)
      beta = 0
      pivot = 1
      do step = 1, min(steps, mass%rows)
         y = 0
         call mass%add_product(1.0_wp, reshape(scaling*x, [mass%rows, 1]), y)
         y(:, 1) = scaling*y(:, 1) - beta*before
         alpha = dot_product(x, y(:, 1))
         pivot = alpha - least_of_mass - beta**2/pivot
         seems_definite = pivot > 0
         if (.not. seems_definite) return
         y(:, 1) = y(:, 1) - alpha*x
         beta = norm2(y)
         if (beta <= cancelled) return
         before = x
         x = y(:, 1)/beta
      end do
   end function seems_definite

   !> Whether each positive diagonal entry is clearly larger than all others of its row together: then a symmetric matrix is
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
