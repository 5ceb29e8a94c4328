!> Solutions for blocks of real right-hand sides by LDL^T, in the order of the unknowns.
module kschur_permuted_sides
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: supernodal_factors_type
   use kschur_kinds, only: wp
   use kschur_substitution, only: sides_at_once, substitute
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: substitute_sides

#define SCALAR real(wp)
#include "kschur_permuted_sides.inc"
end module kschur_permuted_sides
