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
   public :: allowed_motions

contains

   !> Computes an orthonormal basis, n x p, of {x : Cq x = 0, N^T M x = 0}, N the deflated rigid motions, for solvers that project
   !> the problem on it: the orthogonal complement of the rows of Cq and of M N, each scaled to unit length, from QR with column
   !> pivoting (LAPACK's dgeqp3). p is n less the numerical rank.
   subroutine allowed_motions(problem, deflation, basis, error)
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), intent(in) :: deflation
      real(wp), allocatable, intent(out) :: basis(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: block_size = 32
      real(wp), allocatable :: q(:, :), tau(:), work(:)
      integer, allocatable :: pivots(:)
      integer :: n, m, k, i, l, rank, info

      n = problem%unknowns()
      m = problem%multipliers()
      k = m + size(deflation%decay)
      allocate (q(n, max(n, k)), source=0.0_wp)
      associate (cq => problem%constraints)
         do i = 1, m
            do l = cq%row_start(i), cq%row_start(i + 1) - 1
               q(cq%column(l), i) = q(cq%column(l), i) + cq%value(l)
            end do
         end do
      end associate
      q(:, m + 1:k) = deflation%images
      do i = 1, k
         q(:, i) = q(:, i)/max(norm2(q(:, i)), tiny(1.0_wp))
      end do
      allocate (tau(min(n, k) + 1), work(block_size*(n + k + 3)))
      allocate (pivots(k + 1), source=0)
      call dgeqp3(n, k, q, max(n, 1), pivots, tau, work, size(work), info)
      rank = count([(abs(q(i, i)) > dependent, i=1, min(n, k))])
      if (info == 0) call dorgqr(n, n, min(n, k), q, max(n, 1), tau, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK could not make orthogonal factors")
      allocate (basis(n, n - rank), source=q(:, rank + 1:n))
   end subroutine allowed_motions
end module kschur_allowed_motions
