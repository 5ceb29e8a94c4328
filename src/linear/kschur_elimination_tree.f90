!> Elimination tree of a symmetric matrix, and column counts of L without forming L. Unknown order(k) is eliminated as k-th,
!> position is the inverse permutation; the tree is in terms of positions. The matrix is given by its pattern (CSR, 1-based).
module kschur_elimination_tree
   implicit none
   private
   public :: find_parents, find_postorder, count_entries

contains

   !> parent(k) is the row of the first subdiagonal entry of column k of L, 0 if there is none (a root).
   pure subroutine find_parents(row_start, column, order, position, parent)
      integer, intent(in) :: row_start(:), column(:), order(:), position(:)
      integer, intent(out) :: parent(:)
      ! Highest ancestor found so far (path compression).
      integer, allocatable :: ancestor(:)
      integer :: i, k, next, p

      allocate (ancestor(size(parent)), source=0)
      parent = 0
      do k = 1, size(parent)
         do p = row_start(order(k)), row_start(order(k) + 1) - 1
            i = position(column(p))
            do while (i < k)
               next = ancestor(i)
               ancestor(i) = k
               if (next == 0) then
                  parent(i) = k
                  exit
               end if
               i = next
            end do
         end do
      end do
   end subroutine find_parents

   !> Postorder of a forest: sequence(k) is the k-th node, descendants come right before their ancestor.
   pure subroutine find_postorder(parent, sequence)
      !> 0 at a root.
      integer, intent(in) :: parent(:)
      integer, intent(out) :: sequence(:)
      integer, allocatable :: child(:), sibling(:)
      integer :: j, k, next

      allocate (child(0:size(parent)), sibling(size(parent)), source=0)
      do j = size(parent), 1, -1
         sibling(j) = child(parent(j))
         child(parent(j)) = j
      end do
      k = 0
      j = child(0)
      do while (j /= 0)
         do while (child(j) /= 0)
            next = child(j)
            child(j) = 0
            j = next
         end do
         k = k + 1
         sequence(k) = j
         j = merge(sibling(j), parent(j), sibling(j) /= 0)
      end do
   end subroutine find_postorder

   !> Number of entries of each column of L, with the diagonal; the order must be a postorder of its tree.
   subroutine count_entries(row_start, column, order, position, parent, entries)
      integer, intent(in) :: row_start(:), column(:), order(:), position(:), parent(:)
      integer, intent(out) :: entries(:)
      ! First descendant of each node; of each row, first descendant of the last leaf of its subtree, and that leaf.
      integer, allocatable :: first(:), latest(:), leaf(:)
      integer, allocatable :: ancestor(:)
      integer :: i, j, k, p

      allocate (first(size(parent)), latest(size(parent)), leaf(size(parent)), source=0)
      allocate (ancestor, source=[(k, k=1, size(parent))])
      do k = 1, size(parent)
         j = k
         do while (j /= 0)
            if (first(j) /= 0) exit
            first(j) = k
            j = parent(j)
         end do
         entries(k) = merge(1, 0, first(k) == k)
      end do
      do j = 1, size(parent)
         if (parent(j) /= 0) entries(parent(j)) = entries(parent(j)) - 1
         do p = row_start(order(j)), row_start(order(j) + 1) - 1
            i = position(column(p))
            if (i <= j) cycle
            if (first(j) <= latest(i)) cycle
            latest(i) = first(j)
            entries(j) = entries(j) + 1
            if (leaf(i) /= 0) call discount(leaf(i))
            leaf(i) = j
         end do
         if (parent(j) /= 0) ancestor(j) = parent(j)
      end do
      do j = 1, size(parent)
         if (parent(j) /= 0) entries(parent(j)) = entries(parent(j)) + entries(j)
      end do

   contains

      ! Subtracts duplicates: paths from two leaves of a row subtree share all from their common ancestor on.
      subroutine discount(from)
         integer, intent(in) :: from
         integer :: meeting, next, s

         meeting = from
         do while (meeting /= ancestor(meeting))
            meeting = ancestor(meeting)
         end do
         entries(meeting) = entries(meeting) - 1
         s = from
         do while (s /= meeting)
            next = ancestor(s)
            ancestor(s) = meeting
            s = next
         end do
      end subroutine discount
   end subroutine count_entries
end module kschur_elimination_tree
