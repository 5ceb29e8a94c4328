!> Sparse real and complex matrices in compressed sparse row (CSR) storage, with products, norms and tests of symmetry.
module kschur_csr
   use kschur_kinds, only: wp
   use kschur_memory, only: complex_bytes, integer_bytes, real_bytes
   use kschur_row_products, only: add_four_rows, add_rows
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: csr_matrix_type, complex_csr_matrix_type, same_pattern

   !> A real sparse matrix. Column indices ascend within a row, without duplicates.
   type :: csr_matrix_type
      !> Number of rows.
      integer :: rows = 0
      !> Number of columns.
      integer :: columns = 0
      !> Row i holds the entries row_start(i) ... row_start(i+1)-1; 1-based.
      integer, allocatable :: row_start(:)
      !> Column of each entry; 1-based.
      integer, allocatable :: column(:)
      !> Value of each entry.
      real(wp), allocatable :: value(:)
   contains
      !> Number of stored entries.
      procedure :: nonzeros
      !> Memory in bytes.
      procedure :: bytes
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
      !> A x, or A^T x.
      procedure :: product
      !> y := y + alpha A^T x, for real or complex blocks of vectors.
      generic :: add_transposed_product => add_transposed_product_real, add_transposed_product_complex
      !> Largest sum of magnitudes over a row.
      procedure :: infinity_norm
      !> Largest sum of magnitudes over a column.
      procedure :: one_norm
      !> Largest magnitude in each row.
      procedure :: row_maxima
      !> The main diagonal.
      procedure :: diagonal
      !> Row index of each entry, for the triplet form.
      procedure :: row_indices
      !> Position of entry (i, j) in `value`; 0 if it is not stored.
      procedure :: place_of
      !> A := diag(rows) A diag(columns).
      procedure :: scale_entries
      !> Whether the matrix equals its transpose to rounding.
      procedure :: is_symmetric
      !> Whether the pattern of a square matrix is symmetric.
      procedure :: has_symmetric_pattern
      !> Whether every stored value is zero.
      procedure :: is_zero
      procedure, private :: add_product_real, add_product_complex
      procedure, private :: add_transposed_product_real, add_transposed_product_complex
   end type csr_matrix_type

   !> A complex sparse matrix, as used for complex shifted matrices.
   type :: complex_csr_matrix_type
      integer :: rows = 0
      integer :: columns = 0
      integer, allocatable :: row_start(:)
      integer, allocatable :: column(:)
      complex(wp), allocatable :: value(:)
   contains
      procedure :: bytes => complex_bytes_of
      !> y := y + alpha A x for a block of vectors.
      procedure :: add_product => add_product_all_complex
      !> The main diagonal.
      procedure :: diagonal => complex_diagonal
      !> The matrix of the magnitudes of its entries.
      procedure :: magnitudes
   end type complex_csr_matrix_type

contains

   pure integer function nonzeros(self)
      class(csr_matrix_type), intent(in) :: self

      nonzeros = size(self%column)
   end function nonzeros

   pure real(wp) function bytes(self)
      class(csr_matrix_type), intent(in) :: self

      bytes = (integer_bytes + real_bytes)*real(self%nonzeros(), wp) + integer_bytes*(real(self%rows, wp) + 1)
   end function bytes

   pure real(wp) function complex_bytes_of(self)
      class(complex_csr_matrix_type), intent(in) :: self

      complex_bytes_of = (integer_bytes + complex_bytes)*real(size(self%column), wp) + integer_bytes*(real(self%rows, wp) + 1)
   end function complex_bytes_of

   subroutine add_product_real(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: j, fours

      fours = size(x, 2) - modulo(size(x, 2), 4)
      do j = 1, fours, 4
         call add_four_rows(self%row_start, self%column, self%value, alpha, x(:, j:j + 3), y(:, j:j + 3))
      end do
      do j = fours + 1, size(x, 2)
         call add_rows(self%row_start, self%column, self%value, alpha, x(:, j), y(:, j))
      end do
   end subroutine add_product_real

   subroutine add_product_complex(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: y(:, :)
      integer :: j

      do j = 1, size(x, 2)
         call add_rows(self%row_start, self%column, self%value, alpha, x(:, j), y(:, j))
      end do
   end subroutine add_product_complex

   !> A x, or A^T x.
   function product(self, x, transposed) result(y)
      class(csr_matrix_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      !> Absent: false.
      logical, optional, intent(in) :: transposed
      real(wp), allocatable :: y(:, :)
      logical :: by_columns

      by_columns = .false.
      if (present(transposed)) by_columns = transposed
      allocate (y(merge(self%columns, self%rows, by_columns), size(x, 2)), source=0.0_wp)
      if (by_columns) then
         call self%add_transposed_product(1.0_wp, x, y)
      else
         call self%add_product(1.0_wp, x, y)
      end if
   end function product

   pure subroutine add_transposed_product_real(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, j, k

      do j = 1, size(x, 2)
         do i = 1, self%rows
            do k = self%row_start(i), self%row_start(i + 1) - 1
               y(self%column(k), j) = y(self%column(k), j) + alpha*self%value(k)*x(i, j)
            end do
         end do
      end do
   end subroutine add_transposed_product_real

   pure subroutine add_transposed_product_complex(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: y(:, :)
      complex(wp) :: term
      integer :: i, j, k

      do j = 1, size(x, 2)
         do i = 1, self%rows
            term = alpha*x(i, j)
            do k = self%row_start(i), self%row_start(i + 1) - 1
               y(self%column(k), j) = y(self%column(k), j) &
                  + cmplx(self%value(k)*real(term, wp), self%value(k)*aimag(term), wp)
            end do
         end do
      end do
   end subroutine add_transposed_product_complex

   subroutine add_product_all_complex(self, alpha, x, y)
      class(complex_csr_matrix_type), intent(in) :: self
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: y(:, :)
      integer :: j

      do j = 1, size(x, 2)
         call add_rows(self%row_start, self%column, self%value, alpha, x(:, j), y(:, j))
      end do
   end subroutine add_product_all_complex

   pure real(wp) function infinity_norm(self)
      class(csr_matrix_type), intent(in) :: self
      real(wp) :: total
      integer :: i, k

      infinity_norm = 0
      do i = 1, self%rows
         total = 0
         do k = self%row_start(i), self%row_start(i + 1) - 1
            total = total + abs(self%value(k))
         end do
         infinity_norm = max(infinity_norm, total)
      end do
   end function infinity_norm

   pure real(wp) function one_norm(self)
      class(csr_matrix_type), intent(in) :: self
      real(wp) :: total(self%columns)
      integer :: k

      total = 0
      do k = 1, self%nonzeros()
         total(self%column(k)) = total(self%column(k)) + abs(self%value(k))
      end do
      one_norm = maxval([0.0_wp, total])
   end function one_norm

   pure subroutine scale_entries(self, rows, columns)
      class(csr_matrix_type), intent(inout) :: self
      real(wp), intent(in) :: rows(:), columns(:)
      integer :: i, k

      do i = 1, self%rows
         do k = self%row_start(i), self%row_start(i + 1) - 1
            self%value(k) = rows(i)*self%value(k)*columns(self%column(k))
         end do
      end do
   end subroutine scale_entries

   pure function row_maxima(self) result(maxima)
      class(csr_matrix_type), intent(in) :: self
      real(wp) :: maxima(self%rows)
      integer :: i, k

      maxima = 0
      do i = 1, self%rows
         do k = self%row_start(i), self%row_start(i + 1) - 1
            maxima(i) = max(maxima(i), abs(self%value(k)))
         end do
      end do
   end function row_maxima

   pure function diagonal(self) result(values)
      class(csr_matrix_type), intent(in) :: self
      real(wp) :: values(min(self%rows, self%columns))
      integer :: i, k

      values = 0
      do i = 1, size(values)
         k = self%place_of(i, i)
         if (k > 0) values(i) = self%value(k)
      end do
   end function diagonal

   pure function complex_diagonal(self) result(values)
      class(complex_csr_matrix_type), intent(in) :: self
      complex(wp) :: values(min(self%rows, self%columns))
      integer :: i, k

      values = 0
      do i = 1, size(values)
         do k = self%row_start(i), self%row_start(i + 1) - 1
            if (self%column(k) < i) cycle
            if (self%column(k) == i) values(i) = self%value(k)
            exit
         end do
      end do
   end function complex_diagonal

   pure function magnitudes(self) result(matrix)
      class(complex_csr_matrix_type), intent(in) :: self
      type(csr_matrix_type) :: matrix

      matrix%rows = self%rows
      matrix%columns = self%columns
      allocate (matrix%row_start, source=self%row_start)
      allocate (matrix%column, source=self%column)
      allocate (matrix%value, source=abs(self%value))
   end function magnitudes

   pure function row_indices(self) result(row)
      class(csr_matrix_type), intent(in) :: self
      integer :: row(size(self%column))
      integer :: i

      do i = 1, self%rows
         row(self%row_start(i):self%row_start(i + 1) - 1) = i
      end do
   end function row_indices

   pure integer function place_of(self, i, j) result(place)
      class(csr_matrix_type), intent(in) :: self
      integer, intent(in) :: i, j
      integer :: last, middle

      place = self%row_start(i)
      last = self%row_start(i + 1)
      do while (last - place > 1)
         middle = (place + last)/2
         if (self%column(middle) <= j) then
            place = middle
         else
            last = middle
         end if
      end do
      if (last == place) then
         place = 0
      else if (self%column(place) /= j) then
         place = 0
      end if
   end function place_of

   pure logical function is_symmetric(self)
      class(csr_matrix_type), intent(in) :: self
      real(wp) :: maxima(self%rows), mirrored
      ! Of each row, the position of its next entry to be compared with its mirror entry.
      integer :: next(self%rows)
      integer :: i, k

      is_symmetric = self%rows == self%columns
      if (.not. is_symmetric) return
      maxima = self%row_maxima()
      next = self%row_start(:self%rows)
      associate (start => self%row_start, column => self%column, value => self%value)
         do i = 1, self%rows
            do k = next(i), start(i + 1) - 1
               associate (j => column(k))
                  mirrored = 0
                  do while (j >= i .and. next(j) < start(j + 1))
                     if (column(next(j)) > i) exit
                     if (column(next(j)) == i) then
                        mirrored = value(next(j))
                     else if (.not. negligible(value(next(j)), j, column(next(j)))) then
                        is_symmetric = .false.
                     end if
                     next(j) = next(j) + 1
                  end do
                  if (.not. negligible(value(k) - mirrored, i, j)) is_symmetric = .false.
               end associate
            end do
            if (.not. is_symmetric) return
         end do
      end associate

   contains

      ! Whether a difference between entries (i, j) and (j, i) is at rounding level.
      pure logical function negligible(difference, i, j)
         real(wp), intent(in) :: difference
         integer, intent(in) :: i, j

         negligible = .not. abs(difference) > 0
         if (.not. negligible) negligible = abs(difference) <= rounding_of_sums*min(maxima(i), maxima(j))
      end function negligible
   end function is_symmetric

   ! Compares the entries left of the diagonal, row by row, with those above it, which are met in the order of their columns.
   pure logical function has_symmetric_pattern(matrix)
      class(csr_matrix_type), intent(in) :: matrix
      integer :: next(matrix%rows), i, k

      has_symmetric_pattern = .true.
      next = matrix%row_start(:matrix%rows)
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               if (j >= i) exit
               has_symmetric_pattern = has_symmetric_pattern .and. next(j) < matrix%row_start(j + 1)
               if (has_symmetric_pattern) has_symmetric_pattern = matrix%column(next(j)) == i
               if (.not. has_symmetric_pattern) return
               next(j) = next(j) + 1
            end associate
         end do
         next(i) = k
         if (k < matrix%row_start(i + 1)) then
            if (matrix%column(k) == i) next(i) = k + 1
         end if
      end do
      has_symmetric_pattern = all(next == matrix%row_start(2:matrix%rows + 1))
   end function has_symmetric_pattern

   !> Whether two matrices have the same pattern.
   pure logical function same_pattern(a, b)
      type(csr_matrix_type), intent(in) :: a, b

      same_pattern = size(a%row_start) == size(b%row_start) .and. size(a%column) == size(b%column)
      if (same_pattern) same_pattern = all(a%row_start == b%row_start) .and. all(a%column == b%column)
   end function same_pattern

   pure logical function is_zero(self)
      class(csr_matrix_type), intent(in) :: self

      is_zero = all(abs(self%value) <= 0)
   end function is_zero
end module kschur_csr
