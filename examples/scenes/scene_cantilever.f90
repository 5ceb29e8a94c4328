!> The scene `cantilever`: a beam held at its base, a heavy body fixed to its
!> tip (section 6.1 of the paper).
module scene_cantilever
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, table_2_beam, table_2_rayleigh
   use scene_joint, only: add_clamp, add_fix
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, box_inertia
   implicit none
   private
   public :: build_cantilever, cantilever_options

   !> Edges of the tip body along x, y, z, m.
   real(wp), parameter :: edges(3) = [1.0_wp, 2.0_wp, 2.0_wp]
   !> Largest number of elements: all counts of entries stay default integers.
   integer, parameter :: most_elements = 1000000

contains

   !> What the scene can be asked for.
   pure function cantilever_options() result(options)
      type(options_type) :: options

      options%description = "beam clamped at its base, a heavy body at its tip"
      allocate (options%list(6))
      options%list(1) = option_type("--elements", "10", "beam elements")
      options%list(2) = option_type("--tip-mass", "4000", "mass of the tip body, kg")
      options%list(3) = option_type("--length", "6", "length of the beam, m")
      options%list(4) = option_type("--mass", "consistent", "mass of the beam: consistent or lumped")
      options%list(5) = option_type("--damping", "rayleigh", "damping of the beam: rayleigh or none")
      options%list(6) = option_type("--tip-damper", "0", "dashpot between the tip body and the ground, along y, N s/m")
   end function cantilever_options

   !> Builds the scene: node 1 is the body, the beam's nodes follow from the
   !> base on; the base is held by rows of Cq, so m = 12.
   subroutine build_cantilever(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: no_arm(3) = 0
      character(len=:), allocatable :: mass, damping
      integer :: elements, k
      real(wp) :: tip_mass, length, tip_damper
      type(beam_type) :: beam

      call options%read_integer("--elements", 1, most_elements, elements, error)
      call options%read_positive("--tip-mass", tip_mass, error)
      call options%read_positive("--length", length, error)
      call options%read_choice("--mass", [character(len=10) :: "consistent", "lumped"], mass, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      call options%read_not_negative("--tip-damper", tip_damper, error)
      if (allocated(error)) return

      assembly = new_assembly(6*(elements + 2))
      beam = table_2_beam()
      call add_beam(assembly, [(k, k=2, elements + 2)], beam%mass(length/elements, mass == "lumped"), &
         beam%stiffness(length/elements), merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh"))
      call assembly%geometry%add_line(reshape([(k*length/elements, 0.0_wp, 0.0_wp, k=0, elements)], [3, elements + 1]), &
         unknowns_of_nodes([(k, k=2, elements + 2)]))
      call assembly%geometry%add_line(reshape([length + edges(1)/2, 0.0_wp, 0.0_wp], [3, 1]), unknowns_of_nodes([1]))
      associate (body => node_unknowns(1), base => node_unknowns(2), tip => node_unknowns(elements + 2))
         call assembly%mass%add_block(body, body, body_mass(tip_mass, box_inertia(tip_mass, edges)))
         if (tip_damper > 0) call assembly%damping%add_entry(body(2), body(2), tip_damper)
         call add_clamp(assembly, base)
         call add_fix(assembly, body, [-edges(1)/2, 0.0_wp, 0.0_wp], tip, no_arm)
      end associate
   end subroutine build_cantilever
end module scene_cantilever
