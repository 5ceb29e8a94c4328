!> Modal properties: generalised matrices, participation factors and effective masses.
module kschur_properties
   use kschur_kinds, only: wp
   implicit none
   private
   public :: modal_properties_type, direction_length

   !> Length of a direction's name.
   integer, parameter :: direction_length = 16

   !> Modal properties of each mode of a result, with its shape normalised as there. `find_modal_properties` computes them.
   type :: modal_properties_type
      !> Generalised mass phi^* M phi, damping phi^* R phi and stiffness phi^* K phi; the real part if a matrix is unsymmetric.
      real(wp), allocatable :: mass(:), damping(:), stiffness(:)
      !> Modal a = psi^* (2 lambda M + R) phi and b = -lambda a of the state-space form; psi is the left vector, conj(phi)
      !> where the problem is symmetric. Without damping b = 2 psi^* K phi.
      complex(wp), allocatable :: a(:), b(:)
      !> Participation factors, modes x directions: a direction d that the constraints allow is the sum of Re(factor phi)
      !> over all modes there are. Of an undamped mode phi^T M d/(phi^T M phi).
      complex(wp), allocatable :: participation(:, :)
      !> Effective masses Re(factor d^T M phi), modes x directions; over all modes they add up to the total. The slower root
      !> of an overdamped oscillator has a negative one: only the sum of its two is a mass. With losses the sum is the total
      !> where H = g K and there is no damping beside it: else modes with losses do not make up a system of real motions.
      real(wp), allocatable :: effective_mass(:, :)
      !> Names of the directions: x, y, z, rx, ry, rz of a mesh, numbers of those given.
      character(len=direction_length), allocatable :: direction(:)
      !> d^T M d of each direction.
      real(wp), allocatable :: total_mass(:)
   end type modal_properties_type
end module kschur_properties
