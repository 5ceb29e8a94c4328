!> Ritz pairs of real Krylov-Schur decompositions.
module kschur_ritz_real
   use kschur_archive, only: archive_type
   use kschur_eigenvalue_conditions, only: eigenvalue_conditions, two_sided_eigenvectors
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type
   use kschur_projected, only: eigenvector_couplings, join_pairs, schur_form, schur_values
   use kschur_random_start, only: random_start_type
   use kschur_selection, only: order_by_preference, selection_type
   use kschur_unseen_part, only: krylov_polynomial_type
   use kschur_tolerances, only: improbable_miss, negligible_change, same_value
   implicit none
   private
   public :: choose, decomposition_type, check_none_missing, check_start, project, ritz_type

#define SCALAR real(wp)
#include "kschur_ritz.inc"
end module kschur_ritz_real
