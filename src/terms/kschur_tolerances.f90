!> When eigenvalues are told apart.
module kschur_tolerances
   use kschur_kinds, only: wp
   implicit none
   private

   !> An imaginary part below this, relative to the eigenvalue, is rounding.
   real(wp), parameter, public :: real_tolerance = 1.0e-8_wp
   !> Two eigenvalues closer than this, relative to their size, may be one found twice.
   real(wp), parameter, public :: same_value = 1.0e-5_wp
end module kschur_tolerances
