!> An invariant subspace of an operator, given before the iteration.
module kschur_invariant
   use kschur_kinds, only: wp
   implicit none
   private
   public :: invariant_type

   !> C Z = Z T. The iteration locks it and does not return its eigenvalues.
   type :: invariant_type
      !> Z, order x s, of full rank.
      real(wp), allocatable :: vectors(:, :)
      !> T, s x s, upper triangular.
      complex(wp), allocatable :: projected(:, :)
   end type invariant_type
end module kschur_invariant
