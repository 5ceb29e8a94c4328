!> Independent parts of an elimination tree, which threads may work on at the same time. They do not depend on how many
!> threads there are.
module kschur_subtrees
   use kschur_kinds, only: wp
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: subtrees_type, cut_subtrees

   !> An elimination tree cut into parts that are independent of each other, and what is above them.
   type :: subtrees_type
      !> Part t has the supernodes first(t) ... root(t), the last of which is above the others.
      integer, allocatable :: first(:), root(:)
      !> The supernodes above all parts, ascending.
      integer, allocatable :: top(:)
      !> Of each column of these, which one of them it is; how many they are.
      integer, allocatable :: place(:)
      integer :: columns = 0
   end type subtrees_type

   ! A factor with fewer entries is not worth it; no part has more than this part of all entries.
   real(wp), parameter :: least = 3.0e5_wp
   integer, parameter :: parts = 24

contains

   !> The largest subtrees with no more than their part of the entries whose supernodes are neighbours.
   function cut_subtrees(symbolic) result(subtrees)
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type) :: subtrees
      ! Of the subtree of each supernode, its entries, how many supernodes it has, and the first of them.
      real(wp), allocatable :: entries(:)
      integer, allocatable :: members(:), begin(:)
      logical, allocatable :: is_root(:), is_top(:)
      real(wp) :: total
      integer :: nodes, s, parent, column

      nodes = size(symbolic%first) - 1
      allocate (entries(nodes), source=[(real(symbolic%first(s + 1) - symbolic%first(s), wp)* &
         (symbolic%first(s + 1) - symbolic%first(s) + (symbolic%start(s + 1) - symbolic%start(s))), s=1, nodes)])
      allocate (members(nodes), source=1)
      allocate (begin, source=[(s, s=1, nodes)])
      total = sum(entries)
      ! Children come first.
      do s = 1, nodes
         if (symbolic%start(s) == symbolic%start(s + 1)) cycle
         parent = symbolic%supernode(symbolic%row(symbolic%start(s)))
         entries(parent) = entries(parent) + entries(s)
         members(parent) = members(parent) + members(s)
         begin(parent) = min(begin(parent), begin(s))
      end do
      allocate (is_root(nodes), is_top(nodes), source=.false.)
      s = nodes
      do while (s > 0)
         is_root(s) = total >= least .and. entries(s) <= total/parts .and. s - begin(s) + 1 == members(s)
         is_top(s) = .not. is_root(s)
         s = merge(begin(s), s, is_root(s)) - 1
      end do
      allocate (subtrees%root, source=pack([(s, s=1, nodes)], is_root))
      allocate (subtrees%first(size(subtrees%root)), source=begin(subtrees%root))
      allocate (subtrees%top, source=pack([(s, s=1, nodes)], is_top))
      allocate (subtrees%place(size(symbolic%order)), source=0)
      do s = 1, size(subtrees%top)
         do column = symbolic%first(subtrees%top(s)), symbolic%first(subtrees%top(s) + 1) - 1
            subtrees%columns = subtrees%columns + 1
            subtrees%place(column) = subtrees%columns
         end do
      end do
   end function cut_subtrees
end module kschur_subtrees
