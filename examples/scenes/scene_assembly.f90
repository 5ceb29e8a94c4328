!> Collects the matrices of a scene, element by element, and makes the modal
!> problem of them.
module scene_assembly
   use kschur, only: csr_matrix_type, error_type, modal_problem_type, new_csr_from_triplets, new_modal_problem, wp
   use scene_geometry, only: geometry_type
   implicit none
   private
   public :: assembly_type, new_assembly, node_unknowns, triplets_type, unknowns_of_nodes

   !> A growing list of matrix entries; entries of the same place add up.
   type :: triplets_type
      private
      integer :: entries = 0
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
   contains
      !> Adds one entry, also when it is zero.
      procedure :: add_entry
      !> Adds a dense block without its zeros.
      procedure :: add_block
   end type triplets_type

   !> A scene under construction: M, K, R (n x n) and Cq (m x n).
   type :: assembly_type
      type(triplets_type) :: mass, stiffness, damping, constraints
      !> Number of unknowns n.
      integer :: unknowns = 0
      !> Number of constraints m so far.
      integer :: multipliers = 0
      !> Where the scene stands; empty where there is nothing to draw.
      type(geometry_type) :: geometry
   contains
      !> Adds the mass, the stiffness and the Rayleigh damping of an element.
      procedure :: add_element
      !> Appends rows to the constraint Jacobian.
      procedure :: add_constraints
      !> Makes the modal problem.
      procedure :: finish
   end type assembly_type

contains

   !> An empty assembly of a given number of unknowns.
   pure function new_assembly(unknowns) result(assembly)
      integer, intent(in) :: unknowns
      type(assembly_type) :: assembly

      assembly%unknowns = unknowns
   end function new_assembly

   !> Where the six unknowns of a node stand: translations (m), then rotations
   !> (rad), along x, y, z. Node 0 is held still and has none: six zeros, which
   !> every block skips.
   pure function node_unknowns(node) result(places)
      integer, intent(in) :: node
      integer :: places(6)
      integer :: i

      places = 0
      if (node > 0) places = [(6*(node - 1) + i, i=1, 6)]
   end function node_unknowns

   !> The six unknowns of each node.
   pure function unknowns_of_nodes(nodes) result(places)
      integer, intent(in) :: nodes(:)
      integer :: places(6, size(nodes))
      integer :: k

      do k = 1, size(nodes)
         places(:, k) = node_unknowns(nodes(k))
      end do
   end function unknowns_of_nodes

   !> Adds an element's M, K and alpha M + beta K.
   pure subroutine add_element(self, places, mass, stiffness, rayleigh)
      class(assembly_type), intent(inout) :: self
      !> Unknowns of the element; 0 where it is held still.
      integer, intent(in) :: places(:)
      !> Element matrices, size(places) square.
      real(wp), intent(in) :: mass(:, :), stiffness(:, :)
      !> alpha (1/s) and beta (s).
      real(wp), intent(in) :: rayleigh(2)

      call self%mass%add_block(places, places, mass)
      call self%stiffness%add_block(places, places, stiffness)
      call self%damping%add_block(places, places, rayleigh(1)*mass + rayleigh(2)*stiffness)
   end subroutine add_element

   !> Appends the constraints rows x(places) = 0.
   pure subroutine add_constraints(self, places, rows)
      class(assembly_type), intent(inout) :: self
      integer, intent(in) :: places(:)
      real(wp), intent(in) :: rows(:, :)
      integer :: i

      call self%constraints%add_block([(self%multipliers + i, i=1, size(rows, 1))], places, rows)
      self%multipliers = self%multipliers + size(rows, 1)
   end subroutine add_constraints

   !> Makes the problem of what was added; fails as `new_modal_problem` does.
   subroutine finish(self, problem, error)
      class(assembly_type), intent(in) :: self
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: mass, stiffness, damping, constraints

      associate (n => self%unknowns, m => self%multipliers)
         call make_matrix(self%mass, n, n, mass, error)
         if (.not. allocated(error)) call make_matrix(self%stiffness, n, n, stiffness, error)
         if (.not. allocated(error)) call make_matrix(self%damping, n, n, damping, error)
         if (.not. allocated(error)) call make_matrix(self%constraints, m, n, constraints, error)
         if (.not. allocated(error)) call new_modal_problem(problem, mass, stiffness, error, damping, constraints)
         if (.not. allocated(error)) call self%geometry%make_mesh(n, problem%mesh, error)
      end associate
   end subroutine finish

   subroutine make_matrix(triplets, rows, columns, matrix, error)
      type(triplets_type), intent(in) :: triplets
      integer, intent(in) :: rows, columns
      type(csr_matrix_type), intent(out) :: matrix
      type(error_type), allocatable, intent(out) :: error

      if (triplets%entries == 0) then
         call new_csr_from_triplets(matrix, rows, columns, [integer ::], [integer ::], [real(wp) ::], error)
      else
         associate (k => triplets%entries)
            call new_csr_from_triplets(matrix, rows, columns, &
               triplets%row(:k), triplets%column(:k), triplets%value(:k), error)
         end associate
      end if
   end subroutine make_matrix

   pure subroutine add_entry(self, row, column, value)
      class(triplets_type), intent(inout) :: self
      integer, intent(in) :: row, column
      real(wp), intent(in) :: value

      call make_room(self, 1)
      self%entries = self%entries + 1
      self%row(self%entries) = row
      self%column(self%entries) = column
      self%value(self%entries) = value
   end subroutine add_entry

   !> Adds block(i, j) at (rows(i), columns(j)); places 0 are skipped.
   pure subroutine add_block(self, rows, columns, block)
      class(triplets_type), intent(inout) :: self
      integer, intent(in) :: rows(:), columns(:)
      real(wp), intent(in) :: block(:, :)
      integer :: i, j, k

      call make_room(self, size(block))
      k = self%entries
      do j = 1, size(columns)
         if (columns(j) == 0) cycle
         do i = 1, size(rows)
            if (rows(i) == 0 .or. .not. abs(block(i, j)) > 0) cycle
            k = k + 1
            self%row(k) = rows(i)
            self%column(k) = columns(j)
            self%value(k) = block(i, j)
         end do
      end do
      self%entries = k
   end subroutine add_block

   ! Doubles the arrays where `more` entries would not fit.
   pure subroutine make_room(triplets, more)
      type(triplets_type), intent(inout) :: triplets
      integer, intent(in) :: more
      integer :: room

      room = 0
      if (allocated(triplets%value)) room = size(triplets%value)
      if (triplets%entries + more <= room) return
      room = max(2*room, triplets%entries + more, 1024)
      call resize_integers(triplets%row, triplets%entries, room)
      call resize_integers(triplets%column, triplets%entries, room)
      call resize_reals(triplets%value, triplets%entries, room)
   end subroutine make_room

   pure subroutine resize_integers(array, used, room)
      integer, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: used, room
      integer, allocatable :: larger(:)

      allocate (larger(room))
      if (used > 0) larger(:used) = array(:used)
      call move_alloc(larger, array)
   end subroutine resize_integers

   pure subroutine resize_reals(array, used, room)
      real(wp), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: used, room
      real(wp), allocatable :: larger(:)

      allocate (larger(room))
      if (used > 0) larger(:used) = array(:used)
      call move_alloc(larger, array)
   end subroutine resize_reals
end module scene_assembly
