!> The scene `rotor`: a disc at the middle of a round shaft that spins in two bearings, the shaft along x.
!>
!> With a massless shaft in rigid bearings, Omega the speed, J_p and J_d the polar and the diametral inertia, beta the
!> rotating damping of the shaft, c the resting damping of the disc, z = y + i z and theta of the disc:
!>
!>     m z'' + (c + beta k) z' + (1 - i beta Omega) k z = 0,   k = 48 E I/L^3, unstable above Omega = w (1 + c/(beta k)),
!>     J_d theta'' + (beta k' - i J_p Omega) theta' + (1 - i beta Omega) k' theta = 0,   k' = 12 E I/L.
!>
!> Bearings of stiffness b and cross-coupled stiffness q are in series with the shaft: 1/k of it + 1/(2 (b - i q)).
module scene_rotor
   use kschur, only: error_type, error_usage, new_error, text, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, tube
   use scene_joint, only: add_fix
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, gyroscopic_damping
   use scene_vectors, only: dyad, identity, rpm, skew, turned
   implicit none
   private
   public :: build_rotor, rotor_options

   !> Length and diameter of the shaft, m; its moduli, Pa.
   real(wp), parameter :: length = 1, diameter = 0.04_wp, youngs_modulus = 2.1e11_wp, shear_modulus = 8.1e10_wp
   !> Mass (kg) and radius (m) of the disc, thin.
   real(wp), parameter :: mass = 40, radius = 0.25_wp
   !> Stiffness of a bearing along y and z, N/m.
   real(wp), parameter :: isotropic(2) = 2.0e6_wp, anisotropic(2) = [2.0e6_wp, 1.0e6_wp]
   !> The axis of the shaft.
   real(wp), parameter :: axis(3) = identity(:, 1)

contains

   !> What the scene can be asked for.
   pure function rotor_options() result(options)
      type(options_type) :: options

      options%description = "disc on a spinning shaft in two bearings"
      allocate (options%list(8))
      options%list(1) = option_type("--speed", "3000", "speed of the shaft, rpm")
      options%list(2) = option_type("--bearings", "isotropic", "rigid, isotropic (2 MN/m) or anisotropic (2, 1 MN/m)")
      options%list(3) = option_type("--cross", "0", "cross-coupled stiffness of a bearing, as of an oil film, N/m")
      options%list(4) = option_type("--rotating", "1e-4", "damping of the shaft by its stiffness, s")
      options%list(5) = option_type("--resting", "100", "damping of the disc against the ground, N s/m")
      options%list(6) = option_type("--density", "7850", "density of the shaft, kg/m^3")
      options%list(7) = option_type("--elements", "8", "elements of the shaft, an even number: the disc is at the middle")
      options%list(8) = option_type("--damping", "on", "rotating and resting damping: on or none")
   end function rotor_options

   !> Builds the scene: node 1 is the disc, the nodes of the shaft follow. The first is driven: it neither turns about
   !> the axis nor slides. The damping of the shaft acts in axes that turn with it.
   subroutine build_rotor(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: no_arm(3) = 0
      integer, parameter :: most_elements = 10000
      character(len=:), allocatable :: bearings, damping
      type(beam_type) :: shaft
      real(wp) :: speed, cross, rotating, resting, density, inertia(3, 3), stiffness(12, 12)
      integer :: elements, k

      call options%read_not_negative("--speed", speed, error)
      call options%read_choice("--bearings", [character(len=11) :: "rigid", "isotropic", "anisotropic"], bearings, error)
      call options%read_not_negative("--cross", cross, error)
      call options%read_not_negative("--rotating", rotating, error)
      call options%read_not_negative("--resting", resting, error)
      call options%read_choice("--damping", [character(len=4) :: "on", "none"], damping, error)
      call options%require("--damping", "on", [character(len=10) :: "--rotating", "--resting"], error)
      call options%read_not_negative("--density", density, error)
      call options%read_integer("--elements", 2, most_elements, elements, error)
      if (.not. allocated(error) .and. bearings == "rigid" .and. cross > 0) call new_error(error, error_usage, &
         "option --cross wants --bearings isotropic or anisotropic, not 'rigid'")
      if (.not. allocated(error) .and. mod(elements, 2) /= 0) call new_error(error, error_usage, &
         "option --elements wants an even number, as the disc is at the middle of the shaft, not '"//text(elements)//"'")
      if (allocated(error)) return

      if (damping == "none") then
         rotating = 0
         resting = 0
      end if
      speed = rpm*speed
      inertia = mass*radius**2/4*(identity + dyad(axis, axis))
      assembly = new_assembly(6*(elements + 2))
      shaft = tube(diameter, diameter/2, youngs_modulus, shear_modulus, density)
      stiffness = shaft%stiffness(length/elements)
      call add_beam(assembly, [(k, k=2, elements + 2)], shaft%mass(length/elements, .false.), stiffness, [0.0_wp, rotating])
      ! The force -beta K (x' - Omega e x x): the part by the position is a stiffness that is skew.
      call add_beam(assembly, [(k, k=2, elements + 2)], 0*stiffness, &
         -rotating*speed*turned(stiffness, identity, -skew(axis)), [0.0_wp, 0.0_wp])

      associate (disc => node_unknowns(1), middle => node_unknowns(2 + elements/2), &
                 ends => reshape([node_unknowns(2), node_unknowns(elements + 2)], [6, 2]))
         call assembly%mass%add_block(disc, disc, body_mass(mass, inertia))
         call assembly%damping%add_block(disc, disc, gyroscopic_damping(matmul(inertia, speed*axis)))
         call assembly%damping%add_block(disc(:3), disc(:3), resting*(identity - dyad(axis, axis)))
         call add_fix(assembly, disc, no_arm, middle, no_arm)
         call assembly%add_constraints(ends([1, 4], 1), identity(:2, :2))
         do k = 1, 2
            select case (bearings)
            case ("rigid")
               call assembly%add_constraints(ends([2, 3], k), identity(:2, :2))
            case ("isotropic")
               call add_bearing(ends([2, 3], k), isotropic)
            case ("anisotropic")
               call add_bearing(ends([2, 3], k), anisotropic)
            end select
         end do
      end associate
      call assembly%geometry%add_line(reshape([(k*length/elements, 0.0_wp, 0.0_wp, k=0, elements)], [3, elements + 1]), &
         unknowns_of_nodes([(k, k=2, elements + 2)]))
      call assembly%geometry%add_line(reshape([elements/2*length/elements, 0.0_wp, 0.0_wp], [3, 1]), unknowns_of_nodes([1]))

   contains

      subroutine add_bearing(places, springs)
         integer, intent(in) :: places(2)
         real(wp), intent(in) :: springs(2)

         call assembly%stiffness%add_block(places, places, reshape([springs(1), -cross, cross, springs(2)], [2, 2]))
      end subroutine add_bearing
   end subroutine build_rotor
end module scene_rotor
