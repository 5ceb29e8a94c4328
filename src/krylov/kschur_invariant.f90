!> A subspace that an operator is known to leave invariant before it is iterated.
module kschur_invariant
   use kschur_kinds, only: wp
   implicit none
   private
   public :: invariant_type

   !> C Z = Z T. Its eigenvalues are not looked for, and not among those that an iteration returns.
   type :: invariant_type
      !> Z, order x s, of full rank.
      real(wp), allocatable :: vectors(:, :)
      !> T, s x s, upper triangular.
      complex(wp), allocatable :: projected(:, :)
   end type invariant_type
end module kschur_invariant
