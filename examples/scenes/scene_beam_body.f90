!> The scene `beam-body`: Chrono's BeamFixBody, the problem its eigensolver is
!> tested on (data/testing/modal/eigensolver in projectchrono/chrono).
module scene_beam_body
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, table_2_beam, table_2_rayleigh
   use scene_joint, only: add_fix
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, box_inertia
   implicit none
   private
   public :: beam_body_options, build_beam_body

   integer, parameter :: elements = 4
   !> Length of the beam, m.
   real(wp), parameter :: length = 6
   !> Edges of the tip body along x, y, z, m.
   real(wp), parameter :: edges(3) = [0.5_wp, 1.0_wp, 1.0_wp]
   !> Mass of the tip body, kg: its density is 200 kg/m^3.
   real(wp), parameter :: tip_mass = 100

contains

   !> What the scene can be asked for.
   pure function beam_body_options() result(options)
      type(options_type) :: options

      options%description = "clamped beam of 4 lumped elements with a body of 100 kg at its tip"
      allocate (options%list(1))
      options%list(1) = option_type("--damping", "none", "none, rayleigh (beam only) or zero (R of explicit zeros)")
   end function beam_body_options

   !> Builds the scene: node 1 is the body, nodes 2 to 5 are the beam's, whose
   !> clamped end is left out; n = 30, m = 6.
   subroutine build_beam_body(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: nodes(0:elements) = [0, 2, 3, 4, 5]
      real(wp), parameter :: no_arm(3) = 0
      character(len=:), allocatable :: damping
      type(beam_type) :: beam
      integer :: i

      call options%read_choice("--damping", [character(len=8) :: "none", "rayleigh", "zero"], damping, error)
      if (allocated(error)) return

      assembly = new_assembly(6*(elements + 1))
      beam = table_2_beam()
      call add_beam(assembly, nodes, beam%mass(length/elements, lumped=.true.), beam%stiffness(length/elements), &
         merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh"))
      call assembly%geometry%add_line(reshape([(i*length/elements, 0.0_wp, 0.0_wp, i=0, elements)], [3, elements + 1]), &
         unknowns_of_nodes(nodes))
      call assembly%geometry%add_line(reshape([length + edges(1)/2, 0.0_wp, 0.0_wp], [3, 1]), unknowns_of_nodes([1]))
      associate (body => node_unknowns(1), tip => node_unknowns(nodes(elements)))
         call assembly%mass%add_block(body, body, body_mass(tip_mass, box_inertia(tip_mass, edges)))
         call add_fix(assembly, body, [-edges(1)/2, 0.0_wp, 0.0_wp], tip, no_arm)
      end associate
      if (damping == "zero") then
         do i = 1, assembly%unknowns
            call assembly%damping%add_entry(i, i, 0.0_wp)
         end do
      end if
   end subroutine build_beam_body
end module scene_beam_body
