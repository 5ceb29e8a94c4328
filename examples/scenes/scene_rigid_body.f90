!> Mass of a rigid body, 6 unknowns at its centre: three translations (m) and
!> three rotations (rad).
module scene_rigid_body
   use kschur, only: wp
   implicit none
   private
   public :: body_mass, box_inertia

contains

   !> Inertia of a homogeneous box about its centre, kg m^2.
   pure function box_inertia(mass, edges) result(inertia)
      !> Mass, kg.
      real(wp), intent(in) :: mass
      !> Lengths of the edges along x, y, z, m.
      real(wp), intent(in) :: edges(3)
      real(wp) :: inertia(3, 3)
      integer :: i

      inertia = 0
      do i = 1, 3
         inertia(i, i) = mass/12*(sum(edges**2) - edges(i)**2)
      end do
   end function box_inertia

   !> Mass matrix of a body, 6 x 6.
   pure function body_mass(mass, inertia) result(matrix)
      !> Mass, kg.
      real(wp), intent(in) :: mass
      !> Inertia about the centre, kg m^2.
      real(wp), intent(in) :: inertia(3, 3)
      real(wp) :: matrix(6, 6)
      integer :: i

      matrix = 0
      do i = 1, 3
         matrix(i, i) = mass
      end do
      matrix(4:6, 4:6) = inertia
   end function body_mass
end module scene_rigid_body
