!> Options of ARPACK besides those of every Krylov iteration.
module kschur_arpack_options
   use kschur_krylov_options, only: krylov_options_type
   implicit none
   private
   public :: arpack_options_type

   !> Options of this type select ARPACK instead of Krylov-Schur.
   type, extends(krylov_options_type) :: arpack_options_type
      !> Number of eigenvalues nearest to the shift in the first run.
      integer :: values = 6
      !> Whether to run ARPACK once, without filtered start vector, even if eigenvalues nearest to the shift are not the wanted
      !> ones.
      logical :: raw = .false.
   end type arpack_options_type
end module kschur_arpack_options
