!> Energies x^T A x of vectors in a symmetric matrix: they tell null vectors from vectors with a small force A x.
module kschur_energies
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_magnitudes, only: magnitudes, terms_of
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: diagonalize_energies

contains

   !> Diagonalizes X^T A X by rotating the columns of X (Rayleigh-Ritz, by singular vectors). Energies are better known than
   !> forces A x: they err with the square of the error of x.
   subroutine diagonalize_energies(matrix, n, x, energies, relative_energies, error)
      !> A, symmetric.
      type(csr_matrix_type), intent(in) :: matrix
      !> The first n rows are motions, the others multipliers, zero if a vector has none.
      integer, intent(in) :: n
      !> k columns, orthonormal in the first n rows.
      real(wp), intent(inout) :: x(:, :)
      !> k energies without sign, the largest first, and the same relative to |x|^T |A| |x|, the terms that they are sums of.
      real(wp), allocatable, intent(out) :: energies(:), relative_energies(:)
      !> Where LAPACK fails.
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: sizes(size(x, 1), size(x, 2))
      real(wp), allocatable :: rotation(:, :)

      call right_singular_vectors(matmul(transpose(x), matrix%product(x)), energies, rotation, error)
      if (allocated(error)) return
      x = matmul(x, rotation)
      sizes(:n, :) = magnitudes(x(:n, :))
      sizes(n + 1:, :) = abs(x(n + 1:, :))
      allocate (relative_energies, source=energies/max(tiny(1.0_wp), sum(sizes*terms_of(matrix, sizes), 1)))
   end subroutine diagonalize_energies
end module kschur_energies
