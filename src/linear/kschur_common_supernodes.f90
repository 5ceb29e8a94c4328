!> The supernodes at the top of an elimination tree that several processes share, each of which has the subtrees of a part of the
!> others and some rows of these: what they do together.
module kschur_common_supernodes
   use kschur_enclosure, only: enclosure_type
   use kschur_kinds, only: wp
   use kschur_monitor, only: monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_update_memory, only: matrix_type
   implicit none
   private
   public :: common_supernodes_type, common_updates_type

   !> The update matrix of the root of a subtree, allocated; its first rows and columns may be eliminated already.
   type :: common_updates_type
      type(matrix_type) :: matrix
      integer :: eliminated = 0
      !> Of each row, the `sum` of `enclosure_type`, if it is wanted.
      real(wp), allocatable :: sum(:)
   end type common_updates_type

   !> Calls are collective.
   type, abstract :: common_supernodes_type
      !> The first of them among the supernodes of this process, which they end. Below their diagonal blocks the analysis of this
      !> process has its own rows only.
      integer :: first = 1
      !> Rows of the whole matrix.
      integer :: unknowns = 0
      !> Of one process.
      logical :: leads = .true.
   contains
      !> Whether a condition holds in any process.
      procedure(any_of), deferred :: any_of
      !> Computes the columns of these supernodes.
      procedure(eliminate), deferred :: eliminate
      !> Adds rows of vectors of all processes, in each.
      procedure(sum_rows), deferred :: sum_rows
   end type common_supernodes_type

   abstract interface
      logical function any_of(self, here)
         import :: common_supernodes_type
         class(common_supernodes_type), intent(in) :: self
         logical, intent(in) :: here
      end function any_of

      subroutine eliminate(self, matrix, update, enclosure, terms, offset, lower, pivot, no_memory, monitor)
         use kschur_kinds, only: long
         import :: common_supernodes_type, common_updates_type, csr_matrix_type, enclosure_type, monitor_type, wp
         class(common_supernodes_type), intent(inout) :: self
         !> The lower triangle, by columns of this process.
         type(csr_matrix_type), intent(in) :: matrix
         !> Of each supernode of this process before the common ones, if one of these is its parent; freed.
         type(common_updates_type), intent(inout) :: update(:)
         !> Says which bounds are wanted.
         type(enclosure_type), intent(inout) :: enclosure
         !> `terms` of the common columns by the supernodes of this process; empty if no bounds are wanted.
         real(wp), intent(in) :: terms(:)
         !> Where the columns of each common supernode start in `lower`, as in `supernodal_factors_type`; `lower` is not allocated
         !> if L is not wanted.
         integer(long), intent(in) :: offset(:)
         real(wp), allocatable, intent(inout) :: lower(:)
         !> Of all common columns; zero after one that is zero or NaN.
         real(wp), intent(inout) :: pivot(:)
         logical, intent(out) :: no_memory
         !> Polled between supernodes; all processes end if it cancels.
         class(monitor_type), optional, intent(inout) :: monitor
      end subroutine eliminate

      subroutine sum_rows(self, rows)
         import :: common_supernodes_type, wp
         class(common_supernodes_type), intent(in) :: self
         real(wp), contiguous, intent(inout) :: rows(:, :)
      end subroutine sum_rows
   end interface
end module kschur_common_supernodes
