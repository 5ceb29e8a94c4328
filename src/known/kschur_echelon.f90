!> The sparsest look at a few vectors: what one of them has for itself is not mixed with others.
module kschur_echelon
   use kschur_kinds, only: wp
   implicit none
   private
   public :: reduce_to_echelon

   ! An entry beside a pivot of one.
   real(wp), parameter :: rounding = 64*epsilon(1.0_wp)

contains

   !> Replaces a basis by the reduced echelon one of the same space, by elimination with complete pivoting (Golub, Van Loan,
   !> Matrix Computations (2013), section 3.4): each vector has one where all others have zero, and nowhere more than
   !> pivots grow. Entries that are rounding beside that become zero.
   pure subroutine reduce_to_echelon(basis)
      !> n x k, of rank k.
      real(wp), intent(inout) :: basis(:, :)
      real(wp) :: column(size(basis, 1)), factor
      integer :: j, l, largest, place(2)

      do j = 1, size(basis, 2)
         ! Rows of pivots before have zeros here.
         place = maxloc(abs(basis(:, j:)))
         largest = place(2) + j - 1
         if (.not. abs(basis(place(1), largest)) > 0) return
         column = basis(:, largest)/basis(place(1), largest)
         basis(:, largest) = basis(:, j)
         basis(:, j) = column
         do l = 1, size(basis, 2)
            factor = basis(place(1), l)
            if (l == j .or. .not. abs(factor) > 0) cycle
            basis(:, l) = basis(:, l) - factor*column
            basis(place(1), l) = 0
         end do
      end do
      where (abs(basis) <= rounding) basis = 0
   end subroutine reduce_to_echelon
end module kschur_echelon
