!> Partition of an elimination forest for parallel work: leaf parts are subtrees, other parts are chains between branchings. A
!> part may start when its children are done. The partition does not depend on the number of threads, and has at most some
!> hundreds of parts.
module kschur_subtrees
   use kschur_elimination_tree, only: find_postorder
   use kschur_kinds, only: wp
   use kschur_sorting, only: ascending_order
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: subtrees_type, cut_subtrees

   !> A partition of the elimination forest, children before parents.
   type :: subtrees_type
      !> Part t has supernodes first(t) ... root(t): a subtree or chain with its root last, or sibling subtrees of one parent
      !> part. The parts cover all supernodes.
      integer, allocatable :: first(:), root(:)
      !> Parent of part t; number of parts + 1 for a root.
      integer, allocatable :: above(:)
      !> Whether a part has no children.
      logical, allocatable :: is_leaf(:)
      !> The order in which parts are begun, each after those that hang on it: of two that hang on the same one the larger
      !> subtree first, so that threads end together.
      integer, allocatable :: order(:)
      !> Number of each column outside leaves among all such columns; their total.
      integer, allocatable :: place(:)
      integer :: columns = 0
   end type subtrees_type

   ! Factors with fewer entries are not partitioned: 8 bytes each, read twice, are a solve of half a millisecond at 10 GB/s, which
   ! starting tasks would lengthen. No leaf has more than 1/`leaves` of all entries.
   integer, parameter :: least_entries = 300000
   integer, parameter :: leaves = 24
   ! A subtree smaller than a leaf by this factor may be merged into the part above.
   integer, parameter :: small_part = 16

contains

   !> Partitions the forest. Leaf parts are the largest subtrees of contiguous supernodes with at most 1/`leaves` of all entries;
   !> sibling subtrees under the same part are merged while they stay below that bound together.
   function cut_subtrees(symbolic, common) result(subtrees)
      type(symbolic_type), intent(in) :: symbolic
      !> The supernodes from this one on, which are no descendants of others, form the last part; absent: none do.
      integer, optional, intent(in) :: common
      type(subtrees_type) :: subtrees
      integer :: from, s, t, column

      from = size(symbolic%first)
      if (present(common)) from = common
      call find_parts(symbolic, [(symbolic%parent(s), s=1, size(symbolic%first) - 1)], from, subtrees)
      call find_order(symbolic, subtrees)
      allocate (subtrees%place(size(symbolic%order)), source=0)
      do t = 1, size(subtrees%root)
         if (subtrees%is_leaf(t)) cycle
         do column = symbolic%first(subtrees%first(t)), symbolic%first(subtrees%root(t) + 1) - 1
            subtrees%columns = subtrees%columns + 1
            subtrees%place(column) = subtrees%columns
         end do
      end do
   end function cut_subtrees

   subroutine find_order(symbolic, subtrees)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(inout) :: subtrees
      ! Of the subtree of each part; by size, which part, the place of each, and the place of the one that it hangs on.
      real(wp) :: entries(size(subtrees%root))
      integer, dimension(size(subtrees%root)) :: largest, place, tree
      integer :: parts, t, s

      parts = size(subtrees%root)
      entries = 0
      do t = 1, parts
         do s = subtrees%first(t), subtrees%root(t)
            entries(t) = entries(t) + entries_of(symbolic, s)
         end do
         if (subtrees%above(t) <= parts) entries(subtrees%above(t)) = entries(subtrees%above(t)) + entries(t)
      end do
      largest = ascending_order(-entries)
      place(largest) = [(t, t=1, parts)]
      tree = 0
      do t = 1, parts
         if (subtrees%above(t) <= parts) tree(place(t)) = place(subtrees%above(t))
      end do
      allocate (subtrees%order(parts))
      call find_postorder(tree, subtrees%order)
      subtrees%order = largest(subtrees%order)
   end subroutine find_order

   pure real(wp) function entries_of(symbolic, s)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s

      associate (columns => symbolic%first(s + 1) - symbolic%first(s))
         entries_of = real(columns, wp)*(columns + (symbolic%start(s + 1) - symbolic%start(s)))
      end associate
   end function entries_of

   ! Finds the parts in one scan of the supernodes from the last to the first; those from `common` on are one part.
   subroutine find_parts(symbolic, parent, common, subtrees)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: parent(:), common
      type(subtrees_type), intent(inout) :: subtrees
      ! Of the subtree of each supernode: entries, number of supernodes, and first one; number of its children that are not
      ! leaves.
      real(wp), allocatable :: entries(:)
      integer, allocatable :: members(:), begin(:), branches(:)
      ! Part of each supernode, counted from the last.
      integer, allocatable :: part(:)
      logical, allocatable :: leaf(:), ends(:)
      real(wp) :: total
      integer :: nodes, s, low, parts

      nodes = size(parent)
      allocate (entries, source=[(entries_of(symbolic, s), s=1, nodes)])
      total = sum(entries)
      allocate (members(nodes), source=1)
      allocate (begin, source=[(s, s=1, nodes)])
      ! Sums over subtrees: children precede parents.
      do s = 1, nodes
         if (parent(s) == 0) cycle
         entries(parent(s)) = entries(parent(s)) + entries(s)
         members(parent(s)) = members(parent(s)) + members(s)
         begin(parent(s)) = min(begin(parent(s)), begin(s))
      end do
      allocate (leaf, source=entries <= total/leaves .and. [(s, s=1, nodes)] - begin + 1 == members)
      leaf(common:) = .false.
      allocate (branches(nodes), part(nodes), source=0)
      do s = 1, nodes
         if (parent(s) > 0 .and. .not. leaf(s)) branches(parent(s)) = branches(parent(s)) + 1
      end do
      allocate (ends(nodes), source=.false.)
      parts = 0
      s = nodes
      do while (s > 0)
         parts = parts + 1
         ends(s) = .true.
         if (s >= common) then
            low = common
         else if (total < least_entries) then
            leaf(s) = .true.
            low = 1
         else if (leaf(s)) then
            low = first_of_leaves(s)
         else
            low = first_of_chain(s)
         end if
         part(low:s) = parts
         begin(s) = low
         s = low - 1
      end do
      allocate (subtrees%root, source=pack([(s, s=1, nodes)], ends))
      allocate (subtrees%first(parts), source=begin(subtrees%root))
      allocate (subtrees%is_leaf(parts), source=leaf(subtrees%root))
      allocate (subtrees%above(parts), source=parts + 1 - [(above(subtrees%root(s)), s=1, parts)])

   contains

      ! Part of the parent of supernode s; 0 at a root.
      pure integer function above(s)
         integer, intent(in) :: s

         above = 0
         if (parent(s) > 0) above = part(parent(s))
      end function above

      ! First supernode of subtree s and preceding siblings under the same part.
      pure integer function first_of_leaves(s) result(low)
         integer, intent(in) :: s
         real(wp) :: sum

         low = begin(s)
         sum = entries(s)
         do while (low > 1)
            sum = sum + entries(low - 1)
            if (.not. leaf(low - 1) .or. above(low - 1) /= above(s) .or. sum > total/leaves) exit
            low = begin(low - 1)
         end do
      end function first_of_leaves

      ! First supernode of the chain below s from which only leaves branch off, small ones merged into it.
      pure integer function first_of_chain(s) result(low)
         integer, intent(in) :: s
         real(wp) :: taken

         low = s
         taken = 0
         do while (low > 1)
            ! A preceding subtree with no parent in this part belongs to another tree, or to a part above.
            if (parent(low - 1) == 0 .or. parent(low - 1) > s) exit
            if (leaf(low - 1)) then
               taken = taken + entries(low - 1)
               if (taken > total/(leaves*small_part)) exit
               low = begin(low - 1)
            else
               if (branches(parent(low - 1)) > 1) exit
               low = low - 1
            end if
         end do
      end function first_of_chain
   end subroutine find_parts
end module kschur_subtrees
