!> Fill-reducing elimination orders by METIS nested dissection, adapted to constraints: unknowns of a node stay together, and
!> each multiplier follows the unknowns it constrains, unless these are constrained very often or are the anchors of a body.
module kschur_ordering
   use, intrinsic :: iso_c_binding, only: c_int32_t, c_int
   use kschur_anchors, only: anchors_of
   use kschur_elimination_tree, only: find_elimination_tree, multiplications
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_lock, only: acquire_lock, release_lock, lock_metis
   use kschur_mesh_nodes, only: find_mesh_nodes
   use kschur_minimum_degree, only: minimum_degree_order
   use kschur_quotient_graph, only: contract, graph_type, merge_nodes, quotient_graph, stable_order
   use kschur_text, only: text
   implicit none
   private
   public :: elimination_order

   integer, parameter :: metis_ok = 1
   integer, parameter :: metis_options = 40
   ! Position of METIS_OPTION_NUMBERING, counted from 1.
   integer, parameter :: metis_numbering = 18

   ! Number of constraint entries (rows and columns) from which on an unknown is a hub: eliminated before its multipliers, it
   ! would couple them all (dense fill).
   integer, parameter :: most_touches = 256

   ! At more multiplications for each entry of a matrix METIS is tried too: nested dissection, which takes as long as some
   ! thousand for each, pays in solids.
   real(wp), parameter :: solid_work = 4000

   interface
      integer(c_int) function metis_setdefaultoptions(options) bind(C, name="METIS_SetDefaultOptions")
         import :: c_int, c_int32_t
         integer(c_int32_t), intent(out) :: options(*)
      end function metis_setdefaultoptions

      integer(c_int) function metis_nodend(vertices, start, neighbour, weight, options, old_of_new, new_of_old) &
         bind(C, name="METIS_NodeND")
         import :: c_int, c_int32_t
         integer(c_int32_t), intent(in) :: vertices, start(*), neighbour(*), weight(*), options(*)
         integer(c_int32_t), intent(out) :: old_of_new(*), new_of_old(*)
      end function metis_nodend

      subroutine c_hold_sigterm() bind(C, name="kschur_hold_sigterm")
      end subroutine c_hold_sigterm

      subroutine c_let_sigterm() bind(C, name="kschur_let_sigterm")
      end subroutine c_let_sigterm
   end interface

contains

   !> position(i) is the position of unknown i in the elimination order of a square matrix of the given pattern (CSR, 1-based,
   !> not necessarily symmetric); taken from `structure` if given there.
   subroutine elimination_order(row_start, column, structure, position, error)
      integer, intent(in) :: row_start(:), column(:)
      type(matrix_structure_type), intent(in) :: structure
      integer, allocatable, intent(out) :: position(:)
      type(error_type), allocatable, intent(out) :: error
      type(graph_type) :: graph
      integer, allocatable :: vertex(:), rank(:), last(:), order(:), weight(:), constraint_entries(:), anchor(:)
      logical, allocatable :: hub(:)
      integer :: n, unknowns, nodes, vertices, i, k

      if (allocated(structure%position)) then
         allocate (position, source=structure%position)
         return
      end if
      n = size(row_start) - 1
      unknowns = n - structure%multipliers
      allocate (vertex, source=structure%nodes(n))
      vertex(unknowns + 1:) = 0
      nodes = maxval([0, vertex])
      call merge_nodes(row_start, column, unknowns, nodes, vertex)
      vertices = nodes
      call quotient_graph(row_start, column, unknowns, vertices, vertex, graph, error)
      if (allocated(error)) return
      allocate (weight, source=members(vertex, vertices))
      if (structure%multipliers > 0) then
         call dissect_nodes(graph, weight, nodes, rank, error)
      else
         call order_unconstrained(row_start, column, vertex, graph, weight, rank, error)
      end if
      if (allocated(error)) return

      ! A multiplier gets the rank of the last unknown it constrains, hubs excepted unless it constrains hubs only; among equal
      ! ranks it comes last since its index is higher.
      allocate (constraint_entries, source=touches(row_start, column, unknowns))
      allocate (hub(unknowns), source=constraint_entries > most_touches)
      allocate (last(n), source=0)
      do i = 1, n
         if (vertex(i) > 0) last(i) = rank(vertex(i))
      end do
      where (hub) last(:unknowns) = vertices
      do i = 1, unknowns
         if (hub(i)) cycle
         do k = row_start(i), row_start(i + 1) - 1
            if (column(k) > unknowns) last(column(k)) = max(last(column(k)), last(i))
         end do
      end do
      do i = unknowns + 1, n
         do k = row_start(i), row_start(i + 1) - 1
            if (column(k) > unknowns) cycle
            if (.not. hub(column(k))) last(i) = max(last(i), last(column(k)))
         end do
         if (last(i) == 0) last(i) = vertices
      end do
      if (structure%multipliers > 0) then
         anchor = anchors_of(row_start, column, vertex(:unknowns), constraint_entries == 0)
         where (anchor > 0) last(:unknowns) = vertices + anchor
      end if
      call stable_order(last, maxval([0, last]), order)
      allocate (position(n))
      do i = 1, n
         position(order(i)) = i
      end do
   end subroutine elimination_order

   ! How many unknowns, or long constraints, each vertex is.
   pure function members(vertex, vertices) result(weight)
      integer, intent(in) :: vertex(:), vertices
      integer :: weight(vertices), i

      weight = 0
      do i = 1, size(vertex)
         if (vertex(i) > 0) weight(vertex(i)) = weight(vertex(i)) + 1
      end do
   end function members

   ! rank(v) is the place of vertex v of a matrix without multipliers.
   subroutine order_unconstrained(row_start, column, vertex, graph, weight, rank, error)
      integer, intent(in) :: row_start(:), column(:), vertex(:)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: weight(:)
      integer, allocatable, intent(out) :: rank(:)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: other(:)
      real(wp) :: operations

      call minimum_degree_order(graph%start, graph%neighbour, rank, error)
      if (allocated(error)) return
      operations = operations_of(graph, weight, rank)
      if (operations > solid_work*size(column)) then
         call dissect_nodes(graph, weight, size(weight), other, error)
      else if (size(vertex) > 2*size(weight) .and. maxval(weight) > minval(weight)) then
         call order_by_unknowns(row_start, column, vertex, size(weight), other, error)
      else
         return
      end if
      if (allocated(error)) return
      if (operations_of(graph, weight, other) < operations) call move_alloc(other, rank)
   end subroutine order_unconstrained

   ! By minimum degree, which takes a vertex for one unknown, however many it has: where most unknowns share theirs, and some
   ! do not, its degrees are far from those of the matrix.
   subroutine order_by_unknowns(row_start, column, vertex, vertices, rank, error)
      integer, intent(in) :: row_start(:), column(:), vertex(:), vertices
      integer, allocatable, intent(out) :: rank(:)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: position(:), order(:)
      logical :: done(vertices)
      integer :: i, k

      call minimum_degree_order(row_start, column, position, error)
      if (allocated(error)) return
      allocate (order(size(position)), rank(vertices))
      order(position) = [(i, i=1, size(position))]
      done = .false.
      k = 0
      do i = 1, size(order)
         associate (v => vertex(order(i)))
            if (done(v)) cycle
            done(v) = .true.
            k = k + 1
            rank(v) = k
         end associate
      end do
   end subroutine order_by_unknowns

   ! Of an order of elimination.
   real(wp) function operations_of(graph, weight, rank) result(operations)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: weight(:), rank(:)
      integer, allocatable :: order(:), place(:), parent(:), entries(:)
      integer :: v

      allocate (order(size(rank)), parent(size(rank)), entries(size(rank)))
      allocate (place, source=rank)
      order(rank) = [(v, v=1, size(rank))]
      call find_elimination_tree(graph%start, graph%neighbour, weight, order, place, parent, entries)
      operations = multiplications(weight(order), entries)
   end function operations_of

   ! Number of constraint entries of each unknown.
   pure function touches(row_start, column, unknowns)
      integer, intent(in) :: row_start(:), column(:), unknowns
      integer :: touches(unknowns), i, k

      touches = 0
      do i = 1, size(row_start) - 1
         do k = row_start(i), row_start(i + 1) - 1
            if (i <= unknowns .and. column(k) > unknowns) touches(i) = touches(i) + 1
            if (i > unknowns .and. column(k) <= unknowns) touches(column(k)) = touches(column(k)) + 1
         end do
      end do
   end function touches

   ! By mesh nodes, to which the first vertices belong.
   subroutine dissect_nodes(graph, weight, unknown_vertices, rank, error)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: weight(:), unknown_vertices
      integer, allocatable, intent(out) :: rank(:)
      type(error_type), allocatable, intent(out) :: error
      type(graph_type) :: contracted
      integer, allocatable :: node(:), node_weight(:), node_rank(:), order(:)
      integer :: nodes, v

      call find_mesh_nodes(graph, weight(:unknown_vertices), nodes, node)
      if (nodes == size(weight)) then
         call nested_dissection(graph, weight, rank, error)
         return
      end if
      call contract(graph, nodes, node, contracted)
      allocate (node_weight(nodes), source=0)
      do v = 1, size(weight)
         node_weight(node(v)) = node_weight(node(v)) + weight(v)
      end do
      call nested_dissection(contracted, node_weight, node_rank, error)
      if (allocated(error)) return
      call stable_order(node_rank(node), nodes, order)
      allocate (rank(size(weight)))
      rank(order) = [(v, v=1, size(weight))]
   end subroutine dissect_nodes

   ! Calls METIS: rank(v) is the position of vertex v in a nested dissection order.
   subroutine nested_dissection(graph, weight, rank, error)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: weight(:)
      integer, allocatable, intent(out) :: rank(:)
      type(error_type), allocatable, intent(out) :: error
      integer(c_int32_t) :: options(metis_options)
      integer(c_int32_t), allocatable :: old_of_new(:)
      integer :: status, vertices, i

      vertices = size(graph%start) - 1
      allocate (rank(vertices), source=[(i, i=1, vertices)])
      if (size(graph%neighbour) == 0) return
      allocate (old_of_new(vertices))
      status = metis_setdefaultoptions(options)
      options(metis_numbering) = 1
      call acquire_lock(lock_metis)
      ! METIS installs its own SIGTERM handler, which would jump out of any code, even malloc: the signal is blocked meanwhile.
      call c_hold_sigterm()
      status = metis_nodend(vertices, graph%start, graph%neighbour, weight, options, old_of_new, rank)
      call c_let_sigterm()
      call release_lock(lock_metis)
      if (status /= metis_ok) call new_error(error, error_library, &
         "METIS could not order the matrix: METIS_NodeND returned "//text(status))
   end subroutine nested_dissection
end module kschur_ordering
