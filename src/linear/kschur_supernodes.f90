!> Supernodes: adjacent columns of L with nearly the same rows, stored and computed with as one dense block. Columns with equal
!> rows are joined, and a child is merged into its parent if few explicit zeros result (relaxed supernodes).
module kschur_supernodes
   use kschur_elimination_tree, only: find_postorder
   use kschur_kinds, only: wp, long
   use kschur_quotient_graph, only: stable_order
   implicit none
   private
   public :: find_supernodes, widest

   !> Largest number of columns of a supernode.
   integer, parameter :: widest = 192

   ! A tree of blocks: at first one for each run of columns with the same rows.
   type :: blocks_type
      ! 0 at a root.
      integer, allocatable :: parent(:)
      integer, allocatable :: columns(:), rows_below(:)
      ! Number of entries of L.
      integer(long), allocatable :: entries(:)
      ! The block that a block is merged into: itself, or a later one.
      integer, allocatable :: into(:)
   end type blocks_type

contains

   !> Of vertices in postorder, the order in which those of a supernode are neighbours: sequence(k) is the k-th. Their columns
   !> stand in this order; supernode s begins with column first(s), which may be in the middle of a vertex; `above` is its
   !> parent, 0 at a root.
   subroutine find_supernodes(parent, entries, weight, sequence, first, above)
      !> The elimination tree; of each vertex, the entries of its first column of L with its diagonal, and how many columns
      !> it has.
      integer, intent(in) :: parent(:), entries(:), weight(:)
      integer, allocatable, intent(out) :: sequence(:), first(:), above(:)
      type(blocks_type) :: blocks
      integer, allocatable :: block_of(:)

      call find_blocks(parent, entries, weight, blocks, block_of)
      call join_children(blocks)
      call lay_out(parent, weight, blocks, block_of, sequence, first, above)
   end subroutine find_supernodes

   ! Joins runs of columns with the same rows to blocks (fundamental supernodes).
   pure subroutine find_blocks(parent, entries, weight, blocks, block_of)
      integer, intent(in) :: parent(:), entries(:), weight(:)
      type(blocks_type), intent(out) :: blocks
      integer, allocatable, intent(out) :: block_of(:)
      integer :: j, s, n

      n = size(parent)
      allocate (block_of(n))
      s = min(n, 1)
      block_of(:s) = s
      do j = 2, n
         if (parent(j - 1) /= j .or. entries(j - 1) /= entries(j) + weight(j - 1)) s = s + 1
         block_of(j) = s
      end do
      allocate (blocks%parent(s), blocks%columns(s), blocks%rows_below(s), source=0)
      allocate (blocks%entries(s), source=0_long)
      allocate (blocks%into, source=[(j, j=1, s)])
      do j = 1, n
         s = block_of(j)
         blocks%columns(s) = blocks%columns(s) + weight(j)
         blocks%entries(s) = blocks%entries(s) + (int(weight(j), long)*(2*entries(j) - weight(j) + 1))/2
         blocks%rows_below(s) = entries(j) - weight(j)
         blocks%parent(s) = 0
         if (parent(j) /= 0) blocks%parent(s) = block_of(parent(j))
      end do
   end subroutine find_blocks

   ! Merges children into their parents where few explicit zeros result.
   pure subroutine join_children(blocks)
      type(blocks_type), intent(inout) :: blocks
      integer, allocatable :: child(:), sibling(:)
      integer :: c, p

      allocate (child(0:size(blocks%parent)), sibling(size(blocks%parent)), source=0)
      ! Last child first: its columns are adjacent to the parent's.
      do c = 1, size(blocks%parent)
         sibling(c) = child(blocks%parent(c))
         child(blocks%parent(c)) = c
      end do
      do p = 1, size(blocks%parent)
         c = child(p)
         do while (c /= 0)
            if (joined(blocks, c, p)) then
               blocks%into(c) = p
               blocks%columns(p) = blocks%columns(p) + blocks%columns(c)
               blocks%entries(p) = blocks%entries(p) + blocks%entries(c)
            end if
            c = sibling(c)
         end do
      end do
   end subroutine join_children

   ! Whether to merge child c into parent p: if few explicit zeros result. More are accepted in narrow blocks, where index storage
   ! and call overhead weigh more.
   pure logical function joined(blocks, c, p)
      type(blocks_type), intent(in) :: blocks
      integer, intent(in) :: c, p
      integer, parameter :: width(3) = [8, 24, 48]
      real(wp), parameter :: most_zeros(4) = [0.3_wp, 0.1_wp, 0.05_wp, 0.05_wp]
      integer(long) :: columns, all_entries, zeros

      columns = blocks%columns(c) + blocks%columns(p)
      all_entries = columns*(columns + 1)/2 + columns*blocks%rows_below(p)
      zeros = all_entries - blocks%entries(c) - blocks%entries(p)
      joined = real(zeros, wp) <= most_zeros(1 + count(columns > width))*real(all_entries, wp)
   end function joined

   ! Postorders the tree of merged blocks, and splits blocks that are too wide: the parent of a piece is the piece of its last
   ! column's parent, since descendants of a column of a block are adjacent.
   subroutine lay_out(parent, weight, blocks, block_of, sequence, first, above)
      integer, intent(in) :: parent(:), weight(:), block_of(:)
      type(blocks_type), intent(in) :: blocks
      integer, allocatable, intent(out) :: sequence(:), first(:), above(:)
      ! Number of the merged block of each block; their count; the original block of each.
      integer, allocatable :: number(:), whole(:), tree(:), post(:), rank(:)
      ! The first column of each vertex; of each column, its supernode and its vertex.
      integer, allocatable :: place(:), supernode(:), vertex(:)
      integer :: wholes, s, j, k, pieces, piece

      call number_wholes(blocks, number, whole)
      wholes = size(whole)
      allocate (tree(wholes), post(wholes), rank(wholes), source=0)
      do k = 1, wholes
         if (blocks%parent(whole(k)) /= 0) tree(k) = number(blocks%parent(whole(k)))
      end do
      call find_postorder(tree, post)
      do k = 1, wholes
         rank(post(k)) = k
      end do
      call stable_order(rank(number(block_of)), wholes, sequence)

      pieces = sum((blocks%columns(whole) + widest - 1)/widest)
      allocate (first(pieces + 1), above(pieces), source=0)
      first(1) = 1
      s = 0
      do k = 1, wholes
         associate (columns => blocks%columns(whole(post(k))))
            pieces = (columns + widest - 1)/widest
            do piece = 1, pieces
               s = s + 1
               first(s + 1) = first(s) + (columns + piece - 1)/pieces
            end do
         end associate
      end do
      allocate (place(size(parent)), supernode(sum(weight)), vertex(sum(weight)))
      do s = 1, size(above)
         supernode(first(s):first(s + 1) - 1) = s
      end do
      j = 1
      do k = 1, size(sequence)
         place(sequence(k)) = j
         vertex(j:j + weight(sequence(k)) - 1) = sequence(k)
         j = j + weight(sequence(k))
      end do
      do s = 1, size(above)
         associate (next => first(s + 1), last => vertex(first(s + 1) - 1))
            if (next < place(last) + weight(last)) then
               above(s) = s + 1
            else if (parent(last) /= 0) then
               above(s) = supernode(place(parent(last)))
            end if
         end associate
      end do
   end subroutine lay_out

   ! Numbers the merged blocks: `number` of each block, and the block that each merged one is named after.
   pure subroutine number_wholes(blocks, number, whole)
      type(blocks_type), intent(in) :: blocks
      integer, allocatable, intent(out) :: number(:), whole(:)
      integer :: s, k

      allocate (number(size(blocks%into)))
      allocate (whole, source=pack([(s, s=1, size(number))], blocks%into == [(s, s=1, size(number))]))
      do k = size(whole), 1, -1
         number(whole(k)) = k
      end do
      do s = size(number), 1, -1
         number(s) = number(blocks%into(s))
      end do
   end subroutine number_wholes
end module kschur_supernodes
