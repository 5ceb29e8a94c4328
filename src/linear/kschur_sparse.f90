!> Sparse real matrices in compressed sparse rows (CSR): made from triplets,
!> multiplied with real and complex blocks, measured.
module kschur_sparse
   use kschur_error, only: error_type, new_error, error_input
   use kschur_kinds, only: wp
   use kschur_text, only: text
   implicit none
   private
   public :: csr_matrix_type, complex_csr_matrix_type
   public :: new_csr_matrix, new_csr_from_triplets, empty_csr_matrix, identity_csr_matrix
   public :: linear_combination, complex_combination, transpose_csr

   !> A real sparse matrix. Columns ascend within a row, no entry stands twice.
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
      !> y := y + alpha A x, for real or complex blocks of vectors.
      generic :: add_product => add_product_real, add_product_complex
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
      !> Row index of every entry: the other half of a triplet form.
      procedure :: row_indices
      !> Whether the matrix equals its transpose to rounding.
      procedure :: is_symmetric
      !> Whether every stored value is zero.
      procedure :: is_zero
      procedure, private :: add_product_real, add_product_complex
      procedure, private :: add_transposed_product_real, add_transposed_product_complex
   end type csr_matrix_type

   !> A complex sparse matrix, as the shifted matrices to be factored are.
   type :: complex_csr_matrix_type
      integer :: rows = 0
      integer :: columns = 0
      integer, allocatable :: row_start(:)
      integer, allocatable :: column(:)
      complex(wp), allocatable :: value(:)
   end type complex_csr_matrix_type

contains

   !> A matrix from its CSR arrays (1-based). Rows are sorted and repeated
   !> entries summed. Fails on indices out of range and row starts that descend.
   subroutine new_csr_matrix(matrix, rows, columns, row_start, column, value, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(in) :: rows, columns
      !> Start of each row, rows+1 numbers, the first is 1.
      integer, intent(in) :: row_start(:)
      integer, intent(in) :: column(:)
      real(wp), intent(in) :: value(:)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:)
      integer :: i

      if (rows < 0 .or. size(row_start) /= rows + 1) then
         call new_error(error, error_input, "there are "//text(size(row_start))// &
            " row starts, but a matrix of "//text(rows)//" rows needs "//text(rows + 1))
      else if (row_start(1) /= 1 .or. row_start(rows + 1) /= size(column) + 1) then
         call new_error(error, error_input, "the row starts do not span the "//text(size(column))//" entries")
      else if (any(row_start(2:) < row_start(:rows))) then
         call new_error(error, error_input, "the row starts descend")
      end if
      if (allocated(error)) return
      allocate (row(size(column)))
      do i = 1, rows
         row(row_start(i):row_start(i + 1) - 1) = i
      end do
      call new_csr_from_triplets(matrix, rows, columns, row, column, value, error)
   end subroutine new_csr_matrix

   !> A matrix from triplets (row, column, value), 1-based, in any order;
   !> values of the same place are summed. Fails on indices out of range.
   subroutine new_csr_from_triplets(matrix, rows, columns, row, column, value, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(in) :: rows, columns
      integer, intent(in) :: row(:), column(:)
      real(wp), intent(in) :: value(:)
      type(error_type), allocatable, intent(out) :: error
      ! A wrong size line must not take all the memory there is.
      integer, parameter :: very_large = 100000000, very_sparse = 100
      integer, allocatable :: by_column(:), by_row(:), next(:)
      integer :: i, k, entries, last

      if (rows < 0 .or. columns < 0) then
         call new_error(error, error_input, "a matrix cannot have "//text(rows)//" x "//text(columns)//" entries")
      else if (max(rows, columns) > very_large .and. max(rows, columns)/very_sparse > size(row)) then
         call new_error(error, error_input, "a matrix of "//text(rows)//" x "//text(columns)//" with only "// &
            text(size(row))//" entries cannot be meant")
      else if (size(row) /= size(column) .or. size(row) /= size(value)) then
         call new_error(error, error_input, "row indices, column indices and values differ in number")
      else
         do k = 1, size(row)
            if (row(k) < 1 .or. row(k) > rows .or. column(k) < 1 .or. column(k) > columns) then
               call new_error(error, error_input, "entry ("//text(row(k))//", "//text(column(k))// &
                  ") lies outside a matrix of "//text(rows)//" x "//text(columns))
               exit
            end if
         end do
      end if
      if (allocated(error)) return

      ! Two stable counting sorts: by column, then by row.
      call counting_sort(column, columns, [(k, k=1, size(column))], by_column, next)
      call counting_sort(row, rows, by_column, by_row, next)

      matrix%rows = rows
      matrix%columns = columns
      allocate (matrix%row_start(rows + 1), matrix%column(size(row)), matrix%value(size(row)))
      entries = 0
      matrix%row_start(1) = 1
      k = 1
      do i = 1, rows
         last = 0
         do while (k < next(i))
            associate (t => by_row(k))
               if (column(t) == last) then
                  matrix%value(entries) = matrix%value(entries) + value(t)
               else
                  entries = entries + 1
                  last = column(t)
                  matrix%column(entries) = last
                  matrix%value(entries) = value(t)
               end if
            end associate
            k = k + 1
         end do
         matrix%row_start(i + 1) = entries + 1
      end do
      matrix%column = matrix%column(:entries)
      matrix%value = matrix%value(:entries)
   end subroutine new_csr_from_triplets

   ! Orders `items` by key(items), keeping the order of equal keys; on return
   ! next(i) is one past the last place of key i.
   subroutine counting_sort(key, keys, items, sorted, next)
      integer, intent(in) :: key(:), keys, items(:)
      integer, allocatable, intent(out) :: sorted(:), next(:)
      integer :: i, k, start

      allocate (next(keys), source=0)
      allocate (sorted(size(items)))
      do k = 1, size(key)
         next(key(k)) = next(key(k)) + 1
      end do
      start = 1
      do i = 1, keys
         k = next(i)
         next(i) = start
         start = start + k
      end do
      do k = 1, size(items)
         i = key(items(k))
         sorted(next(i)) = items(k)
         next(i) = next(i) + 1
      end do
   end subroutine counting_sort

   !> The rows x columns matrix without entries.
   pure function empty_csr_matrix(rows, columns) result(matrix)
      integer, intent(in) :: rows, columns
      type(csr_matrix_type) :: matrix

      matrix%rows = rows
      matrix%columns = columns
      allocate (matrix%row_start(rows + 1), source=1)
      allocate (matrix%column(0), matrix%value(0))
   end function empty_csr_matrix

   !> The identity of order n.
   pure function identity_csr_matrix(n) result(matrix)
      integer, intent(in) :: n
      type(csr_matrix_type) :: matrix
      integer :: i

      matrix%rows = n
      matrix%columns = n
      allocate (matrix%row_start(n + 1), source=[(i, i=1, n + 1)])
      allocate (matrix%column(n), source=[(i, i=1, n)])
      allocate (matrix%value(n), source=1.0_wp)
   end function identity_csr_matrix

   !> The sum of coefficient(k) matrix(k) over matrices of the same shape. An
   !> entry stands wherever any of them has one, zeros included, so that the
   !> pattern depends on the matrices only.
   pure function linear_combination(coefficients, matrices) result(combined)
      real(wp), intent(in) :: coefficients(:)
      type(csr_matrix_type), intent(in) :: matrices(:)
      type(csr_matrix_type) :: combined
      integer :: i, j, k, entries, smallest
      integer :: next(size(matrices))

      combined%rows = matrices(1)%rows
      combined%columns = matrices(1)%columns
      entries = 0
      do k = 1, size(matrices)
         entries = entries + matrices(k)%nonzeros()
      end do
      allocate (combined%row_start(combined%rows + 1), combined%column(entries), combined%value(entries))
      combined%row_start(1) = 1
      entries = 0
      do i = 1, combined%rows
         do k = 1, size(matrices)
            next(k) = matrices(k)%row_start(i)
         end do
         do
            smallest = huge(1)
            do k = 1, size(matrices)
               if (next(k) < matrices(k)%row_start(i + 1)) smallest = min(smallest, matrices(k)%column(next(k)))
            end do
            if (smallest == huge(1)) exit
            entries = entries + 1
            combined%column(entries) = smallest
            combined%value(entries) = 0
            do k = 1, size(matrices)
               j = next(k)
               if (j == matrices(k)%row_start(i + 1)) cycle
               if (matrices(k)%column(j) /= smallest) cycle
               combined%value(entries) = combined%value(entries) + coefficients(k)*matrices(k)%value(j)
               next(k) = j + 1
            end do
         end do
         combined%row_start(i + 1) = entries + 1
      end do
      combined%column = combined%column(:entries)
      combined%value = combined%value(:entries)
   end function linear_combination

   !> The same with complex coefficients.
   pure function complex_combination(coefficients, matrices) result(combined)
      complex(wp), intent(in) :: coefficients(:)
      type(csr_matrix_type), intent(in) :: matrices(:)
      type(complex_csr_matrix_type) :: combined
      type(csr_matrix_type) :: re, im

      re = linear_combination(real(coefficients, wp), matrices)
      im = linear_combination(aimag(coefficients), matrices)
      combined%rows = re%rows
      combined%columns = re%columns
      allocate (combined%row_start(size(re%row_start)), source=re%row_start)
      allocate (combined%column(size(re%column)), source=re%column)
      allocate (combined%value(size(re%value)), source=cmplx(re%value, im%value, wp))
   end function complex_combination

   !> The transpose.
   pure function transpose_csr(matrix) result(transposed)
      type(csr_matrix_type), intent(in) :: matrix
      type(csr_matrix_type) :: transposed
      integer :: i, k, place
      integer, allocatable :: next(:)

      transposed%rows = matrix%columns
      transposed%columns = matrix%rows
      allocate (transposed%row_start(matrix%columns + 1), source=0)
      allocate (transposed%column(matrix%nonzeros()), transposed%value(matrix%nonzeros()))
      do k = 1, matrix%nonzeros()
         transposed%row_start(matrix%column(k) + 1) = transposed%row_start(matrix%column(k) + 1) + 1
      end do
      transposed%row_start(1) = 1
      do i = 1, matrix%columns
         transposed%row_start(i + 1) = transposed%row_start(i + 1) + transposed%row_start(i)
      end do
      allocate (next(matrix%columns), source=transposed%row_start(:matrix%columns))
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            place = next(matrix%column(k))
            transposed%column(place) = i
            transposed%value(place) = matrix%value(k)
            next(matrix%column(k)) = place + 1
         end do
      end do
   end function transpose_csr

   pure integer function nonzeros(self)
      class(csr_matrix_type), intent(in) :: self

      nonzeros = size(self%column)
   end function nonzeros

   pure subroutine add_product_real(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, j, k
      real(wp) :: total

      do j = 1, size(x, 2)
         do i = 1, self%rows
            total = 0
            do k = self%row_start(i), self%row_start(i + 1) - 1
               total = total + self%value(k)*x(self%column(k), j)
            end do
            y(i, j) = y(i, j) + alpha*total
         end do
      end do
   end subroutine add_product_real

   pure subroutine add_product_complex(self, alpha, x, y)
      class(csr_matrix_type), intent(in) :: self
      complex(wp), intent(in) :: alpha
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, j, k
      complex(wp) :: total

      do j = 1, size(x, 2)
         do i = 1, self%rows
            total = 0
            do k = self%row_start(i), self%row_start(i + 1) - 1
               total = total + self%value(k)*x(self%column(k), j)
            end do
            y(i, j) = y(i, j) + alpha*total
         end do
      end do
   end subroutine add_product_complex

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
      integer :: i, j, k

      do j = 1, size(x, 2)
         do i = 1, self%rows
            do k = self%row_start(i), self%row_start(i + 1) - 1
               y(self%column(k), j) = y(self%column(k), j) + alpha*self%value(k)*x(i, j)
            end do
         end do
      end do
   end subroutine add_transposed_product_complex

   pure real(wp) function infinity_norm(self)
      class(csr_matrix_type), intent(in) :: self
      integer :: i

      infinity_norm = 0
      do i = 1, self%rows
         infinity_norm = max(infinity_norm, sum(abs(self%value(self%row_start(i):self%row_start(i + 1) - 1))))
      end do
   end function infinity_norm

   pure real(wp) function one_norm(self)
      class(csr_matrix_type), intent(in) :: self
      type(csr_matrix_type) :: transposed

      transposed = transpose_csr(self)
      one_norm = transposed%infinity_norm()
   end function one_norm

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
         do k = self%row_start(i), self%row_start(i + 1) - 1
            if (self%column(k) == i) values(i) = self%value(k)
         end do
      end do
   end function diagonal

   pure function row_indices(self) result(row)
      class(csr_matrix_type), intent(in) :: self
      integer :: row(size(self%column))
      integer :: i

      do i = 1, self%rows
         row(self%row_start(i):self%row_start(i + 1) - 1) = i
      end do
   end function row_indices

   pure logical function is_symmetric(self)
      class(csr_matrix_type), intent(in) :: self
      real(wp), parameter :: rounding = 64*epsilon(1.0_wp)
      type(csr_matrix_type) :: difference, pair(2)
      real(wp) :: maxima(self%rows)
      integer :: i, k

      is_symmetric = self%rows == self%columns
      if (.not. is_symmetric) return
      maxima = self%row_maxima()
      pair(1) = self
      pair(2) = transpose_csr(self)
      difference = linear_combination([1.0_wp, -1.0_wp], pair)
      do i = 1, self%rows
         do k = difference%row_start(i), difference%row_start(i + 1) - 1
            if (abs(difference%value(k)) > rounding*min(maxima(i), maxima(difference%column(k)))) then
               is_symmetric = .false.
               return
            end if
         end do
      end do
   end function is_symmetric

   pure logical function is_zero(self)
      class(csr_matrix_type), intent(in) :: self

      is_zero = all(abs(self%value) <= 0)
   end function is_zero
end module kschur_sparse
