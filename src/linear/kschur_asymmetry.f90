!> Finds the largest deviation of a matrix from symmetry.
module kschur_asymmetry
   use kschur_csr, only: csr_matrix_type
   use kschur_kinds, only: wp
   implicit none
   private
   public :: asymmetry_type, largest_asymmetry

   !> The two entries that differ most, a(row, column) and a(column, row).
   type :: asymmetry_type
      !> 1-based; 0 where the matrix is its transpose.
      integer :: row = 0, column = 0
      real(wp) :: entry = 0, mirrored = 0
      !> Their difference relative to the smaller of the largest magnitudes in their two rows, the measure of `is_symmetric`;
      !> relative to the larger if that is zero.
      real(wp) :: part = 0
   end type asymmetry_type

contains

   !> The largest asymmetry of a square matrix.
   pure function largest_asymmetry(matrix) result(largest)
      type(csr_matrix_type), intent(in) :: matrix
      type(asymmetry_type) :: largest
      real(wp) :: maxima(matrix%rows), mirrored, part, least
      integer :: i, k, place

      maxima = matrix%row_maxima()
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k), entry => matrix%value(k))
               mirrored = 0
               place = matrix%place_of(j, i)
               if (place > 0) mirrored = matrix%value(place)
               if (.not. abs(entry - mirrored) > 0) cycle
               least = min(maxima(i), maxima(j))
               part = abs(entry - mirrored)/merge(least, max(maxima(i), maxima(j)), least > 0)
               if (part > largest%part) largest = asymmetry_type(i, j, entry, mirrored, part)
            end associate
         end do
      end do
   end function largest_asymmetry
end module kschur_asymmetry
