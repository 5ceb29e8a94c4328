!> Balance: unknowns in units of their own, so that what is stiff, what is soft and what is
!> measured in other units have entries of one size.
module kschur_balance
   use kschur_kinds, only: wp
   use kschur_presolve, only: presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_scaling, only: typical_rate
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_tied_levels, only: spread_levels
   use kschur_tolerances, only: rounding_of_entry, uneven
   implicit none
   private
   public :: balance

contains

   !> Replaces the unknowns y of a reduced problem by z, y = D z with powers of two in D: D M D, D R D,
   !> D K D and Cq D, with a diagonal of about one in D K D. It rounds nothing, and has the same
   !> eigenvalues and multipliers. Of an unsymmetric problem rows have other units than columns: E D M D E^{-1}, and so on, with
   !> entries of one size beside the diagonal.
   subroutine balance(reduced, plan)
      type(modal_problem_type), intent(inout) :: reduced
      !> What the problem was reduced by; phi = T D E^{-1} z from now on.
      type(presolve_type), intent(inout) :: plan
      real(wp), dimension(reduced%unknowns()) :: factors, ratios, rows, columns

      call find_factors(reduced, factors, ratios)
      rows = factors*ratios
      columns = factors/ratios
      call reduced%mass%scale_entries(rows, columns)
      call reduced%damping%scale_entries(rows, columns)
      if (allocated(reduced%dampers)) call reduced%dampers%scale_entries(rows, columns)
      call reduced%stiffness%scale_entries(rows, columns)
      if (allocated(reduced%loss)) call reduced%loss%scale_entries(rows, columns)
      call reduced%constraints%scale_entries(spread(1.0_wp, 1, reduced%multipliers()), columns)
      call plan%change_units(columns)
      if (any(abs(ratios - 1) > 0)) call plan%change_row_units(ratios**2, reduced%constraints)
   end subroutine balance

   ! D is that of the diagonals: their ratios do not depend on the units the unknowns have. Where a diagonal says nothing,
   ! as of equations in an order of their own, rows and columns do.
   subroutine find_factors(problem, factors, ratios)
      type(modal_problem_type), intent(in) :: problem
      !> The diagonals of D and E.
      real(wp), intent(out) :: factors(:), ratios(:)
      real(wp), dimension(size(factors)) :: level, inertia
      real(wp) :: rate
      logical, dimension(size(factors)) :: held, open

      level = abs(problem%stiffness%diagonal())
      call leave_rounding_out(abs(problem%mass%diagonal()), level)
      held = level > 0
      call spread_levels(problem%constraints, level)
      open = .not. level > 0
      rate = typical_rate(problem)
      inertia = rate**2*abs(problem%mass%diagonal()) + rate*abs(problem%damping%diagonal())
      where (open) level = inertia
      ! However small its part in constraints is, inertia and damping of an unknown must not hide those of others.
      where (.not. held) level = max(level, inertia/uneven)
      ! What is tied to a motion that only mass and damping hold has its units.
      call spread_levels(problem%constraints, level)
      factors = 1
      if (any(.not. level > 0)) then
         where (.not. level > 0) level = line_maxima(problem%stiffness, factors, factors)
         where (.not. level > 0) level = rate**2*line_maxima(problem%mass, factors, factors) &
            + rate*line_maxima(problem%damping, factors, factors)
      end if
      where (level > tiny(level) .and. level < huge(level)) &
         factors = scale(1.0_wp, (modulo(exponent(level), 2) - exponent(level))/2)
      ratios = 1
      if (.not. problem%symmetric) ratios = row_ratios(problem, rate, factors)
      call equilibrate(problem%stiffness, open, factors, ratios)
   end subroutine find_factors

   ! A stiffness that is rounding squared beside others, as of an axis at a right angle, gives an unknown no unit; beside inertias
   ! that tells it in any units.
   pure subroutine leave_rounding_out(mass, stiffness)
      real(wp), intent(in) :: mass(:)
      real(wp), intent(inout) :: stiffness(:)
      real(wp) :: highest

      if (.not. any(mass > 0)) return
      highest = maxval(stiffness/mass, mass > 0)
      where (stiffness <= rounding_of_entry**2*highest*mass) stiffness = 0
   end subroutine leave_rounding_out

   ! The diagonal of E that makes rows and columns of E W E^{-1} equal, W = D (s^2 |M| + s |R| + |K|) D, by the largest entries
   ! beside the diagonal (Osborne, J. ACM 7 (1960)): a coupling that goes one way only has units of its own. What is small
   ! beside the diagonal is left as it is. Unknowns that constraints tie together have one ratio, as Cq stands on both sides.
   function row_ratios(problem, rate, factors) result(ratios)
      type(modal_problem_type), intent(in) :: problem
      !> s (1/s)
      real(wp), intent(in) :: rate
      !> The diagonal of D.
      real(wp), intent(in) :: factors(:)
      real(wp) :: ratios(size(factors))
      ! What is so small beside the diagonal couples little; ratios that are smaller cost no more than two digits.
      real(wp), parameter :: matters = 64
      integer, parameter :: passes = 100
      type(csr_matrix_type) :: matrices(3), weights
      real(wp), dimension(size(factors)) :: inside, in_row, in_column, change
      integer :: group(size(factors)), pass

      matrices(1) = problem%mass
      matrices(2) = problem%damping
      matrices(3) = problem%stiffness
      do pass = 1, size(matrices)
         matrices(pass)%value = abs(matrices(pass)%value)
      end do
      weights = linear_combination([rate**2, rate, 1.0_wp], matrices)
      if (allocated(problem%loss)) weights = linear_combination(1.0_wp, weights, 1.0_wp, magnitudes_of(problem%loss))
      call weights%scale_entries(factors, factors)
      call number_groups(problem%constraints, group)
      ratios = 1
      do pass = 1, passes
         call find_maxima(weights, group, ratios, inside, in_row, in_column)
         inside = inside/matters
         change = 1
         where (max(in_row, in_column) > 2*max(inside, min(in_row, in_column)) .and. max(inside, min(in_row, in_column)) > 0) &
            change = scale(1.0_wp, nint(log(max(in_column, inside)/max(in_row, inside))/log(16.0_wp)))
         if (.not. any(abs(change - 1) > 0)) exit
         ratios = ratios*change(group)
      end do
      if (maxval(ratios) < matters*minval(ratios)) ratios = 1
   end function row_ratios

   ! |A|.
   pure function magnitudes_of(matrix) result(magnitudes)
      type(csr_matrix_type), intent(in) :: matrix
      type(csr_matrix_type) :: magnitudes

      magnitudes = matrix
      magnitudes%value = abs(magnitudes%value)
   end function magnitudes_of

   ! The largest entry of each group's diagonal block, and of its rows and its columns beside that, of E W E^{-1}.
   pure subroutine find_maxima(weights, group, ratios, inside, in_row, in_column)
      type(csr_matrix_type), intent(in) :: weights
      integer, intent(in) :: group(:)
      real(wp), intent(in) :: ratios(:)
      real(wp), intent(out) :: inside(:), in_row(:), in_column(:)
      real(wp) :: entry
      integer :: i, k

      inside = 0
      in_row = 0
      in_column = 0
      do i = 1, weights%rows
         do k = weights%row_start(i), weights%row_start(i + 1) - 1
            associate (j => weights%column(k))
               entry = ratios(i)*weights%value(k)/ratios(j)
               if (group(i) == group(j)) then
                  inside(group(i)) = max(inside(group(i)), entry)
               else
                  in_row(group(i)) = max(in_row(group(i)), entry)
                  in_column(group(j)) = max(in_column(group(j)), entry)
               end if
            end associate
         end do
      end do
   end subroutine find_maxima

   ! Unknowns that constraints tie together, directly or by others, have one number: that of the first of them.
   pure subroutine number_groups(constraints, group)
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(out) :: group(:)
      integer :: i, k, first, other

      group = [(i, i=1, size(group))]
      do i = 1, constraints%rows
         first = 0
         do k = constraints%row_start(i), constraints%row_start(i + 1) - 1
            if (.not. abs(constraints%value(k)) > 0) cycle
            other = root(constraints%column(k))
            if (first == 0) first = other
            group(max(first, other)) = min(first, other)
            first = min(first, other)
         end do
      end do
      do i = 1, size(group)
         group(i) = group(group(i))
      end do

   contains

      pure integer function root(i)
         integer, intent(in) :: i

         root = i
         do while (group(root) /= root)
            root = group(root)
         end do
      end function root
   end subroutine number_groups

   ! Where the diagonal is small beside its row or column, as that of a saddle, these decide: each takes half
   ! of what its largest entry is off by, in turns (Ruiz 2001).
   subroutine equilibrate(matrix, open, factors, ratios)
      type(csr_matrix_type), intent(in) :: matrix
      !> Whose diagonal says nothing: those may be too small as well.
      logical, intent(in) :: open(:)
      real(wp), intent(inout) :: factors(:)
      real(wp), intent(in) :: ratios(:)
      real(wp), parameter :: balanced = 4
      integer, parameter :: passes = 20
      real(wp) :: largest(size(factors))
      logical :: too_large(size(factors))
      integer :: pass

      do pass = 1, passes
         largest = line_maxima(matrix, factors, ratios)
         too_large = largest > balanced .or. (open .and. largest > 0 .and. largest < 1/balanced)
         if (.not. any(too_large)) exit
         where (too_large) factors = scale(factors, -exponent(largest)/2)
      end do
   end subroutine equilibrate

   ! The largest entry of each row and of the column of the same number, of E D A D E^{-1}.
   pure function line_maxima(matrix, factors, ratios) result(maxima)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: factors(:), ratios(:)
      real(wp) :: maxima(matrix%rows), entry
      integer :: i, k

      maxima = 0
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               entry = abs(ratios(i)*factors(i)*matrix%value(k)*factors(j)/ratios(j))
               maxima(i) = max(maxima(i), entry)
               maxima(j) = max(maxima(j), entry)
            end associate
         end do
      end do
   end function line_maxima
end module kschur_balance
