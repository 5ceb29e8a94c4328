!> An orthonormal basis of the motions that the constraints allow and that are not known already.
module kschur_allowed_motions
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgeqp3, dorgqr
   use kschur_problem, only: modal_problem_type
   use kschur_tolerances, only: dependent
   implicit none
   private
   public :: allowed_motions, orthogonal_factors

contains

   !> A basis, n x p, of {x : Cq x = 0, N^T M x = 0}, N being the rigid motions that are deflated: the orthogonal
   !> complement of the rows of Cq, each of unit length, and of M N, by QR factors with pivots. p is n less the rank.
   subroutine allowed_motions(problem, deflation, basis, error)
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), intent(in) :: deflation
      real(wp), allocatable, intent(out) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: normals(:, :), q(:, :), r(:, :)
      integer :: n, m, i, l, rank

      n = problem%unknowns()
      m = problem%multipliers()
      allocate (normals(n, m + size(deflation%decay)), source=0.0_wp)
      associate (cq => problem%constraints)
         do i = 1, m
            do l = cq%row_start(i), cq%row_start(i + 1) - 1
               normals(cq%column(l), i) = normals(cq%column(l), i) + cq%value(l)
            end do
         end do
      end associate
      normals(:, m + 1:) = deflation%images
      do i = 1, size(normals, 2)
         normals(:, i) = normals(:, i)/max(norm2(normals(:, i)), tiny(1.0_wp))
      end do
      call orthogonal_factors(normals, .true., q, r, error)
      if (allocated(error)) return
      rank = count([(abs(r(i, i)) > dependent, i=1, min(n, size(r, 2)))])
      allocate (basis(n, n - rank), source=q(:, rank + 1:))
   end subroutine allowed_motions

   !> A = Q R, or A P = Q R with the largest columns first: all n columns of Q, and R, n x k.
   subroutine orthogonal_factors(a, pivoting, q, r, error)
      !> n x k, k <= n.
      real(wp), intent(in) :: a(:, :)
      logical, intent(in) :: pivoting
      real(wp), allocatable, intent(out) :: q(:, :), r(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: block_size = 32
      real(wp), allocatable :: tau(:), work(:)
      integer, allocatable :: pivots(:)
      integer :: n, k, i, info

      n = size(a, 1)
      k = size(a, 2)
      allocate (q(n, max(n, k)), source=0.0_wp)
      q(:, :k) = a
      allocate (tau(min(n, k) + 1), work(block_size*(n + k + 3)))
      allocate (pivots(k + 1), source=merge(0, 1, pivoting))
      call dgeqp3(n, k, q, max(n, 1), pivots, tau, work, size(work), info)
      allocate (r(n, k), source=q(:, :k))
      do i = 1, k
         r(i + 1:, i) = 0
      end do
      if (info == 0) call dorgqr(n, n, min(n, k), q, max(n, 1), tau, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK could not make orthogonal factors")
      if (k > n) q = q(:, :n)
   end subroutine orthogonal_factors
end module kschur_allowed_motions
