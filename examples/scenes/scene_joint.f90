!> Constraint rows of joints between frames of six unknowns: three translations
!> (m) and three small rotations (rad), along the global axes.
module scene_joint
   use kschur, only: wp
   use scene_assembly, only: assembly_type
   use scene_vectors, only: cross, dyad, identity, normal_plane
   implicit none
   private
   public :: add_clamp, add_fix, add_joint, add_reaction, add_revolute, add_tie
   public :: averaged, prismatic_rows, revolute_rows, spherical_rows

contains

   !> Fixes two frames to each other at a point: 6 rows,
   !> u2 + theta2 x r2 = u1 + theta1 x r1 and theta2 = theta1.
   pure subroutine add_fix(assembly, first, first_arm, second, second_arm)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the two frames.
      integer, intent(in) :: first(6), second(6)
      !> Lever arms r1 and r2 from each frame's origin to the point, m.
      real(wp), intent(in) :: first_arm(3), second_arm(3)

      call add_joint(assembly, first, first_arm, second, second_arm, fixed_rows())
   end subroutine add_fix

   !> Joins two frames at a point, free to rotate about an axis: 5 rows.
   pure subroutine add_revolute(assembly, first, first_arm, second, second_arm, axis)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      !> Unit vector.
      real(wp), intent(in) :: axis(3)

      call add_joint(assembly, first, first_arm, second, second_arm, revolute_rows(axis))
   end subroutine add_revolute

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

   !> Adds a joint of any kind between two frames at a point.
   pure subroutine add_joint(assembly, first, first_arm, second, second_arm, rows)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first(6), second(6)
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      !> What the joint forbids: rows of the relative motion at the point.
      real(wp), intent(in) :: rows(:, :)

      call assembly%add_constraints([second, first], &
         reshape([at_arm(rows, second_arm), -at_arm(rows, first_arm)], [size(rows, 1), 12]))
   end subroutine add_joint

   ! Rows of the motion u + theta x r at a point in those of the frame.
   pure function at_arm(rows, arm) result(moved)
      real(wp), intent(in) :: rows(:, :), arm(3)
      real(wp) :: moved(size(rows, 1), 6)
      integer :: k

      moved = rows
      do k = 1, size(rows, 1)
         moved(k, 4:6) = rows(k, 4:6) + cross(arm, rows(k, 1:3))
      end do
   end function at_arm

   ! What a joint that fixes forbids.
   pure function fixed_rows() result(rows)
      real(wp) :: rows(6, 6)

      rows = 0
      rows(1:3, 1:3) = identity
      rows(4:6, 4:6) = identity
   end function fixed_rows

   !> What a revolute joint about an axis (a unit vector) forbids: 5 rows of the relative motion.
   pure function revolute_rows(axis) result(rows)
      real(wp), intent(in) :: axis(3)
      real(wp) :: rows(5, 6)

      rows = 0
      rows(1:3, 1:3) = identity
      rows(4:5, 4:6) = transpose(normal_plane(axis))
   end function revolute_rows

   !> What a spherical joint forbids: 3 rows.
   pure function spherical_rows() result(rows)
      real(wp) :: rows(3, 6)

      rows = 0
      rows(:, 1:3) = identity
   end function spherical_rows

   !> What a guide along an axis (a unit vector) forbids: 5 rows.
   pure function prismatic_rows(axis) result(rows)
      real(wp), intent(in) :: axis(3)
      real(wp) :: rows(5, 6)

      rows = 0
      rows(1:2, 1:3) = transpose(normal_plane(axis))
      rows(3:5, 4:6) = identity
   end function prismatic_rows

   !> Rows of the average motion of a set of points, in their translations: the frame in their middle that fits them
   !> by least squares, u_f = mean of u, theta_f = S^-1 mean of r x u, S = mean of -skew(r)^2.
   pure function averaged(rows, arms) result(spread_out)
      !> Rows of the motion of the frame, and positions of the points from their middle (m).
      real(wp), intent(in) :: rows(:, :), arms(:, :)
      real(wp) :: spread_out(size(rows, 1), 3*size(arms, 2))
      real(wp) :: spin(3, 3), inverse(3, 3)
      integer :: k, i

      spin = sum(arms**2)*identity
      do i = 1, size(arms, 2)
         spin = spin - dyad(arms(:, i), arms(:, i))
      end do
      inverse = transpose(reshape([cross(spin(:, 2), spin(:, 3)), cross(spin(:, 3), spin(:, 1)), &
         cross(spin(:, 1), spin(:, 2))], [3, 3]))/dot_product(spin(:, 1), cross(spin(:, 2), spin(:, 3)))
      do k = 1, size(rows, 1)
         associate (turn => matmul(rows(k, 4:6), inverse))
            do i = 1, size(arms, 2)
               spread_out(k, 3*i - 2:3*i) = rows(k, 1:3)/size(arms, 2) + cross(turn, arms(:, i))
            end do
         end associate
      end do
   end function averaged
end module scene_joint
