!> Multifrontal LDL^T of one supernode. A dense front takes its columns of A, and the update matrices of its children; its columns
!> are factored and stored in L; what they subtract from the rows below is its update matrix, for its parent. (J. W. H. Liu, SIAM
!> Rev. 34 (1992), doi 10.1137/1034004.)
module kschur_fronts
   use kschur_enclosure, only: enclosure_type
   use kschur_kinds, only: wp, long, single
   use kschur_panel, only: factor_panel, factor_rows, subtract_trapezoid
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: block_columns, symbolic_type
   use kschur_update_memory, only: matrix_type, stacks_type, update_plan_type
   implicit none
   private
   public :: supernodal_factors_type, elimination_type, front_type
   public :: eliminate_supernode

#define SCALAR real(wp)
#define ROUNDED real(single)
#define MATRIX_TYPE csr_matrix_type
#include "kschur_fronts.inc"
end module kschur_fronts
