!> Quotient graph for ordering a constrained matrix: vertices are nodes instead of unknowns; short constraints become cliques of
!> edges, long ones become vertices.
module kschur_quotient_graph
   use, intrinsic :: iso_c_binding, only: c_int32_t
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: long
   use kschur_text, only: text
   implicit none
   private
   public :: contract, graph_type, merge_nodes, quotient_graph, stable_order

   !> The neighbours of vertex v are neighbour(start(v):start(v+1)-1).
   type :: graph_type
      integer, allocatable :: start(:), neighbour(:)
   end type graph_type

   ! Number of entries (row and column) above which a constraint becomes a vertex; a shorter one connects the nodes it
   ! constrains, as its elimination would.
   integer, parameter :: longest_clique = 48

contains

   !> Merges nodes with the same neighbours (indistinguishable nodes) into one vertex; the graph of a solid shrinks to a third
   !> (C. Ashcraft, SIAM J. Sci. Comput. 16 (1995)).
   subroutine merge_nodes(row_start, column, unknowns, nodes, node)
      integer, intent(in) :: row_start(:), column(:), unknowns
      !> Number of nodes, and node of each unknown.
      integer, intent(inout) :: nodes, node(:)
      integer(long), parameter :: prime = 2147483647_long
      ! Unknowns sorted by node: those of v are first(v) ... first(v+1)-1.
      integer, allocatable :: order(:), first(:)
      ! Hash of each neighbour set, the node included: its size and two sums.
      integer(long), allocatable :: marks(:, :)
      ! Chains of nodes with equal hash.
      integer, allocatable :: head(:), next(:), marked_by(:), number(:)
      integer :: merged, v, r

      call stable_order(node(:unknowns), nodes, order, first)
      allocate (head(nodes), next(nodes), number(nodes), source=0)
      allocate (marked_by(nodes + size(row_start) - 1 - unknowns), source=0)
      allocate (marks(3, nodes))
      merged = 0
      do v = 1, nodes
         call mark_neighbours()
         associate (place => head(1 + modulo(sum(marks(:, v)), int(nodes, long))))
            r = place
            do while (r > 0)
               if (all(marks(:, r) == marks(:, v))) then
                  if (neighbours_are_those_of(r)) exit
               end if
               r = next(r)
            end do
            if (r == 0) then
               next(v) = place
               place = v
               merged = merged + 1
               number(v) = merged
            else
               number(v) = number(r)
            end if
         end associate
      end do
      nodes = merged
      node(:unknowns) = number(node(:unknowns))

   contains

      ! Number of a node or multiplier.
      integer function neighbour(k)
         integer, intent(in) :: k

         if (column(k) <= unknowns) then
            neighbour = node(column(k))
         else
            neighbour = nodes + column(k) - unknowns
         end if
      end function neighbour

      ! Marks the neighbours of v, and computes their hash.
      subroutine mark_neighbours()
         integer :: i, k

         marks(:, v) = 0
         call mark(v)
         do i = first(v), first(v + 1) - 1
            do k = row_start(order(i)), row_start(order(i) + 1) - 1
               call mark(neighbour(k))
            end do
         end do
      end subroutine mark_neighbours

      ! Marks w as a neighbour of v, and adds it to the hash, once.
      subroutine mark(w)
         integer, intent(in) :: w

         if (marked_by(w) == v) return
         marked_by(w) = v
         marks(:, v) = marks(:, v) + [1_long, int(w, long), modulo(int(w, long)**2, prime)]
      end subroutine mark

      ! Whether r has the neighbours of v, given equal numbers.
      logical function neighbours_are_those_of(r) result(same)
         integer, intent(in) :: r
         integer :: i, k

         same = marked_by(r) == v
         do i = first(r), first(r + 1) - 1
            do k = row_start(order(i)), row_start(order(i) + 1) - 1
               same = same .and. marked_by(neighbour(k)) == v
            end do
         end do
      end function neighbours_are_those_of
   end subroutine merge_nodes

   !> Builds the symmetric graph of nodes and long constraints, without loops and duplicates; long constraints get new vertices.
   subroutine quotient_graph(row_start, column, unknowns, vertices, vertex, graph, error)
      integer, intent(in) :: row_start(:), column(:), unknowns
      integer, intent(inout) :: vertices, vertex(:)
      type(graph_type), intent(out) :: graph
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: from(:), to(:), members(:), touching_start(:), touching(:), marked_by(:)
      integer(long) :: edges
      integer :: n, pass, i, j, k

      n = size(row_start) - 1
      call constraint_members(row_start, column, unknowns, touching_start, touching)
      do i = unknowns + 1, n
         if (touching_start(i - unknowns + 1) - touching_start(i - unknowns) > longest_clique) then
            vertices = vertices + 1
            vertex(i) = vertices
         end if
      end do

      allocate (marked_by(vertices))
      do pass = 1, 2
         edges = 0
         marked_by = 0
         do i = 1, n
            if (vertex(i) == 0) cycle
            do k = row_start(i), row_start(i + 1) - 1
               j = vertex(column(k))
               if (j == 0) cycle
               ! Most are seen from the unknown before, of the same vertex.
               if (marked_by(j) /= vertex(i)) call add_edge(vertex(i), j)
               marked_by(j) = vertex(i)
            end do
         end do
         do i = unknowns + 1, n
            if (vertex(i) > 0) cycle
            members = touching(touching_start(i - unknowns):touching_start(i - unknowns + 1) - 1)
            do j = 1, size(members)
               do k = 1, j - 1
                  call add_edge(vertex(members(j)), vertex(members(k)))
               end do
            end do
         end do
         if (pass == 2) exit
         ! METIS has 32-bit indices.
         if (2*edges > huge(1_c_int32_t)) then
            call new_error(error, error_library, "METIS could not order the matrix: its graph has more than "// &
               text(huge(1_c_int32_t))//" entries")
            return
         end if
         allocate (from(edges), to(edges))
      end do

      call new_graph(graph, vertices, from, to)

   contains

      ! Counts an edge in the first pass; stores it, in both directions, in the second.
      subroutine add_edge(a, b)
         integer, intent(in) :: a, b

         if (a == b) return
         edges = edges + 1
         if (pass == 1) return
         from(edges) = a
         to(edges) = b
      end subroutine add_edge
   end subroutine quotient_graph

   ! The graph of edges, each of which may be there several times, in one direction or in both.
   subroutine new_graph(graph, vertices, from, to)
      type(graph_type), intent(out) :: graph
      integer, intent(in) :: vertices
      integer, intent(in) :: from(:), to(:)
      type(graph_type) :: both
      integer, allocatable :: next(:), last(:)
      integer :: k, v, p, edges

      allocate (both%start(vertices + 1), next(vertices), last(vertices), source=0)
      do k = 1, size(from)
         next(from(k)) = next(from(k)) + 1
         next(to(k)) = next(to(k)) + 1
      end do
      call begin_lists(both%start, next)
      allocate (both%neighbour(2*size(from)))
      do k = 1, size(from)
         call append(both, from(k), to(k))
         call append(both, to(k), from(k))
      end do
      ! Each once.
      edges = 0
      do v = 1, vertices
         associate (first => both%start(v))
            next(v) = 0
            do p = first, both%start(v + 1) - 1
               if (last(both%neighbour(p)) == v) cycle
               last(both%neighbour(p)) = v
               both%neighbour(first + next(v)) = both%neighbour(p)
               next(v) = next(v) + 1
            end do
         end associate
         edges = edges + next(v)
      end do
      ! In ascending order, as they are appended by ascending vertices.
      last = next
      allocate (graph%start(vertices + 1), graph%neighbour(edges))
      call begin_lists(graph%start, next)
      do v = 1, vertices
         do p = both%start(v), both%start(v) + last(v) - 1
            call append(graph, both%neighbour(p), v)
         end do
      end do

   contains

      ! Of lists that have so many entries; `count` becomes where each begins.
      subroutine begin_lists(start, count)
         integer, intent(out) :: start(:)
         integer, intent(inout) :: count(:)
         integer :: i

         start(1) = 1
         do i = 1, size(count)
            start(i + 1) = start(i) + count(i)
         end do
         count = start(:size(count))
      end subroutine begin_lists

      subroutine append(lists, v, w)
         type(graph_type), intent(inout) :: lists
         integer, intent(in) :: v, w

         lists%neighbour(next(v)) = w
         next(v) = next(v) + 1
      end subroutine append
   end subroutine new_graph

   !> The graph of groups of vertices.
   subroutine contract(graph, groups, group, contracted)
      type(graph_type), intent(in) :: graph
      !> How many there are, and the one of each vertex.
      integer, intent(in) :: groups, group(:)
      type(graph_type), intent(out) :: contracted
      integer, allocatable :: from(:), to(:), marked_by(:)
      integer :: v, p, edges, pass

      allocate (marked_by(groups))
      do pass = 1, 2
         edges = 0
         marked_by = 0
         do v = 1, size(group)
            marked_by(group(v)) = group(v)
            do p = graph%start(v), graph%start(v + 1) - 1
               associate (other => group(graph%neighbour(p)))
                  if (marked_by(other) == group(v)) cycle
                  marked_by(other) = group(v)
                  edges = edges + 1
                  if (pass == 1) cycle
                  from(edges) = group(v)
                  to(edges) = other
               end associate
            end do
         end do
         if (pass == 1) allocate (from(edges), to(edges))
      end do
      call new_graph(contracted, groups, from, to)
   end subroutine contract

   ! The unknowns of each constraint, from its row and column.
   subroutine constraint_members(row_start, column, unknowns, start, member)
      integer, intent(in) :: row_start(:), column(:), unknowns
      integer, allocatable, intent(out) :: start(:), member(:)
      integer :: pass, i, k, n
      integer, allocatable :: next(:)

      n = size(row_start) - 1
      allocate (start(n - unknowns + 1), source=0)
      allocate (next(n - unknowns), source=0)
      do pass = 1, 2
         do i = unknowns + 1, n
            do k = row_start(i), row_start(i + 1) - 1
               if (column(k) <= unknowns) call place(i - unknowns, column(k))
            end do
         end do
         do i = 1, unknowns
            do k = row_start(i), row_start(i + 1) - 1
               if (column(k) > unknowns) call place(column(k) - unknowns, i)
            end do
         end do
         if (pass == 2) exit
         start(1) = 1
         do i = 1, n - unknowns
            start(i + 1) = start(i + 1) + start(i)
         end do
         next = start(:n - unknowns)
         allocate (member(start(n - unknowns + 1) - 1))
      end do

   contains

      ! Counts an unknown of a constraint in the first pass; stores it in the second.
      subroutine place(constraint, unknown)
         integer, intent(in) :: constraint, unknown

         if (pass == 1) then
            start(constraint + 1) = start(constraint + 1) + 1
         else
            member(next(constraint)) = unknown
            next(constraint) = next(constraint) + 1
         end if
      end subroutine place
   end subroutine constraint_members

   !> Stable counting sort of positions 1..size(key) by key (1..keys).
   pure subroutine stable_order(key, keys, order, first)
      integer, intent(in) :: key(:), keys
      integer, allocatable, intent(out) :: order(:)
      !> Positions of key k are order(first(k):first(k + 1) - 1); size keys + 1.
      integer, allocatable, intent(out), optional :: first(:)
      integer, allocatable :: next(:)
      integer :: i

      allocate (next(keys + 1), source=0)
      allocate (order(size(key)))
      do i = 1, size(key)
         next(key(i) + 1) = next(key(i) + 1) + 1
      end do
      next(1) = 1
      do i = 1, keys
         next(i + 1) = next(i + 1) + next(i)
      end do
      if (present(first)) allocate (first, source=next)
      do i = 1, size(key)
         order(next(key(i))) = i
         next(key(i)) = next(key(i)) + 1
      end do
   end subroutine stable_order
end module kschur_quotient_graph
