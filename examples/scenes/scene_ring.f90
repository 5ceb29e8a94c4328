!> Three identical parts, equally spaced around an axis, that turn about it at constant speed on a support at rest.
!>
!> Each part moves in axes that turn with it: q'' M + q' R + q K with the spin terms R_i, K_i of those axes. What it
!> passes to the support depends on its azimuth, but not in the multi-blade coordinates z of q = T(Omega t) z: mean,
!> cosine and sine over the azimuth (Bir, Multi-blade coordinate transformation and its application to wind turbine
!> analysis, NREL/CP-500-42553, 2008). The unknowns here are y = T(0) z: the motions of the three parts as they are
!> when the first stands where it was given. With G = T'(0) T(0)^T, which couples each part to the two others,
!>
!>     M y'' + (R + 2 Omega G M) y' + (K + Omega G R + Omega^2 G^2 M) y,
!>
!> and constraints to the support are those of the parts at that place.
module scene_ring
   use kschur, only: wp
   use scene_assembly, only: assembly_type
   use scene_vectors, only: rotation, turned
   implicit none
   private
   public :: new_ring, ring_type

   real(wp), parameter :: third = 2*acos(-1.0_wp)/3

   !> The parts and their speed.
   type :: ring_type
      !> Speed, rad/s.
      real(wp) :: speed
      !> Rotation from the first part to each.
      real(wp) :: turn(3, 3, 3)
   contains
      !> Adds a matrix triple to each part.
      procedure :: add
   end type ring_type

contains

   !> The ring about an axis (a unit vector, which the parts turn about by the right-hand rule) at a speed (rad/s).
   pure function new_ring(axis, speed) result(ring)
      real(wp), intent(in) :: axis(3), speed
      type(ring_type) :: ring
      integer :: k

      ring%speed = speed
      do k = 1, 3
         ring%turn(:, :, k) = rotation(axis, (k - 1)*third)
      end do
   end function new_ring

   pure subroutine add(self, assembly, places, mass, damping, stiffness)
      class(ring_type), intent(in) :: self
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the element, one column for each part.
      integer, intent(in) :: places(:, :)
      !> Element matrices of the first part, in global axes, spin terms included.
      real(wp), intent(in) :: mass(:, :), damping(:, :), stiffness(:, :)
      real(wp) :: g, g2, same
      integer :: j, k

      do j = 1, 3
         do k = 1, 3
            same = merge(1.0_wp, 0.0_wp, j == k)
            g = self%speed*2*sin((j - k)*third)/3
            g2 = self%speed**2*(1.0_wp/3 - same)
            associate (left => self%turn(:, :, k), right => self%turn(:, :, j), rows => places(:, k), columns => places(:, j))
               call assembly%mass%add_block(rows, columns, turned(same*mass, left, right))
               call assembly%damping%add_block(rows, columns, turned(same*damping + 2*g*mass, left, right))
               call assembly%stiffness%add_block(rows, columns, turned(same*stiffness + g*damping + g2*mass, left, right))
            end associate
         end do
      end do
   end subroutine add
end module scene_ring
