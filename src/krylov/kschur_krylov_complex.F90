!> Krylov-Schur for complex operators.
module kschur_krylov_complex
   use kschur_archive, only: archive_type
   use kschur_basis_complex, only: basis_type, plain_basis_type
   use kschur_checkpoint, only: checkpoint_type
   use kschur_error, only: error_type
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, ritz_pairs_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_operator, only: complex_operator_type
   use kschur_outcome, only: history_type, reason_cancelled, reason_fewer_modes, reason_max_restarts
   use kschur_projected, only: schur_form
   use kschur_random, only: random_vector, state_of_seed
   use kschur_ritz_complex, only: choose, decomposition_type, check_none_missing, check_start, project, ritz_type
   use kschur_schur_vectors_complex, only: extract, restore_conjugates, truncate
   use kschur_selection, only: selection_type
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: krylov_schur

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#define PROJECTED(x) x
#include "kschur_krylov.inc"
end module kschur_krylov_complex
