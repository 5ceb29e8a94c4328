!> Construction of sparse matrices from CSR arrays and triplets; entries are sorted by transposing twice.
module kschur_csr_assembly
   use kschur_csr, only: csr_matrix_type
   use kschur_error, only: error_type, new_error, error_input
   use kschur_kinds, only: wp
   use kschur_memory, only: integer_bytes, real_bytes, require_memory
   use kschur_text, only: text
   implicit none
   private
   public :: new_csr_matrix, settle_csr_matrix, new_csr_from_triplets
   public :: empty_csr_matrix, identity_csr_matrix, rows_of_csr, transpose_csr

contains

   !> Creates a matrix from CSR arrays (1-based). Sorts rows and sums duplicate entries. Fails if indices are out of range or
   !> row starts descend.
   subroutine new_csr_matrix(matrix, rows, columns, row_start, column, value, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(in) :: rows, columns
      !> Start of each row, rows+1 numbers, the first is 1.
      integer, intent(in) :: row_start(:)
      integer, intent(in) :: column(:)
      real(wp), intent(in) :: value(:)
      type(error_type), allocatable, intent(out) :: error

      call require_memory(integer_bytes*(size(row_start) + real(size(column), wp)) + real_bytes*size(value), "a matrix", error)
      if (allocated(error)) return
      allocate (matrix%row_start, source=row_start)
      allocate (matrix%column, source=column)
      allocate (matrix%value, source=value)
      matrix%rows = rows
      matrix%columns = columns
      call settle_csr_matrix(matrix, error)
   end subroutine new_csr_matrix

   !> Checks, sorts and completes a matrix whose arrays, rows and columns are set, as `new_csr_matrix` does.
   subroutine settle_csr_matrix(matrix, error)
      type(csr_matrix_type), intent(inout) :: matrix
      type(error_type), allocatable, intent(out) :: error
      logical :: ascending
      integer :: i, k

      call check_row_starts(matrix, error)
      if (.not. allocated(error)) call check_extents(matrix%rows, matrix%columns, size(matrix%column), &
         size(matrix%column) == size(matrix%value), error)
      if (allocated(error)) return
      ascending = .true.
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            if (matrix%column(k) < 1 .or. matrix%column(k) > matrix%columns) then
               call report_outside(matrix%rows, matrix%columns, i, matrix%column(k), error)
               return
            end if
            if (k > matrix%row_start(i)) ascending = ascending .and. matrix%column(k - 1) < matrix%column(k)
         end do
      end do
      if (ascending) return
      call require_memory(3*matrix%bytes(), "the entries of a matrix, to sort them", error)
      if (allocated(error)) return
      ! Transposing twice is a stable sort.
      matrix = transpose_csr(matrix)
      matrix = transpose_csr(matrix)
      call sum_repeated(matrix)
   end subroutine settle_csr_matrix

   subroutine check_row_starts(matrix, error)
      type(csr_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error

      associate (rows => matrix%rows, row_start => matrix%row_start, entries => size(matrix%column))
         if (rows < 0 .or. size(row_start) /= rows + 1) then
            call new_error(error, error_input, "there are "//text(size(row_start))// &
               " row starts, but a matrix of "//text(rows)//" rows needs "//text(rows + 1))
         else if (row_start(1) /= 1 .or. row_start(rows + 1) /= entries + 1) then
            call new_error(error, error_input, "the row starts do not span the "//text(entries)//" entries")
         else if (any(row_start(2:) < row_start(:rows))) then
            call new_error(error, error_input, "the row starts descend at number "// &
               text(findloc(row_start(2:) < row_start(:rows), .true., 1) + 1)//" of "//text(rows + 1))
         end if
      end associate
   end subroutine check_row_starts

   ! Fails if extents are negative, far larger than the number of entries allows, or arrays differ in length.
   subroutine check_extents(rows, columns, entries, complete, error)
      integer, intent(in) :: rows, columns, entries
      !> Whether there are as many indices as values.
      logical, intent(in) :: complete
      type(error_type), allocatable, intent(out) :: error
      ! Guards against an allocation of all memory by a corrupt size line.
      integer, parameter :: very_large = 100000000, very_sparse = 100

      if (rows < 0 .or. columns < 0) then
         call new_error(error, error_input, "a matrix cannot be "//text(rows)//" x "//text(columns))
      else if (max(rows, columns) > very_large .and. max(rows, columns)/very_sparse > entries) then
         call new_error(error, error_input, "a matrix of "//text(rows)//" x "//text(columns)//" with only "// &
            text(entries)//" entries cannot be meant: are its extents right?")
      else if (.not. complete) then
         call new_error(error, error_input, "row indices, column indices and values differ in number")
      end if
   end subroutine check_extents

   subroutine report_outside(rows, columns, i, j, error)
      integer, intent(in) :: rows, columns, i, j
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_input, "entry ("//text(i)//", "//text(j)//") lies outside a matrix of "// &
         text(rows)//" x "//text(columns))
   end subroutine report_outside

   !> Creates a matrix from triplets (row, column, value), 1-based, in any order; sums duplicate entries. Fails if indices are
   !> out of range.
   subroutine new_csr_from_triplets(matrix, rows, columns, row, column, value, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(in) :: rows, columns
      integer, intent(in) :: row(:), column(:)
      real(wp), intent(in) :: value(:)
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: by_column
      integer :: k, place
      integer, allocatable :: next(:)

      call check_extents(rows, columns, size(row), size(row) == size(column) .and. size(row) == size(value), error)
      if (.not. allocated(error)) call require_memory(3*((integer_bytes + real_bytes)*real(size(row), wp) + &
         integer_bytes*(real(rows, wp) + columns)), "a matrix of "//text(size(row))//" entries", error)
      if (allocated(error)) return
      do k = 1, size(row)
         if (row(k) < 1 .or. row(k) > rows .or. column(k) < 1 .or. column(k) > columns) then
            call report_outside(rows, columns, row(k), column(k), error)
            return
         end if
      end do
      by_column%rows = columns
      by_column%columns = rows
      allocate (by_column%row_start(columns + 1), by_column%column(size(row)), by_column%value(size(row)))
      call count_places(column, by_column%row_start, next)
      do k = 1, size(row)
         place = next(column(k))
         by_column%column(place) = row(k)
         by_column%value(place) = value(k)
         next(column(k)) = place + 1
      end do
      matrix = transpose_csr(by_column)
      call sum_repeated(matrix)
   end subroutine new_csr_from_triplets

   ! Start of the entries of each key after a counting sort; `next` is a copy for the caller to advance.
   pure subroutine count_places(key, start, next)
      integer, intent(in) :: key(:)
      integer, intent(out) :: start(:)
      integer, allocatable, intent(out) :: next(:)
      integer :: i, k

      start = 0
      start(1) = 1
      do k = 1, size(key)
         start(key(k) + 1) = start(key(k) + 1) + 1
      end do
      do i = 2, size(start)
         start(i) = start(i) + start(i - 1)
      end do
      allocate (next(size(start) - 1), source=start(:size(start) - 1))
   end subroutine count_places

   ! Sums duplicate entries, which are adjacent.
   subroutine sum_repeated(matrix)
      type(csr_matrix_type), intent(inout) :: matrix
      integer :: i, k, first, entries

      entries = 0
      do i = 1, matrix%rows
         first = matrix%row_start(i)
         matrix%row_start(i) = entries + 1
         do k = first, matrix%row_start(i + 1) - 1
            if (k > first) then
               if (matrix%column(k) == matrix%column(entries)) then
                  matrix%value(entries) = matrix%value(entries) + matrix%value(k)
                  cycle
               end if
            end if
            entries = entries + 1
            matrix%column(entries) = matrix%column(k)
            matrix%value(entries) = matrix%value(k)
         end do
      end do
      matrix%row_start(matrix%rows + 1) = entries + 1
      if (entries == size(matrix%column)) return
      matrix%column = matrix%column(:entries)
      matrix%value = matrix%value(:entries)
   end subroutine sum_repeated

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

   !> Extracts rows in the given order.
   pure function rows_of_csr(matrix, chosen) result(part)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: chosen(:)
      type(csr_matrix_type) :: part
      integer :: i, first, entries

      part%rows = size(chosen)
      part%columns = matrix%columns
      allocate (part%row_start(size(chosen) + 1))
      part%row_start(1) = 1
      do i = 1, size(chosen)
         part%row_start(i + 1) = part%row_start(i) + matrix%row_start(chosen(i) + 1) - matrix%row_start(chosen(i))
      end do
      allocate (part%column(part%row_start(size(chosen) + 1) - 1), part%value(part%row_start(size(chosen) + 1) - 1))
      do i = 1, size(chosen)
         first = matrix%row_start(chosen(i))
         entries = part%row_start(i + 1) - part%row_start(i)
         part%column(part%row_start(i):part%row_start(i + 1) - 1) = matrix%column(first:first + entries - 1)
         part%value(part%row_start(i):part%row_start(i + 1) - 1) = matrix%value(first:first + entries - 1)
      end do
   end function rows_of_csr

   !> The transpose.
   pure function transpose_csr(matrix) result(transposed)
      type(csr_matrix_type), intent(in) :: matrix
      type(csr_matrix_type) :: transposed
      integer :: i, k, place
      integer, allocatable :: next(:)

      transposed%rows = matrix%columns
      transposed%columns = matrix%rows
      allocate (transposed%row_start(matrix%columns + 1))
      allocate (transposed%column(matrix%nonzeros()), transposed%value(matrix%nonzeros()))
      call count_places(matrix%column, transposed%row_start, next)
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            place = next(matrix%column(k))
            transposed%column(place) = i
            transposed%value(place) = matrix%value(k)
            next(matrix%column(k)) = place + 1
         end do
      end do
   end function transpose_csr
end module kschur_csr_assembly
