!> The scene `turbine`: the NREL 5-MW reference turbine at an operating point (section 6.4 of the paper). Tower and blades
!> are beams, nacelle, hub and generator bodies. x is downwind, z up.
module scene_turbine
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, tube
   use scene_joint, only: add_clamp, add_fix, add_reaction, add_revolute
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, gyroscopic_damping, spin_damping, spin_stiffness
   use scene_ring, only: new_ring, ring_type
   use scene_turbine_blade, only: axial, blade_length, chord, edge, edge_inertia, flap, flap_inertia, lumped, mass, place, &
      section, stations, torsion, tributary, twist
   use scene_vectors, only: cross, degree, dyad, identity, rpm, turned
   implicit none
   private
   public :: build_turbine, turbine_options

   real(wp), parameter :: gravity = 9.81_wp, air_density = 1.225_wp, pi = acos(-1.0_wp)
   !> Tower: height, diameter and thickness at base and top (m), moduli (Pa), density with paint and bolts (kg/m^3).
   real(wp), parameter :: tower_height = 87.6_wp, tower_diameter(2) = [6.0_wp, 3.87_wp], &
      tower_thickness(2) = [0.0351_wp, 0.0247_wp], tower_moduli(2) = [210.0e9_wp, 80.8e9_wp], tower_density = 8500
   !> Nacelle: mass (kg), inertia about the tower axis (kg m^2), centre from the tower top (m).
   real(wp), parameter :: nacelle_mass = 240000, nacelle_yaw_inertia = 2607890, nacelle_centre(3) = [1.9_wp, 0.0_wp, 1.75_wp]
   !> Hub: mass (kg), inertia (kg m^2), of a shell the same about all axes; radius (m).
   real(wp), parameter :: hub_mass = 56780, hub_inertia = 115926, hub_radius = 1.5_wp
   !> Overhang along the shaft, upwind, and height of the shaft on the tower axis above the top (m); angles (rad).
   real(wp), parameter :: overhang = 5.0191_wp, shaft_height = 1.96256_wp, tilt = 5*degree, precone = 2.5_wp*degree
   !> Shaft: torsional stiffness (N m/rad) and damping (N m s/rad); generator inertia on its side of the gears (kg m^2).
   real(wp), parameter :: shaft_stiffness = 867637000, shaft_damping = 6215000, gears = 97, generator_inertia = 534.116_wp
   !> Damping by stiffness (s): 1 % at the first tower mode, 0.477465 % at the first flapwise mode of a blade.
   real(wp), parameter :: tower_beta = 2*0.01_wp/(2*pi*0.32_wp), blade_beta = 2*0.00477465_wp/(2*pi*0.68_wp)
   !> Axis of the shaft, which the rotor turns about by the right-hand rule; direction of the first blade.
   real(wp), parameter :: shaft(3) = [cos(tilt), 0.0_wp, -sin(tilt)], upwards(3) = [sin(tilt), 0.0_wp, cos(tilt)], &
      span(3) = cos(precone)*upwards - sin(precone)*shaft
   real(wp), parameter :: top(3) = [0.0_wp, 0.0_wp, tower_height], &
      hub_centre(3) = top + shaft_height*identity(:, 3) - overhang*shaft
   real(wp), parameter :: no_arm(3) = 0, down(3) = -identity(:, 3)
   !> Nodes of the bodies; those of the tower and of the blades follow.
   integer, parameter :: nacelle_node = 1, hub_node = 2, generator_node = 3, bodies = 3

contains

   !> What the scene can be asked for.
   pure function turbine_options() result(options)
      type(options_type) :: options

      options%description = "NREL 5-MW reference wind turbine at an operating point"
      allocate (options%list(5))
      options%list(1) = option_type("--speed", "0", "speed of the rotor, rpm; rated 12.1")
      options%list(2) = option_type("--generator", "locked", "generator: locked at its speed or free")
      options%list(3) = option_type("--damping", "on", "structural damping: on or none")
      options%list(4) = option_type("--aerodynamic", "1", "factor on the damping by the air; -1 reverses it")
      options%list(5) = option_type("--tower-elements", "20", "elements of the tower")
   end function turbine_options

   !> Builds the scene.
   subroutine build_turbine(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_elements = 1000
      character(len=:), allocatable :: generator, damping
      real(wp) :: speed, aerodynamic, damped, rotor_mass
      integer :: elements, i

      call options%read_not_negative("--speed", speed, error)
      call options%read_choice("--generator", [character(len=6) :: "locked", "free"], generator, error)
      call options%read_choice("--damping", [character(len=4) :: "on", "none"], damping, error)
      call options%read_number("--aerodynamic", aerodynamic, error)
      call options%read_integer("--tower-elements", 1, most_elements, elements, error)
      if (allocated(error)) return

      damped = merge(1.0_wp, 0.0_wp, damping == "on")
      rotor_mass = hub_mass + 3*sum([(lumped(mass, i), i=1, stations)])
      assembly = new_assembly(6*(bodies + elements + 1 + 3*stations))
      call add_tower(assembly, elements, damped*tower_beta, nacelle_mass + rotor_mass)
      call add_nacelle(assembly, rotor_mass)
      call add_shaft(assembly, rpm*speed, generator == "locked", damped*shaft_damping)
      call add_blades(assembly, bodies + elements + 1, rpm*speed, damped*blade_beta, aerodynamic)
   end subroutine build_turbine

   ! From the base, which is held, to the top; loaded by its own weight and by what stands on it.
   subroutine add_tower(assembly, elements, beta, mass_above)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: elements
      real(wp), intent(in) :: beta, mass_above
      ! From local axes, x along the beam.
      real(wp), parameter :: upright(3, 3) = reshape([identity(:, 3), identity(:, 2), -identity(:, 1)], [3, 3])
      type(beam_type) :: element
      real(wp) :: height, length, above
      integer :: k

      length = tower_height/elements
      above = mass_above
      do k = elements, 1, -1
         height = (k - 0.5_wp)/elements
         element = tube(between(tower_diameter, height), between(tower_thickness, height), tower_moduli(1), tower_moduli(2), &
            tower_density)
         above = above + element%density*element%area*length/2
         associate (nodes => bodies + [k, k + 1], stiffness => element%stiffness(length))
            call add_beam(assembly, nodes, turned(element%mass(length, .false.), upright, upright), &
               turned(stiffness, upright, upright), [0.0_wp, beta])
            ! Its weight bends the tower further.
            call add_beam(assembly, nodes, 0*stiffness, &
               turned(element%geometric_stiffness(length, -above*gravity), upright, upright), [0.0_wp, 0.0_wp])
         end associate
         above = above + element%density*element%area*length/2
      end do
      call add_clamp(assembly, node_unknowns(bodies + 1))
      call add_fix(assembly, node_unknowns(bodies + elements + 1), no_arm, node_unknowns(nacelle_node), -nacelle_centre)
      call add_reaction(assembly, node_unknowns(bodies + elements + 1), no_arm, node_unknowns(nacelle_node), &
         -nacelle_centre, mass_above*gravity*down)
      call assembly%geometry%add_line(reshape([(0.0_wp, 0.0_wp, k*length, k=0, elements), hub_centre], [3, elements + 2]), &
         unknowns_of_nodes([(bodies + 1 + k, k=0, elements), hub_node]))
      do k = 1, bodies
         if (k /= hub_node) call assembly%geometry%add_line(reshape(top + nacelle_centre, [3, 1]), unknowns_of_nodes([k]))
      end do
   end subroutine add_tower

   pure subroutine add_nacelle(assembly, rotor_mass)
      type(assembly_type), intent(inout) :: assembly
      real(wp), intent(in) :: rotor_mass
      real(wp) :: inertia(3, 3)

      associate (nacelle => node_unknowns(nacelle_node), hub => node_unknowns(hub_node), &
                 arm => hub_centre - top - nacelle_centre)
         inertia = (nacelle_yaw_inertia - nacelle_mass*nacelle_centre(1)**2)*dyad(down, down)
         call assembly%mass%add_block(nacelle, nacelle, body_mass(nacelle_mass, inertia))
         call add_revolute(assembly, nacelle, arm, hub, no_arm, shaft)
         call add_reaction(assembly, nacelle, arm, hub, no_arm, rotor_mass*gravity*down)
      end associate
   end subroutine add_nacelle

   ! The hub, and behind the shaft the generator.
   pure subroutine add_shaft(assembly, speed, locked, damping)
      type(assembly_type), intent(inout) :: assembly
      real(wp), intent(in) :: speed, damping
      logical, intent(in) :: locked
      real(wp) :: about_shaft(6, 6)

      associate (nacelle => node_unknowns(nacelle_node), hub => node_unknowns(hub_node), &
                 generator => node_unknowns(generator_node))
         call assembly%mass%add_block(hub, hub, body_mass(hub_mass, hub_inertia*identity))
         call assembly%damping%add_block(hub, hub, gyroscopic_damping(hub_inertia*speed*shaft))
         call assembly%mass%add_block(generator, generator, &
            body_mass(0.0_wp, gears**2*generator_inertia*dyad(shaft, shaft)))
         about_shaft(1:3, 1:3) = dyad(shaft, shaft)
         about_shaft(1:3, 4:6) = -about_shaft(1:3, 1:3)
         about_shaft(4:6, :) = -about_shaft(1:3, :)
         call assembly%add_element([hub(4:), generator(4:)], 0*about_shaft, shaft_stiffness*about_shaft, &
            [0.0_wp, damping/shaft_stiffness])
         if (locked) then
            call add_fix(assembly, nacelle, no_arm, generator, no_arm)
         else
            call add_revolute(assembly, nacelle, no_arm, generator, no_arm, shaft)
         end if
      end associate
   end subroutine add_shaft

   ! Three beams with their masses at the stations, seen from axes that turn with the rotor.
   subroutine add_blades(assembly, before, speed, beta, aerodynamic)
      type(assembly_type), intent(inout) :: assembly
      !> Nodes before those of the blades.
      integer, intent(in) :: before
      real(wp), intent(in) :: speed, beta, aerodynamic
      type(ring_type) :: ring
      type(beam_type) :: element
      real(wp) :: masses(stations), along(stations), pull(stations), here(9), axes(3, 3), inertia(3, 3), air(6, 6), &
         stiffness(12, 12), tension(12, 12)
      integer :: nodes(stations, 3), i, k

      ring = new_ring(shaft, speed)
      nodes = before + reshape([(i, i=1, 3*stations)], [stations, 3])
      masses = [(lumped(mass, i), i=1, stations)]
      do i = 1, stations
         here = section(real(i, wp))
         along(i) = hub_radius + blade_length*here(place)
      end do
      ! Centrifugal force of all from a station on.
      pull = [(speed**2*cos(precone)*sum(masses(i:)*along(i:)), i=1, stations)]

      do i = 1, stations
         here = section(real(i, wp))
         axes = section_axes(here(twist))
         inertia = lumped(flap_inertia, i)*(dyad(axes(:, 2), axes(:, 2)) + dyad(span, span)) &
            + lumped(edge_inertia, i)*(dyad(axes(:, 3), axes(:, 3)) + dyad(span, span))
         ! Quasi-steady lift, slope 2 pi, by a velocity across the section; it follows the section.
         air = 0
         air(1:3, 1:3) = aerodynamic*pi*air_density*chord(along(i) - hub_radius)*tributary(i)*speed*along(i)*cos(precone) &
            *dyad(axes(:, 3), axes(:, 3))
         call ring%add(assembly, unknowns_of(nodes(i:i, :)), body_mass(masses(i), inertia), &
            spin_damping(masses(i), inertia, speed*shaft) + air, spin_stiffness(masses(i), inertia, speed*shaft))
      end do
      do i = 1, stations - 1
         here = section(i + 0.5_wp)
         axes = section_axes(here(twist))
         ! Stiffness in units of 10^6.
         element = beam_type(1.0e6_wp, 1.0e6_wp, 0.0_wp, here(axial), here(flap), here(edge), here(torsion))
         stiffness = turned(element%stiffness(along(i + 1) - along(i)), axes, axes)
         tension = turned(element%geometric_stiffness(along(i + 1) - along(i), cos(precone)*pull(i + 1)), axes, axes)
         call ring%add(assembly, unknowns_of(nodes(i:i + 1, :)), 0*stiffness, beta*stiffness, stiffness + tension)
      end do
      do k = 1, 3
         associate (hub => node_unknowns(hub_node), root => node_unknowns(nodes(1, k)), &
                    arm => hub_radius*matmul(ring%turn(:, :, k), span), outwards => matmul(ring%turn(:, :, k), upwards))
            call add_fix(assembly, hub, arm, root, no_arm)
            call add_reaction(assembly, hub, arm, root, no_arm, pull(1)*outwards)
            call assembly%geometry%add_line(spread(hub_centre, 2, stations) + spread(arm/hub_radius, 2, stations) &
               *spread(along, 1, 3), unknowns_of_nodes(nodes(:, k)))
         end associate
      end do
   end subroutine add_blades

   ! Of the nodes of each column.
   pure function unknowns_of(nodes) result(places)
      integer, intent(in) :: nodes(:, :)
      integer :: places(6*size(nodes, 1), size(nodes, 2))
      integer :: i, j

      do j = 1, size(nodes, 2)
         places(:, j) = [(node_unknowns(nodes(i, j)), i=1, size(nodes, 1))]
      end do
   end function unknowns_of

   ! Axes of a section of the first blade, as columns: along the blade, edgewise towards the leading edge, flapwise
   ! downwind. The twist turns the leading edge upwind.
   pure function section_axes(twist) result(axes)
      !> Degrees.
      real(wp), intent(in) :: twist
      real(wp) :: axes(3, 3)
      real(wp), parameter :: downwind(3) = cos(precone)*shaft + sin(precone)*upwards

      associate (forward => cross(downwind, span), c => cos(twist*degree), s => sin(twist*degree))
         axes = reshape([span, c*forward - s*downwind, c*downwind + s*forward], [3, 3])
      end associate
   end function section_axes

   pure real(wp) function between(ends, part)
      real(wp), intent(in) :: ends(2), part

      between = ends(1) + part*(ends(2) - ends(1))
   end function between
end module scene_turbine
