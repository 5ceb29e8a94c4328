!> Mass of a rigid body, 6 unknowns at its centre: three translations (m) and
!> three rotations (rad); and what its spin adds to damping (R_i) and stiffness (K_i).
module scene_rigid_body
   use kschur, only: wp
   use scene_vectors, only: skew
   implicit none
   private
   public :: body_mass, box_inertia, gyroscopic_damping, spin_damping, spin_stiffness

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
   !> R_i of a body that spins about an axis of symmetry of its inertia, seen from axes at rest: 6 x 6.
   pure function gyroscopic_damping(momentum) result(matrix)
      !> Angular momentum of the spin, N m s.
      real(wp), intent(in) :: momentum(3)
      real(wp) :: matrix(6, 6)

      matrix = 0
      matrix(4:6, 4:6) = -skew(momentum)
   end function gyroscopic_damping

   !> R_i of any body, seen from axes that turn with it, through their origin: 6 x 6.
   pure function spin_damping(mass, inertia, omega) result(matrix)
      !> Mass (kg), inertia about the centre (kg m^2), angular velocity (rad/s).
      real(wp), intent(in) :: mass, inertia(3, 3), omega(3)
      real(wp) :: matrix(6, 6), spin(3, 3)

      spin = skew(omega)
      matrix = 0
      matrix(1:3, 1:3) = 2*mass*spin
      matrix(4:6, 4:6) = matmul(spin, inertia) + turning_momentum(inertia, omega)
   end function spin_damping

   !> K_i of any body, seen from axes that turn with it: 6 x 6.
   pure function spin_stiffness(mass, inertia, omega) result(matrix)
      real(wp), intent(in) :: mass, inertia(3, 3), omega(3)
      real(wp) :: matrix(6, 6), spin(3, 3), turning(3, 3)

      spin = skew(omega)
      turning = turning_momentum(inertia, omega)
      matrix = 0
      matrix(1:3, 1:3) = mass*matmul(spin, spin)
      matrix(4:6, 4:6) = matmul(spin, turning)
   end function spin_stiffness

   ! How the angular momentum J omega changes as the body turns by theta: (J skew(omega) - skew(J omega)) theta.
   pure function turning_momentum(inertia, omega) result(matrix)
      real(wp), intent(in) :: inertia(3, 3), omega(3)
      real(wp) :: matrix(3, 3), spin(3, 3), momentum(3)

      spin = skew(omega)
      momentum = matmul(inertia, omega)
      matrix = matmul(inertia, spin) - skew(momentum)
   end function turning_momentum
end module scene_rigid_body
