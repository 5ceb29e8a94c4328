!> Whether a mass matrix is semidefinite, and its nullity.
module kschur_mass
   use kschur_effort, only: effort_type, for_mass
   use kschur_error, only: error_singular, error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_mass_bound, only: bound_smallest_eigenvalue
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, rows_of_csr, transpose_csr
   use kschur_tolerances, only: least_of_mass, rounding_of_sums, usual_least_of_mass
   implicit none
   private
   public :: examine_mass

contains

   !> Tests whether a mass matrix is semidefinite, and so an inner product on the motions that have mass, and counts its zero
   !> eigenvalues. First by the bound of its smallest eigenvalue, which proves masses of finite elements definite with some dozens
   !> of products; otherwise by inertia, with a diagonal larger and one smaller by rounding, so that eigenvalues that are zero to
   !> rounding, in any units, are not negative, and count as zero; without a solver that counts pivots, by the smallest Ritz value,
   !> which rejects semidefinite matrices with eigenvalues near zero, too.
   subroutine examine_mass(mass, inner, semidefinite, nullity, smallest, poor, error, effort)
      !> Symmetric.
      type(csr_matrix_type), intent(in) :: mass
      type(inner_solvers_type), intent(in) :: inner
      !> Whether no eigenvalue is negative.
      logical, intent(out) :: semidefinite
      !> Number of eigenvalues that are zero to rounding; of empty rows alone where no factorization counts them.
      integer, intent(out) :: nullity
      !> Lower bound of the eigenvalues on the unknowns that have mass, scaled to unit diagonal; zero: none was proved.
      real(wp), intent(out) :: smallest
      !> Whether a Ritz value shows that M is worse conditioned than masses of finite elements.
      logical, intent(out) :: poor
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), optional, intent(inout) :: effort
      class(real_linear_solver_type), allocatable :: solver
      type(matrix_structure_type) :: structure
      type(csr_matrix_type) :: part
      logical :: seems_definite
      integer :: negative, i

      smallest = 0
      poor = .false.
      nullity = count(.not. mass%row_maxima() > 0)
      semidefinite = mass%is_zero()
      if (semidefinite) return
      call bound_smallest_eigenvalue(mass, usual_least_of_mass, smallest, seems_definite, poor)
      semidefinite = smallest >= least_of_mass
      if (semidefinite) return
      ! Where no factors count pivots.
      semidefinite = seems_definite
      if (.not. allocated(inner%counting)) return
      ! Without empty rows, where pivots are zero, the counts can be proved.
      associate (with_mass => pack([(i, i=1, mass%rows)], mass%row_maxima() > 0))
         part = rows_of_csr(transpose_csr(rows_of_csr(mass, with_mass)), with_mass)
      end associate
      structure%symmetric = .true.
      structure%regular = .true.
      allocate (solver, source=inner%counting)
      call count_negative(1 + rounding_of_sums)
      if (allocated(error) .or. negative < 0) return
      semidefinite = negative == 0
      if (.not. semidefinite) return
      call count_negative(1 - rounding_of_sums)
      nullity = nullity + max(negative, 0)

   contains

      ! Counts the negative eigenvalues of M with another diagonal; -1 if that fails.
      subroutine count_negative(factor)
         real(wp), intent(in) :: factor

         negative = -1
         call solver%factorize(with_diagonal_times(factor, part), structure, error)
         if (allocated(error)) then
            ! A solver of the user's may fail so where M is semidefinite.
            if (error%code == error_singular) deallocate (error)
            return
         end if
         if (present(effort)) call effort%add_factors(solver, for_mass)
         negative = solver%negative_pivots
      end subroutine count_negative
   end subroutine examine_mass

   ! A matrix with another diagonal.
   type(csr_matrix_type) function with_diagonal_times(factor, matrix) result(changed)
      real(wp), intent(in) :: factor
      type(csr_matrix_type), intent(in) :: matrix
      integer :: i, k

      changed = matrix
      do i = 1, changed%rows
         k = changed%place_of(i, i)
         if (k > 0) changed%value(k) = factor*changed%value(k)
      end do
   end function with_diagonal_times
end module kschur_mass
