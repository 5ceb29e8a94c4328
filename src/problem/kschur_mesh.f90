!> Mesh of a problem: nodes, the node and component of each unknown, and cells. Solves do not need it; pictures of modes and
!> directions of motion do.
module kschur_mesh
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_error, only: error_type, new_error, error_input, error_memory
   use kschur_kinds, only: wp
   use kschur_quotient_graph, only: stable_order
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: text
   implicit none
   private
   public :: mesh_type, join_nodes, settle_mesh

   !> Set by the caller, then checked by `settle_mesh`.
   type :: mesh_type
      !> Positions (m in SI), 3 x nodes.
      real(wp), allocatable :: coordinates(:, :)
      !> T, N x n: the unknowns u = T q that move the nodes, from the n unknowns q of the problem; u includes, for example, slaves
      !> that were eliminated before. Nodes and components below are those of u. Not allocated: u = q.
      type(csr_matrix_type), allocatable :: transformation
      !> Node of each unknown, n or N; 0 where it has none.
      integer, allocatable :: unknown_node(:)
      !> What each unknown is there, n or N: 0, 1, 2 translations along x, y, z, 3, 4, 5 rotations about them.
      integer, allocatable :: unknown_component(:)
      !> Cells in VTK's layout: cell c has the nodes connectivity(offsets(c) + 1:offsets(c + 1)), counted from 1, and
      !> VTK's number types(c). Not allocated where the problem came without.
      integer, allocatable :: offsets(:), connectivity(:), types(:)
   contains
      !> Numbers of nodes and cells.
      procedure :: nodes
      procedure :: cells
      !> Nodal displacements of a shape.
      procedure :: displacements
      !> Rigid motions of the mesh, and the number of unknowns that have none.
      procedure :: rigid_motions
      procedure :: unplaced
   end type mesh_type

   !> Names of `rigid_motions`: translations along x, y, z and rotations about these axes.
   character(len=2), parameter, public :: rigid_motion_names(6) = ["x ", "y ", "z ", "rx", "ry", "rz"]

   !> VTK's numbers of cells.
   integer, parameter, public :: vtk_vertex = 1, vtk_line = 3, vtk_quadrilateral = 9, vtk_tetrahedron = 10, &
      vtk_hexahedron = 12, vtk_quadratic_tetrahedron = 24

contains

   !> Checks a mesh for a problem of n unknowns, or for those of its transformation. If nodes and components of unknowns are not
   !> given, sets them: unknowns are numbered node by node, each with three translations and three rotations, or three
   !> translations, or those along x and y, or that along z.
   subroutine settle_mesh(mesh, n, error)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error
      integer :: moving

      if (allocated(error)) return
      moving = n
      if (allocated(mesh%transformation)) then
         call check_transformation(mesh, n, error)
         if (allocated(error)) return
         moving = mesh%transformation%rows
      end if
      if (size(mesh%coordinates, 1) /= 3 .or. mesh%nodes() < 1) then
         call new_error(error, error_input, "the coordinates must be those of one node or more, three for each")
      else if (.not. all(ieee_is_finite(mesh%coordinates))) then
         call new_error(error, error_input, "the coordinates hold what is not a finite number")
      else if (allocated(mesh%unknown_node) .neqv. allocated(mesh%unknown_component)) then
         call new_error(error, error_input, "of the unknowns' nodes and components one is missing: give both or none")
      else if (.not. allocated(mesh%unknown_node)) then
         call number_in_order(mesh, moving, error)
      else
         call check_unknowns(mesh, moving, error)
      end if
      if (.not. allocated(error) .and. allocated(mesh%types)) call check_cells(mesh, error)
   end subroutine settle_mesh

   subroutine check_transformation(mesh, n, error)
      type(mesh_type), intent(in) :: mesh
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error

      associate (t => mesh%transformation)
         if (t%columns /= n) then
            call new_error(error, error_input, "the transformation is "//text(t%rows)//" x "//text(t%columns)// &
               " but must have a column for each of "//text(n)//" unknowns")
         else if (.not. all(ieee_is_finite(t%value))) then
            call new_error(error, error_input, "the transformation holds what is not a finite number")
         else if (.not. allocated(mesh%types)) then
            call new_error(error, error_input, "with a transformation the cells must be given: the stiffness matrix does not "// &
               "join nodes whose unknowns were eliminated")
         end if
      end associate
   end subroutine check_transformation

   ! Sets node and component of n unknowns that are numbered node by node.
   subroutine number_in_order(mesh, n, error)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error
      integer :: each, i, status

      each = n/mesh%nodes()
      if (each*mesh%nodes() /= n .or. all(each /= [1, 2, 3, 6])) then
         call new_error(error, error_input, text(n)//" unknowns are not 1, 2, 3 or 6 for each of "//text(mesh%nodes())// &
            " nodes: it must be said of each unknown to which node it belongs, and what it is there")
         return
      end if
      allocate (mesh%unknown_node(n), mesh%unknown_component(n), stat=status)
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      do i = 1, n
         mesh%unknown_node(i) = 1 + (i - 1)/each
         mesh%unknown_component(i) = mod(i - 1, each)
      end do
      if (each == 1) mesh%unknown_component = 2
   end subroutine number_in_order

   ! Fails if a node or component does not exist, or two unknowns are the same component of a node.
   subroutine check_unknowns(mesh, n, error)
      type(mesh_type), intent(in) :: mesh
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error
      logical, allocatable :: taken(:, :)
      integer :: i, status

      if (size(mesh%unknown_node) /= n .or. size(mesh%unknown_component) /= n) then
         call new_error(error, error_input, "the unknowns' nodes and components must be "//text(n)//" each, not "// &
            text(size(mesh%unknown_node))//" and "//text(size(mesh%unknown_component)))
         return
      end if
      allocate (taken(0:5, mesh%nodes()), source=.false., stat=status)
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      do i = 1, n
         associate (node => mesh%unknown_node(i), component => mesh%unknown_component(i))
            if (node == 0) cycle
            if (node < 0 .or. node > mesh%nodes() .or. component < 0 .or. component > 5) then
               call new_error(error, error_input, "unknown "//text(i)//" is component "//text(component)// &
                  " of node "//text(node)//", but there are components 0 to 5 and "//text(mesh%nodes())//" nodes (counted from 1)")
            else if (taken(component, node)) then
               call new_error(error, error_input, "two unknowns are component "//text(component)// &
                  " of node "//text(node)//" (counted from 1)")
            else
               taken(component, node) = .true.
            end if
         end associate
         if (allocated(error)) return
      end do
   end subroutine check_unknowns

   subroutine no_memory(error)
      type(error_type), allocatable, intent(inout) :: error

      call new_error(error, error_memory, "no memory for the mesh")
   end subroutine no_memory

   subroutine check_cells(mesh, error)
      type(mesh_type), intent(in) :: mesh
      type(error_type), allocatable, intent(inout) :: error
      integer :: cells

      cells = mesh%cells()
      if (size(mesh%offsets) /= cells + 1) then
         call new_error(error, error_input, text(cells)//" cells need "//text(cells + 1)//" offsets, not "// &
            text(size(mesh%offsets)))
      else if (mesh%offsets(1) /= 0 .or. mesh%offsets(cells + 1) /= size(mesh%connectivity) &
         .or. any(mesh%offsets(2:) < mesh%offsets(:cells))) then
         call new_error(error, error_input, "the offsets of the cells must grow from 0 to the number of nodes in "// &
            "the connectivity, "//text(size(mesh%connectivity)))
      else if (any(mesh%connectivity < 1 .or. mesh%connectivity > mesh%nodes())) then
         call new_error(error, error_input, "a cell has a node that is none of the "//text(mesh%nodes()))
      else if (any(mesh%types < 1 .or. mesh%types > 255)) then
         call new_error(error, error_input, "a cell's type is none of VTK's, which lie between 1 and 255")
      end if
   end subroutine check_cells

   !> If the mesh has no cells, creates lines between nodes that a matrix couples.
   subroutine join_nodes(mesh, matrix)
      type(mesh_type), intent(inout) :: mesh
      !> Stiffness of the unknowns of the checked mesh.
      type(csr_matrix_type), intent(in) :: matrix
      integer, allocatable :: first(:), unknowns(:), seen(:), joined(:)
      integer :: lines, pass, node, k

      if (allocated(mesh%types)) return
      ! Unknowns without a node come first.
      call stable_order(mesh%unknown_node + 1, mesh%nodes() + 1, unknowns, first)
      allocate (seen(mesh%nodes()))
      do pass = 1, 2
         lines = 0
         seen(:) = 0
         do node = 1, mesh%nodes()
            do k = first(node + 1), first(node + 2) - 1
               call add_lines(unknowns(k))
            end do
         end do
         if (pass == 1) allocate (joined(2*lines))
      end do
      allocate (mesh%offsets(lines + 1), source=[(2*k, k=0, lines)])
      allocate (mesh%types(lines), source=vtk_line)
      call move_alloc(joined, mesh%connectivity)

   contains

      ! Adds lines from the node to coupled nodes with higher numbers.
      subroutine add_lines(row)
         integer, intent(in) :: row
         integer :: entry, other

         do entry = matrix%row_start(row), matrix%row_start(row + 1) - 1
            if (.not. abs(matrix%value(entry)) > 0) cycle
            other = mesh%unknown_node(matrix%column(entry))
            if (other <= node) cycle
            if (seen(other) == node) cycle
            seen(other) = node
            lines = lines + 1
            if (pass == 2) joined(2*lines - 1:2*lines) = [node, other]
         end do
      end subroutine add_lines
   end subroutine join_nodes

   pure integer function nodes(self)
      class(mesh_type), intent(in) :: self

      nodes = size(self%coordinates, 2)
   end function nodes

   pure integer function cells(self)
      class(mesh_type), intent(in) :: self

      cells = 0
      if (allocated(self%types)) cells = size(self%types)
   end function cells

   !> Displacements of the nodes, 3 x nodes; zero for missing components.
   pure subroutine displacements(self, shape, moved)
      class(mesh_type), intent(in) :: self
      !> A vector of the problem's unknowns, n.
      complex(wp), intent(in) :: shape(:)
      complex(wp), allocatable, intent(out) :: moved(:, :)
      integer :: i

      allocate (moved(3, self%nodes()))
      moved = 0
      do i = 1, size(self%unknown_node)
         if (self%unknown_node(i) > 0 .and. self%unknown_component(i) < 3) &
            moved(1 + self%unknown_component(i), self%unknown_node(i)) = of_unknown(i)
      end do

   contains

      ! Displacement u_i.
      pure complex(wp) function of_unknown(i)
         integer, intent(in) :: i

         if (.not. allocated(self%transformation)) then
            of_unknown = shape(i)
         else
            associate (t => self%transformation, first => self%transformation%row_start(i), &
               last => self%transformation%row_start(i + 1) - 1)
               of_unknown = sum(t%value(first:last)*shape(t%column(first:last)))
            end associate
         end if
      end function of_unknown
   end subroutine displacements

   !> Motions of the unknowns, n x 6, when the whole mesh is translated by 1 m along x, y, z, or rotated by 1 rad about these axes
   !> through the origin (linearised); zero for an unknown without a node. With a transformation an unknown has the motion of the
   !> row of T that consists of it alone, with entry 1.
   pure subroutine rigid_motions(self, motions)
      class(mesh_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: motions(:, :)
      integer :: i

      if (.not. allocated(self%transformation)) then
         allocate (motions(size(self%unknown_node), 6), source=0.0_wp)
         do i = 1, size(motions, 1)
            if (self%unknown_node(i) > 0) motions(i, :) = rigid_motion(self, i)
         end do
         return
      end if
      associate (t => self%transformation)
         allocate (motions(t%columns, 6), source=0.0_wp)
         do i = 1, t%rows
            if (self%unknown_node(i) == 0) cycle
            if (is_unit_row(t, i)) motions(t%column(t%row_start(i)), :) = rigid_motion(self, i)
         end do
      end associate
   end subroutine rigid_motions

   !> Number of unknowns that move nodes but have no row of the transformation to themselves: zero in `rigid_motions`, as T does
   !> not tell where they are.
   pure integer function unplaced(self)
      class(mesh_type), intent(in) :: self
      logical, allocatable :: moves(:), placed(:)
      integer :: i

      unplaced = 0
      if (.not. allocated(self%transformation)) return
      associate (t => self%transformation)
         allocate (moves(t%columns), placed(t%columns), source=.false.)
         do i = 1, t%rows
            if (self%unknown_node(i) == 0) cycle
            moves(t%column(t%row_start(i):t%row_start(i + 1) - 1)) = .true.
            if (is_unit_row(t, i)) placed(t%column(t%row_start(i))) = .true.
         end do
      end associate
      unplaced = count(moves .and. .not. placed)
   end function unplaced

   ! Whether the only entry of a row is 1.
   pure logical function is_unit_row(matrix, row)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: row

      is_unit_row = matrix%row_start(row + 1) == matrix%row_start(row) + 1
      if (is_unit_row) is_unit_row = .not. abs(matrix%value(matrix%row_start(row)) - 1) > 0
   end function is_unit_row

   ! The six rigid motions at an unknown that has a node.
   pure function rigid_motion(mesh, i) result(motion)
      type(mesh_type), intent(in) :: mesh
      integer, intent(in) :: i
      real(wp) :: motion(6)
      integer :: c

      motion = 0
      c = mesh%unknown_component(i)
      motion(1 + c) = 1
      if (c > 2) return
      ! Component c of e x p, e along the next axis and the one after that.
      associate (next => modulo(c + 1, 3), last => modulo(c + 2, 3), p => mesh%coordinates(:, mesh%unknown_node(i)))
         motion(4 + next) = p(1 + last)
         motion(4 + last) = -p(1 + next)
      end associate
   end function rigid_motion
end module kschur_mesh
