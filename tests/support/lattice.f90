!> Lattices of strings whose eigenvalues have a closed form.
module lattice
   use kschur, only: csr_matrix_type, error_type, new_csr_from_triplets, wp
   implicit none
   private
   public :: lattice_matrix, lattice_eigenvalues

contains

   !> Strings of stiffness one between neighbours of a box of points, and to the ground around it; less a multiple of one.
   function lattice_matrix(points, shift) result(matrix)
      integer, intent(in) :: points(3)
      real(wp), intent(in) :: shift
      type(csr_matrix_type) :: matrix
      type(error_type), allocatable :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: stride(3), here, k, d

      stride = [1, points(1), points(1)*points(2)]
      associate (n => product(points))
         allocate (row(7*n), column(7*n), value(7*n))
         k = 0
         do here = 0, n - 1
            call put(here, 2*count(points > 1) - shift)
            do d = 1, 3
               if (mod(here/stride(d), points(d)) > 0) call put(here - stride(d), -1.0_wp)
               if (mod(here/stride(d), points(d)) < points(d) - 1) call put(here + stride(d), -1.0_wp)
            end do
         end do
         call new_csr_from_triplets(matrix, n, n, row(:k), column(:k), value(:k), error)
      end associate

   contains

      subroutine put(there, entry)
         integer, intent(in) :: there
         real(wp), intent(in) :: entry

         k = k + 1
         row(k) = here + 1
         column(k) = there + 1
         value(k) = entry
      end subroutine put
   end function lattice_matrix

   !> Without a shift: sums of those of chains.
   pure function lattice_eigenvalues(points) result(values)
      integer, intent(in) :: points(3)
      real(wp) :: values(product(points))
      real(wp), parameter :: pi = acos(-1.0_wp)
      integer :: i, d, stride

      values = 0
      stride = 1
      do d = 1, 3
         if (points(d) > 1) values = values + [(2 - 2*cos((mod((i - 1)/stride, points(d)) + 1)*pi/(points(d) + 1)), &
            i=1, size(values))]
         stride = stride*points(d)
      end do
   end function lattice_eigenvalues
end module lattice
