!> Explicit interfaces to the ARPACK routines the library calls.
module kschur_arpack_interfaces
   use kschur_kinds, only: wp
   implicit none
   private
   public :: dnaupd, dneupd, dsaupd, dseupd, znaupd, zneupd

   interface
      !> Implicitly restarted Arnoldi iteration, real.
      subroutine dnaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         integer, intent(inout) :: ido, iparam(11), ipntr(14), info
         character(len=1), intent(in) :: bmat
         character(len=2), intent(in) :: which
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         real(wp), intent(inout) :: tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dnaupd

      !> Eigenvalues and eigenvectors after dnaupd; `z` may be `v`.
      subroutine dneupd(rvec, howmny, select, dr, di, z, ldz, sigmar, sigmai, workev, bmat, n, which, nev, tol, resid, &
         ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         logical, intent(in) :: rvec
         character(len=1), intent(in) :: howmny, bmat
         character(len=2), intent(in) :: which
         logical, intent(inout) :: select(*)
         integer, intent(in) :: ldz, n, nev, ncv, ldv, lworkl
         integer, intent(inout) :: iparam(11), ipntr(14), info
         real(wp), intent(in) :: sigmar, sigmai
         real(wp), intent(inout) :: dr(*), di(*), z(ldz, *), workev(*), tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dneupd

      !> Implicitly restarted Lanczos iteration.
      subroutine dsaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         integer, intent(inout) :: ido, iparam(11), ipntr(11), info
         character(len=1), intent(in) :: bmat
         character(len=2), intent(in) :: which
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         real(wp), intent(inout) :: tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dsaupd

      !> Eigenvalues and eigenvectors after dsaupd; `z` may be `v`.
      subroutine dseupd(rvec, howmny, select, d, z, ldz, sigma, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, &
         ipntr, workd, workl, lworkl, info)
         import :: wp
         logical, intent(in) :: rvec
         character(len=1), intent(in) :: howmny, bmat
         character(len=2), intent(in) :: which
         logical, intent(inout) :: select(*)
         integer, intent(in) :: ldz, n, nev, ncv, ldv, lworkl
         integer, intent(inout) :: iparam(11), ipntr(11), info
         real(wp), intent(in) :: sigma
         real(wp), intent(inout) :: d(*), z(ldz, *), tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dseupd

      !> Implicitly restarted Arnoldi iteration, complex.
      subroutine znaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, rwork, info)
         import :: wp
         integer, intent(inout) :: ido, iparam(11), ipntr(14), info
         character(len=1), intent(in) :: bmat
         character(len=2), intent(in) :: which
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         real(wp), intent(inout) :: tol, rwork(*)
         complex(wp), intent(inout) :: resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine znaupd

      !> Eigenvalues and eigenvectors after znaupd; `z` may be `v`.
      subroutine zneupd(rvec, howmny, select, d, z, ldz, sigma, workev, bmat, n, which, nev, tol, resid, ncv, v, ldv, &
         iparam, ipntr, workd, workl, lworkl, rwork, info)
         import :: wp
         logical, intent(in) :: rvec
         character(len=1), intent(in) :: howmny, bmat
         character(len=2), intent(in) :: which
         logical, intent(inout) :: select(*)
         integer, intent(in) :: ldz, n, nev, ncv, ldv, lworkl
         integer, intent(inout) :: iparam(11), ipntr(14), info
         complex(wp), intent(in) :: sigma
         real(wp), intent(inout) :: tol, rwork(*)
         complex(wp), intent(inout) :: d(*), z(ldz, *), workev(*), resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine zneupd
   end interface
end module kschur_arpack_interfaces
