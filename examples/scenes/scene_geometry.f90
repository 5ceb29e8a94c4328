!> Where a scene stands in space, for pictures of its modes: points that move with three of the unknowns, and the
!> cells between them.
module scene_geometry
   use kschur, only: wp
   implicit none
   private
   public :: geometry_type

   !> Points and cells; only the first `points` and `cells` columns count.
   type :: geometry_type
      integer :: points = 0, cells = 0
      !> Positions (m), 3 x points.
      real(wp), allocatable :: position(:, :)
      !> Unknowns that are the translations of a point, 3 x points; 0 where it is held still.
      integer, allocatable :: places(:, :)
      !> Points of each cell, 4 x cells: one, a line of two or a tetrahedron of four; 0 fills up.
      integer, allocatable :: cell(:, :)
   contains
      !> Adds points and the lines from each to the next; of a single point the point itself.
      procedure :: add_line
      !> Adds points and the tetrahedra between them.
      procedure :: add_tetrahedra
   end type geometry_type

contains

   pure subroutine add_line(self, position, places)
      class(geometry_type), intent(inout) :: self
      !> Positions (m) and unknowns of the points, 3 x points each.
      real(wp), intent(in) :: position(:, :)
      integer, intent(in) :: places(:, :)
      integer :: i

      if (size(position, 2) == 1) then
         call add(self, position, places, reshape([1, 0, 0, 0], [4, 1]))
      else
         call add(self, position, places, reshape([(i, i + 1, 0, 0, i=1, size(position, 2) - 1)], &
            [4, size(position, 2) - 1]))
      end if
   end subroutine add_line

   pure subroutine add_tetrahedra(self, position, places, cell)
      class(geometry_type), intent(inout) :: self
      !> Positions (m) and unknowns of the points, 3 x points each.
      real(wp), intent(in) :: position(:, :)
      integer, intent(in) :: places(:, :)
      !> Points of the tetrahedra, 4 x tetrahedra, counted among those that are added.
      integer, intent(in) :: cell(:, :)

      call add(self, position, places, cell)
   end subroutine add_tetrahedra

   pure subroutine add(geometry, position, places, cell)
      type(geometry_type), intent(inout) :: geometry
      real(wp), intent(in) :: position(:, :)
      integer, intent(in) :: places(:, :), cell(:, :)

      associate (p => geometry%points, c => geometry%cells, p_more => size(position, 2), c_more => size(cell, 2))
         call make_room(geometry, p + p_more, c + c_more)
         geometry%position(:, p + 1:p + p_more) = position
         geometry%places(:, p + 1:p + p_more) = places
         geometry%cell(:, c + 1:c + c_more) = merge(cell + p, 0, cell > 0)
         c = c + c_more
         p = p + p_more
      end associate
   end subroutine add

   ! Doubles the arrays that are too small.
   pure subroutine make_room(geometry, points, cells)
      type(geometry_type), intent(inout) :: geometry
      integer, intent(in) :: points, cells
      real(wp), allocatable :: position(:, :)
      integer, allocatable :: places(:, :), cell(:, :)
      integer :: room(2)

      room = 0
      if (allocated(geometry%cell)) room = [size(geometry%places, 2), size(geometry%cell, 2)]
      if (points > room(1)) then
         allocate (position(3, max(points, 2*room(1))), places(3, max(points, 2*room(1))))
         if (geometry%points > 0) then
            position(:, :geometry%points) = geometry%position(:, :geometry%points)
            places(:, :geometry%points) = geometry%places(:, :geometry%points)
         end if
         call move_alloc(position, geometry%position)
         call move_alloc(places, geometry%places)
      end if
      if (cells > room(2)) then
         allocate (cell(4, max(cells, 2*room(2))))
         if (geometry%cells > 0) cell(:, :geometry%cells) = geometry%cell(:, :geometry%cells)
         call move_alloc(cell, geometry%cell)
      end if
   end subroutine make_room
end module scene_geometry
