!> Elimination tree of a symmetric matrix, and column counts of L without forming L. Unknown order(k) is eliminated as k-th,
!> position is the inverse permutation; the tree is in terms of positions. The matrix is given by its pattern (CSR, 1-based).
module kschur_elimination_tree
   use kschur_kinds, only: wp
   implicit none
   private
   public :: find_elimination_tree, find_postorder, multiplications

contains

   !> The tree of an order, which becomes a postorder of it: parent(k) is the first place below the k-th in which its columns
   !> of L have entries, 0 where there is none; entries(k) those of its first column, its diagonal included.
   subroutine find_elimination_tree(start, neighbour, weight, order, position, parent, entries)
      !> The neighbours of vertex v are neighbour(start(v):start(v+1)-1); its unknowns.
      integer, intent(in) :: start(:), neighbour(:), weight(:)
      integer, intent(inout) :: order(:), position(:)
      integer, intent(out) :: parent(:), entries(:)
      integer, allocatable :: sequence(:), rank(:)
      integer :: k

      allocate (sequence(size(order)), rank(size(order)))
      call find_parents(start, neighbour, order, position, parent)
      call find_postorder(parent, sequence)
      order = order(sequence)
      position(order) = [(k, k=1, size(order))]
      rank(sequence) = [(k, k=1, size(order))]
      parent = parent(sequence)
      do k = 1, size(order)
         if (parent(k) > 0) parent(k) = rank(parent(k))
      end do
      call count_entries(start, neighbour, weight, order, position, parent, entries)
   end subroutine find_elimination_tree

   !> Multiplications that factors take whose vertices have so many unknowns, and the first column of each so many entries.
   pure real(wp) function multiplications(weight, entries) result(operations)
      integer, intent(in) :: weight(:), entries(:)
      integer :: k, i

      operations = 0
      do k = 1, size(weight)
         do i = 0, weight(k) - 1
            operations = operations + real(entries(k) - i, wp)**2/2
         end do
      end do
   end function multiplications

   ! J. W. H. Liu, SIAM J. Matrix Anal. Appl. 11 (1990), doi 10.1137/0611010.
   pure subroutine find_parents(start, neighbour, order, position, parent)
      integer, intent(in) :: start(:), neighbour(:), order(:), position(:)
      integer, intent(out) :: parent(:)
      ! Highest ancestor found so far (path compression).
      integer, allocatable :: ancestor(:)
      integer :: i, k, next, p

      allocate (ancestor(size(parent)), source=0)
      parent = 0
      do k = 1, size(parent)
         do p = start(order(k)), start(order(k) + 1) - 1
            i = position(neighbour(p))
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

   ! Of an order that is a postorder of its tree.
   ! J. R. Gilbert, E. G. Ng, B. W. Peyton, SIAM J. Matrix Anal. Appl. 15 (1994), doi 10.1137/S089547989225921X.
   subroutine count_entries(start, neighbour, weight, order, position, parent, entries)
      integer, intent(in) :: start(:), neighbour(:), weight(:), order(:), position(:), parent(:)
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
         entries(k) = merge(weight(order(k)), 0, first(k) == k)
      end do
      do j = 1, size(parent)
         if (parent(j) /= 0) entries(parent(j)) = entries(parent(j)) - weight(order(j))
         do p = start(order(j)), start(order(j) + 1) - 1
            i = position(neighbour(p))
            if (i <= j) cycle
            if (first(j) <= latest(i)) cycle
            latest(i) = first(j)
            entries(j) = entries(j) + weight(order(i))
            if (leaf(i) /= 0) call discount(leaf(i), weight(order(i)))
            leaf(i) = j
         end do
         if (parent(j) /= 0) ancestor(j) = parent(j)
      end do
      do j = 1, size(parent)
         if (parent(j) /= 0) entries(parent(j)) = entries(parent(j)) + entries(j)
      end do

   contains

      ! Subtracts duplicates: paths from two leaves of a row subtree share all from their common ancestor on.
      subroutine discount(from, rows)
         integer, intent(in) :: from, rows
         integer :: meeting, next, s

         meeting = from
         do while (meeting /= ancestor(meeting))
            meeting = ancestor(meeting)
         end do
         entries(meeting) = entries(meeting) - rows
         s = from
         do while (s /= meeting)
            next = ancestor(s)
            ancestor(s) = meeting
            s = next
         end do
      end subroutine discount
   end subroutine count_entries
end module kschur_elimination_tree
