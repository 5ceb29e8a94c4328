!> Restart and extraction of eigenpairs for complex Krylov-Schur decompositions, by Schur vectors of the active part.
module kschur_schur_vectors_complex
   use kschur_basis_complex, only: basis_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_lapack, only: dznrm2
   use kschur_projected, only: independent_eigenvectors, join_pairs, keep_one_of_pairs, move_to_head, schur_values
   use kschur_ritz_complex, only: decomposition_type, ritz_type
   use kschur_selection, only: selection_type, order_by_preference
   implicit none
   private
   public :: extract, restore_conjugates, truncate

#define SCALAR complex(wp)
#include "kschur_schur_vectors.inc"
end module kschur_schur_vectors_complex
