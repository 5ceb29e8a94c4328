!> Constraint rows of joints between frames of six unknowns: three translations
!> (m) and three small rotations (rad), along the global axes.
module scene_joint
   use kschur, only: wp
   use scene_assembly, only: assembly_type
   use scene_vectors, only: cross, dyad, identity, normal_plane, skew
   implicit none
   private
   public :: add_average, add_clamp, add_fix, add_prismatic, add_reaction, add_revolute, add_spherical, add_tie

   real(wp), parameter :: nothing(3, 0) = reshape([real(wp) ::], [3, 0])

contains

   !> Fixes two frames to each other at a point: 6 rows,
   !> u2 + theta2 x r2 = u1 + theta1 x r1 and theta2 = theta1.
   pure subroutine add_fix(assembly, first, first_arm, second, second_arm)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the two frames.
      integer, intent(in) :: first(6), second(6)
      !> Lever arms r1 and r2 from each frame's origin to the point, m.
      real(wp), intent(in) :: first_arm(3), second_arm(3)

      call add_joint(assembly, first, first_arm, second, second_arm, identity, identity)
   end subroutine add_fix

   !> Joins two frames at a point, free to rotate about an axis: 5 rows.
   pure subroutine add_revolute(assembly, first, first_arm, second, second_arm, axis)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      !> Unit vector.
      real(wp), intent(in) :: axis(3)

      call add_joint(assembly, first, first_arm, second, second_arm, identity, normal_plane(axis))
   end subroutine add_revolute

   !> Joins two frames at a point, free to rotate: 3 rows.
   pure subroutine add_spherical(assembly, first, first_arm, second, second_arm)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)

      call add_joint(assembly, first, first_arm, second, second_arm, identity, nothing)
   end subroutine add_spherical

   !> Joins two frames at a point, free to slide along an axis: 5 rows.
   pure subroutine add_prismatic(assembly, first, first_arm, second, second_arm, axis)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      !> Unit vector.
      real(wp), intent(in) :: axis(3)

      call add_joint(assembly, first, first_arm, second, second_arm, normal_plane(axis), identity)
   end subroutine add_prismatic

   !> Ties two nodes at the same point: 6 rows, x2 = x1.
   pure subroutine add_tie(assembly, first, second)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the two nodes.
      integer, intent(in) :: first(6), second(6)
      real(wp), parameter :: no_arm(3) = 0

      call add_fix(assembly, first, no_arm, second, no_arm)
   end subroutine add_tie

   !> Holds a frame still: 6 rows of a single entry, x = 0.
   pure subroutine add_clamp(assembly, frame)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the frame.
      integer, intent(in) :: frame(6)
      integer, parameter :: ground(6) = 0

      call add_tie(assembly, ground, frame)
   end subroutine add_clamp

   !> Makes a frame follow a set of points on the average: 6 rows, the mean of u - (u_f + theta_f x r) and of
   !> r x (u - (u_f + theta_f x r)) over the points is zero.
   pure subroutine add_average(assembly, frame, points, arms)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the frame.
      integer, intent(in) :: frame(6)
      !> Unknowns of the points, 3 x points, and their positions r from the origin of the frame (m).
      integer, intent(in) :: points(:, :)
      real(wp), intent(in) :: arms(:, :)
      real(wp) :: rows(6, 6 + 3*size(points, 2)), moment(3, 3)
      integer :: k

      rows = 0
      associate (weight => 1.0_wp/size(points, 2))
         do k = 1, size(points, 2)
            moment = skew(arms(:, k))
            rows(1:3, 3*k + 4:3*k + 6) = weight*identity
            rows(4:6, 3*k + 4:3*k + 6) = weight*moment
            rows(1:3, 4:6) = rows(1:3, 4:6) + weight*moment
            rows(4:6, 1:3) = rows(4:6, 1:3) - weight*moment
            rows(4:6, 4:6) = rows(4:6, 4:6) + weight*matmul(moment, moment)
         end do
      end associate
      rows(1:3, 1:3) = -identity
      call assembly%add_constraints([frame, reshape(points, [size(points)])], rows)
   end subroutine add_average

   !> Adds the stiffness K_c of a joint that carries a force (eq. (9) of the paper): as a frame rotates, the lever arm
   !> of the force turns, d(r x f)/d theta = skew(f) skew(r) = r f^T - (r.f) I.
   pure subroutine add_reaction(assembly, first, first_arm, second, second_arm, force)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      !> What the joint's multipliers put into the equation of motion of the second frame, Cq^T gamma (N): in
      !> equilibrium the sum of all other forces on it.
      real(wp), intent(in) :: force(3)

      call assembly%stiffness%add_block(first(4:), first(4:), &
         dot_product(force, first_arm)*identity - dyad(first_arm, force))
      call assembly%stiffness%add_block(second(4:), second(4:), &
         dyad(second_arm, force) - dot_product(force, second_arm)*identity)
   end subroutine add_reaction

   ! The rows d.(u2 + theta2 x r2 - u1 - theta1 x r1) = 0 for each d of `translations`,
   ! d.(theta2 - theta1) = 0 for each of `rotations`.
   pure subroutine add_joint(assembly, first, first_arm, second, second_arm, translations, rotations)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3), translations(:, :), rotations(:, :)
      real(wp) :: rows(size(translations, 2) + size(rotations, 2), 12)
      integer :: k, t

      t = size(translations, 2)
      rows = 0
      do k = 1, t
         associate (d => translations(:, k))
            rows(k, :) = [-d, -cross(first_arm, d), d, cross(second_arm, d)]
         end associate
      end do
      do k = 1, size(rotations, 2)
         rows(t + k, 4:6) = -rotations(:, k)
         rows(t + k, 10:12) = rotations(:, k)
      end do
      call assembly%add_constraints([first, second], rows)
   end subroutine add_joint
end module scene_joint
