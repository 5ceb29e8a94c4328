!> Parts of an elimination tree: subtrees, and above these what lies between two branchings. A part may be worked on as soon
!> as those that hang on it are done, so that threads share them; what they are does not depend on how many threads there are.
module kschur_subtrees
   use kschur_kinds, only: wp
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: subtrees_type, cut_subtrees

   !> An elimination tree cut into parts, each after those that hang on it.
   type :: subtrees_type
      !> Part t has the supernodes first(t) ... root(t), the last of which is above the others; the parts have all.
      integer, allocatable :: first(:), root(:)
      !> The part that part t hangs on; one more than there are where that is none.
      integer, allocatable :: above(:)
      !> The first part that hangs on part t, and the next one beside part t that hangs where it does; 0: there is none.
      integer, allocatable :: below(:), beside(:)
      !> Nothing hangs on it.
      logical, allocatable :: is_leaf(:)
      !> Of each column of the others, which one of them it is; how many they are.
      integer, allocatable :: place(:)
      integer :: columns = 0
   end type subtrees_type

   ! A factor with fewer entries is not worth it; no leaf has more than this part of all entries.
   real(wp), parameter :: least = 3.0e5_wp
   integer, parameter :: leaves = 24

contains

   !> Leaves are the largest subtrees with no more than their part of the entries whose supernodes are neighbours.
   function cut_subtrees(symbolic) result(subtrees)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type) :: subtrees
      integer, allocatable :: parent(:), part(:)
      integer :: nodes, t, column

      nodes = size(symbolic%first) - 1
      allocate (parent(nodes), part(nodes))
      call find_parents(symbolic, parent)
      call find_parts(symbolic, parent, subtrees)
      do t = 1, size(subtrees%root)
         part(subtrees%first(t):subtrees%root(t)) = t
      end do
      allocate (subtrees%above(size(subtrees%root)), source=size(subtrees%root) + 1)
      do t = 1, size(subtrees%root)
         if (parent(subtrees%root(t)) > 0) subtrees%above(t) = part(parent(subtrees%root(t)))
      end do
      call list_parts(subtrees)
      allocate (subtrees%place(size(symbolic%order)), source=0)
      do t = 1, size(subtrees%root)
         if (subtrees%is_leaf(t)) cycle
         do column = symbolic%first(subtrees%first(t)), symbolic%first(subtrees%root(t) + 1) - 1
            subtrees%columns = subtrees%columns + 1
            subtrees%place(column) = subtrees%columns
         end do
      end do
   end function cut_subtrees

   ! What hangs on each part: separate trees may be as many as unknowns.
   pure subroutine list_parts(subtrees)
      type(subtrees_type), intent(inout) :: subtrees
      integer :: t

      allocate (subtrees%below(size(subtrees%root) + 1), subtrees%beside(size(subtrees%root)), source=0)
      do t = size(subtrees%root), 1, -1
         subtrees%beside(t) = subtrees%below(subtrees%above(t))
         subtrees%below(subtrees%above(t)) = t
      end do
   end subroutine list_parts

   ! 0 at a root.
   pure subroutine find_parents(symbolic, parent)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(out) :: parent(:)
      integer :: s

      parent = 0
      do s = 1, size(parent)
         if (symbolic%start(s) < symbolic%start(s + 1)) parent(s) = symbolic%supernode(symbolic%row(symbolic%start(s)))
      end do
   end subroutine find_parents

   ! From the last supernode down: a leaf, or a chain of only children.
   subroutine find_parts(symbolic, parent, subtrees)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: parent(:)
      type(subtrees_type), intent(inout) :: subtrees
      ! Of the subtree of each supernode, its entries, how many supernodes it has, and the first of them.
      real(wp), allocatable :: entries(:)
      integer, allocatable :: members(:), begin(:), children(:)
      logical, allocatable :: ends(:), leaf(:)
      real(wp) :: total
      integer :: nodes, s, low

      nodes = size(parent)
      allocate (entries, source=[(real(symbolic%first(s + 1) - symbolic%first(s), wp)* &
         (symbolic%first(s + 1) - symbolic%first(s) + (symbolic%start(s + 1) - symbolic%start(s))), s=1, nodes)])
      total = sum(entries)
      allocate (members(nodes), source=1)
      allocate (begin, source=[(s, s=1, nodes)])
      allocate (children(nodes), source=0)
      ! Children come first.
      do s = 1, nodes
         if (parent(s) == 0) cycle
         entries(parent(s)) = entries(parent(s)) + entries(s)
         members(parent(s)) = members(parent(s)) + members(s)
         begin(parent(s)) = min(begin(parent(s)), begin(s))
         children(parent(s)) = children(parent(s)) + 1
      end do
      allocate (leaf, source=total >= least .and. entries <= total/leaves .and. [(s, s=1, nodes)] - begin + 1 == members)
      allocate (ends(nodes), source=.false.)
      s = nodes
      do while (s > 0)
         ends(s) = .true.
         low = s
         if (total < least) then
            leaf(s) = .true.
            low = 1
         else if (leaf(s)) then
            low = begin(s)
         else
            do while (children(low) == 1)
               if (parent(low - 1) /= low .or. leaf(low - 1)) exit
               low = low - 1
            end do
         end if
         begin(s) = low
         s = low - 1
      end do
      allocate (subtrees%root, source=pack([(s, s=1, nodes)], ends))
      allocate (subtrees%first(size(subtrees%root)), source=begin(subtrees%root))
      allocate (subtrees%is_leaf(size(subtrees%root)), source=leaf(subtrees%root))
   end subroutine find_parts
end module kschur_subtrees
