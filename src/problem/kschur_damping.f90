!> Classifies a damping matrix R: proportional, R = alpha M + beta K, proportional except at a few unknowns, or general.
module kschur_damping
   use kschur_kinds, only: wp, xp
   use kschur_sorting, only: ascending_order
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: above_all_rounding, agreeing_entry, cancelled, least_misfit, rounding_of_row
   implicit none
   private
   public :: classify_damping

   !> No damping matrix, or one of zeros.
   integer, parameter, public :: damping_none = 0
   !> R = alpha M + beta K to rounding.
   integer, parameter, public :: damping_proportional = 1
   !> Any other damping or gyroscopic matrix.
   integer, parameter, public :: damping_general = 2
   !> Names of the kinds of damping, from `damping_none` on.
   character(len=*), parameter, public :: damping_names(0:2) = [character(len=12) :: "none", "proportional", "general"]

   ! If alpha M and beta K exceed R by this factor they cancel, as for nearly parallel M and K: their rounding is not small
   ! relative to R.
   real(wp), parameter :: cancelling = 10
   ! Largest number of rows with dampers.
   integer, parameter :: most_rows = 256
   ! Largest number of entries sampled for a fit.
   integer, parameter :: most_sampled = 50000

contains

   !> Fits R = alpha M + beta K by least squares relative to the entries of R, then requires all entries to agree to the
   !> rounding of their terms and of their row and column of R. If few rows do not agree, fits only the others. Entries that are
   !> rounding errors of assembly are ignored.
   subroutine classify_damping(mass, stiffness, damping, kind, alpha, beta, dampers)
      type(csr_matrix_type), intent(in) :: mass, stiffness, damping
      !> One of `damping_*`.
      integer, intent(out) :: kind
      real(wp), intent(out) :: alpha, beta
      !> R - alpha M - beta K, n x n, if it has few nonzero rows; else not allocated.
      type(csr_matrix_type), allocatable, intent(out) :: dampers
      type(csr_matrix_type) :: rest
      real(wp), allocatable :: m(:), k(:)

      kind = damping_none
      alpha = 0
      beta = 0
      if (damping%is_zero()) return
      call divide(mass, damping, m)
      call divide(stiffness, damping, k)
      call fit(m, k, 1 + 0*m, alpha, beta)
      call drop_rounding(mass, stiffness, maxval(abs(damping%value)), alpha, beta)
      call subtract(mass, stiffness, damping, alpha, beta, 0, rest)
      kind = merge(damping_proportional, damping_general, allocated(rest%value))
      if (kind == damping_proportional) then
         if (max(abs(alpha)*largest(mass), abs(beta)*largest(stiffness)) <= cancelling*largest(damping)) return
         kind = damping_general
         alpha = 0
         beta = 0
         return
      end if
      associate (every => max(size(m)/most_sampled, 1))
         call fit_most(m(::every), k(::every), alpha, beta)
         call drop_rounding(mass, stiffness, median(abs(damping%value(::every))), alpha, beta)
      end associate
      call subtract(mass, stiffness, damping, alpha, beta, most_rows, rest)
      call try_all_of_damping(mass, stiffness, damping, alpha, beta, rest)
      if (allocated(rest%value)) then
         allocate (dampers, source=rest)
      else
         alpha = 0
         beta = 0
      end if
   end subroutine classify_damping

   ! Takes all of R as dampers, with alpha = beta = 0, if it has no more nonzero rows than R - alpha M - beta K.
   subroutine try_all_of_damping(mass, stiffness, damping, alpha, beta, rest)
      type(csr_matrix_type), intent(in) :: mass, stiffness, damping
      real(wp), intent(inout) :: alpha, beta
      !> Its arrays are not allocated if it has too many rows.
      type(csr_matrix_type), intent(inout) :: rest
      integer :: rows

      rows = most_rows
      if (allocated(rest%value)) rows = filled_rows(rest)
      if (filled_rows(damping) > rows) return
      alpha = 0
      beta = 0
      call subtract(mass, stiffness, damping, alpha, beta, rows, rest)
   end subroutine try_all_of_damping

   ! Number of rows with a nonzero entry.
   pure integer function filled_rows(matrix)
      type(csr_matrix_type), intent(in) :: matrix

      filled_rows = count(matrix%row_maxima() > 0)
   end function filled_rows

   ! Largest magnitude of an entry.
   pure real(wp) function largest(matrix)
      type(csr_matrix_type), intent(in) :: matrix

      largest = maxval([0.0_wp, abs(matrix%value)])
   end function largest

   ! Sets alpha or beta to zero if its term is at rounding level.
   pure subroutine drop_rounding(mass, stiffness, level, alpha, beta)
      type(csr_matrix_type), intent(in) :: mass, stiffness
      !> Magnitude of the damping.
      real(wp), intent(in) :: level
      real(wp), intent(inout) :: alpha, beta

      if (abs(alpha)*largest(mass) <= above_all_rounding*level) alpha = 0
      if (abs(beta)*largest(stiffness) <= above_all_rounding*level) beta = 0
   end subroutine drop_rounding

   ! Divides the entries of a matrix by those of another of its shape, where these are above rounding.
   pure subroutine divide(matrix, divisors, ratios)
      type(csr_matrix_type), intent(in) :: matrix, divisors
      real(wp), allocatable, intent(out) :: ratios(:)
      real(wp) :: of_row(divisors%rows), of_column(divisors%columns)
      integer :: i, j, k, total

      call level_of_rounding(divisors, of_row, of_column)
      allocate (ratios(count(abs(divisors%value) > 0)), source=0.0_wp)
      total = 0
      do i = 1, divisors%rows
         k = matrix%row_start(i)
         do j = divisors%row_start(i), divisors%row_start(i + 1) - 1
            if (.not. abs(divisors%value(j)) > min(of_row(i), of_column(divisors%column(j)))) cycle
            total = total + 1
            do while (k < matrix%row_start(i + 1))
               if (matrix%column(k) >= divisors%column(j)) exit
               k = k + 1
            end do
            if (k == matrix%row_start(i + 1)) cycle
            if (matrix%column(k) == divisors%column(j)) ratios(total) = matrix%value(k)/divisors%value(j)
         end do
      end do
      ratios = ratios(:total)
   end subroutine divide

   ! Rounding level of each row and column: entries below the smaller of the two may be rounding errors of cancelling sums.
   pure subroutine level_of_rounding(matrix, of_row, of_column)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: of_row(:), of_column(:)
      integer :: k

      of_row = rounding_of_row*matrix%row_maxima()
      of_column = 0
      do k = 1, size(matrix%value)
         associate (level => of_column(matrix%column(k)))
            level = max(level, rounding_of_row*abs(matrix%value(k)))
         end associate
      end do
   end subroutine level_of_rounding

   ! Least squares solution of alpha m + beta k = right by orthogonalisation: normal equations would lose alpha. If m and k are
   ! parallel to rounding, as for K = c M, only one of them is used. Sums in extended precision: where m and k are nearly parallel
   ! alpha and beta would else have errors that are seen in the eigenvalues, as alpha M + beta K takes the place of R.
   pure subroutine fit(m, k, right, alpha, beta)
      real(wp), intent(in) :: m(:), k(:), right(:)
      real(wp), intent(out) :: alpha, beta
      real(xp) :: along, square_of_m, square_of_rest, step, a, b
      integer :: pass

      ! k - along m is orthogonal to m.
      square_of_m = sum(real(m, xp)**2)
      along = 0
      if (square_of_m > 0) along = sum(real(m, xp)*k)/square_of_m
      square_of_rest = sum((k - along*m)**2)
      if (.not. square_of_rest > cancelled**2*sum(real(k, xp)**2)) square_of_rest = 0
      a = 0
      b = 0
      ! The second pass corrects rounding errors of long sums.
      do pass = 1, 2
         step = 0
         if (square_of_rest > 0) step = sum((k - along*m)*(right - a*m - b*k))/square_of_rest
         if (square_of_m > 0) a = a + sum(m*(right - a*m - b*k - step*k))/square_of_m
         b = b + step
      end do
      alpha = real(a, wp)
      beta = real(b, wp)
   end subroutine fit

   ! Fits alpha m + beta k = 1 to most of the entries, then to all that agree with these. If M is lumped, only diagonal entries
   ! determine alpha: beta is found first, from the others.
   pure subroutine fit_most(m, k, alpha, beta)
      real(wp), intent(in) :: m(:), k(:)
      real(wp), intent(out) :: alpha, beta
      ! At most this fraction of the entries may belong to dampers.
      integer, parameter :: part = 8
      integer, parameter :: turns = 2
      logical :: fits(size(m)), alone(size(m))
      real(wp) :: unused
      integer :: turn

      alone = .not. abs(m) > 0 .and. abs(k) > 0
      if (part*count(alone) > size(m)) then
         call concentrate(pack(0*m, alone), pack(k, alone), 1 + 0*pack(m, alone), unused, beta)
         call concentrate(pack(m, abs(m) > 0), pack(0*k, abs(m) > 0), pack(1 - beta*k, abs(m) > 0), alpha, unused)
      else
         call concentrate(m, k, 1 + 0*m, alpha, beta)
      end if
      do turn = 1, turns
         fits = abs(1 - alpha*m - beta*k) <= agreeing_entry
         if (any(fits)) call fit(pack(m, fits), pack(k, fits), 1 + 0*pack(m, fits), alpha, beta)
      end do
   end subroutine fit_most

   ! Least trimmed squares by concentration steps: repeatedly fits the half that fits best (Rousseeuw, Van Driessen, Data Mining
   ! and Knowledge Discovery 12 (2006)). Entries dominated by a damper have small weights in the first fit.
   pure subroutine concentrate(m, k, right, alpha, beta)
      real(wp), intent(in) :: m(:), k(:), right(:)
      real(wp), intent(out) :: alpha, beta
      integer, parameter :: turns = 20
      logical :: fits(size(m)), before(size(m))
      real(wp) :: misfit(size(m))
      integer :: turn

      call fit(m, k, right, alpha, beta)
      before = .false.
      do turn = 1, turns
         misfit = abs(right - alpha*m - beta*k)
         fits = misfit <= median(misfit)
         ! Converged: the same half gives the same fit.
         if (all(fits .eqv. before)) exit
         before = fits
         if (any(fits)) call fit(pack(m, fits), pack(k, fits), pack(right, fits), alpha, beta)
      end do
   end subroutine concentrate

   ! Median of nonnegative numbers to within a factor, by bisection of the exponent.
   pure real(wp) function median(numbers)
      real(wp), intent(in) :: numbers(:)
      real(wp) :: low, high
      integer :: step

      low = least_misfit
      high = max(maxval([0.0_wp, numbers]), 2*least_misfit)
      do step = 1, 20
         median = sqrt(low*high)
         if (2*count(numbers <= median) >= size(numbers)) then
            high = median
         else
            low = median
         end if
      end do
      median = high
   end function median

   ! Computes R - alpha M - beta K and drops entries that are rounding errors. Allocates its arrays if it has at most `most` nonzero
   ! rows.
   subroutine subtract(mass, stiffness, damping, alpha, beta, most, rest)
      type(csr_matrix_type), intent(in) :: mass, stiffness, damping
      real(wp), intent(in) :: alpha, beta
      integer, intent(in) :: most
      type(csr_matrix_type), intent(out) :: rest
      ! Current row of R - alpha M - beta K, sums of the magnitudes of its terms, and start of each row.
      real(wp), dimension(damping%rows) :: difference, terms
      real(wp), dimension(damping%rows) :: of_row, of_column
      integer :: column(damping%rows), start(damping%rows + 1), i, j, rows, width
      integer, allocatable :: columns(:)
      real(wp), allocatable :: values(:)

      call level_of_rounding(damping, of_row, of_column)
      difference = 0
      terms = 0
      rows = 0
      allocate (columns(0), values(0))
      start(1) = 1
      do i = 1, damping%rows
         width = 0
         call add(damping, 1.0_wp)
         call add(mass, -alpha)
         call add(stiffness, -beta)
         call compress_row(damping)
         call compress_row(mass)
         call compress_row(stiffness)
         if (width > 0) then
            rows = rows + 1
            if (rows > most) exit
            column(:width) = column(ascending_order(real(column(:width), wp)))
            columns = [columns, column(:width)]
            values = [values, (difference(column(j)), j=1, width)]
            difference(column(:width)) = 0
         end if
         start(i + 1) = size(columns) + 1
      end do
      if (rows > most) return
      rest%rows = damping%rows
      rest%columns = damping%columns
      allocate (rest%row_start, source=start)
      call move_alloc(columns, rest%column)
      call move_alloc(values, rest%value)

   contains

      ! Adds factor times row i of a matrix to the current row.
      subroutine add(matrix, factor)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp), intent(in) :: factor
         integer :: k

         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               difference(j) = difference(j) + factor*matrix%value(k)
               terms(j) = terms(j) + abs(factor*matrix%value(k))
            end associate
         end do
      end subroutine add

      ! Drops rounding errors from the current row.
      subroutine compress_row(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         integer :: k

         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               if (abs(difference(j)) <= max(min(rounding_of_row*terms(j), 10*of_row(i)), min(of_row(i), of_column(j)))) then
                  difference(j) = 0
               else if (terms(j) > 0) then
                  width = width + 1
                  column(width) = j
               end if
               terms(j) = 0
            end associate
         end do
      end subroutine compress_row
   end subroutine subtract
end module kschur_damping
