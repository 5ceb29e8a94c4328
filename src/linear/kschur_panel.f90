!> Dense kernels of LDL^T on column-major blocks: own loops for small blocks, BLAS for others.
module kschur_panel
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   implicit none
   private
   public :: subtract_trapezoid, factor_panel, factor_rows, enclosure_type

   !> Perturbation of pivots: downwards or upwards by a bound of the rounding errors (theory in kschur_proved_inertia), or to a
   !> least size.
   type :: enclosure_type
      !> -1 downwards, 1 upwards, 0 not at all.
      integer :: side = 0
      !> Dimensions of the panel.
      integer :: rows = 0, columns = 0
      !> Of each row of the diagonal block, the sum of (e_p + sqrt(e_p)) |d_p| l_kp^2 over the columns done; of all
      !> columns before it, the number of entries.
      real(wp), allocatable :: sum(:), terms(:)
      !> Bound of errors by underflow.
      real(wp) :: underflow = 0
      !> Least size of a pivot; smaller ones are replaced by it.
      real(wp) :: least = 0
   contains
      !> (e + sqrt(e)) |d| of column k, its pivot d, e entries below it.
      procedure :: weight
      procedure, private :: move
      procedure, private :: add_column
   end type enclosure_type

   ! Multiplications that cost as much as a call of BLAS.
   integer, parameter :: call_cost = 4000
   ! Columns that one call of BLAS multiplies; beside the diagonal, where entries above it are wasted work.
   integer, parameter :: block = 192, strip = 48
   ! Columns of a panel that are eliminated one by one (unblocked).
   integer, parameter :: narrow = 12

contains

   !> C := C - A B^T in the lower trapezoid of C; A B^T is symmetric in its first rows.
   subroutine subtract_trapezoid(rows, columns, terms, a, lda, b, ldb, c, ldc)
      !> columns <= rows.
      integer, intent(in) :: rows, columns, terms, lda, ldb, ldc
      !> rows x terms, and columns x terms.
      real(wp), intent(in) :: a(lda, *), b(ldb, *)
      !> rows x columns; the part above the diagonal is undefined.
      real(wp), intent(inout) :: c(ldc, *)
      integer :: i, j, last

      if (real(rows, wp)*columns*terms < call_cost) then
         call subtract_small(rows, columns, terms, a, lda, b, ldb, c, ldc)
         return
      end if
      do j = 1, columns, block
         last = min(j + block - 1, columns)
         do i = j, last, strip
            call dgemm("N", "T", last - i + 1, min(strip, last - i + 1), terms, -1.0_wp, a(i, 1), lda, b(i, 1), ldb, 1.0_wp, &
               c(i, i), ldc)
         end do
         if (last < rows) call dgemm("N", "T", rows - last, last - j + 1, terms, -1.0_wp, a(last + 1, 1), lda, b(j, 1), ldb, &
            1.0_wp, c(last + 1, j), ldc)
      end do
   end subroutine subtract_trapezoid

   ! As `subtract_trapezoid` without BLAS: tiles of 4 x 2 are kept in registers.
   pure subroutine subtract_small(rows, columns, terms, a, lda, b, ldb, c, ldc)
      integer, intent(in) :: rows, columns, terms, lda, ldb, ldc
      real(wp), intent(in) :: a(lda, *), b(ldb, *)
      real(wp), intent(inout) :: c(ldc, *)
      real(wp) :: first(4), second(4)
      integer :: i, j, p

      do j = 1, columns - 1, 2
         do i = j, rows - 3, 4
            first = 0
            second = 0
            do p = 1, terms
               first = first + a(i:i + 3, p)*b(j, p)
               second = second + a(i:i + 3, p)*b(j + 1, p)
            end do
            c(i:i + 3, j) = c(i:i + 3, j) - first
            c(i:i + 3, j + 1) = c(i:i + 3, j + 1) - second
         end do
         do i = i, rows
            first(:2) = 0
            do p = 1, terms
               first(1) = first(1) + a(i, p)*b(j, p)
               first(2) = first(2) + a(i, p)*b(j + 1, p)
            end do
            c(i, j) = c(i, j) - first(1)
            c(i, j + 1) = c(i, j + 1) - first(2)
         end do
      end do
      if (mod(columns, 2) == 0) return
      do i = columns, rows - 3, 4
         first = 0
         do p = 1, terms
            first = first + a(i:i + 3, p)*b(columns, p)
         end do
         c(i:i + 3, columns) = c(i:i + 3, columns) - first
      end do
      do i = i, rows
         first(1) = 0
         do p = 1, terms
            first(1) = first(1) + a(i, p)*b(columns, p)
         end do
         c(i, columns) = c(i, columns) - first(1)
      end do
   end subroutine subtract_small

   !> Computes L and D of a panel whose first rows are the symmetric diagonal block; L without its unit diagonal overwrites it.
   subroutine factor_panel(rows, columns, panel, lda, pivot, scaled, enclosure)
      !> columns <= rows.
      integer, intent(in) :: rows, columns, lda
      real(wp), intent(inout) :: panel(lda, columns)
      !> D; after a pivot that is zero or NaN the others are undefined.
      real(wp), intent(inout) :: pivot(columns)
      !> Workspace, at most 12 x columns.
      real(wp), intent(inout) :: scaled(*)
      type(enclosure_type), intent(inout) :: enclosure
      integer :: first, last

      do first = 1, columns, narrow
         last = min(first + narrow - 1, columns)
         if (first > 1) call subtract_columns(rows, first - 1, last, panel, lda, pivot, scaled)
         call eliminate_columns(rows, first, last, panel, lda, pivot, enclosure)
      end do
   end subroutine factor_panel

   !> Computes L in rows first_row ... last_row of a panel, after its diagonal block.
   subroutine factor_rows(first_row, last_row, columns, panel, lda, pivot)
      integer, intent(in) :: first_row, last_row, columns, lda
      real(wp), intent(inout) :: panel(lda, columns)
      real(wp), intent(in) :: pivot(columns)
      real(wp) :: scaled(narrow, columns)
      integer :: first, last, j, p

      do first = 1, columns, narrow
         last = min(first + narrow - 1, columns)
         do p = 1, last
            do j = max(first, p + 1), last
               scaled(j - first + 1, p) = pivot(p)*panel(j, p)
            end do
         end do
         if (first > 1) call dgemm("N", "T", last_row - first_row + 1, last - first + 1, first - 1, -1.0_wp, &
            panel(first_row, 1), lda, scaled, narrow, 1.0_wp, panel(first_row, first), lda)
         do j = first, last
            do p = first, j - 1
               panel(first_row:last_row, j) = panel(first_row:last_row, j) - panel(first_row:last_row, p)*scaled(j - first + 1, p)
            end do
            panel(first_row:last_row, j) = panel(first_row:last_row, j)/pivot(j)
         end do
      end do
   end subroutine factor_rows

   ! Subtracts the update of the first `eliminated` columns from the next ones.
   subroutine subtract_columns(rows, eliminated, last, panel, lda, pivot, scaled)
      integer, intent(in) :: rows, eliminated, last, lda
      real(wp), intent(inout) :: panel(lda, *), scaled(last - eliminated, *)
      real(wp), intent(in) :: pivot(*)
      integer :: p

      do p = 1, eliminated
         scaled(:, p) = pivot(p)*panel(eliminated + 1:last, p)
      end do
      call subtract_trapezoid(rows - eliminated, last - eliminated, eliminated, panel(eliminated + 1, 1), lda, scaled, &
         last - eliminated, panel(eliminated + 1, eliminated + 1), lda)
   end subroutine subtract_columns

   ! Eliminates columns first..last one by one, after the update by earlier ones: L and D by the unblocked algorithm.
   pure subroutine eliminate_columns(rows, first, last, panel, lda, pivot, enclosure)
      integer, intent(in) :: rows, first, last, lda
      real(wp), intent(inout) :: panel(lda, *), pivot(*)
      type(enclosure_type), intent(inout) :: enclosure
      integer :: i, j, p

      do j = first, last
         do p = first, j - 4, 4
            associate (z => panel(j, p:p + 3)*pivot(p:p + 3))
               do i = j, rows
                  panel(i, j) = panel(i, j) - &
                     (panel(i, p)*z(1) + panel(i, p + 1)*z(2) + panel(i, p + 2)*z(3) + panel(i, p + 3)*z(4))
               end do
            end associate
         end do
         do p = p, j - 1
            associate (z => panel(j, p)*pivot(p))
               panel(j:rows, j) = panel(j:rows, j) - panel(j:rows, p)*z
            end associate
         end do
         pivot(j) = panel(j, j)
         if (abs(pivot(j)) < enclosure%least) pivot(j) = enclosure%least
         if (enclosure%side /= 0) call enclosure%move(j, pivot(j))
         panel(j + 1:rows, j) = panel(j + 1:rows, j)/pivot(j)
         if (enclosure%side /= 0) call enclosure%add_column(j, pivot(j), panel(j + 1:enclosure%columns, j))
      end do
   end subroutine eliminate_columns

   pure real(wp) function weight(self, k, pivot)
      class(enclosure_type), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: pivot

      weight = (self%rows - k + sqrt(real(self%rows - k, wp)))*abs(pivot)
   end function weight

   ! Moves pivot k by the bound S_k of kschur_proved_inertia.
   pure subroutine move(self, k, pivot)
      class(enclosure_type), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(inout) :: pivot
      real(wp), parameter :: unit = epsilon(1.0_wp)/2
      ! Allows for second-order terms and for rounding of the bound.
      real(wp), parameter :: caution = 1.01_wp
      real(wp) :: rounding

      rounding = self%sum(k) + (1 + sqrt(real(self%rows - k, wp)))*abs(pivot)
      pivot = pivot + self%side*(caution*unit*(self%terms(k) + 4)*rounding + self%underflow)
   end subroutine move

   ! Adds the terms of column k of L to the sums of S in the rows below pivot k.
   pure subroutine add_column(self, k, pivot, column)
      class(enclosure_type), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: pivot, column(:)

      self%sum(k + 1:k + size(column)) = self%sum(k + 1:k + size(column)) + self%weight(k, pivot)*column**2
   end subroutine add_column
end module kschur_panel
