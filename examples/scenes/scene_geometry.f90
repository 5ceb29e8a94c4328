!> Where a scene stands in space, for pictures of its modes: points that move with some of the unknowns, and the cells
!> between them.
module scene_geometry
   use kschur, only: error_type, mesh_type, settle_mesh, vtk_line, vtk_vertex, wp
   implicit none
   private
   public :: geometry_type

   !> Most points of a cell: those of a quadratic tetrahedron.
   integer, parameter :: most_corners = 10

   !> Points and cells; only the first `points` and `cells` columns count.
   type :: geometry_type
      integer :: points = 0, cells = 0
      !> Positions (m), 3 x points.
      real(wp), allocatable :: position(:, :)
      !> Unknowns that are the translations and rotations of a point, 6 x points; 0 where it is held still or has none.
      integer, allocatable :: places(:, :)
      !> Points of each cell, `most_corners` x cells, in VTK's order; 0 fills up. And VTK's numbers of what they are.
      integer, allocatable :: cell(:, :), types(:)
   contains
      !> Adds points and the lines from each to the next; of a single point the point itself.
      procedure :: add_line
      !> Adds points and the cells of one kind between them.
      procedure :: add_cells
      !> Makes the mesh of a problem, points that move together being one node.
      procedure :: make_mesh
   end type geometry_type

contains

   pure subroutine add_line(self, position, places)
      class(geometry_type), intent(inout) :: self
      !> Positions (m) of the points, 3 x points, and their unknowns: the first few of six, translations before rotations.
      real(wp), intent(in) :: position(:, :)
      integer, intent(in) :: places(:, :)
      integer :: i

      if (size(position, 2) == 1) then
         call self%add_cells(position, places, reshape([1], [1, 1]), vtk_vertex)
      else
         call self%add_cells(position, places, reshape([(i, i + 1, i=1, size(position, 2) - 1)], &
            [2, size(position, 2) - 1]), vtk_line)
      end if
   end subroutine add_line

   pure subroutine add_cells(self, position, places, cell, kind)
      class(geometry_type), intent(inout) :: self
      !> Positions (m) of the points, 3 x points, and their unknowns: the first few of six, translations before rotations.
      real(wp), intent(in) :: position(:, :)
      integer, intent(in) :: places(:, :)
      !> Points of the cells, corners x cells, counted among those that are added, in VTK's order.
      integer, intent(in) :: cell(:, :)
      !> VTK's number of such a cell.
      integer, intent(in) :: kind

      associate (p => self%points, c => self%cells, p_more => size(position, 2), c_more => size(cell, 2))
         call make_room(self, p + p_more, c + c_more)
         self%position(:, p + 1:p + p_more) = position
         self%places(:, p + 1:p + p_more) = 0
         self%places(:size(places, 1), p + 1:p + p_more) = places
         self%cell(:, c + 1:c + c_more) = 0
         self%cell(:size(cell, 1), c + 1:c + c_more) = cell + p
         self%types(c + 1:c + c_more) = kind
         c = c + c_more
         p = p + p_more
      end associate
   end subroutine add_cells

   subroutine make_mesh(self, unknowns, mesh, error)
      class(geometry_type), intent(in) :: self
      !> How many the problem has; those of no point are none of the mesh.
      integer, intent(in) :: unknowns
      !> Not allocated where there are no points.
      type(mesh_type), allocatable, intent(out) :: mesh
      type(error_type), allocatable, intent(inout) :: error
      integer :: node(self%points), corners(self%cells), nodes, p, c

      if (self%points == 0) return
      allocate (mesh)
      allocate (mesh%unknown_node(unknowns), mesh%unknown_component(unknowns), source=0)
      allocate (mesh%coordinates(3, self%points))
      nodes = 0
      do p = 1, self%points
         node(p) = node_of(self%places(:, p), mesh%unknown_node)
         if (node(p) > 0) cycle
         nodes = nodes + 1
         node(p) = nodes
         mesh%coordinates(:, nodes) = self%position(:, p)
         do c = 1, 6
            if (self%places(c, p) == 0) cycle
            mesh%unknown_node(self%places(c, p)) = nodes
            mesh%unknown_component(self%places(c, p)) = c - 1
         end do
      end do
      mesh%coordinates = mesh%coordinates(:, :nodes)
      corners = count(self%cell(:, :self%cells) > 0, 1)
      allocate (mesh%offsets(self%cells + 1), source=0)
      do c = 1, self%cells
         mesh%offsets(c + 1) = mesh%offsets(c) + corners(c)
      end do
      allocate (mesh%connectivity(sum(corners)))
      do c = 1, self%cells
         mesh%connectivity(mesh%offsets(c) + 1:mesh%offsets(c + 1)) = node(self%cell(:corners(c), c))
      end do
      allocate (mesh%types(self%cells), source=self%types(:self%cells))
      call settle_mesh(mesh, unknowns, error)
   end subroutine make_mesh

   ! That of the first of these unknowns which has one; 0 where none has.
   pure integer function node_of(places, unknown_node)
      integer, intent(in) :: places(:), unknown_node(:)
      integer :: c

      node_of = 0
      do c = 1, size(places)
         if (places(c) > 0 .and. node_of == 0) node_of = unknown_node(places(c))
      end do
   end function node_of

   ! Doubles the arrays that are too small.
   pure subroutine make_room(geometry, points, cells)
      type(geometry_type), intent(inout) :: geometry
      integer, intent(in) :: points, cells
      real(wp), allocatable :: position(:, :)
      integer, allocatable :: places(:, :), cell(:, :), types(:)
      integer :: room(2)

      room = 0
      if (allocated(geometry%cell)) room = [size(geometry%places, 2), size(geometry%cell, 2)]
      if (points > room(1)) then
         allocate (position(3, max(points, 2*room(1))), places(6, max(points, 2*room(1))))
         if (geometry%points > 0) then
            position(:, :geometry%points) = geometry%position(:, :geometry%points)
            places(:, :geometry%points) = geometry%places(:, :geometry%points)
         end if
         call move_alloc(position, geometry%position)
         call move_alloc(places, geometry%places)
      end if
      if (cells > room(2)) then
         allocate (cell(most_corners, max(cells, 2*room(2))), types(max(cells, 2*room(2))))
         if (geometry%cells > 0) then
            cell(:, :geometry%cells) = geometry%cell(:, :geometry%cells)
            types(:geometry%cells) = geometry%types(:geometry%cells)
         end if
         call move_alloc(cell, geometry%cell)
         call move_alloc(types, geometry%types)
      end if
   end subroutine make_room
end module scene_geometry
