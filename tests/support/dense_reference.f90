!> All eigenvalues and eigenvectors of a small modal problem by dense LAPACK: what
!> tests compare the sparse methods with. Failures of LAPACK show as NaN.
module dense_reference
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur, only: csr_matrix_type, modal_problem_type, wp
   implicit none
   private
   public :: dense_eigenvalues, dense_eigenvectors, dense_log_determinant, dense_matrix, dense_shapes, dense_squared_frequencies

   interface
      subroutine dgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info)
         import :: wp
         character, intent(in) :: jobu, jobvt
         integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
         integer, intent(out) :: info
      end subroutine dgesvd

      subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
         import :: wp
         integer, intent(in) :: itype, n, lda, ldb, lwork
         character, intent(in) :: jobz, uplo
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsygv

      subroutine dggev(jobvl, jobvr, n, a, lda, b, ldb, alphar, alphai, beta, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: wp
         character, intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldb, ldvl, ldvr, lwork
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: alphar(*), alphai(*), beta(*), vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dggev

      subroutine zggev(jobvl, jobvr, n, a, lda, b, ldb, alpha, beta, vl, ldvl, vr, ldvr, work, lwork, rwork, info)
         import :: wp
         character, intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldb, ldvl, ldvr, lwork
         complex(wp), intent(inout) :: a(lda, *), b(ldb, *)
         complex(wp), intent(out) :: alpha(*), beta(*), vl(ldvl, *), vr(ldvr, *), work(*)
         real(wp), intent(out) :: rwork(*)
         integer, intent(out) :: info
      end subroutine zggev

      subroutine zgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         complex(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgetrf
   end interface

contains

   !> log det A by LU with partial pivoting; the phase is known up to whole turns.
   function dense_log_determinant(matrix) result(logarithm)
      complex(wp), intent(in) :: matrix(:, :)
      complex(wp) :: logarithm
      complex(wp) :: lu(size(matrix, 1), size(matrix, 1))
      integer :: pivot(size(matrix, 1)), i, info

      lu = matrix
      call zgetrf(size(lu, 1), size(lu, 1), lu, size(lu, 1), pivot, info)
      logarithm = 0
      do i = 1, size(lu, 1)
         logarithm = logarithm + log(merge(lu(i, i), -lu(i, i), pivot(i) == i))
      end do
      if (info /= 0) logarithm = ieee_value(1.0_wp, ieee_quiet_nan)
   end function dense_log_determinant

   !> All finite lambda of (lambda^2 M + lambda R + K) phi + Cq^T xi = 0,
   !> Cq phi = 0, unsorted: 2(n - m) of them where M and Cq have full rank.
   !> An isolated one has some nine digits; a zero of Jordan type is off by
   !> the square root of rounding.
   subroutine dense_eigenvalues(problem, values)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), allocatable, intent(out) :: values(:)
      real(wp), allocatable :: basis(:, :), a(:, :), b(:, :), re(:), im(:), beta(:), work(:)
      real(wp) :: no_left(1, 1), no_right(1, 1), unit, level
      logical, allocatable :: finite(:)
      integer :: i, n, info

      call constrained_motions(problem%constraints, basis)
      n = size(basis, 2)
      ! In units of time and force where M and K are alike.
      unit = 1
      level = problem%mass%infinity_norm()
      if (.not. problem%stiffness%is_zero()) then
         unit = sqrt(problem%stiffness%infinity_norm()/level)
         level = problem%stiffness%infinity_norm()
      end if
      allocate (a(2*n, 2*n), b(2*n, 2*n), source=0.0_wp)
      allocate (re(2*n), im(2*n), beta(2*n), work(32*n + 64))
      do i = 1, n
         a(i, n + i) = 1
         b(i, i) = 1
      end do
      a(n + 1:, :n) = -reduced(problem%stiffness, basis)/level
      a(n + 1:, n + 1:) = -reduced(problem%damping, basis)*(unit/level)
      b(n + 1:, n + 1:) = reduced(problem%mass, basis)*(unit**2/level)
      call dggev("N", "N", 2*n, a, 2*n, b, 2*n, re, im, beta, no_left, 1, no_right, 1, work, size(work), info)
      if (info /= 0) re = ieee_value(re, ieee_quiet_nan)
      allocate (finite(2*n), source=beta > 2*n*epsilon(beta)*maxval(beta))
      allocate (values(count(finite)), source=unit*cmplx(pack(re, finite), pack(im, finite), wp)/pack(beta, finite))
   end subroutine dense_eigenvalues

   !> All eigenvalues with right and left vectors, unsorted, for complex dense
   !> matrices with units of the size of one and a regular M.
   subroutine dense_eigenvectors(mass, damping, stiffness, constraints, values, right, left)
      complex(wp), intent(in) :: mass(:, :), damping(:, :), stiffness(:, :)
      type(csr_matrix_type), intent(in) :: constraints
      complex(wp), allocatable, intent(out) :: values(:)
      !> phi and psi in columns, n x 2(n - m).
      complex(wp), allocatable, intent(out) :: right(:, :), left(:, :)
      real(wp), allocatable :: basis(:, :), rwork(:)
      complex(wp), allocatable :: a(:, :), b(:, :), alpha(:), beta(:), vl(:, :), vr(:, :), work(:)
      integer :: i, n, info

      call constrained_motions(constraints, basis)
      n = size(basis, 2)
      allocate (a(2*n, 2*n), b(2*n, 2*n), source=(0.0_wp, 0.0_wp))
      allocate (alpha(2*n), beta(2*n), vl(2*n, 2*n), vr(2*n, 2*n), work(66*n), rwork(16*n))
      do i = 1, n
         a(i, n + i) = 1
         b(i, i) = 1
      end do
      a(n + 1:, :n) = -matmul(transpose(basis), matmul(stiffness, basis))
      a(n + 1:, n + 1:) = -matmul(transpose(basis), matmul(damping, basis))
      b(n + 1:, n + 1:) = matmul(transpose(basis), matmul(mass, basis))
      call zggev("V", "V", 2*n, a, 2*n, b, 2*n, alpha, beta, vl, 2*n, vr, 2*n, work, size(work), rwork, info)
      if (info /= 0) alpha = ieee_value(1.0_wp, ieee_quiet_nan)
      allocate (values, source=alpha/beta)
      allocate (right, source=matmul(basis, vr(:n, :)))
      ! The lower half of a left vector of the linearisation is one of the problem.
      allocate (left, source=matmul(basis, vl(n + 1:, :)))
   end subroutine dense_eigenvectors

   !> omega^2 of the undamped problem, ascending; M and K symmetric, M positive
   !> definite on the motions that the constraints allow.
   subroutine dense_squared_frequencies(problem, values)
      type(modal_problem_type), intent(in) :: problem
      real(wp), allocatable, intent(out) :: values(:)
      real(wp), allocatable :: basis(:, :), stiffness(:, :), mass(:, :), work(:)
      integer :: n, info

      call constrained_motions(problem%constraints, basis)
      n = size(basis, 2)
      allocate (stiffness, source=reduced(problem%stiffness, basis))
      allocate (mass, source=reduced(problem%mass, basis))
      allocate (values(n), work(64*n + 64))
      call dsygv(1, "N", "U", n, stiffness, n, mass, n, values, work, size(work), info)
      if (info /= 0) values = ieee_value(values, ieee_quiet_nan)
   end subroutine dense_squared_frequencies

   !> Shapes of the undamped problem without constraints, lowest frequency first, of M phi =
   !> mu (K + level M) phi: the lowest ones are the most accurate.
   subroutine dense_shapes(problem, level, shapes)
      type(modal_problem_type), intent(in) :: problem
      !> Of the size of the wanted omega^2 (1/s^2).
      real(wp), intent(in) :: level
      complex(wp), allocatable, intent(out) :: shapes(:, :)
      real(wp), allocatable :: mass(:, :), shifted(:, :), values(:), work(:)
      integer :: n, info

      n = problem%unknowns()
      allocate (mass, source=dense_matrix(problem%mass))
      allocate (shifted, source=dense_matrix(problem%stiffness) + level*mass)
      allocate (values(n), work(64*n + 64))
      call dsygv(1, "V", "U", n, mass, n, shifted, n, values, work, size(work), info)
      allocate (shapes, source=cmplx(mass(:, n:1:-1), 0, wp))
      if (info /= 0) shapes = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine dense_shapes

   !> The matrix with its zeros.
   pure function dense_matrix(matrix) result(dense)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp) :: dense(matrix%rows, matrix%columns)
      integer :: i, k

      dense = 0
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            dense(i, matrix%column(k)) = matrix%value(k)
         end do
      end do
   end function dense_matrix

   ! Orthonormal columns that span null(Cq); the rank of Cq is found.
   subroutine constrained_motions(constraints, basis)
      type(csr_matrix_type), intent(in) :: constraints
      real(wp), allocatable, intent(out) :: basis(:, :)
      real(wp), allocatable :: a(:, :), singular(:), vt(:, :), work(:)
      real(wp) :: no_left(1, 1)
      integer :: m, n, rank, info

      m = max(1, constraints%rows)
      n = constraints%columns
      allocate (a(m, n), source=0.0_wp)
      a(:constraints%rows, :) = dense_matrix(constraints)
      allocate (singular(min(m, n)), vt(n, n), work(32*(m + n) + 64))
      call dgesvd("N", "A", m, n, a, m, singular, no_left, 1, vt, n, work, size(work), info)
      rank = count(singular > n*epsilon(singular)*singular(1))
      allocate (basis, source=transpose(vt(rank + 1:, :)))
      if (info /= 0) basis = ieee_value(basis, ieee_quiet_nan)
   end subroutine constrained_motions

   function reduced(matrix, basis)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), contiguous, intent(in) :: basis(:, :)
      real(wp) :: reduced(size(basis, 2), size(basis, 2))
      real(wp) :: product(size(basis, 1), size(basis, 2))

      product = 0
      call matrix%add_product(1.0_wp, basis, product)
      reduced = matmul(transpose(basis), product)
   end function reduced
end module dense_reference
