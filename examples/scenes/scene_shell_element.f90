!> A flat rectangular shell element of four nodes with six unknowns each, three translations (m) and three rotations (rad):
!> bilinear in its plane, with the rotation about its normal tied to that of the plane (Hughes and Brezzi, Computer Methods in
!> Applied Mechanics and Engineering 72 (1989)), and a plate of Mindlin's with the shear strains of MITC4 (Dvorkin and Bathe,
!> Engineering Computations 1 (1984)).
module scene_shell_element
   use kschur, only: wp
   implicit none
   private
   public :: shell_type

   !> What a shell is made of, and the edges of an element.
   type :: shell_type
      !> Young's modulus (Pa), Poisson's ratio, density (kg/m^3).
      real(wp) :: youngs_modulus, poisson_ratio, density
      !> Thickness, and edges along the local x and y axes, m.
      real(wp) :: thickness, edges(2)
   contains
      !> 24 x 24, local axes.
      procedure :: stiffness
      !> Consistent, 24 x 24, local axes.
      procedure :: mass
   end type shell_type

   ! Corners in turn, on a square from -1 to 1, and Gauss's points in it.
   integer, parameter :: corners(2, 4) = reshape([-1, -1, 1, -1, 1, 1, -1, 1], [2, 4])
   real(wp), parameter :: points(2, 4) = corners/sqrt(3.0_wp)
   ! Of the nodes: what of the 24 is which.
   integer, parameter :: u(4) = [1, 7, 13, 19], v(4) = u + 1, w(4) = u + 2, rx(4) = u + 3, ry(4) = u + 4, rz(4) = u + 5
   real(wp), parameter :: shear_correction = 5.0_wp/6

contains

   pure function stiffness(self) result(matrix)
      class(shell_type), intent(in) :: self
      real(wp) :: matrix(24, 24)
      ! In the plane, of bending, of shear across, and the rotation about the normal that the plane does not have.
      real(wp) :: plane(3, 24), bending(3, 24), across(2, 24), excess(1, 24), elastic(3, 3), shear, n(4), slope(4, 2)
      integer :: p

      shear = self%youngs_modulus/(2*(1 + self%poisson_ratio))
      elastic = 0
      elastic(:2, :2) = self%poisson_ratio
      elastic(1, 1) = 1
      elastic(2, 2) = 1
      elastic(3, 3) = (1 - self%poisson_ratio)/2
      elastic = self%youngs_modulus/(1 - self%poisson_ratio**2)*elastic
      matrix = 0
      do p = 1, 4
         call shapes(self%edges, points(:, p), n, slope)
         plane = 0
         plane(1, u) = slope(:, 1)
         plane(2, v) = slope(:, 2)
         plane(3, u) = slope(:, 2)
         plane(3, v) = slope(:, 1)
         bending = 0
         bending(1, ry) = slope(:, 1)
         bending(2, rx) = -slope(:, 2)
         bending(3, ry) = slope(:, 2)
         bending(3, rx) = -slope(:, 1)
         excess = 0
         excess(1, rz) = n
         excess(1, v) = -slope(:, 1)/2
         excess(1, u) = slope(:, 2)/2
         across = shear_across(self%edges, points(:, p))
         matrix = matrix + product(self%edges)/4*( &
            self%thickness*matmul(transpose(plane), matmul(elastic, plane)) &
            + self%thickness**3/12*matmul(transpose(bending), matmul(elastic, bending)) &
            + shear*self%thickness*(shear_correction*matmul(transpose(across), across) + matmul(transpose(excess), excess)))
      end do
   end function stiffness

   !> The rotation about the normal has the inertia of the others, so that no unknown is without.
   pure function mass(self) result(matrix)
      class(shell_type), intent(in) :: self
      real(wp) :: matrix(24, 24)
      real(wp) :: n(4), slope(4, 2), of_nodes(4, 4)
      integer :: p, i

      of_nodes = 0
      do p = 1, 4
         call shapes(self%edges, points(:, p), n, slope)
         of_nodes = of_nodes + self%density*self%thickness*product(self%edges)/4*spread(n, 2, 4)*spread(n, 1, 4)
      end do
      matrix = 0
      do i = 1, 6
         matrix(i::6, i::6) = merge(1.0_wp, self%thickness**2/12, i <= 3)*of_nodes
      end do
   end function mass

   ! w,x + theta_y and w,y - theta_x: the first as it is in the middle of the edges along x, linear between them, the second
   ! as in the middle of those along y.
   pure function shear_across(edges, at) result(rows)
      real(wp), intent(in) :: edges(2), at(2)
      real(wp) :: rows(2, 24)
      real(wp) :: n(4), slope(4, 2)
      integer :: side

      rows = 0
      do side = -1, 1, 2
         call shapes(edges, [0.0_wp, real(side, wp)], n, slope)
         rows(1, w) = rows(1, w) + (1 + side*at(2))/2*slope(:, 1)
         rows(1, ry) = rows(1, ry) + (1 + side*at(2))/2*n
         call shapes(edges, [real(side, wp), 0.0_wp], n, slope)
         rows(2, w) = rows(2, w) + (1 + side*at(1))/2*slope(:, 2)
         rows(2, rx) = rows(2, rx) - (1 + side*at(1))/2*n
      end do
   end function shear_across

   ! Bilinear shape functions at a place of the square, and their slopes along x and y (1/m).
   pure subroutine shapes(edges, at, n, slope)
      real(wp), intent(in) :: edges(2), at(2)
      real(wp), intent(out) :: n(4), slope(4, 2)

      associate (along_x => 1 + corners(1, :)*at(1), along_y => 1 + corners(2, :)*at(2))
         n = along_x*along_y/4
         slope(:, 1) = corners(1, :)*along_y/(2*edges(1))
         slope(:, 2) = corners(2, :)*along_x/(2*edges(2))
      end associate
   end subroutine shapes
end module scene_shell_element
