!> The scene `grid`: a free grid of beams tied where they cross, of any size
!> (section 6.5 of the paper).
module scene_grid
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_beam, only: add_beam, beam_type, table_2_beam, table_2_rayleigh
   use scene_joint, only: add_tie
   use scene_options, only: option_type, options_type
   use scene_vectors, only: turned
   implicit none
   private
   public :: build_grid, grid_options

   !> Elements of a beam from one crossing to the next, 1 m, along x and along y.
   integer, parameter :: elements_along(2) = [3, 2]
   !> Most cells along one side: all counts of entries stay default integers.
   integer, parameter :: most_cells = 2000
   integer, parameter :: most_dashpots = 1000
   !> Axes of the beams along y: the beam's x, y, z are the grid's y, z, x. So
   !> the beams along x stand on edge, those along y lie flat.
   real(wp), parameter :: transverse_axes(3, 3) = &
      reshape([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp], [3, 3])

contains

   !> What the scene can be asked for.
   pure function grid_options() result(options)
      type(options_type) :: options

      options%description = "free grid of beams tied at their crossings"
      allocate (options%list(4))
      options%list(1) = option_type("--cells", "20x14", "cells of 1 m along x and along y")
      options%list(2) = option_type("--mass", "consistent", "mass of the beams: consistent or lumped")
      options%list(3) = option_type("--damping", "rayleigh", "damping: rayleigh or none")
      options%list(4) = option_type("--dashpots", "0", "dashpots of 1 to 10 N s/m to the ground, spread over it")
   end function grid_options

   !> Builds the scene. Nodes are numbered beam after beam, first those along x;
   !> every beam has its own, and each crossing ties two by six rows of Cq.
   subroutine build_grid(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: mass, damping
      integer :: cells(2), nodes_along(2), transverse, dashpots, i, j, k
      real(wp) :: lengths(2), rayleigh(2), element_mass(12, 12), element_stiffness(12, 12)
      type(beam_type) :: beam

      call options%read_integer_pair("--cells", 1, most_cells, cells, error)
      call options%read_choice("--mass", [character(len=10) :: "consistent", "lumped"], mass, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      call options%read_integer("--dashpots", 0, most_dashpots, dashpots, error)
      if (allocated(error)) return

      beam = table_2_beam()
      lengths = 1.0_wp/elements_along
      rayleigh = merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh")
      nodes_along = elements_along*cells + 1
      transverse = (cells(2) + 1)*nodes_along(1)
      assembly = new_assembly(6*(transverse + (cells(1) + 1)*nodes_along(2)))

      element_mass = beam%mass(lengths(1), mass == "lumped")
      element_stiffness = beam%stiffness(lengths(1))
      do j = 0, cells(2)
         associate (nodes => [(j*nodes_along(1) + k, k=1, nodes_along(1))])
            call add_beam(assembly, nodes, element_mass, element_stiffness, rayleigh)
            call assembly%geometry%add_line(reshape([(k*lengths(1), real(j, wp), 0.0_wp, k=0, size(nodes) - 1)], &
               [3, size(nodes)]), unknowns_of_nodes(nodes))
         end associate
      end do
      element_mass = turned(beam%mass(lengths(2), mass == "lumped"), transverse_axes, transverse_axes)
      element_stiffness = turned(beam%stiffness(lengths(2)), transverse_axes, transverse_axes)
      do i = 0, cells(1)
         associate (nodes => [(transverse + i*nodes_along(2) + k, k=1, nodes_along(2))])
            call add_beam(assembly, nodes, element_mass, element_stiffness, rayleigh)
            call assembly%geometry%add_line(reshape([(real(i, wp), k*lengths(2), 0.0_wp, k=0, size(nodes) - 1)], &
               [3, size(nodes)]), unknowns_of_nodes(nodes))
         end associate
      end do
      do j = 0, cells(2)
         do i = 0, cells(1)
            call add_tie(assembly, node_unknowns(1 + j*nodes_along(1) + i*elements_along(1)), &
               node_unknowns(1 + transverse + i*nodes_along(2) + j*elements_along(2)))
         end do
      end do
      call add_dashpots(assembly, dashpots)
   end subroutine build_grid

   ! At one translation each, along x, y and z in turns.
   subroutine add_dashpots(assembly, dashpots)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: dashpots
      real(wp), parameter :: weakest = 1, strongest = 10
      integer :: nodes, i, places(6)

      nodes = assembly%unknowns/6
      do i = 1, dashpots
         places = node_unknowns(1 + int((real(i, wp) - 0.5_wp)/dashpots*nodes))
         call assembly%damping%add_entry(places(1 + mod(i, 3)), places(1 + mod(i, 3)), &
            weakest + (strongest - weakest)*(i - 1)/max(dashpots - 1, 1))
      end do
   end subroutine add_dashpots
end module scene_grid
