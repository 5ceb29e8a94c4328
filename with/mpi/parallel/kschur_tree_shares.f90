!> Shares of an elimination tree: each process has some subtrees, and some rows of what is above them all, the common supernodes.
module kschur_tree_shares
   use kschur_kinds, only: wp, long
   use kschur_memory, only: integer_bytes, real_bytes
   use kschur_shared_fronts, only: common_tree_type, process_of_row
   use kschur_sorting, only: ascending_order
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: largest_share, owners_of_supernodes, take_common, take_share, take_values

   !> Owner of a common supernode.
   integer, parameter, public :: common_owner = -1

   ! More loads are not sorted: they are small then.
   integer, parameter :: most_sorted = 1000

   ! Multiplications that cost as much as to send an entry of a common supernode to all (8 bytes at 2 GB/s); as one of a diagonal
   ! block, which the first process factors while others wait, without long products.
   real(wp), parameter :: sending = 64, waiting = 4

   ! A tree whose subtrees are shared.
   type :: tree_type
      ! Children of a supernode: first_child, next_sibling(first_child) ...; 0 at the end.
      integer, allocatable :: first_child(:), next_sibling(:)
      ! Multiplications of each supernode, with the updates by it, and of its subtree.
      real(wp), allocatable :: operations(:), subtree(:)
      ! What a supernode costs if it is common, counted in multiplications of each process.
      real(wp), allocatable :: shared(:)
   end type tree_type

contains

   !> The process, from 0, that has each supernode; `common_owner` of common ones. The largest subtree is cut open at its root, as
   !> long as that lets the processes end earlier: the one with most operations, and after it all with the common supernodes.
   !> Subtrees go to the process with the least so far, the largest first.
   function owners_of_supernodes(symbolic, processes) result(owner)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: processes
      integer, allocatable :: owner(:)
      type(tree_type) :: tree
      ! Subtrees, by their roots, and the process of each; the best so far.
      integer, allocatable :: roots(:), of_root(:), best_roots(:), best_of_root(:)
      real(wp) :: common, most, least
      integer :: nodes, largest, s, k

      nodes = size(symbolic%first) - 1
      call find_tree(symbolic, processes, tree, roots)
      common = 0
      allocate (best_roots, source=roots)
      call assign(tree%subtree(roots), processes, best_of_root, least)
      do
         call assign(tree%subtree(roots), processes, of_root, most)
         if (common + most < least) then
            least = common + most
            best_roots = roots
            best_of_root = of_root
         end if
         if (size(roots) == 0) exit
         largest = maxloc(tree%subtree(roots), dim=1)
         s = roots(largest)
         common = common + tree%shared(s)
         if (common >= least) exit
         roots = [roots(:largest - 1), children(tree, s), roots(largest + 1:)]
      end do
      allocate (owner(nodes), source=common_owner)
      owner(best_roots) = best_of_root
      ! Children have lower numbers than their parents.
      do s = nodes, 1, -1
         if (owner(s) == common_owner) cycle
         k = tree%first_child(s)
         do while (k /= 0)
            owner(k) = owner(s)
            k = tree%next_sibling(k)
         end do
      end do
   end function owners_of_supernodes

   !> Bytes of the factors of the process that has most, of their row indices, and of the work arrays of one thread.
   real(wp) function largest_share(symbolic, processes) result(bytes)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: processes
      integer, allocatable :: owner(:)
      real(wp) :: share(0:processes - 1), columns, rows, most
      integer :: s

      owner = owners_of_supernodes(symbolic, processes)
      share = 0
      most = 0
      do s = 1, size(owner)
         columns = symbolic%first(s + 1) - symbolic%first(s)
         rows = real(symbolic%start(s + 1) - symbolic%start(s), wp)
         if (owner(s) == common_owner) then
            share = share + real_bytes*columns*((columns - 1)/2 + rows/processes) + 2*integer_bytes*rows
         else
            share(owner(s)) = share(owner(s)) + real_bytes*columns*((columns - 1)/2 + rows) + integer_bytes*rows
         end if
         most = max(most, columns*(columns + rows))
      end do
      bytes = maxval(share) + 3*real_bytes*most + symbolic%update_bytes() + 6*integer_bytes*size(symbolic%order)
   end function largest_share

   subroutine find_tree(symbolic, processes, tree, roots)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: processes
      type(tree_type), intent(out) :: tree
      integer, allocatable, intent(out) :: roots(:)
      integer :: parent(size(symbolic%first) - 1), nodes, s
      real(wp) :: columns, rows

      nodes = size(parent)
      allocate (tree%operations(nodes), tree%subtree(nodes), tree%shared(nodes))
      allocate (tree%first_child(nodes), tree%next_sibling(nodes), source=0)
      parent = 0
      do s = 1, nodes
         if (symbolic%start(s) < symbolic%start(s + 1)) parent(s) = symbolic%supernode(symbolic%row(symbolic%start(s)))
         columns = symbolic%first(s + 1) - symbolic%first(s)
         rows = real(symbolic%start(s + 1) - symbolic%start(s), wp)
         tree%operations(s) = columns*(columns**2/3 + columns*rows + rows**2)/2
         tree%shared(s) = tree%operations(s)/processes + sending*columns*(columns + rows) + waiting*columns**3/6
      end do
      tree%subtree = tree%operations
      do s = 1, nodes
         if (parent(s) > 0) tree%subtree(parent(s)) = tree%subtree(parent(s)) + tree%subtree(s)
      end do
      do s = nodes, 1, -1
         if (parent(s) == 0) cycle
         tree%next_sibling(s) = tree%first_child(parent(s))
         tree%first_child(parent(s)) = s
      end do
      roots = pack([(s, s=1, nodes)], parent == 0)
   end subroutine find_tree

   pure function children(tree, s)
      type(tree_type), intent(in) :: tree
      integer, intent(in) :: s
      integer, allocatable :: children(:)
      integer :: k

      allocate (children(0))
      k = tree%first_child(s)
      do while (k /= 0)
         children = [children, k]
         k = tree%next_sibling(k)
      end do
   end function children

   ! Gives each of some loads to a process, and returns the most that one has.
   subroutine assign(loads, processes, of_load, most)
      real(wp), intent(in) :: loads(:)
      integer, intent(in) :: processes
      integer, allocatable, intent(out) :: of_load(:)
      real(wp), intent(out) :: most
      integer :: order(size(loads)), i, p
      real(wp) :: load(0:processes - 1)

      order = [(i, i=1, size(loads))]
      if (size(loads) <= most_sorted) order = ascending_order(-loads)
      allocate (of_load(size(loads)))
      load = 0
      do i = 1, size(loads)
         p = minloc(load, dim=1) - 1
         of_load(order(i)) = p
         load(p) = load(p) + loads(order(i))
      end do
      most = maxval(load)
   end subroutine assign

   !> The common supernodes.
   subroutine take_common(symbolic, owner, common)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: owner(:)
      type(common_tree_type), intent(out) :: common
      integer, allocatable :: node(:)
      integer :: place(size(symbolic%order)), i, j, s, columns

      node = pack([(s, s=1, size(owner))], owner == common_owner)
      allocate (common%first(size(node) + 1), common%start(size(node) + 1))
      common%start(1) = 1
      columns = 0
      do i = 1, size(node)
         common%first(i) = columns + 1
         do j = symbolic%first(node(i)), symbolic%first(node(i) + 1) - 1
            columns = columns + 1
            place(j) = columns
         end do
         common%start(i + 1) = common%start(i) + symbolic%start(node(i) + 1) - symbolic%start(node(i))
      end do
      common%first(size(node) + 1) = columns + 1
      allocate (common%row(common%start(size(node) + 1) - 1))
      do i = 1, size(node)
         common%row(common%start(i):common%start(i + 1) - 1) = place(symbolic%row(symbolic%start(node(i)): &
            symbolic%start(node(i) + 1) - 1))
      end do
   end subroutine take_common

   !> The share of a process: its supernodes, then the common ones, with its rows of these only, and with columns counted anew in
   !> this order. Without `supernode`, `order` and `position`, which are those of the identity.
   subroutine take_share(symbolic, owner, process, common, processes, share, unknown, column, place)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: owner(:), process, processes
      type(common_tree_type), intent(in) :: common
      type(symbolic_type), intent(out) :: share
      !> Rows of the matrix that it has, and the column of each; of each column of the whole, that in the share, 0 if it has none.
      integer, allocatable, intent(out) :: unknown(:), column(:), place(:)
      integer, allocatable :: node(:), rows(:)
      integer :: s, i, j, own, columns
      integer(long) :: k

      node = pack([(s, s=1, size(owner))], owner == process)
      own = size(node)
      node = [node, pack([(s, s=1, size(owner))], owner == common_owner)]
      allocate (share%first(size(node) + 1), share%start(size(node) + 1), place(size(symbolic%order)))
      place = 0
      columns = 0
      do i = 1, size(node)
         share%first(i) = columns + 1
         do j = symbolic%first(node(i)), symbolic%first(node(i) + 1) - 1
            columns = columns + 1
            place(j) = columns
         end do
      end do
      share%first(size(node) + 1) = columns + 1
      associate (before => share%first(own + 1) - 1)
         column = [[(j, j=1, before)], before + pack([(j, j=1, columns - before)], &
            process_of_row([(j, j=1, columns - before)], processes) == process)]
         allocate (unknown(columns))
         do j = 1, size(place)
            if (place(j) > 0) unknown(place(j)) = symbolic%order(j)
         end do
         unknown = unknown(column)
         k = sum([(symbolic%start(node(i) + 1) - symbolic%start(node(i)), i=1, own)]) + &
            count(process_of_row(common%row, processes) == process)
         allocate (share%row(k))
         share%start(1) = 1
         do i = 1, size(node)
            rows = place(symbolic%row(symbolic%start(node(i)):symbolic%start(node(i) + 1) - 1))
            if (i > own) rows = pack(rows, process_of_row(rows - before, processes) == process)
            share%start(i + 1) = share%start(i) + size(rows)
            share%row(share%start(i):share%start(i + 1) - 1) = rows
         end do
      end associate
   end subroutine take_share

   !> The lower triangle of the matrix in a share, by columns: all entries of columns before the common ones, and of these the
   !> entries in rows that the process has.
   subroutine take_values(matrix, symbolic, own, column, place, values)
      type(csr_matrix_type), intent(in) :: matrix
      type(symbolic_type), intent(in) :: symbolic
      !> Number of columns before the common ones.
      integer, intent(in) :: own
      !> As from `take_share`.
      integer, intent(in) :: column(:), place(:)
      type(csr_matrix_type), intent(out) :: values
      logical :: is_here(maxval(place))
      integer :: row(maxval(place)), to(size(place)), j, p, k, entries, pass

      values%rows = size(row)
      values%columns = size(row)
      is_here = .false.
      is_here(column) = .true.
      do j = 1, size(place)
         if (place(j) > 0) row(place(j)) = symbolic%order(j)
      end do
      ! The column of each unknown in the share.
      to = place(symbolic%position)
      allocate (values%row_start(size(row) + 1))
      do pass = 1, 2
         entries = 0
         do j = 1, size(row)
            values%row_start(j) = entries + 1
            do p = matrix%row_start(row(j)), matrix%row_start(row(j) + 1) - 1
               k = to(matrix%column(p))
               if (k < j) cycle
               if (j > own .and. .not. is_here(k)) cycle
               entries = entries + 1
               if (pass == 1) cycle
               values%column(entries) = k
               values%value(entries) = matrix%value(p)
            end do
         end do
         values%row_start(size(row) + 1) = entries + 1
         if (pass == 1) allocate (values%column(entries), values%value(entries))
      end do
   end subroutine take_values
end module kschur_tree_shares
