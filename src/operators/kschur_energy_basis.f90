!> Coordinates in which the energies of a state are sums of squares, slowest motions first: stiff motions then do not hide soft
!> ones, and eigenvalues of different magnitudes keep their relative accuracy.
module kschur_energy_basis
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: symmetric_eigenvectors
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: new_energy_basis

contains

   !> Computes dual bases B and D of states (x, v), v = lambda/unit x, D^T B = 1, from the modes of the symmetric parts of M and
   !> P(s): each mode as a position of unit energy x^T P(s) x, and as a velocity of unit kinetic energy. Nonpositive energies
   !> are replaced by their magnitudes.
   subroutine new_energy_basis(problem, motions, s, unit, basis, dual, error)
      type(modal_problem_type), intent(in) :: problem
      !> Orthonormal basis of the null space of the constraints, n x p.
      real(wp), contiguous, intent(in) :: motions(:, :)
      !> Point s of the energy, and unit of lambda in v (1/s).
      real(wp), intent(in) :: s, unit
      !> B and D, 2n x 2p.
      real(wp), allocatable, intent(out) :: basis(:, :), dual(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: a(:, :), u(:, :), m(:, :), energy(:), inertia(:), x(:, :), y(:, :)
      integer :: n, p, j
      real(wp) :: speed

      n = size(motions, 1)
      p = size(motions, 2)
      allocate (basis(2*n, 2*p), dual(2*n, 2*p), source=0.0_wp)
      if (p == 0) return
      allocate (a(p, p), source=reduced(problem%stiffness, motions) + s*reduced(problem%damping, motions) &
         + s**2*reduced(problem%mass, motions))
      call diagonalize(a, energy, error)
      if (allocated(error)) return
      energy = sqrt(energy)
      ! U/e and U e are dual bases.
      allocate (u, source=a)
      do j = 1, p
         a(:, j) = a(:, j)/energy(j)
         u(:, j) = u(:, j)*energy(j)
      end do
      x = product_of(motions, a)
      y = product_of(motions, u)
      allocate (m(p, p), source=reduced(problem%mass, x))
      call diagonalize(m, inertia, error)
      if (allocated(error)) return
      x = product_of(x, m)
      y = product_of(y, m)
      do j = 1, p
         ! Descending order: LAPACK sorts in ascending order.
         associate (k => p + 1 - j)
            speed = unit*sqrt(inertia(j))
            basis(:n, 2*k - 1) = x(:, j)
            dual(:n, 2*k - 1) = y(:, j)
            basis(n + 1:, 2*k) = x(:, j)/speed
            dual(n + 1:, 2*k) = y(:, j)*speed
         end associate
      end do
   end subroutine new_energy_basis

   ! The symmetric part of X^T A X.
   function reduced(matrix, x)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp) :: reduced(size(x, 2), size(x, 2))
      real(wp) :: y(size(x, 1), size(x, 2))
      integer :: n, p

      n = size(x, 1)
      p = size(x, 2)
      y = 0
      call matrix%add_product(0.5_wp, x, y)
      call dgemm("T", "N", p, p, n, 1.0_wp, x, n, y, n, 0.0_wp, reduced, p)
      reduced = reduced + transpose(reduced)
   end function reduced

   ! X Y.
   function product_of(x, y) result(z)
      real(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      real(wp), allocatable :: z(:, :)
      integer :: n, p, q

      n = size(x, 1)
      p = size(x, 2)
      q = size(y, 2)
      allocate (z(n, q))
      call dgemm("N", "N", n, q, p, 1.0_wp, x, n, y, p, 0.0_wp, z, n)
   end function product_of

   ! Overwrites a symmetric matrix by its eigenvectors; returns the magnitudes of its eigenvalues, at least at rounding level.
   subroutine diagonalize(a, values, error)
      real(wp), contiguous, intent(inout) :: a(:, :)
      real(wp), allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error

      call symmetric_eigenvectors(a, values, error)
      values = max(abs(values), epsilon(1.0_wp)*maxval(abs(values)), tiny(1.0_wp))
   end subroutine diagonalize
end module kschur_energy_basis
