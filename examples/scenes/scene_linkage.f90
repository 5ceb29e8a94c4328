!> The scene `linkage`: a ladder of rigid rods, hinged to each other, that folds in a plane anywhere in space. Two rails are
!> rods end to end; rungs between them close loops of one or more cells; springs at the hinges hold all of it.
!>
!> In space a rod has 6 unknowns and a hinge 5 rows of Cq. Three of the five hold rods in the plane, around a closed loop once
!> too often: 3 rows of each loop follow from the others. In the plane itself a rod has 3 unknowns, a hinge has 2 rows, and
!> none follows from others. Both have the same 2 cells - loops motions, and the same modes. One loop of one cell has
!> omega^2 = 4 k/(L^2 (2/3 m + m_rung) + w^2 m/6), k the stiffness of a spring, m, L, w mass, length and edge of a rail's rod.
module scene_linkage
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns
   use scene_beam, only: table_2_rayleigh
   use scene_joint, only: add_joint, revolute_rows
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass, box_inertia
   use scene_vectors, only: degree, dyad, rotation, turned
   implicit none
   private
   public :: build_linkage, linkage_options

   !> Lengths of a rod of a rail and of a rung, m; edge of the square section (m) and mass a length (kg/m) of both.
   real(wp), parameter :: rail_length = 1, rung_length = 0.5_wp, edge = 0.02_wp, line_mass = 3.14_wp
   !> What the plane is tilted about: a line in it along no axis of space, so that tilted rods and hinges are along none.
   real(wp), parameter :: tilt_axis(3) = [1.0_wp, 2.0_wp, 0.0_wp]/sqrt(5.0_wp)
   !> The ends of a rod, as factors of its arm.
   real(wp), parameter :: near_end = -1, far_end = 1

   !> A rod.
   type :: rod_type
      !> Its unknowns; those that a plane does not have are 0.
      integer :: places(6)
      !> Where its centre is, and the lever arm from there to its far end, m.
      real(wp) :: centre(3), arm(3)
   end type rod_type

   !> What all hinges have in common.
   type :: hinge_type
      !> Normal of the plane.
      real(wp) :: axis(3)
      !> What a hinge forbids.
      real(wp), allocatable :: rows(:, :)
      !> Of its spring, N m/rad.
      real(wp) :: stiffness, rayleigh(2)
   end type hinge_type

contains

   !> What the scene can be asked for.
   pure function linkage_options() result(options)
      type(options_type) :: options

      options%description = "ladder of hinged rods in a tilted plane: redundant constraints"
      allocate (options%list(6))
      options%list(1) = option_type("--loops", "8", "closed loops of rods in a row")
      options%list(2) = option_type("--cells-per-loop", "1", "rods of a rail between two rungs")
      options%list(3) = option_type("--tilt", "30", "angle of the plane to x and y, degrees")
      options%list(4) = option_type("--dimensions", "3", "3: bodies in space; 2: in x and y, none redundant")
      options%list(5) = option_type("--stiffness", "100", "stiffness of the spring at each hinge, N m/rad")
      options%list(6) = option_type("--damping", "none", "damping: none or rayleigh")
   end function linkage_options

   !> Builds the scene, cell after cell: rod of either rail, then the rung, if there is one. In space n = 6 (2 cells +
   !> loops + 1) and m = 10 (cells + loops) + 6, which is more than n where every cell is a loop.
   subroutine build_linkage(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_loops = 10000, most_cells = 100, ground(6) = 0
      real(wp), parameter :: no_arm(3) = 0
      character(len=:), allocatable :: damping, dimensions
      type(hinge_type) :: hinge
      type(rod_type) :: rung, rod, rail(2)
      integer :: loops, cells, c, side
      logical :: planar
      real(wp) :: tilt, axes(3, 3)

      call options%read_integer("--loops", 1, most_loops, loops, error)
      call options%read_integer("--cells-per-loop", 1, most_cells, cells, error)
      call options%read_number("--tilt", tilt, error)
      call options%read_choice("--dimensions", ["2", "3"], dimensions, error)
      call options%read_positive("--stiffness", hinge%stiffness, error)
      call options%read_choice("--damping", [character(len=8) :: "none", "rayleigh"], damping, error)
      call options%require("--dimensions", "3", ["--tilt"], error)
      if (allocated(error)) return

      planar = dimensions == "2"
      ! Along the rails, along the rungs, and the normal.
      axes = rotation(tilt_axis, merge(0.0_wp, tilt, planar)*degree)
      hinge%axis = axes(:, 3)
      hinge%rayleigh = merge(table_2_rayleigh, 0.0_wp, damping == "rayleigh")
      allocate (hinge%rows, source=revolute_rows(hinge%axis))
      ! Along the frame of the joint, as multibody codes have them: no such row lies in a plane of two axes of space.
      hinge%rows(4:, 4:) = transpose(axes(:, :2))
      ! In the plane a hinge holds its point along x and y; what else the rows hold does not move.
      if (planar) hinge%rows = hinge%rows(:2, :)

      assembly = new_assembly(merge(3, 6, planar)*(loops*(2*cells + 1) + 1))
      rung = new_rung(0)
      call add_rod(assembly, rung, axes, hinge%rayleigh)
      call add_joint(assembly, ground, no_arm, rung%places, near_end*rung%arm, held(hinge))
      do c = 1, loops*cells
         do side = 1, 2
            rod = new_rod(side)
            call add_rod(assembly, rod, axes, hinge%rayleigh)
            if (c == 1) then
               call join(assembly, hinge, rung, merge(near_end, far_end, side == 1), rod, near_end)
            else
               call join(assembly, hinge, rail(side), far_end, rod, near_end)
            end if
            rail(side) = rod
         end do
         if (mod(c, cells) > 0) cycle
         rung = new_rung(c)
         call add_rod(assembly, rung, axes, hinge%rayleigh)
         call join(assembly, hinge, rail(1), far_end, rung, near_end)
         call join(assembly, hinge, rail(2), far_end, rung, far_end)
      end do

   contains

      ! That of cell c of one of the rails; rungs of the cells before come first.
      pure function new_rod(side) result(new)
         integer, intent(in) :: side
         type(rod_type) :: new

         new%places = body_unknowns(2*(c - 1) + side + (c - 1)/cells + 1, planar)
         new%arm = rail_length/2*axes(:, 1)
         new%centre = (c - 0.5_wp)*rail_length*axes(:, 1) + (side - 1)*rung_length*axes(:, 2)
      end function new_rod

      ! The rung at the end of a cell.
      pure function new_rung(cell) result(new)
         integer, intent(in) :: cell
         type(rod_type) :: new

         new%places = body_unknowns(2*cell + cell/cells + 1, planar)
         new%arm = rung_length/2*axes(:, 2)
         new%centre = cell*rail_length*axes(:, 1) + new%arm
      end function new_rung
   end subroutine build_linkage

   ! The unknowns of a body: all six, or x, y and the rotation about z.
   pure function body_unknowns(body, planar) result(places)
      integer, intent(in) :: body
      logical, intent(in) :: planar
      integer :: places(6)

      places = node_unknowns(body)
      if (planar) places = [3*body - 2, 3*body - 1, 0, 0, 0, 3*body]
   end function body_unknowns

   subroutine add_rod(assembly, rod, axes, rayleigh)
      type(assembly_type), intent(inout) :: assembly
      type(rod_type), intent(in) :: rod
      !> Along the rails, along the rungs, and the normal.
      real(wp), intent(in) :: axes(3, 3), rayleigh(2)
      real(wp), parameter :: no_stiffness(6, 6) = 0
      real(wp) :: mass, edges(3)

      edges = max(2*abs(matmul(rod%arm, axes)), edge)
      mass = line_mass*2*norm2(rod%arm)
      call assembly%add_element(rod%places, body_mass(mass, turned(box_inertia(mass, edges), axes, axes)), no_stiffness, &
         rayleigh)
   end subroutine add_rod

   ! Hinges two rods to each other, with a spring, and draws a line between their centres. The arms are those of the rods,
   ! not differences of places far from the origin: what is redundant is so to rounding.
   subroutine join(assembly, hinge, first, first_end, second, second_end)
      type(assembly_type), intent(inout) :: assembly
      type(hinge_type), intent(in) :: hinge
      type(rod_type), intent(in) :: first, second
      !> `near_end` or `far_end`.
      real(wp), intent(in) :: first_end, second_end
      real(wp), parameter :: no_mass(6, 6) = 0
      real(wp) :: spring(6, 6)

      call add_joint(assembly, first%places, first_end*first%arm, second%places, second_end*second%arm, hinge%rows)
      spring(:3, :3) = hinge%stiffness*dyad(hinge%axis, hinge%axis)
      spring(:3, 4:) = -spring(:3, :3)
      spring(4:, :) = -spring(:3, :)
      call assembly%add_element([first%places(4:), second%places(4:)], no_mass, spring, hinge%rayleigh)
      call assembly%geometry%add_line(reshape([first%centre, second%centre], [3, 2]), &
         reshape([first%places, second%places], [6, 2]))
   end subroutine join

   ! What a joint forbids that does not turn about the axis either.
   pure function held(hinge) result(rows)
      type(hinge_type), intent(in) :: hinge
      real(wp) :: rows(size(hinge%rows, 1) + 1, 6)

      rows = 0
      rows(:size(hinge%rows, 1), :) = hinge%rows
      rows(size(rows, 1), 4:) = hinge%axis
   end function held
end module scene_linkage
