!> Balance: unknowns in units of their own, so that what is stiff, what is soft and what is
!> measured in other units have entries of one size.
module kschur_balance
   use kschur_kinds, only: wp
   use kschur_presolve, only: presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_scaling, only: typical_rate
   use kschur_sparse, only: csr_matrix_type
   use kschur_tied_levels, only: spread_levels
   implicit none
   private
   public :: balance

contains

   !> Replaces the unknowns y of a reduced problem by z, y = D z with powers of two in D: D M D, D R D,
   !> D K D and Cq D, with a diagonal of about one in D K D. It rounds nothing, and has the same
   !> eigenvalues and multipliers.
   subroutine balance(reduced, plan)
      type(modal_problem_type), intent(inout) :: reduced
      !> What the problem was reduced by; phi = T D z from now on.
      type(presolve_type), intent(inout) :: plan
      real(wp) :: factors(reduced%unknowns())

      factors = balancing_factors(reduced)
      call reduced%mass%scale_entries(factors, factors)
      call reduced%damping%scale_entries(factors, factors)
      if (allocated(reduced%dampers)) call reduced%dampers%scale_entries(factors, factors)
      call reduced%stiffness%scale_entries(factors, factors)
      call reduced%constraints%scale_entries(spread(1.0_wp, 1, reduced%multipliers()), factors)
      call plan%change_units(factors)
   end subroutine balance

   ! Of the diagonals: their ratios do not depend on the units the unknowns have. Where a diagonal says nothing,
   ! as of equations in an order of their own, rows and columns do.
   function balancing_factors(problem) result(factors)
      type(modal_problem_type), intent(in) :: problem
      real(wp) :: factors(problem%unknowns())
      real(wp) :: level(size(factors)), rate
      logical :: open(size(factors))

      level = abs(problem%stiffness%diagonal())
      call spread_levels(problem%constraints, level)
      open = .not. level > 0
      rate = typical_rate(problem)
      where (.not. level > 0) level = rate**2*abs(problem%mass%diagonal()) + rate*abs(problem%damping%diagonal())
      ! What is tied to a motion that only mass and damping hold has its units.
      call spread_levels(problem%constraints, level)
      factors = 1
      if (any(.not. level > 0)) then
         where (.not. level > 0) level = line_maxima(problem%stiffness, factors)
         where (.not. level > 0) level = rate**2*line_maxima(problem%mass, factors) &
            + rate*line_maxima(problem%damping, factors)
      end if
      where (level > tiny(level) .and. level < huge(level)) &
         factors = scale(1.0_wp, (modulo(exponent(level), 2) - exponent(level))/2)
      call equilibrate(problem%stiffness, open, factors)
   end function balancing_factors

   ! Where the diagonal is small beside its row or column, as that of a saddle, these decide: each takes half
   ! of what its largest entry is off by, in turns (Ruiz 2001).
   subroutine equilibrate(matrix, open, factors)
      type(csr_matrix_type), intent(in) :: matrix
      !> Whose diagonal says nothing: those may be too small as well.
      logical, intent(in) :: open(:)
      real(wp), intent(inout) :: factors(:)
      real(wp), parameter :: balanced = 4
      integer, parameter :: passes = 20
      real(wp) :: largest(size(factors))
      logical :: uneven(size(factors))
      integer :: pass

      do pass = 1, passes
         largest = line_maxima(matrix, factors)
         uneven = largest > balanced .or. (open .and. largest > 0 .and. largest < 1/balanced)
         if (.not. any(uneven)) exit
         where (uneven) factors = scale(factors, -exponent(largest)/2)
      end do
   end subroutine equilibrate

   ! The largest entry of each row and of the column of the same number, of D A D with a diagonal D of factors.
   pure function line_maxima(matrix, factors) result(maxima)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: factors(:)
      real(wp) :: maxima(matrix%rows), entry
      integer :: i, k

      maxima = 0
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               entry = abs(factors(i)*matrix%value(k)*factors(j))
               maxima(i) = max(maxima(i), entry)
               maxima(j) = max(maxima(j), entry)
            end associate
         end do
      end do
   end function line_maxima
end module kschur_balance
