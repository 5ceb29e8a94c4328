!> The Euler-Bernoulli beam element: 12 unknowns, three translations (m) and
!> three rotations (rad) at each end, the local x axis along the beam.
!> Textbook matrices, as in Przemieniecki, Theory of Matrix Structural
!> Analysis (1968), sections 5.6 and 11.
module scene_beam
   use kschur, only: wp
   use scene_assembly, only: assembly_type, node_unknowns
   implicit none
   private
   public :: add_beam, beam_type, rectangular_beam, table_2_beam, tube

   !> The paper's test beams (Table 2): Young's modulus (Pa), Poisson's ratio, density (kg/m^3); alpha (1/s) and beta (s)
   !> of their Rayleigh damping.
   real(wp), parameter, public :: table_2_material(3) = [1.0e8_wp, 0.31_wp, 1000.0_wp]
   real(wp), parameter, public :: table_2_rayleigh(2) = [1.0e-3_wp, 1.0e-5_wp]

   !> What a beam is made of: one material, one section.
   type :: beam_type
      !> Young's modulus E and shear modulus G, Pa.
      real(wp) :: youngs_modulus, shear_modulus
      !> Density rho, kg/m^3.
      real(wp) :: density
      !> Area A of the section, m^2.
      real(wp) :: area
      !> Second moments of area about the local y axis (bending along z) and
      !> about the local z axis (bending along y), m^4.
      real(wp) :: moment_y, moment_z
      !> Torsion constant J, m^4.
      real(wp) :: torsion_constant
   contains
      !> Stiffness of an element of a given length (m), 12 x 12, local axes.
      procedure :: stiffness
      !> Mass of an element of a given length (m), 12 x 12, local axes.
      procedure :: mass
      !> What an axial force adds to the stiffness, 12 x 12, local axes.
      procedure, nopass :: geometric_stiffness
   end type beam_type

   integer, parameter :: axial(2) = [1, 7], twist(2) = [4, 10]
   integer, parameter :: along_y(4) = [2, 6, 8, 12], along_z(4) = [3, 5, 9, 11]

contains

   !> A beam of solid rectangular section. The torsion constant is the usual
   !> approximation to Saint-Venant's series (Roark, Formulas for Stress and
   !> Strain, 7th edition, table 10.1, case 4).
   pure function rectangular_beam(width_y, width_z, youngs_modulus, poisson_ratio, density) result(beam)
      !> Widths of the section along the local y and z axes, m.
      real(wp), intent(in) :: width_y, width_z
      !> Young's modulus, Pa.
      real(wp), intent(in) :: youngs_modulus
      real(wp), intent(in) :: poisson_ratio
      !> Density, kg/m^3.
      real(wp), intent(in) :: density
      type(beam_type) :: beam
      real(wp) :: thin, wide

      thin = min(width_y, width_z)
      wide = max(width_y, width_z)
      beam%youngs_modulus = youngs_modulus
      beam%shear_modulus = youngs_modulus/(2*(1 + poisson_ratio))
      beam%density = density
      beam%area = width_y*width_z
      beam%moment_y = width_y*width_z**3/12
      beam%moment_z = width_z*width_y**3/12
      beam%torsion_constant = wide*thin**3*(1.0_wp/3 - 0.21_wp*(thin/wide)*(1 - (thin/wide)**4/12))
   end function rectangular_beam

   !> The test beam of the paper's Table 2, 0.05 m along y and 0.3 m along z.
   pure function table_2_beam() result(beam)
      type(beam_type) :: beam

      beam = rectangular_beam(width_y=0.05_wp, width_z=0.3_wp, youngs_modulus=table_2_material(1), &
         poisson_ratio=table_2_material(2), density=table_2_material(3))
   end function table_2_beam

   !> A round beam, solid or hollow.
   pure function tube(diameter, thickness, youngs_modulus, shear_modulus, density) result(beam)
      !> Outer diameter and thickness of the wall, m; half the diameter where it is solid.
      real(wp), intent(in) :: diameter, thickness
      !> Young's and shear modulus, Pa; density, kg/m^3.
      real(wp), intent(in) :: youngs_modulus, shear_modulus, density
      type(beam_type) :: beam
      real(wp), parameter :: pi = acos(-1.0_wp)

      associate (inner => diameter - 2*thickness)
         beam%area = pi/4*(diameter**2 - inner**2)
         beam%moment_y = pi/64*(diameter**4 - inner**4)
      end associate
      beam%moment_z = beam%moment_y
      beam%torsion_constant = 2*beam%moment_y
      beam%youngs_modulus = youngs_modulus
      beam%shear_modulus = shear_modulus
      beam%density = density
   end function tube

   !> Adds a straight beam: equal elements between consecutive nodes.
   pure subroutine add_beam(assembly, nodes, mass, stiffness, rayleigh)
      type(assembly_type), intent(inout) :: assembly
      !> Nodes along the beam; 0 is a node held still.
      integer, intent(in) :: nodes(:)
      !> Matrices of one element, 12 x 12, global axes.
      real(wp), intent(in) :: mass(:, :), stiffness(:, :)
      !> alpha (1/s) and beta (s) of the Rayleigh damping.
      real(wp), intent(in) :: rayleigh(2)
      integer :: k

      do k = 1, size(nodes) - 1
         call assembly%add_element([node_unknowns(nodes(k)), node_unknowns(nodes(k + 1))], &
            mass, stiffness, rayleigh)
      end do
   end subroutine add_beam

   pure function stiffness(self, length) result(matrix)
      class(beam_type), intent(in) :: self
      real(wp), intent(in) :: length
      real(wp) :: matrix(12, 12)
      real(wp), parameter :: spring(2, 2) = reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])

      matrix = 0
      matrix(axial, axial) = self%youngs_modulus*self%area/length*spring
      matrix(twist, twist) = self%shear_modulus*self%torsion_constant/length*spring
      matrix(along_y, along_y) = self%youngs_modulus*self%moment_z/length**3*bending_stiffness(length)
      matrix(along_z, along_z) = self%youngs_modulus*self%moment_y/length**3*bending_stiffness(-length)
   end function stiffness

   !> Of a beam under an axial force: the string that resists bending (Przemieniecki, chapter 15).
   pure function geometric_stiffness(length, force) result(matrix)
      !> Length of the element, m; tension, N.
      real(wp), intent(in) :: length, force
      real(wp) :: matrix(12, 12)

      matrix = 0
      matrix(along_y, along_y) = force/(30*length)*string_stiffness(length)
      matrix(along_z, along_z) = force/(30*length)*string_stiffness(-length)
   end function geometric_stiffness

   !> The consistent mass, without rotary inertia of the section in bending, or
   !> the diagonal one of Chrono's BeamFixBody, which gives the bending
   !> rotations 1/500 of the translations' mass.
   pure function mass(self, length, lumped) result(matrix)
      class(beam_type), intent(in) :: self
      real(wp), intent(in) :: length
      logical, intent(in) :: lumped
      real(wp) :: matrix(12, 12)
      real(wp), parameter :: rod(2, 2) = reshape([2.0_wp, 1.0_wp, 1.0_wp, 2.0_wp], [2, 2])/6
      real(wp) :: per_length, polar, nodal(6)
      integer :: i

      per_length = self%density*self%area
      polar = self%density*(self%moment_y + self%moment_z)
      matrix = 0
      if (lumped) then
         nodal = length/2*[per_length, per_length, per_length, polar, per_length/500, per_length/500]
         do i = 1, 6
            matrix(i, i) = nodal(i)
            matrix(i + 6, i + 6) = nodal(i)
         end do
      else
         matrix(axial, axial) = per_length*length*rod
         matrix(twist, twist) = polar*length*rod
         matrix(along_y, along_y) = per_length*length/420*bending_mass(length)
         matrix(along_z, along_z) = per_length*length/420*bending_mass(-length)
      end if
   end function mass

   ! Of deflection and slope at both ends; a rotation about y is minus the slope
   ! along z, which a negative length says.
   pure function bending_stiffness(length) result(matrix)
      real(wp), intent(in) :: length
      real(wp) :: matrix(4, 4)

      associate (l => length)
         matrix = reshape([12.0_wp, 6*l, -12.0_wp, 6*l, &
            6*l, 4*l**2, -6*l, 2*l**2, &
            -12.0_wp, -6*l, 12.0_wp, -6*l, &
            6*l, 2*l**2, -6*l, 4*l**2], [4, 4])
      end associate
   end function bending_stiffness

   pure function string_stiffness(length) result(matrix)
      real(wp), intent(in) :: length
      real(wp) :: matrix(4, 4)

      associate (l => length)
         matrix = reshape([36.0_wp, 3*l, -36.0_wp, 3*l, &
            3*l, 4*l**2, -3*l, -l**2, &
            -36.0_wp, -3*l, 36.0_wp, -3*l, &
            3*l, -l**2, -3*l, 4*l**2], [4, 4])
      end associate
   end function string_stiffness

   pure function bending_mass(length) result(matrix)
      real(wp), intent(in) :: length
      real(wp) :: matrix(4, 4)

      associate (l => length)
         matrix = reshape([156.0_wp, 22*l, 54.0_wp, -13*l, &
            22*l, 4*l**2, 13*l, -3*l**2, &
            54.0_wp, 13*l, 156.0_wp, -22*l, &
            -13*l, -3*l**2, -22*l, 4*l**2], [4, 4])
      end associate
   end function bending_mass
end module scene_beam
