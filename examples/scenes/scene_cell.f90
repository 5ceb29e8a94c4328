!> Cells of a box, of eight-node bricks or ten-node tetrahedra (Zienkiewicz and Taylor, The Finite Element Method, 5th edition,
!> volume 1, chapter 8). They are integrated at as many points as make stiffness and consistent mass exact: two along each
!> edge of a brick, four of a cube that collapses to a tetrahedron.
module scene_cell
   use kschur, only: vtk_hexahedron, vtk_quadratic_tetrahedron, wp
   use scene_solid, only: cell_corners, shape_gradients, tetrahedra
   implicit none
   private
   public :: brick_cell, cell_type, tetrahedra_cell

   !> A cell: its nodes, its elements, and what both are at the points of integration.
   type :: cell_type
      !> From node to node along an edge, and VTK's number of an element.
      integer :: steps, kind
      !> Places of the nodes along the edges, 3 x nodes, 0 to `steps`.
      integer, allocatable :: at(:, :)
      !> Nodes of the elements, in VTK's order, corners x elements.
      integer, allocatable :: element(:, :)
      !> Of the points: positions from the first corner (m), weights (m^3).
      real(wp), allocatable :: position(:, :), weight(:)
      !> Shape functions, nodes x points, and gradients (1/m), 3 x nodes x points.
      real(wp), allocatable :: shape(:, :), gradient(:, :, :)
   contains
      !> Of one direction, nodes square: the integral of density times shape functions.
      procedure :: mass
      !> Linear and isotropic, 3 nodes square.
      procedure :: stiffness
      !> Of one direction, nodes square: what stresses along x, y, z at the points (Pa, 3 x points) add to the stiffness.
      procedure :: stress_stiffness
   end type cell_type

   !> Gauss's points and weights of the unit interval: two are exact for degree 3, four for degree 7.
   real(wp), parameter :: two_points(2) = 0.5_wp + [-0.5_wp, 0.5_wp]/sqrt(3.0_wp)
   real(wp), parameter :: inner = sqrt(3.0_wp/7 - 2.0_wp/7*sqrt(1.2_wp)), outer = sqrt(3.0_wp/7 + 2.0_wp/7*sqrt(1.2_wp))
   real(wp), parameter :: four_points(4) = 0.5_wp + 0.5_wp*[-outer, -inner, inner, outer]
   real(wp), parameter :: four_weights(4) = 0.25_wp + sqrt(30.0_wp)/72*[-1, 1, 1, -1]
   !> Corners on the edges of a tetrahedron, in VTK's order.
   integer, parameter :: ends(2, 6) = reshape([1, 2, 2, 3, 1, 3, 1, 4, 2, 4, 3, 4], [2, 6])

contains

   !> A brick of eight nodes.
   pure function brick_cell(edges) result(cell)
      !> Along x, y, z, m.
      real(wp), intent(in) :: edges(3)
      type(cell_type) :: cell
      real(wp) :: along(3, 8), place(3)
      integer :: p, d

      cell%steps = 1
      cell%kind = vtk_hexahedron
      allocate (cell%at, source=cell_corners)
      allocate (cell%element, source=reshape([1, 2, 4, 3, 5, 6, 8, 7], [8, 1]))
      allocate (cell%position(3, 8), cell%shape(8, 8), cell%gradient(3, 8, 8))
      allocate (cell%weight(8), source=product(edges)/8)
      do p = 1, 8
         place = two_points(1 + cell_corners(:, p))
         along = merge(spread(place, 2, 8), spread(1 - place, 2, 8), cell_corners == 1)
         cell%position(:, p) = place*edges
         cell%shape(:, p) = product(along, 1)
         do d = 1, 3
            cell%gradient(d, :, p) = (2*cell_corners(d, :) - 1)/edges(d)* &
               product(along([mod(d, 3) + 1, mod(d + 1, 3) + 1], :), 1)
         end do
      end do
   end function brick_cell

   !> Six tetrahedra of ten nodes around the long diagonal, with straight edges.
   pure function tetrahedra_cell(edges) result(cell)
      !> Along x, y, z, m.
      real(wp), intent(in) :: edges(3)
      type(cell_type) :: cell
      integer, parameter :: nodes = 27, points = 6*size(four_points)**3
      integer :: at_corners(3, 4), t, e, i, j, k, p

      cell%steps = 2
      cell%kind = vtk_quadratic_tetrahedron
      allocate (cell%at(3, nodes))
      do k = 0, 2
         do j = 0, 2
            do i = 0, 2
               cell%at(:, 1 + i + 3*j + 9*k) = [i, j, k]
            end do
         end do
      end do
      allocate (cell%element(10, 6), cell%position(3, points), cell%weight(points))
      allocate (cell%shape(nodes, points), cell%gradient(3, nodes, points), source=0.0_wp)
      p = 0
      do t = 1, 6
         at_corners = cell_corners(:, tetrahedra(:, t))
         do e = 1, 4
            cell%element(e, t) = 1 + dot_product([1, 3, 9], 2*at_corners(:, e))
         end do
         do e = 1, 6
            cell%element(4 + e, t) = 1 + dot_product([1, 3, 9], at_corners(:, ends(1, e)) + at_corners(:, ends(2, e)))
         end do
         do k = 1, 4
            do j = 1, 4
               do i = 1, 4
                  p = p + 1
                  call set_tetrahedron_point(cell, p, cell%element(:, t), spread(edges, 2, 4)*at_corners, [i, j, k])
               end do
            end do
         end do
      end do
   end function tetrahedra_cell

   ! A point of a tetrahedron: one of the cube that collapses to it (Stroud, Approximate Calculation of Multiple Integrals,
   ! 1971, section 2.5).
   pure subroutine set_tetrahedron_point(cell, p, nodes, corners, at)
      type(cell_type), intent(inout) :: cell
      integer, intent(in) :: p, nodes(10)
      real(wp), intent(in) :: corners(3, 4)
      !> Which of the four points along each edge of the cube.
      integer, intent(in) :: at(3)
      real(wp) :: gradient(3, 4), volume, l(4)
      integer :: e

      call shape_gradients(corners, gradient, volume)
      associate (u => four_points(at(1)), v => four_points(at(2)), w => four_points(at(3)))
         l = [u, (1 - u)*v, (1 - u)*(1 - v)*w, (1 - u)*(1 - v)*(1 - w)]
         cell%weight(p) = 6*volume*product(four_weights(at))*(1 - u)**2*(1 - v)
      end associate
      cell%position(:, p) = matmul(corners, l)
      cell%shape(nodes(:4), p) = l*(2*l - 1)
      do e = 1, 4
         cell%gradient(:, nodes(e), p) = (4*l(e) - 1)*gradient(:, e)
      end do
      do e = 1, 6
         associate (a => ends(1, e), b => ends(2, e))
            cell%shape(nodes(4 + e), p) = 4*l(a)*l(b)
            cell%gradient(:, nodes(4 + e), p) = 4*(l(a)*gradient(:, b) + l(b)*gradient(:, a))
         end associate
      end do
   end subroutine set_tetrahedron_point

   pure function mass(self, density) result(matrix)
      class(cell_type), intent(in) :: self
      !> kg/m^3.
      real(wp), intent(in) :: density
      real(wp) :: matrix(size(self%at, 2), size(self%at, 2))

      matrix = integral(density*self%weight, self%shape, self%shape)
   end function mass

   pure function stiffness(self, youngs_modulus, poisson_ratio) result(matrix)
      class(cell_type), intent(in) :: self
      !> Young's modulus, Pa.
      real(wp), intent(in) :: youngs_modulus, poisson_ratio
      real(wp) :: matrix(3*size(self%at, 2), 3*size(self%at, 2))
      real(wp) :: shear, first, of_slopes(size(self%at, 2), size(self%at, 2))
      integer :: i, j, k

      shear = youngs_modulus/(2*(1 + poisson_ratio))
      first = youngs_modulus*poisson_ratio/((1 + poisson_ratio)*(1 - 2*poisson_ratio))
      matrix = 0
      do j = 1, 3
         do i = 1, 3
            of_slopes = integral(self%weight, self%gradient(i, :, :), self%gradient(j, :, :))
            matrix(i::3, j::3) = matrix(i::3, j::3) + first*of_slopes
            matrix(j::3, i::3) = matrix(j::3, i::3) + shear*of_slopes
            if (i /= j) cycle
            do k = 1, 3
               matrix(k::3, k::3) = matrix(k::3, k::3) + shear*of_slopes
            end do
         end do
      end do
   end function stiffness

   pure function stress_stiffness(self, stress) result(matrix)
      class(cell_type), intent(in) :: self
      real(wp), intent(in) :: stress(:, :)
      real(wp) :: matrix(size(self%at, 2), size(self%at, 2))
      integer :: d

      matrix = 0
      do d = 1, 3
         matrix = matrix + integral(self%weight*stress(d, :), self%gradient(d, :, :), self%gradient(d, :, :))
      end do
   end function stress_stiffness

   ! Of products of functions, nodes x points.
   pure function integral(weight, f, g) result(matrix)
      real(wp), intent(in) :: weight(:), f(:, :), g(:, :)
      real(wp) :: matrix(size(f, 1), size(g, 1))
      integer :: p

      matrix = 0
      do p = 1, size(weight)
         matrix = matrix + weight(p)*spread(f(:, p), 2, size(g, 1))*spread(g(:, p), 1, size(f, 1))
      end do
   end function integral
end module scene_cell
