!> The scene `crank`: crank, rod and piston of tetrahedra (section 6.2 of the paper). Bearings hold the end faces of the
!> parts on the average; a guide lets the piston slide along x.
module scene_crank
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly
   use scene_beam, only: table_2_material, table_2_rayleigh
   use scene_joint, only: averaged, prismatic_rows, revolute_rows, spherical_rows
   use scene_options, only: option_type, options_type
   use scene_solid, only: add_box, box_face, box_type
   use scene_vectors, only: degree, identity, rotation
   implicit none
   private
   public :: build_crank, crank_options

   !> Young's modulus (Pa), Poisson's ratio, density (kg/m^3).
   real(wp), parameter :: steel(3) = [2.1e11_wp, 0.3_wp, 7800.0_wp]
   !> A part: its size in units of the thickness (m) of the rod at scale 1.
   real(wp), parameter :: rod_thickness = 0.02_wp
   integer, parameter :: crank = 1, rod = 2, piston = 3, sizes(3, 3) = reshape([5, 2, 1, 15, 1, 1, 3, 3, 2], [3, 3])
   real(wp), parameter :: about(3) = identity(:, 3), along(3) = identity(:, 1)

contains

   !> What the scene can be asked for.
   pure function crank_options() result(options)
      type(options_type) :: options

      options%description = "crank, rod and piston of tetrahedra"
      allocate (options%list(6))
      options%list(1) = option_type("--density", "4", "cells across the rod; n is 11,973 at 4, 253,917 at 12")
      options%list(2) = option_type("--angle", "60", "angle of the crank, degrees")
      options%list(3) = option_type("--bearings", "revolute", "of the rod: revolute or spherical, which lets it spin")
      options%list(4) = option_type("--damping", "rayleigh", "damping: rayleigh or none")
      options%list(5) = option_type("--material", "steel", "steel, or table-2 of the paper: 100 MPa, 1000 kg/m^3")
      options%list(6) = option_type("--scale", "1", "factor on all lengths; the rod is 0.3 m long at 1")
   end function crank_options

   !> Builds the scene: the nodes of crank, rod and piston; m = 20, or 16 with spherical bearings.
   subroutine build_crank(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_cells = 20
      character(len=:), allocatable :: bearings, damping, material
      real(wp) :: angle, factor
      type(box_type) :: box(3)
      integer :: cells, before(4), p

      call options%read_integer("--density", 1, most_cells, cells, error)
      call options%read_number("--angle", angle, error)
      call options%read_choice("--bearings", [character(len=9) :: "revolute", "spherical"], bearings, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      call options%read_choice("--material", [character(len=7) :: "steel", "table-2"], material, error)
      call options%read_positive("--scale", factor, error)
      if (allocated(error)) return

      box = parts(angle*degree, cells, merge(table_2_material, steel, material == "table-2"), factor*rod_thickness)
      before(1) = 0
      do p = 1, 3
         before(p + 1) = before(p) + 3*box(p)%nodes()
      end do
      assembly = new_assembly(before(4))
      do p = 1, 3
         call add_box(assembly, box(p), before(p), merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh"))
      end do
      call hold(assembly, box(crank), before(crank), .false., revolute_rows(about))
      do p = crank, rod
         if (bearings == "revolute") then
            call join(assembly, box(p:p + 1), before(p:p + 1), revolute_rows(about))
         else
            call join(assembly, box(p:p + 1), before(p:p + 1), spherical_rows())
         end if
      end do
      call hold(assembly, box(piston), before(piston), .true., prismatic_rows(along))
   end subroutine build_crank

   ! Joins an end face to the ground.
   subroutine hold(assembly, box, before, far, rows)
      type(assembly_type), intent(inout) :: assembly
      type(box_type), intent(in) :: box
      integer, intent(in) :: before
      logical, intent(in) :: far
      !> What the joint forbids.
      real(wp), intent(in) :: rows(:, :)
      integer, allocatable :: places(:, :)
      real(wp), allocatable :: arms(:, :)

      call box_face(box, before, far, places, arms)
      call assembly%add_constraints([places], averaged(rows, arms))
   end subroutine hold

   ! Joins the far face of the first box to the near face of the second.
   subroutine join(assembly, box, before, rows)
      type(assembly_type), intent(inout) :: assembly
      type(box_type), intent(in) :: box(2)
      integer, intent(in) :: before(2)
      real(wp), intent(in) :: rows(:, :)
      integer, allocatable :: first(:, :), second(:, :)
      real(wp), allocatable :: first_arms(:, :), second_arms(:, :)

      call box_face(box(1), before(1), .true., first, first_arms)
      call box_face(box(2), before(2), .false., second, second_arms)
      call assembly%add_constraints([second, first], reshape([averaged(rows, second_arms), -averaged(rows, first_arms)], &
         [size(rows, 1), size(first) + size(second)]))
   end subroutine join

   ! Crank, rod and piston in their places: the middle of the first face of each is where the part before ends.
   pure function parts(angle, cells, material, thickness) result(box)
      !> Angle of the crank, rad, and cells across the rod.
      real(wp), intent(in) :: angle
      integer, intent(in) :: cells
      !> As `steel`, and thickness of the rod, m.
      real(wp), intent(in) :: material(3), thickness
      type(box_type) :: box(3)
      real(wp) :: start(3), turn(3, 3), angles(3)
      integer :: p

      angles = [angle, -asin(sin(angle)*sizes(1, crank)/sizes(1, rod)), 0.0_wp]
      start = 0
      do p = 1, 3
         turn = rotation(about, angles(p))
         associate (edges => thickness*sizes(:, p))
            box(p) = box_type(material(1), material(2), material(3), cells*sizes(:, p), edges, &
               start - matmul(turn, [0.0_wp, edges(2), edges(3)]/2), turn)
            start = start + turn(:, 1)*edges(1)
         end associate
      end do
   end function parts
end module scene_crank
