!> Explicit interfaces to the BLAS and LAPACK routines the library calls.
module kschur_lapack
   use kschur_kinds, only: wp
   implicit none
   private
   public :: dnrm2, dznrm2, dgees, dgelsy, dgemm, dgemv, dgeqp3, dgesv, dgesvd, dorgqr, dormqr, dpstrf, dsyevd, dsygv, &
      dtrevc, dtrsen, dtrsm, dtrsna, zgees, zgemm, zgemv, zgesv, zgesvd, ztrevc, ztrsen

   interface
      !> C := alpha op(A) op(B) + beta C.
      subroutine zgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
         import :: wp
         character, intent(in) :: transa, transb
         integer, intent(in) :: m, n, k, lda, ldb, ldc
         complex(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
         complex(wp), intent(inout) :: c(ldc, *)
      end subroutine zgemm

      !> y := alpha op(A) x + beta y.
      subroutine zgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         character, intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         complex(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
         complex(wp), intent(inout) :: y(*)
      end subroutine zgemv

      !> Schur form of a complex matrix.
      subroutine zgees(jobvs, sort, select, n, a, lda, sdim, w, vs, ldvs, work, lwork, rwork, bwork, info)
         import :: wp
         character, intent(in) :: jobvs, sort
         interface
            logical function select(value)
               import :: wp
               complex(wp), intent(in) :: value
            end function select
         end interface
         integer, intent(in) :: n, lda, ldvs, lwork
         complex(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: sdim, info
         complex(wp), intent(out) :: w(*), vs(ldvs, *), work(*)
         real(wp), intent(out) :: rwork(*)
         logical, intent(out) :: bwork(*)
      end subroutine zgees

      !> Eigenvectors of a complex upper triangular matrix.
      subroutine ztrevc(side, howmny, select, n, t, ldt, vl, ldvl, vr, ldvr, mm, m, work, rwork, info)
         import :: wp
         character, intent(in) :: side, howmny
         logical, intent(in) :: select(*)
         integer, intent(in) :: n, ldt, ldvl, ldvr, mm
         complex(wp), intent(inout) :: t(ldt, *), vl(ldvl, *), vr(ldvr, *)
         integer, intent(out) :: m, info
         complex(wp), intent(out) :: work(*)
         real(wp), intent(out) :: rwork(*)
      end subroutine ztrevc

      !> Moves selected eigenvalues of a complex Schur form to its head.
      subroutine ztrsen(job, compq, select, n, t, ldt, q, ldq, w, m, s, sep, work, lwork, info)
         import :: wp
         character, intent(in) :: job, compq
         logical, intent(in) :: select(*)
         integer, intent(in) :: n, ldt, ldq, lwork
         complex(wp), intent(inout) :: t(ldt, *), q(ldq, *)
         complex(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: m, info
         real(wp), intent(out) :: s, sep
      end subroutine ztrsen

      !> C := alpha op(A) op(B) + beta C, real.
      subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
         import :: wp
         character, intent(in) :: transa, transb
         integer, intent(in) :: m, n, k, lda, ldb, ldc
         real(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
         real(wp), intent(inout) :: c(ldc, *)
      end subroutine dgemm

      !> y := alpha op(A) x + beta y, real.
      subroutine dgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         character, intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         real(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
         real(wp), intent(inout) :: y(*)
      end subroutine dgemv

      !> Schur form of a real matrix.
      subroutine dgees(jobvs, sort, select, n, a, lda, sdim, wr, wi, vs, ldvs, work, lwork, bwork, info)
         import :: wp
         character, intent(in) :: jobvs, sort
         interface
            logical function select(re, im)
               import :: wp
               real(wp), intent(in) :: re, im
            end function select
         end interface
         integer, intent(in) :: n, lda, ldvs, lwork
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: sdim, info
         real(wp), intent(out) :: wr(*), wi(*), vs(ldvs, *), work(*)
         logical, intent(out) :: bwork(*)
      end subroutine dgees

      !> Eigenvectors of a real quasi-triangular matrix.
      subroutine dtrevc(side, howmny, select, n, t, ldt, vl, ldvl, vr, ldvr, mm, m, work, info)
         import :: wp
         character, intent(in) :: side, howmny
         logical, intent(inout) :: select(*)
         integer, intent(in) :: n, ldt, ldvl, ldvr, mm
         real(wp), intent(in) :: t(ldt, *)
         real(wp), intent(inout) :: vl(ldvl, *), vr(ldvr, *)
         integer, intent(out) :: m, info
         real(wp), intent(out) :: work(*)
      end subroutine dtrevc

      !> Moves selected eigenvalues of a real Schur form to its head.
      subroutine dtrsen(job, compq, select, n, t, ldt, q, ldq, wr, wi, m, s, sep, work, lwork, iwork, liwork, info)
         import :: wp
         character, intent(in) :: job, compq
         logical, intent(in) :: select(*)
         integer, intent(in) :: n, ldt, ldq, lwork, liwork
         real(wp), intent(inout) :: t(ldt, *), q(ldq, *)
         real(wp), intent(out) :: wr(*), wi(*), work(*)
         integer, intent(out) :: m, iwork(*), info
         real(wp), intent(out) :: s, sep
      end subroutine dtrsen

      !> Condition numbers of the eigenvalues of a real quasi-triangular matrix.
      subroutine dtrsna(job, howmny, select, n, t, ldt, vl, ldvl, vr, ldvr, s, sep, mm, m, work, ldwork, iwork, info)
         import :: wp
         character, intent(in) :: job, howmny
         logical, intent(in) :: select(*)
         integer, intent(in) :: n, ldt, ldvl, ldvr, mm, ldwork
         real(wp), intent(in) :: t(ldt, *), vl(ldvl, *), vr(ldvr, *)
         real(wp), intent(out) :: s(*), sep(*), work(ldwork, *)
         integer, intent(out) :: m, iwork(*), info
      end subroutine dtrsna

      !> Singular value decomposition of a real matrix.
      subroutine dgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info)
         import :: wp
         character, intent(in) :: jobu, jobvt
         integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
         integer, intent(out) :: info
      end subroutine dgesvd

      !> Singular value decomposition of a complex matrix.
      subroutine zgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, rwork, info)
         import :: wp
         character, intent(in) :: jobu, jobvt
         integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
         complex(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: s(*), rwork(*)
         complex(wp), intent(out) :: u(ldu, *), vt(ldvt, *), work(*)
         integer, intent(out) :: info
      end subroutine zgesvd

      !> Least squares for real matrices of any rank, by orthogonal factors.
      subroutine dgelsy(m, n, nrhs, a, lda, b, ldb, jpvt, rcond, rank, work, lwork, info)
         import :: wp
         integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(inout) :: jpvt(*)
         real(wp), intent(in) :: rcond
         integer, intent(out) :: rank, info
         real(wp), intent(out) :: work(*)
      end subroutine dgelsy

      !> QR factors with pivots; columns with a nonzero jpvt come first, in their order.
      subroutine dgeqp3(m, n, a, lda, jpvt, tau, work, lwork, info)
         import :: wp
         integer, intent(in) :: m, n, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(inout) :: jpvt(*)
         real(wp), intent(out) :: tau(*), work(*)
         integer, intent(out) :: info
      end subroutine dgeqp3

      !> The first n columns of Q from the reflectors of a QR factorisation.
      subroutine dorgqr(m, n, k, a, lda, tau, work, lwork, info)
         import :: wp
         integer, intent(in) :: m, n, k, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(in) :: tau(*)
         real(wp), intent(out) :: work(*)
         integer, intent(out) :: info
      end subroutine dorgqr

      !> C := op(Q) C or C op(Q), Q from the reflectors of a QR factorisation.
      subroutine dormqr(side, trans, m, n, k, a, lda, tau, c, ldc, work, lwork, info)
         import :: wp
         character, intent(in) :: side, trans
         integer, intent(in) :: m, n, k, lda, ldc, lwork
         real(wp), intent(in) :: a(lda, *), tau(*)
         real(wp), intent(inout) :: c(ldc, *)
         real(wp), intent(out) :: work(*)
         integer, intent(out) :: info
      end subroutine dormqr

      !> B := A^{-1} B by LU factors, in place of A.
      subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgesv

      !> The same, complex.
      subroutine zgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         integer, intent(in) :: n, nrhs, lda, ldb
         complex(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgesv

      !> Cholesky factor with pivots of a semidefinite matrix, and its rank; a tolerance below zero is LAPACK's own.
      subroutine dpstrf(uplo, n, a, lda, piv, rank, tol, work, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: piv(*), rank, info
         real(wp), intent(in) :: tol
         real(wp), intent(out) :: work(*)
      end subroutine dpstrf

      !> B := alpha op(A)^{-1} B or alpha B op(A)^{-1}, A triangular.
      subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: wp
         character, intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(wp), intent(in) :: alpha, a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
      end subroutine dtrsm

      !> Euclidean norm of a real vector.
      real(wp) function dnrm2(n, x, incx)
         import :: wp
         integer, intent(in) :: n, incx
         real(wp), intent(in) :: x(*)
      end function dnrm2

      !> Euclidean norm of a complex vector.
      real(wp) function dznrm2(n, x, incx)
         import :: wp
         integer, intent(in) :: n, incx
         complex(wp), intent(in) :: x(*)
      end function dznrm2

      !> Eigenvalues and eigenvectors of a real symmetric matrix.
      subroutine dsyevd(jobz, uplo, n, a, lda, w, work, lwork, iwork, liwork, info)
         import :: wp
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork, liwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dsyevd

      !> Eigenvalues and B-orthonormal eigenvectors of A x = theta B x, symmetric with B definite.
      subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
         import :: wp
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: itype, n, lda, ldb, lwork
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsygv
   end interface
end module kschur_lapack
