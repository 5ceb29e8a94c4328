!> Constraint rows of joints between frames of six unknowns: three translations
!> (m) and three small rotations (rad), along the global axes.
module scene_joint
   use kschur, only: wp
   use scene_assembly, only: assembly_type
   implicit none
   private
   public :: add_clamp, add_fix, add_tie

   real(wp), parameter :: identity(3, 3) = &
      reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

contains

   !> Fixes two frames to each other at a point: 6 rows,
   !> u2 + theta2 x r2 = u1 + theta1 x r1 and theta2 = theta1.
   pure subroutine add_fix(assembly, first, first_arm, second, second_arm)
      type(assembly_type), intent(inout) :: assembly
      !> Unknowns of the two frames.
      integer, intent(in) :: first(6), second(6)
      !> Lever arms r1 and r2 from each frame's origin to the point, m.
      real(wp), intent(in) :: first_arm(3), second_arm(3)
      real(wp) :: rows(6, 12)

      rows = 0
      rows(1:3, 1:3) = -identity
      rows(1:3, 4:6) = skew(first_arm)
      rows(4:6, 4:6) = -identity
      rows(1:3, 7:9) = identity
      rows(1:3, 10:12) = -skew(second_arm)
      rows(4:6, 10:12) = identity
      call assembly%add_constraints([first, second], rows)
   end subroutine add_fix

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
      real(wp) :: rows(6, 6)

      rows = 0
      rows(1:3, 1:3) = identity
      rows(4:6, 4:6) = identity
      call assembly%add_constraints(frame, rows)
   end subroutine add_clamp

   ! skew(r) x = r cross x.
   pure function skew(r) result(matrix)
      real(wp), intent(in) :: r(3)
      real(wp) :: matrix(3, 3)

      matrix = reshape([0.0_wp, r(3), -r(2), -r(3), 0.0_wp, r(1), r(2), -r(1), 0.0_wp], [3, 3])
   end function skew
end module scene_joint
