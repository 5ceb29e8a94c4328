!> Linear combinations of sparse matrices of one shape. The result has the union of their patterns, explicit zeros included, so
!> that its pattern does not depend on the coefficients.
module kschur_csr_combination
   use kschur_csr_assembly, only: transpose_csr
   use kschur_csr, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_kinds, only: wp
   implicit none
   private
   public :: complete_pattern, complex_combination, linear_combination, unite

   !> Returns the sum of coefficient(k) matrix(k), or alpha A + beta B without copying them into an array.
   interface linear_combination
      module procedure combination_of_all, combination_of_two
   end interface linear_combination

contains

   pure function combination_of_all(coefficients, matrices) result(combined)
      real(wp), intent(in) :: coefficients(:)
      type(csr_matrix_type), intent(in) :: matrices(:)
      type(csr_matrix_type) :: combined
      integer :: k

      combined%rows = matrices(1)%rows
      combined%columns = matrices(1)%columns
      call unite_all(matrices, combined%row_start, combined%column)
      allocate (combined%value(size(combined%column)), source=0.0_wp)
      do k = 1, size(matrices)
         call add_real(combined, coefficients(k), matrices(k))
      end do
   end function combination_of_all

   pure function combination_of_two(alpha, a, beta, b) result(combined)
      real(wp), intent(in) :: alpha, beta
      type(csr_matrix_type), intent(in) :: a, b
      type(csr_matrix_type) :: combined

      combined%rows = a%rows
      combined%columns = a%columns
      allocate (combined%row_start, source=a%row_start)
      allocate (combined%column, source=a%column)
      call unite(combined%row_start, combined%column, b)
      allocate (combined%value(size(combined%column)), source=0.0_wp)
      call add_real(combined, alpha, a)
      call add_real(combined, beta, b)
   end function combination_of_two

   !> Returns the sum of coefficient(k) matrix(k), complex.
   pure function complex_combination(coefficients, matrices) result(combined)
      complex(wp), intent(in) :: coefficients(:)
      type(csr_matrix_type), intent(in) :: matrices(:)
      type(complex_csr_matrix_type) :: combined
      integer :: k

      combined%rows = matrices(1)%rows
      combined%columns = matrices(1)%columns
      call unite_all(matrices, combined%row_start, combined%column)
      allocate (combined%value(size(combined%column)), source=(0.0_wp, 0.0_wp))
      do k = 1, size(matrices)
         call add_complex(combined, coefficients(k), matrices(k))
      end do
   end function complex_combination

   !> Makes the pattern of a matrix that is symmetric to rounding symmetric, by averaging it with its transpose: factorisations
   !> then need not search for missing mirror entries.
   subroutine complete_pattern(matrix)
      type(csr_matrix_type), intent(inout) :: matrix

      if (.not. matrix%has_symmetric_pattern()) matrix = linear_combination(0.5_wp, matrix, 0.5_wp, transpose_csr(matrix))
   end subroutine complete_pattern

   ! combined := combined + coefficient*matrix, whose pattern the combined one contains.
   pure subroutine add_real(combined, coefficient, matrix)
      type(csr_matrix_type), intent(inout) :: combined
      real(wp), intent(in) :: coefficient
      type(csr_matrix_type), intent(in) :: matrix
      integer :: i, k, place

      do i = 1, matrix%rows
         place = combined%row_start(i)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            do while (combined%column(place) /= matrix%column(k))
               place = place + 1
            end do
            combined%value(place) = combined%value(place) + coefficient*matrix%value(k)
         end do
      end do
   end subroutine add_real

   ! As `add_real`, complex.
   pure subroutine add_complex(combined, coefficient, matrix)
      type(complex_csr_matrix_type), intent(inout) :: combined
      complex(wp), intent(in) :: coefficient
      type(csr_matrix_type), intent(in) :: matrix
      real(wp) :: re, im
      integer :: i, k, place

      re = real(coefficient, wp)
      im = aimag(coefficient)
      do i = 1, matrix%rows
         place = combined%row_start(i)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            do while (combined%column(place) /= matrix%column(k))
               place = place + 1
            end do
            combined%value(place) = combined%value(place) + cmplx(re*matrix%value(k), im*matrix%value(k), wp)
         end do
      end do
   end subroutine add_complex

   ! Union of the patterns.
   pure subroutine unite_all(matrices, row_start, column)
      type(csr_matrix_type), intent(in) :: matrices(:)
      integer, allocatable, intent(out) :: row_start(:), column(:)
      integer :: k

      allocate (row_start, source=matrices(1)%row_start)
      allocate (column, source=matrices(1)%column)
      do k = 2, size(matrices)
         call unite(row_start, column, matrices(k))
      end do
   end subroutine unite_all

   !> Adds the pattern of a matrix to another.
   pure subroutine unite(row_start, column, matrix)
      !> CSR, 1-based, columns ascending.
      integer, allocatable, intent(inout) :: row_start(:), column(:)
      type(csr_matrix_type), intent(in) :: matrix
      integer, allocatable :: united(:)
      integer :: start(size(matrix%row_start)), i, length

      if (contains_all(row_start, column, matrix)) return
      allocate (united(size(column) + matrix%nonzeros()))
      start(1) = 1
      do i = 1, matrix%rows
         length = row_start(i + 1) - row_start(i)
         united(start(i):start(i) + length - 1) = column(row_start(i):row_start(i + 1) - 1)
         call merge_ascending(united(start(i):), length, matrix%column(matrix%row_start(i):matrix%row_start(i + 1) - 1))
         start(i + 1) = start(i) + length
      end do
      row_start = start
      column = united(:start(size(start)) - 1)
   end subroutine unite

   ! Whether a pattern contains that of a matrix. All columns ascend.
   pure logical function contains_all(row_start, column, matrix)
      integer, intent(in) :: row_start(:), column(:)
      type(csr_matrix_type), intent(in) :: matrix
      integer :: i, k, place

      contains_all = .false.
      if (size(column) < matrix%nonzeros()) return
      do i = 1, matrix%rows
         place = row_start(i)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            do while (place < row_start(i + 1))
               if (column(place) >= matrix%column(k)) exit
               place = place + 1
            end do
            if (place == row_start(i + 1)) return
            if (column(place) /= matrix%column(k)) return
         end do
      end do
      contains_all = .true.
   end function contains_all

   ! Merges `more` into the first `length` entries of a list, without duplicates. All ascend.
   pure subroutine merge_ascending(list, length, more)
      integer, contiguous, intent(inout) :: list(:)
      integer, intent(inout) :: length
      integer, contiguous, intent(in) :: more(:)
      integer :: i, k, place

      place = length
      i = 1
      do k = 1, size(more)
         do while (i <= length)
            if (list(i) >= more(k)) exit
            i = i + 1
         end do
         if (i > length) then
            place = place + size(more) - k + 1
            exit
         end if
         if (list(i) /= more(k)) place = place + 1
      end do
      i = length
      length = place
      ! Merges from the end; stops when the rest is in place.
      k = size(more)
      do while (place > i)
         if (i == 0) then
            list(:place) = more(:k)
            return
         end if
         if (list(i) > more(k)) then
            list(place) = list(i)
            i = i - 1
         else
            if (list(i) == more(k)) i = i - 1
            list(place) = more(k)
            k = k - 1
         end if
         place = place - 1
      end do
   end subroutine merge_ascending
end module kschur_csr_combination
