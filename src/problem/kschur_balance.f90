!> Balancing: scales the unknowns so that stiff and soft ones, and those in different units, have entries of one magnitude.
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

   !> Substitutes y = D z in a reduced problem, D a diagonal of powers of two: D M D, D R D, D K D and Cq D, with a diagonal of
   !> about one in D K D. Exact, with the same eigenvalues and multipliers. Rows of an unsymmetric problem are scaled
   !> differently from columns: E D M D E^{-1} and so on, with off-diagonal entries of one magnitude.
   subroutine balance(reduced, plan)
      type(modal_problem_type), intent(inout) :: reduced
      !> Its reduction; phi = T D E^{-1} z from now on.
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

   ! Finds the diagonals of D and E. D follows from the diagonals of K, M and R, whose ratios do not depend on the units of the
   ! unknowns. Unknowns without diagonal entries, as of equations in arbitrary order, are scaled by rows and columns.
   subroutine find_factors(problem, factors, ratios)
      type(modal_problem_type), intent(in) :: problem
      !> The diagonals of D and E.
      real(wp), intent(out) :: factors(:), ratios(:)
      real(wp), dimension(size(factors)) :: level, inertia
      real(wp) :: rate
      logical, dimension(size(factors)) :: has_stiffness, undetermined

      level = abs(problem%stiffness%diagonal())
      call drop_rounding(abs(problem%mass%diagonal()), level)
      has_stiffness = level > 0
      call spread_levels(problem%constraints, level)
      undetermined = .not. level > 0
      rate = typical_rate(problem)
      inertia = rate**2*abs(problem%mass%diagonal()) + rate*abs(problem%damping%diagonal())
      where (undetermined) level = inertia
      ! Inertia and damping of an unknown must not hide those of others, however small it is in constraints.
      where (.not. has_stiffness) level = max(level, inertia/uneven)
      ! Unknowns tied to a motion held by mass and damping only share its scale.
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
      call equilibrate(problem%stiffness, undetermined, factors, ratios)
   end subroutine find_factors

   ! Drops a stiffness that is a squared rounding error next to others, as of an axis at a right angle: it defines no scale.
   ! Compared in units of the inertia, which are consistent.
   pure subroutine drop_rounding(mass, stiffness)
      real(wp), intent(in) :: mass(:)
      real(wp), intent(inout) :: stiffness(:)
      real(wp) :: highest

      if (.not. any(mass > 0)) return
      highest = maxval(stiffness/mass, mass > 0)
      where (stiffness <= rounding_of_entry**2*highest*mass) stiffness = 0
   end subroutine drop_rounding

   ! Diagonal of E that equilibrates rows and columns of E W E^{-1}, W = D (s^2 |M| + s |R| + |K|) D, by largest off-diagonal
   ! entries (Osborne, J. ACM 7 (1960)): one-way couplings have their own units. Entries small relative to the diagonal are
   ! ignored. Unknowns coupled by constraints share one ratio, as Cq occurs on both sides.
   function row_ratios(problem, rate, factors) result(ratios)
      type(modal_problem_type), intent(in) :: problem
      !> s (1/s)
      real(wp), intent(in) :: rate
      !> The diagonal of D.
      real(wp), intent(in) :: factors(:)
      real(wp) :: ratios(size(factors))
      ! Off-diagonal entries smaller than the diagonal by this factor are ignored; smaller ratios cost no more than two digits.
      real(wp), parameter :: matters = 64
      integer, parameter :: passes = 100
      type(csr_matrix_type) :: matrices(3), weights
      real(wp), dimension(size(factors)) :: in_block, in_row, in_column, change
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
         call find_maxima(weights, group, ratios, in_block, in_row, in_column)
         in_block = in_block/matters
         change = 1
         where (max(in_row, in_column) > 2*max(in_block, min(in_row, in_column)) .and. max(in_block, min(in_row, in_column)) > 0) &
            change = scale(1.0_wp, nint(log(max(in_column, in_block)/max(in_row, in_block))/log(16.0_wp)))
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

   ! Largest entry of each group's diagonal block of E W E^{-1}, and of its rows and columns outside the block.
   pure subroutine find_maxima(weights, group, ratios, in_block, in_row, in_column)
      type(csr_matrix_type), intent(in) :: weights
      integer, intent(in) :: group(:)
      real(wp), intent(in) :: ratios(:)
      real(wp), intent(out) :: in_block(:), in_row(:), in_column(:)
      real(wp) :: entry
      integer :: i, k

      in_block = 0
      in_row = 0
      in_column = 0
      do i = 1, weights%rows
         do k = weights%row_start(i), weights%row_start(i + 1) - 1
            associate (j => weights%column(k))
               entry = ratios(i)*weights%value(k)/ratios(j)
               if (group(i) == group(j)) then
                  in_block(group(i)) = max(in_block(group(i)), entry)
               else
                  in_row(group(i)) = max(in_row(group(i)), entry)
                  in_column(group(j)) = max(in_column(group(j)), entry)
               end if
            end associate
         end do
      end do
   end subroutine find_maxima

   ! Finds the groups of unknowns that constraints couple, directly or indirectly (union-find); each is numbered by its first
   ! unknown.
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

      ! First unknown of the group of unknown i so far.
      pure integer function root(i)
         integer, intent(in) :: i

         root = i
         do while (group(root) /= root)
            root = group(root)
         end do
      end function root
   end subroutine number_groups

   ! If the diagonal is small relative to its row or column, as in a saddle point matrix, equilibrates rows and columns: each
   ! takes half of the deviation of its largest entry, repeatedly (Ruiz 2001).
   subroutine equilibrate(matrix, undetermined, factors, ratios)
      type(csr_matrix_type), intent(in) :: matrix
      !> Unknowns without diagonal: their rows may also be too small.
      logical, intent(in) :: undetermined(:)
      real(wp), intent(inout) :: factors(:)
      real(wp), intent(in) :: ratios(:)
      real(wp), parameter :: balanced = 4
      integer, parameter :: passes = 20
      real(wp) :: largest(size(factors))
      logical :: too_large(size(factors))
      integer :: pass

      do pass = 1, passes
         largest = line_maxima(matrix, factors, ratios)
         too_large = largest > balanced .or. (undetermined .and. largest > 0 .and. largest < 1/balanced)
         if (.not. any(too_large)) exit
         where (too_large) factors = scale(factors, -exponent(largest)/2)
      end do
   end subroutine equilibrate

   ! Largest entry of each row and of the column of the same number, of E D A D E^{-1}.
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
