!> Vectors in space, and the matrices that multiply them.
module scene_vectors
   use kschur, only: wp
   implicit none
   private
   public :: cross, dyad, normal_plane, rotation, skew, turned

   !> The unit matrix.
   real(wp), parameter, public :: identity(3, 3) = &
      reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

   real(wp), parameter, public :: degree = acos(-1.0_wp)/180
   !> A revolution a minute, rad/s.
   real(wp), parameter, public :: rpm = acos(-1.0_wp)/30

contains

   !> skew(r) x = r cross x.
   pure function skew(r) result(matrix)
      real(wp), intent(in) :: r(3)
      real(wp) :: matrix(3, 3)

      matrix = reshape([0.0_wp, r(3), -r(2), -r(3), 0.0_wp, r(1), r(2), -r(1), 0.0_wp], [3, 3])
   end function skew

   !> a cross b.
   pure function cross(a, b) result(vector)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: vector(3)

      vector = a([2, 3, 1])*b([3, 1, 2]) - a([3, 1, 2])*b([2, 3, 1])
   end function cross

   !> a b^T.
   pure function dyad(a, b) result(matrix)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: matrix(3, 3)

      matrix = spread(a, 2, 3)*spread(b, 1, 3)
   end function dyad

   !> Two unit vectors at right angles to a unit vector and to each other, as columns.
   pure function normal_plane(axis) result(directions)
      real(wp), intent(in) :: axis(3)
      real(wp) :: directions(3, 2)

      directions(:, 1) = identity(:, minloc(abs(axis), 1))
      directions(:, 1) = directions(:, 1) - dot_product(directions(:, 1), axis)*axis
      directions(:, 1) = directions(:, 1)/norm2(directions(:, 1))
      directions(:, 2) = cross(axis, directions(:, 1))
   end function normal_plane

   !> The rotation about a unit vector by an angle (rad).
   pure function rotation(axis, angle) result(matrix)
      real(wp), intent(in) :: axis(3), angle
      real(wp) :: matrix(3, 3)

      matrix = cos(angle)*identity + sin(angle)*skew(axis) + (1 - cos(angle))*dyad(axis, axis)
   end function rotation

   !> A matrix between vectors, its 3 x 3 blocks B replaced by left B right^T: `turned(matrix, axes, axes)` takes one
   !> from local to global axes, whose unit vectors are the columns of `axes`.
   pure function turned(matrix, left, right) result(changed)
      !> Sizes multiples of 3.
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(in) :: left(3, 3), right(3, 3)
      real(wp) :: changed(size(matrix, 1), size(matrix, 2))
      integer :: i, j

      do j = 1, size(matrix, 2), 3
         do i = 1, size(matrix, 1), 3
            changed(i:i + 2, j:j + 2) = matmul(left, matmul(matrix(i:i + 2, j:j + 2), transpose(right)))
         end do
      end do
   end function turned
end module scene_vectors
