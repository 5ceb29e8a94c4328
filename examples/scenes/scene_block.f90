!> The scene `block`: a cube of steel, of eight-node bricks or ten-node tetrahedra, that may spin: the fill of three
!> dimensions. Or two of them, one behind the other along x, on a hinge.
!>
!> It spins about the x axis, through its middle, and is described in axes that turn with it (S = skew(e), P = I - e e^T):
!>
!>     M u'' + (R + 2 W S_M) u' + (K - W^2 P_M + K_s) u = 0.
!>
!> K_s is of the stresses rho W^2/2 (a^2 - y^2) along y and as much along z, a half the edge: they are in equilibrium with the
!> centrifugal force and with free faces, so that what moves as a rigid body does it as it should. They are the stresses where
!> Poisson's ratio is zero; what it changes in them is in equilibrium with itself.
module scene_block
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly
   use scene_cell, only: brick_cell, cell_type, tetrahedra_cell
   use scene_joint, only: averaged, revolute_rows
   use scene_options, only: option_type, options_type
   use scene_vectors, only: dyad, identity, rpm, skew
   implicit none
   private
   public :: add_block, block_options, block_type, build_block

   !> alpha (1/s) and beta (s), and beta of the half that is damped otherwise.
   real(wp), parameter :: alpha = 10, beta = 1.0e-6_wp, other_beta = 5.0e-6_wp
   !> Of the dashpot, N s/m.
   real(wp), parameter :: dashpot = 1.0e5_wp
   !> What it spins about.
   real(wp), parameter :: axis(3) = identity(:, 1)

   !> A box of equal cells, the middle of its first face at a place of the x axis.
   type :: block_type
      type(cell_type) :: cell
      !> Young's modulus (Pa), Poisson's ratio, density (kg/m^3): those of steel.
      real(wp) :: youngs_modulus = 2.1e11_wp, poisson_ratio = 0.3_wp, density = 7850
      !> Number of cells and edges (m) along x, y, z.
      integer :: cells(3)
      real(wp) :: edges(3)
      !> Where the first face is, m.
      real(wp) :: start = 0
      !> Unknowns before those of the block.
      integer :: before = 0
      !> Whether the first face is held still, and its nodes have no unknowns.
      logical :: clamped = .false.
   contains
      !> Number of unknowns.
      procedure :: unknowns
      !> Unknowns of the node at a place, counted from 0 along each edge.
      procedure :: unknowns_at
      !> Where that node is, m.
      procedure :: position_of
   end type block_type

contains

   !> What the scene can be asked for.
   pure function block_options() result(options)
      type(options_type) :: options

      options%description = "cube of steel, clamped, free, or two on a hinge; it may spin"
      allocate (options%list(5))
      options%list(1) = option_type("--cells", "10", "cells along an edge of 1 m; n of bricks is 3,630 at 10")
      options%list(2) = option_type("--element", "hex8", "hex8: bricks, or tet10: tetrahedra, six a cell")
      options%list(3) = option_type("--supports", "clamped", "clamped at a face, free, or hinged: two free ones")
      options%list(4) = option_type("--damping", "rayleigh", "damping: none, rayleigh, dashpot or general")
      options%list(5) = option_type("--speed", "0", "speed about the axis through the clamped face, rpm")
   end function block_options

   !> Builds the scene. A node has three unknowns, none where it is clamped; m = 0, or 5 of the hinge, which holds the motion
   !> that fits the two faces by least squares and lets them turn about z.
   subroutine build_block(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: most_cells = 100
      character(len=:), allocatable :: element, supports, damping
      type(block_type) :: block(2)
      real(wp) :: rayleigh(2, 2), speed
      integer :: cells, corner(3), b, last

      call options%read_integer("--cells", 1, most_cells, cells, error)
      call options%read_choice("--element", [character(len=5) :: "hex8", "tet10"], element, error)
      call options%read_choice("--supports", [character(len=7) :: "clamped", "free", "hinged"], supports, error)
      call options%read_choice("--damping", [character(len=8) :: "none", "rayleigh", "dashpot", "general"], damping, error)
      call options%read_not_negative("--speed", speed, error)
      if (allocated(error)) return

      last = merge(2, 1, supports == "hinged")
      do b = 1, last
         block(b)%cells = cells
         block(b)%edges = 1
         if (element == "hex8") block(b)%cell = brick_cell(block(b)%edges/cells)
         if (element == "tet10") block(b)%cell = tetrahedra_cell(block(b)%edges/cells)
         block(b)%clamped = supports == "clamped"
      end do
      block(2)%start = block(1)%edges(1)
      block(2)%before = block(1)%unknowns()

      rayleigh = spread(merge([alpha, beta], 0.0_wp, damping /= "none"), 2, 2)
      if (damping == "general") rayleigh(2, 2) = other_beta
      assembly = new_assembly(block(last)%before + block(last)%unknowns())
      do b = 1, last
         call add_block(assembly, block(b), rayleigh, rpm*speed)
      end do
      if (supports == "hinged") call add_hinge(assembly, block)
      if (damping == "dashpot") then
         corner = block(last)%unknowns_at(block(last)%cells*block(last)%cell%steps)
         call assembly%damping%add_entry(corner(3), corner(3), dashpot)
      end if
   end subroutine build_block

   !> Adds a block.
   subroutine add_block(assembly, block, rayleigh, speed)
      type(assembly_type), intent(inout) :: assembly
      type(block_type), intent(in) :: block
      !> alpha (1/s) and beta (s) of the Rayleigh damping of the cells of the first half along x, and of the others.
      real(wp), intent(in) :: rayleigh(2, 2)
      !> About x, rad/s.
      real(wp), intent(in) :: speed
      real(wp) :: inertia(size(block%cell%at, 2), size(block%cell%at, 2))
      real(wp), dimension(size(block%cell%at), size(block%cell%at)) :: mass, stiffness, turning, pulled
      integer :: places(3, size(block%cell%at, 2)), i, j, k, c, half

      inertia = block%cell%mass(block%density)
      mass = in_space(inertia, identity)
      stiffness = block%cell%stiffness(block%youngs_modulus, block%poisson_ratio)
      turning = in_space(inertia, 2*speed*skew(axis))
      do k = 0, block%cells(3) - 1
         do j = 0, block%cells(2) - 1
            if (speed > 0) pulled = in_space(block%cell%stress_stiffness(stresses(j, k)), identity) &
               - in_space(inertia, speed**2*(identity - dyad(axis, axis)))
            do i = 0, block%cells(1) - 1
               do c = 1, size(places, 2)
                  places(:, c) = block%unknowns_at([i, j, k]*block%cell%steps + block%cell%at(:, c))
               end do
               half = merge(1, 2, 2*i < block%cells(1))
               call assembly%add_element([places], mass, stiffness, rayleigh(:, half))
               if (.not. speed > 0) cycle
               call assembly%damping%add_block([places], [places], turning)
               call assembly%stiffness%add_block([places], [places], pulled)
            end do
         end do
      end do
      call add_geometry(assembly, block)

   contains

      ! At the points of the cells j along y and k along z.
      pure function stresses(j, k) result(stress)
         integer, intent(in) :: j, k
         real(wp) :: stress(3, size(block%cell%weight))
         integer :: d, at(3)

         at = [0, j, k]
         stress = 0
         do d = 2, 3
            associate (from_middle => at(d)*block%edges(d)/block%cells(d) + block%cell%position(d, :) - block%edges(d)/2)
               stress(d, :) = block%density*speed**2/2*((block%edges(d)/2)**2 - from_middle**2)
            end associate
         end do
      end function stresses
   end subroutine add_block

   ! The matrix of a cell where each pair of nodes has this matrix of its directions.
   pure function in_space(of_nodes, directions) result(matrix)
      real(wp), intent(in) :: of_nodes(:, :), directions(3, 3)
      real(wp) :: matrix(3*size(of_nodes, 1), 3*size(of_nodes, 1))
      integer :: i, j

      do j = 1, 3
         do i = 1, 3
            matrix(i::3, j::3) = directions(i, j)*of_nodes
         end do
      end do
   end function in_space

   ! Holds the near face of the second block to the far face of the first, on the average.
   subroutine add_hinge(assembly, block)
      type(assembly_type), intent(inout) :: assembly
      type(block_type), intent(in) :: block(2)
      integer, allocatable :: near(:, :), far(:, :)
      real(wp), allocatable :: arms(:, :)

      call face(block(1), block(1)%cells(1)*block(1)%cell%steps, far, arms)
      call face(block(2), 0, near, arms)
      associate (rows => averaged(revolute_rows(identity(:, 3)), arms))
         call assembly%add_constraints([near, far], reshape([rows, -rows], [size(rows, 1), 2*size(rows, 2)]))
      end associate
   end subroutine add_hinge

   ! The nodes at one place along x: their unknowns, and positions from the axis, m.
   subroutine face(block, place, places, arms)
      type(block_type), intent(in) :: block
      integer, intent(in) :: place
      integer, allocatable, intent(out) :: places(:, :)
      real(wp), allocatable, intent(out) :: arms(:, :)
      integer :: j, k, n

      associate (last => block%cells*block%cell%steps)
         allocate (places(3, product(last(2:) + 1)), arms(3, product(last(2:) + 1)))
         n = 0
         do k = 0, last(3)
            do j = 0, last(2)
               n = n + 1
               places(:, n) = block%unknowns_at([place, j, k])
               arms(:, n) = block%position_of([place, j, k])
            end do
         end do
      end associate
      arms(1, :) = 0
   end subroutine face

   subroutine add_geometry(assembly, block)
      type(assembly_type), intent(inout) :: assembly
      type(block_type), intent(in) :: block
      integer, allocatable :: places(:, :), element(:, :)
      real(wp), allocatable :: position(:, :)
      integer :: last(3), at(3), n, e, i, j, k

      last = block%cells*block%cell%steps
      allocate (places(3, product(last + 1)), position(3, product(last + 1)))
      do n = 1, size(places, 2)
         at = [mod(n - 1, last(1) + 1), mod((n - 1)/(last(1) + 1), last(2) + 1), (n - 1)/product(last(:2) + 1)]
         places(:, n) = block%unknowns_at(at)
         position(:, n) = block%position_of(at)
      end do
      associate (of_cell => block%cell%element, along => [1, last(1) + 1, product(last(:2) + 1)])
         allocate (element(size(of_cell, 1), size(of_cell, 2)*product(block%cells)))
         e = 0
         do k = 0, block%cells(3) - 1
            do j = 0, block%cells(2) - 1
               do i = 0, block%cells(1) - 1
                  element(:, e + 1:e + size(of_cell, 2)) = 1 + dot_product(along, block%cell%steps*[i, j, k]) &
                     + reshape(matmul(along, block%cell%at(:, [of_cell])), shape(of_cell))
                  e = e + size(of_cell, 2)
               end do
            end do
         end do
      end associate
      call assembly%geometry%add_cells(position, places, element, block%cell%kind)
   end subroutine add_geometry

   pure integer function unknowns(self)
      class(block_type), intent(in) :: self

      associate (last => self%cells*self%cell%steps)
         unknowns = 3*(last(1) + merge(0, 1, self%clamped))*product(last(2:) + 1)
      end associate
   end function unknowns

   ! Node after node along x, then y, then z.
   pure function unknowns_at(self, at) result(places)
      class(block_type), intent(in) :: self
      integer, intent(in) :: at(3)
      integer :: places(3)

      places = 0
      if (self%clamped .and. at(1) == 0) return
      associate (last => self%cells*self%cell%steps, held => merge(1, 0, self%clamped))
         places = self%before + 3*(at(1) - held + (last(1) + 1 - held)*(at(2) + (last(2) + 1)*at(3))) + [1, 2, 3]
      end associate
   end function unknowns_at

   pure function position_of(self, at) result(position)
      class(block_type), intent(in) :: self
      integer, intent(in) :: at(3)
      real(wp) :: position(3)

      position = at*self%edges/(self%cells*self%cell%steps) + [self%start, -self%edges(2:)/2]
   end function position_of
end module scene_block
