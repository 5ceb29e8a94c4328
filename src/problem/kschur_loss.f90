!> Hysteretic losses: loss stiffness H in K + i H, and loss factors of modes.
module kschur_loss
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_sorting, only: ascending_order
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets
   use kschur_tolerances, only: rounding_of_row
   implicit none
   private
   public :: factor_of_loss, find_local_loss, loss_factor_of, loss_or_none, times_factor

contains

   !> Returns g if H = g K to the rounding of rows; else 0.
   real(wp) function factor_of_loss(stiffness, loss) result(factor)
      type(csr_matrix_type), intent(in) :: stiffness, loss
      type(csr_matrix_type) :: rest
      real(wp) :: of_rows(loss%rows), entry
      integer, allocatable :: row(:)
      integer :: i, k

      factor = 0
      if (stiffness%nonzeros() == 0 .or. loss%nonzeros() == 0) return
      k = maxloc(abs(stiffness%value), 1)
      allocate (row(stiffness%nonzeros()), source=stiffness%row_indices())
      i = loss%place_of(row(k), stiffness%column(k))
      if (i == 0) return
      entry = stiffness%value(k)
      if (.not. abs(entry) > 0) return
      factor = loss%value(i)/entry
      rest = linear_combination(1.0_wp, loss, -factor, stiffness)
      of_rows = loss%row_maxima()
      do i = 1, rest%rows
         do k = rest%row_start(i), rest%row_start(i + 1) - 1
            if (abs(rest%value(k)) <= rounding_of_row*min(of_rows(i), of_rows(rest%column(k)))) cycle
            factor = 0
            return
         end do
      end do
   end function factor_of_loss

   !> Splits H = g K + L, with L in few rows: g is the median of h_ii/k_ii, and entries of L that are rounding errors of their row
   !> and column are dropped.
   subroutine find_local_loss(stiffness, loss, most_rows, factor, local, few, error)
      type(csr_matrix_type), intent(in) :: stiffness, loss
      !> Largest number of nonzero rows of L.
      integer, intent(in) :: most_rows
      !> g.
      real(wp), intent(out) :: factor
      !> L, if `few`.
      type(csr_matrix_type), intent(out) :: local
      !> Whether L has few rows.
      logical, intent(out) :: few
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: rest
      real(wp) :: of_rows(loss%rows), of_columns(loss%rows)
      real(wp), allocatable :: ratios(:)
      integer, allocatable :: row(:), order(:)
      logical, allocatable :: kept(:)
      logical :: filled(loss%rows)
      integer :: k

      associate (diagonal => stiffness%diagonal())
         allocate (ratios, source=pack(loss%diagonal(), abs(diagonal) > 0)/pack(diagonal, abs(diagonal) > 0))
      end associate
      factor = 0
      if (size(ratios) > 0) then
         allocate (order, source=ascending_order(ratios))
         factor = ratios(order((size(order) + 1)/2))
      end if
      rest = linear_combination(1.0_wp, loss, -factor, stiffness)
      allocate (row, source=rest%row_indices())
      of_rows = max(loss%row_maxima(), abs(factor)*stiffness%row_maxima())
      of_columns = 0
      do k = 1, loss%nonzeros()
         of_columns(loss%column(k)) = max(of_columns(loss%column(k)), abs(loss%value(k)))
      end do
      of_columns = max(of_columns, of_rows)
      allocate (kept, source=abs(rest%value) > rounding_of_row*min(of_rows(row), of_columns(rest%column)))
      filled = .false.
      filled(pack(row, kept)) = .true.
      few = count(filled) <= most_rows
      if (few) call new_csr_from_triplets(local, loss%rows, loss%rows, pack(row, kept), pack(rest%column, kept), &
         pack(rest%value, kept), error)
   end subroutine find_local_loss

   !> Returns H, or a zero matrix with the pattern of K if there is none.
   pure function loss_or_none(stiffness, loss) result(matrix)
      type(csr_matrix_type), intent(in) :: stiffness
      type(csr_matrix_type), allocatable, intent(in) :: loss
      type(csr_matrix_type) :: matrix

      if (allocated(loss)) then
         matrix = loss
      else
         matrix = times_factor(stiffness, 0.0_wp)
      end if
   end function loss_or_none

   !> Returns g A.
   pure function times_factor(matrix, factor) result(product)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: factor
      type(csr_matrix_type) :: product

      product = matrix
      product%value = factor*product%value
   end function times_factor

   !> Im(-lambda^2)/Re(-lambda^2): equals eta for lambda^2 = -omega^2 (1 + i eta), an undamped structure of one lossy material;
   !> 2 zeta up to third order for a viscous damping ratio zeta. NaN if Re(-lambda^2) is not positive, as for zeta above 0.7,
   !> without resonance.
   elemental real(wp) function loss_factor_of(lambda) result(eta)
      complex(wp), intent(in) :: lambda

      eta = ieee_value(1.0_wp, ieee_quiet_nan)
      associate (decay => -real(lambda, wp), frequency => abs(aimag(lambda)))
         if (frequency > abs(decay)) eta = 2*(decay/frequency)/((1 - decay/frequency)*(1 + decay/frequency))
      end associate
   end function loss_factor_of
end module kschur_loss
