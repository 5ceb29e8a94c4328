!> Boxes of tetrahedra: linear, isotropic, four nodes of three translations (m) each.
module scene_solid
   use kschur, only: vtk_tetrahedron, wp
   use scene_assembly, only: assembly_type
   use scene_vectors, only: cross
   implicit none
   private
   public :: add_box, box_face, box_type, shape_gradients, tetrahedron_mass, tetrahedron_stiffness

   !> A box of equal cells, each split into six tetrahedra.
   type :: box_type
      !> Young's modulus (Pa), Poisson's ratio, density (kg/m^3).
      real(wp) :: youngs_modulus, poisson_ratio, density
      !> Number of cells and edges (m) along the box's own axes.
      integer :: cells(3)
      real(wp) :: edges(3)
      !> The corner where its axes start (m), and their unit vectors as columns.
      real(wp) :: corner(3), axes(3, 3)
   contains
      !> Number of nodes.
      procedure :: nodes
   end type box_type

   !> Corners of a cell in turn, and the six tetrahedra around its long diagonal: neighbours fit each other.
   integer, parameter, public :: cell_corners(3, 8) = reshape( &
      [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1], [3, 8])
   integer, parameter, public :: tetrahedra(4, 6) = reshape( &
      [1, 2, 4, 8, 1, 4, 3, 8, 1, 3, 7, 8, 1, 7, 5, 8, 1, 5, 6, 8, 1, 6, 2, 8], [4, 6])

contains

   pure integer function nodes(self)
      class(box_type), intent(in) :: self

      nodes = product(self%cells + 1)
   end function nodes

   !> Adds the box; its nodes follow each other along the first axis, then the second.
   pure subroutine add_box(assembly, box, before, rayleigh)
      type(assembly_type), intent(inout) :: assembly
      type(box_type), intent(in) :: box
      !> Unknowns before those of the box.
      integer, intent(in) :: before
      !> alpha (1/s) and beta (s) of the Rayleigh damping.
      real(wp), intent(in) :: rayleigh(2)
      real(wp) :: mass(24, 24), stiffness(24, 24), corners(3, 8), position(3, box%nodes())
      integer :: corner(8), cell(4, 6*product(box%cells)), i, j, k, c, t, cells

      corners = matmul(box%axes, cell_corners*spread(box%edges/box%cells, 2, 8))
      mass = 0
      stiffness = 0
      do t = 1, size(tetrahedra, 2)
         associate (corner => tetrahedra(:, t))
            associate (places => [([(3*(corner(c) - 1) + i, i=1, 3)], c=1, 4)])
               mass(places, places) = mass(places, places) + tetrahedron_mass(corners(:, corner), box%density)
               stiffness(places, places) = stiffness(places, places) &
                  + tetrahedron_stiffness(corners(:, corner), box%youngs_modulus, box%poisson_ratio)
            end associate
         end associate
      end do

      cells = 0
      do k = 0, box%cells(3) - 1
         do j = 0, box%cells(2) - 1
            do i = 0, box%cells(1) - 1
               corner = [(node_at(box, [i, j, k] + cell_corners(:, c)), c=1, 8)]
               call assembly%add_element([([(before + 3*(corner(c) - 1) + t, t=1, 3)], c=1, 8)], mass, stiffness, rayleigh)
               do t = 1, size(tetrahedra, 2)
                  cells = cells + 1
                  cell(:, cells) = corner(tetrahedra(:, t))
               end do
            end do
         end do
      end do
      do t = 1, size(position, 2)
         position(:, t) = node_position(box, t)
      end do
      call assembly%geometry%add_cells(position, reshape([(before + t, t=1, 3*size(position, 2))], shape(position)), cell, &
         vtk_tetrahedron)
   end subroutine add_box

   !> The nodes of a face across the first axis.
   pure subroutine box_face(box, before, far, places, arms)
      type(box_type), intent(in) :: box
      integer, intent(in) :: before
      !> The face at the far end of the axis, or the one where it starts.
      logical, intent(in) :: far
      !> Their unknowns, 3 x nodes, and positions from the middle of the face (m).
      integer, allocatable, intent(out) :: places(:, :)
      real(wp), allocatable, intent(out) :: arms(:, :)
      integer :: node, n, c

      associate (count => (box%cells(2) + 1)*(box%cells(3) + 1))
         allocate (places(3, count), arms(3, count))
         do n = 1, count
            node = 1 + (n - 1)*(box%cells(1) + 1) + merge(box%cells(1), 0, far)
            places(:, n) = [(before + 3*(node - 1) + c, c=1, 3)]
            arms(:, n) = node_position(box, node)
         end do
         arms = arms - spread(sum(arms, 2)/count, 2, count)
      end associate
   end subroutine box_face

   pure integer function node_at(box, place)
      type(box_type), intent(in) :: box
      integer, intent(in) :: place(3)

      node_at = 1 + place(1) + (box%cells(1) + 1)*(place(2) + (box%cells(2) + 1)*place(3))
   end function node_at

   pure function node_position(box, node) result(position)
      type(box_type), intent(in) :: box
      integer, intent(in) :: node
      real(wp) :: position(3)
      integer :: row, place(3), i

      row = (node - 1)/(box%cells(1) + 1)
      place = [mod(node - 1, box%cells(1) + 1), mod(row, box%cells(2) + 1), row/(box%cells(2) + 1)]
      position = box%corner
      do i = 1, 3
         position = position + place(i)*box%edges(i)/box%cells(i)*box%axes(:, i)
      end do
   end function node_position

   !> Stiffness, 12 x 12, of constant strain: V B^T D B.
   pure function tetrahedron_stiffness(corners, youngs_modulus, poisson_ratio) result(matrix)
      !> Corners as columns, m.
      real(wp), intent(in) :: corners(3, 4)
      real(wp), intent(in) :: youngs_modulus, poisson_ratio
      real(wp) :: matrix(12, 12)
      real(wp) :: gradient(3, 4), shear, first, volume
      integer :: a, b, i, j

      shear = youngs_modulus/(2*(1 + poisson_ratio))
      first = youngs_modulus*poisson_ratio/((1 + poisson_ratio)*(1 - 2*poisson_ratio))
      call shape_gradients(corners, gradient, volume)
      do b = 1, 4
         do a = 1, 4
            do j = 1, 3
               do i = 1, 3
                  matrix(3*(a - 1) + i, 3*(b - 1) + j) = volume*(first*gradient(i, a)*gradient(j, b) &
                     + shear*gradient(j, a)*gradient(i, b) &
                     + merge(shear*dot_product(gradient(:, a), gradient(:, b)), 0.0_wp, i == j))
               end do
            end do
         end do
      end do
   end function tetrahedron_stiffness

   !> Consistent mass, 12 x 12: rho V/20 (1 + delta).
   pure function tetrahedron_mass(corners, density) result(matrix)
      real(wp), intent(in) :: corners(3, 4), density
      real(wp) :: matrix(12, 12), gradient(3, 4), volume
      integer :: a, b, i

      call shape_gradients(corners, gradient, volume)
      matrix = 0
      do b = 1, 4
         do a = 1, 4
            do i = 1, 3
               matrix(3*(a - 1) + i, 3*(b - 1) + i) = density*volume/20*merge(2, 1, a == b)
            end do
         end do
      end do
   end function tetrahedron_mass

   !> Gradients of the four linear shape functions (1/m) and the volume (m^3).
   pure subroutine shape_gradients(corners, gradient, volume)
      real(wp), intent(in) :: corners(3, 4)
      real(wp), intent(out) :: gradient(3, 4), volume
      real(wp) :: six

      associate (a => corners(:, 2) - corners(:, 1), b => corners(:, 3) - corners(:, 1), c => corners(:, 4) - corners(:, 1))
         six = dot_product(a, cross(b, c))
         gradient(:, 2) = cross(b, c)/six
         gradient(:, 3) = cross(c, a)/six
         gradient(:, 4) = cross(a, b)/six
      end associate
      gradient(:, 1) = -sum(gradient(:, 2:), 2)
      volume = abs(six)/6
   end subroutine shape_gradients
end module scene_solid
