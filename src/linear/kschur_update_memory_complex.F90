!> Memory for complex update matrices of a multifrontal elimination. New memory takes page faults, which cost as much as the
!> arithmetic; so it is used again. Updates of a supernode and of its parent lie on two stacks in turn, as then those of the
!> children of a supernode are the last on theirs: one thread has the whole tree on its stacks, one of several a leaf part at a
!> time. Others are allocated, and the largest free ones kept.
module kschur_update_memory_complex
   use kschur_kinds, only: wp, long
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: block_columns, symbolic_type, triangle_entries
   implicit none
   private
   public :: matrix_type, stacks_type, update_plan_type

#define SCALAR complex(wp)
#include "kschur_update_memory.inc"
end module kschur_update_memory_complex
