!> The scene `shell`: a square panel of steel sheet, flat, curved, or bent to a whole cylinder, of four-node elements.
!>
!> A flat one on hinged edges has Mindlin's closed form. With k^2 = pi^2 (i^2 + j^2)/L^2, D = E t^3/(12 (1 - nu^2)) and
!> S = 5/6 G t, of each pair i, j omega is the smaller root of
!>
!>     (S k^2 - rho t omega^2) (D k^2 + S - rho t^3/12 omega^2) = S^2 k^2.
!>
!> A thin free cylinder of radius r bends without stretching at nearly omega^2 = D/(rho t r^4) i^2 (i^2 - 1)^2/(i^2 + 1), twice
!> for each i from 2 on (Rayleigh, The Theory of Sound, section 233).
module scene_shell
   use kschur, only: error_type, error_usage, new_error, vtk_quadrilateral, wp
   use scene_assembly, only: assembly_type, new_assembly
   use scene_options, only: option_type, options_type
   use scene_shell_element, only: shell_type
   use scene_vectors, only: cross, degree, identity, turned
   implicit none
   private
   public :: build_shell, shell_options

   !> Young's modulus (Pa), Poisson's ratio, density (kg/m^3); alpha (1/s) and beta (s) of the Rayleigh damping.
   real(wp), parameter :: youngs_modulus = 2.1e11_wp, poisson_ratio = 0.3_wp, density = 7850
   real(wp), parameter :: damped(2) = [1.0_wp, 1.0e-5_wp]
   !> Edges along x and along the arc, m.
   real(wp), parameter :: length = 1

contains

   !> What the scene can be asked for.
   pure function shell_options() result(options)
      type(options_type) :: options

      options%description = "square panel of steel sheet, flat, curved or a whole cylinder"
      allocate (options%list(5))
      options%list(1) = option_type("--cells", "20x20", "elements along the axis x and along the arc")
      options%list(2) = option_type("--angle", "0", "of the arc of 1 m, degrees; 0 is flat, 360 a whole cylinder")
      options%list(3) = option_type("--thickness", "0.01", "thickness of the sheet, m")
      options%list(4) = option_type("--supports", "hinged", "of all edges: hinged, clamped or free")
      options%list(5) = option_type("--damping", "rayleigh", "damping: rayleigh or none")
   end function shell_options

   !> Builds the scene. Nodes are numbered along x, then along the arc; their rotations are about the global axes.
   subroutine build_shell(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_cells = 1000
      character(len=:), allocatable :: supports, damping
      type(shell_type) :: shell
      integer, allocatable :: places(:, :, :), cell(:, :)
      real(wp), allocatable :: position(:, :, :)
      real(wp) :: angle, rayleigh(2), axes(3, 3), mass(24, 24), stiffness(24, 24)
      integer :: cells(2), last, i, j, c
      logical :: closed

      call options%read_integer_pair("--cells", 1, most_cells, cells, error)
      call options%read_not_negative("--angle", angle, error)
      call options%read_positive("--thickness", shell%thickness, error)
      call options%read_choice("--supports", [character(len=7) :: "hinged", "clamped", "free"], supports, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      closed = .not. angle < 360
      if (.not. allocated(error) .and. (angle > 360 .or. closed .and. cells(2) < 3)) call new_error(error, error_usage, &
         "option --angle wants a number from 0 to 360, and of 360 three cells along the arc")
      if (allocated(error)) return

      allocate (places(6, 0:cells(1), 0:cells(2)), position(3, 0:cells(1), 0:cells(2)))
      allocate (cell(4, product(cells)))
      last = 0
      do j = 0, cells(2)
         do i = 0, cells(1)
            position(:, i, j) = on_arc(i*length/cells(1), j*length/cells(2), angle*degree)
            associate (free => is_free(supports, any(i == [0, cells(1)]), any(j == [0, cells(2)]) .and. .not. closed))
               places(:, i, j) = merge([(last + count(free(:c)), c=1, 6)], 0, free)
               if (.not. (closed .and. j == cells(2))) last = last + count(free)
            end associate
         end do
      end do
      if (closed) places(:, :, cells(2)) = places(:, :, 0)

      assembly = new_assembly(last)
      rayleigh = merge(damped, 0.0_wp, damping == "rayleigh")
      shell%youngs_modulus = youngs_modulus
      shell%poisson_ratio = poisson_ratio
      shell%density = density
      shell%edges = [length/cells(1), norm2(position(:, 0, 1) - position(:, 0, 0))]
      do j = 1, cells(2)
         axes(:, 1) = identity(:, 1)
         axes(:, 2) = (position(:, 0, j) - position(:, 0, j - 1))/shell%edges(2)
         axes(:, 3) = cross(axes(:, 1), axes(:, 2))
         mass = turned(shell%mass(), axes, axes)
         stiffness = turned(shell%stiffness(), axes, axes)
         do i = 1, cells(1)
            call assembly%add_element([places(:, i - 1, j - 1), places(:, i, j - 1), places(:, i, j), places(:, i - 1, j)], &
               mass, stiffness, rayleigh)
            cell(:, i + (j - 1)*cells(1)) = i + (j - 1)*(cells(1) + 1) + [0, 1, cells(1) + 2, cells(1) + 1]
         end do
      end do
      call assembly%geometry%add_cells(reshape(position, [3, size(position)/3]), reshape(places, [6, size(places)/6]), cell, &
         vtk_quadrilateral)
   end subroutine build_shell

   ! Where a place of the sheet is: x is the axis of the arc, whose middle is at z = 0.
   pure function on_arc(x, arc, angle) result(position)
      !> From a corner, m.
      real(wp), intent(in) :: x, arc
      !> Of the arc, rad.
      real(wp), intent(in) :: angle
      real(wp) :: position(3)

      position = [x, arc - length/2, 0.0_wp]
      if (.not. angle > 0) return
      associate (radius => length/angle, from_middle => (arc/length - 0.5_wp)*angle)
         position(2:) = radius*[sin(from_middle), -2*sin(from_middle/2)**2]
      end associate
   end function on_arc

   ! Which of the six unknowns of a node are not held. A hinged edge may turn about itself.
   pure function is_free(supports, at_end, on_side) result(free)
      character(len=*), intent(in) :: supports
      !> Whether the node is on an edge along the arc, or on one along x.
      logical, intent(in) :: at_end, on_side
      logical :: free(6)

      free = supports == "free" .or. .not. (at_end .or. on_side)
      if (supports /= "hinged") return
      if (at_end) free(5:6) = .true.
      if (on_side) free(4) = .not. at_end
      if (on_side) free(5:6) = .false.
   end function is_free
end module scene_shell
