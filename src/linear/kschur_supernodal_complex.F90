!> Multifrontal complex symmetric LDL^T without pivoting. Threads share independent parts of the elimination tree, and tiles of
!> panels above its leaves; neither the partition nor the digits depend on the number of threads.
module kschur_supernodal_complex
   use kschur_common_supernodes, only: common_supernodes_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts_complex, only: elimination_type, eliminate_supernode, front_type, supernodal_factors_type
   use kschur_kinds, only: wp, long
   use kschur_monitor, only: ask_monitor, is_stopped, monitor_type
   use kschur_sparse, only: complex_csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   implicit none
   private
   public :: eliminate

#define SCALAR complex(wp)
#define MATRIX_TYPE complex_csr_matrix_type
#include "kschur_supernodal.inc"
end module kschur_supernodal_complex
