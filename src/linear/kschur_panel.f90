!> Dense kernels of LDL^T on column-major blocks: loops of our own where a block is small, BLAS where it is not.
module kschur_panel
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   implicit none
   private
   public :: subtract_trapezoid, subtract_rectangle, factor_panel, factor_rows, enclosure_type

   !> By what pivots are moved: so that rounding cannot turn their signs (kschur_proved_inertia has the theory), or that none is
   !> null.
   type :: enclosure_type
      !> -1 downwards, 1 upwards, 0 not at all.
      integer :: side = 0
      !> Of the panel.
      integer :: rows = 0, columns = 0
      !> Of each row of its diagonal block, (e_p + sqrt(e_p)) |d_p| l_kp^2 of the columns that are known, and how many these are.
      real(wp), allocatable :: sum(:), terms(:)
      !> What may be lost below the smallest number.
      real(wp) :: underflow = 0
      !> The least size of a pivot: a smaller one becomes as large.
      real(wp) :: least = 0
   contains
      !> (e + sqrt(e)) |d| of column k, its pivot d, e entries below it.
      procedure :: weight
      procedure, private :: move
      procedure, private :: add_column
   end type enclosure_type

   ! A call of BLAS costs as much as so many multiplications.
   integer, parameter :: call_cost = 4000
   ! Columns that BLAS multiplies at once: above the diagonal it does so in vain.
   integer, parameter :: strip = 48
   ! Columns of a panel that are eliminated one by one.
   integer, parameter :: narrow = 12

contains

   !> Takes A B^T, which is symmetric in its first rows, from the lower trapezoid of C.
   subroutine subtract_trapezoid(rows, columns, terms, a, lda, b, c, ldc)
      !> columns <= rows.
      integer, intent(in) :: rows, columns, terms, lda, ldc
      !> rows x terms, and columns x terms.
      real(wp), intent(in) :: a(lda, *), b(columns, *)
      !> rows x columns; what is above the diagonal means nothing.
      real(wp), intent(inout) :: c(ldc, *)
      integer :: j, width

      if (rows*columns*terms < call_cost) then
         call subtract_small(rows, columns, terms, a, lda, b, c, ldc)
         return
      end if
      do j = 1, columns, strip
         width = min(strip, columns - j + 1)
         call dgemm("N", "T", rows - j + 1, width, terms, -1.0_wp, a(j, 1), lda, b(j, 1), columns, 1.0_wp, c(j, j), ldc)
      end do
   end subroutine subtract_trapezoid

   !> Takes all of A B^T, likewise.
   subroutine subtract_rectangle(rows, columns, terms, a, lda, b, c, ldc)
      integer, intent(in) :: rows, columns, terms, lda, ldc
      real(wp), intent(in) :: a(lda, *), b(columns, *)
      real(wp), intent(inout) :: c(ldc, *)

      call dgemm("N", "T", rows, columns, terms, -1.0_wp, a, lda, b, columns, 1.0_wp, c, ldc)
   end subroutine subtract_rectangle

   ! Tiles of four rows and two columns stay in registers.
   pure subroutine subtract_small(rows, columns, terms, a, lda, b, c, ldc)
      integer, intent(in) :: rows, columns, terms, lda, ldc
      real(wp), intent(in) :: a(lda, *), b(columns, *)
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

   !> L and D of a panel whose first rows are symmetric: L takes its place, but for the unit diagonal.
   subroutine factor_panel(rows, columns, panel, lda, pivot, scaled, enclosure)
      !> columns <= rows.
      integer, intent(in) :: rows, columns, lda
      real(wp), intent(inout) :: panel(lda, columns)
      !> D; what is zero or not a number is the last that is set.
      real(wp), intent(inout) :: pivot(columns)
      !> Workspace, as large as its square.
      real(wp), intent(inout) :: scaled(*)
      type(enclosure_type), intent(inout) :: enclosure
      integer :: first, last

      do first = 1, columns, narrow
         last = min(first + narrow - 1, columns)
         if (first > 1) call subtract_columns(rows, first - 1, last, panel, lda, pivot, scaled)
         call eliminate_columns(rows, first, last, panel, lda, pivot, enclosure)
      end do
   end subroutine factor_panel

   !> L in rows first_row ... last_row of a panel, where it is known in the diagonal block.
   subroutine factor_rows(first_row, last_row, columns, panel, lda, pivot, scaled)
      integer, intent(in) :: first_row, last_row, columns, lda
      real(wp), intent(inout) :: panel(lda, columns)
      real(wp), intent(in) :: pivot(columns)
      !> Workspace.
      real(wp), intent(inout) :: scaled(narrow, *)
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

   ! Takes what the first `known` columns make of the next ones.
   subroutine subtract_columns(rows, known, last, panel, lda, pivot, scaled)
      integer, intent(in) :: rows, known, last, lda
      real(wp), intent(inout) :: panel(lda, *), scaled(last - known, *)
      real(wp), intent(in) :: pivot(*)
      integer :: p

      do p = 1, known
         scaled(:, p) = pivot(p)*panel(known + 1:last, p)
      end do
      call subtract_trapezoid(rows - known, last - known, known, panel(known + 1, 1), lda, scaled, &
         panel(known + 1, known + 1), lda)
   end subroutine subtract_columns

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

   ! By S_k.
   pure subroutine move(self, k, pivot)
      class(enclosure_type), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(inout) :: pivot
      real(wp), parameter :: unit = epsilon(1.0_wp)/2
      ! Terms of second order, and the rounding of the bound itself.
      real(wp), parameter :: caution = 1.01_wp
      real(wp) :: rounding

      rounding = self%sum(k) + (1 + sqrt(real(self%rows - k, wp)))*abs(pivot)
      pivot = pivot + self%side*(caution*unit*(self%terms(k) + 4)*rounding + self%underflow)
   end subroutine move

   ! What the entries of column k of L may round in the rows of the diagonal block below pivot k.
   pure subroutine add_column(self, k, pivot, column)
      class(enclosure_type), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: pivot, column(:)

      self%sum(k + 1:k + size(column)) = self%sum(k + 1:k + size(column)) + self%weight(k, pivot)*column**2
   end subroutine add_column
end module kschur_panel
