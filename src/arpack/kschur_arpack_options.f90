!> What ARPACK is told beside what every Krylov iteration is.
module kschur_arpack_options
   use kschur_krylov_options, only: krylov_options_type
   implicit none
   private
   public :: arpack_options_type

   !> Options of this type ask for ARPACK in place of Krylov-Schur.
   type, extends(krylov_options_type) :: arpack_options_type
      !> How many eigenvalues are asked for at first, those nearest to the shift.
      integer :: values = 6
      !> No filtered start vector, and no second run where the nearest to the shift are not the wanted ones.
      logical :: raw = .false.
   end type arpack_options_type
end module kschur_arpack_options
