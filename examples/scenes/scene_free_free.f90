!> The scene `free-free`: beams with a body fixed to one end that nothing holds (section 6.3 of the paper). Each has six
!> rigid motions, exact zeros, and beside them the modes of one alone.
module scene_free_free
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, table_2_beam, table_2_rayleigh
   use scene_joint, only: add_fix
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, box_inertia
   implicit none
   private
   public :: build_free_free, free_free_options

   !> Length of a beam, m; mass (kg) and edges (m) of a body.
   real(wp), parameter :: length = 6, mass = 100, edges(3) = [0.5_wp, 1.0_wp, 1.0_wp]

contains

   !> What the scene can be asked for.
   pure function free_free_options() result(options)
      type(options_type) :: options

      options%description = "beams with a body at one end that nothing holds"
      allocate (options%list(3))
      options%list(1) = option_type("--bodies", "3", "how many, apart from each other")
      options%list(2) = option_type("--elements", "8", "elements of each beam")
      options%list(3) = option_type("--damping", "rayleigh", "damping of the beams: rayleigh or none")
   end function free_free_options

   !> Builds the scene, one beam after the other: its nodes, then its body; m = 6 a body.
   subroutine build_free_free(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: no_arm(3) = 0, apart = 2
      integer, parameter :: most_bodies = 1000, most_elements = 1000
      character(len=:), allocatable :: damping
      integer :: bodies, elements, b, k
      type(beam_type) :: beam

      call options%read_integer("--bodies", 1, most_bodies, bodies, error)
      call options%read_integer("--elements", 1, most_elements, elements, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      if (allocated(error)) return

      assembly = new_assembly(6*bodies*(elements + 2))
      beam = table_2_beam()
      do b = 0, bodies - 1
         associate (nodes => [(b*(elements + 2) + k, k=1, elements + 2)])
            call add_beam(assembly, nodes(:elements + 1), beam%mass(length/elements, .false.), &
               beam%stiffness(length/elements), merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh"))
            associate (tip => node_unknowns(nodes(elements + 1)), body => node_unknowns(nodes(elements + 2)))
               call assembly%mass%add_block(body, body, body_mass(mass, box_inertia(mass, edges)))
               call add_fix(assembly, tip, no_arm, body, [-edges(1)/2, 0.0_wp, 0.0_wp])
            end associate
            call assembly%geometry%add_line(reshape([(k*length/elements, b*apart, 0.0_wp, k=0, elements), &
               length + edges(1)/2, b*apart, 0.0_wp], [3, elements + 2]), unknowns_of_nodes(nodes))
         end associate
      end do
   end subroutine build_free_free
end module scene_free_free
