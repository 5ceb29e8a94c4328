!> Symbolic LDL^T factorisation: elimination order and pattern of L.
module kschur_symbolic
   use kschur_compressed_pattern, only: compressed_pattern_type
   use kschur_elimination_tree, only: find_elimination_tree, multiplications
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_memory, only: integer_bytes, real_bytes
   use kschur_ordering, only: elimination_order
   use kschur_sparse, only: csr_matrix_type, linear_combination, transpose_csr
   use kschur_supernodes, only: find_supernodes
   use kschur_text, only: text
   implicit none
   private
   public :: symbolic_type, analyze, check_fill, triangle_entries

   !> Columns of a block of an update matrix: as many as a call of BLAS multiplies at a time (`kschur_panel`).
   integer, parameter, public :: block_columns = 192

   !> Order, supernodes and row structure of L; all indices 1-based.
   type :: symbolic_type
      !> Unknown order(k) is eliminated as k-th; position is the inverse permutation.
      integer, allocatable :: order(:), position(:)
      !> Supernode s has columns first(s) ... first(s+1)-1 of L, after those of its children.
      integer, allocatable :: first(:)
      !> Rows below its diagonal block: row(start(s):start(s+1)-1), ascending.
      integer(long), allocatable :: start(:)
      integer, allocatable :: row(:)
      !> The supernode of each column.
      integer, allocatable :: supernode(:)
      !> Number of entries of L, without explicit zeros.
      integer(long) :: factor_entries = 0
      !> Number of multiplications of the factorisation.
      real(wp) :: operations = 0
      !> Pattern of the matrix that was analysed.
      type(compressed_pattern_type) :: pattern
   contains
      procedure :: entries_a_column
      !> Parent of a supernode in the elimination tree; 0 at a root.
      procedure :: parent
      !> Number of rows below the diagonal block of a supernode, and the largest of these.
      procedure :: rows_below, most_rows
      !> Whether a supernode has all rows of its parent, as the piece before it of a wide supernode has: its update matrix becomes
      !> that of the parent.
      procedure :: gives_update
      !> Memory in bytes of the factors, their row indices, and the work arrays and update matrices of one thread.
      procedure :: bytes => factor_bytes
      !> Memory in bytes of the update matrices at a time, by one thread.
      procedure :: update_bytes
   end type symbolic_type

contains

   !> Analyses a symmetric matrix in the order of `structure` if given, else of AMD, or of METIS if there are multipliers or it
   !> needs fewer operations. Fails if columns have more than `most_entries` entries on average (error_library).
   recursive subroutine analyze(matrix, structure, most_entries, symbolic, error)
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(in) :: most_entries
      type(symbolic_type), intent(out) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      type(compressed_pattern_type) :: pattern
      integer, allocatable :: order(:), place(:), parent(:), entries(:)
      integer :: status, vertices, k

      ! A matrix that is symmetric to rounding may have a tiny entry on one side only.
      if (.not. matrix%has_symmetric_pattern()) then
         call analyze(linear_combination(1.0_wp, matrix, 1.0_wp, transpose_csr(matrix)), structure, most_entries, symbolic, &
            error)
         return
      end if
      call elimination_order(matrix%row_start, matrix%column, structure, symbolic%position, error)
      if (allocated(error)) return
      call pattern%compress(matrix%row_start, matrix%column, symbolic%position)
      vertices = size(pattern%weight)
      allocate (order(vertices), place(vertices), parent(vertices), entries(vertices), stat=status)
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      order = [(k, k=1, vertices)]
      place = order
      call find_elimination_tree(pattern%start, pattern%neighbour, pattern%weight, order, place, parent, entries)
      associate (weight => pattern%weight(order))
         symbolic%factor_entries = sum((int(weight, long)*(2*entries - weight + 1))/2)
         symbolic%operations = multiplications(weight, entries)
      end associate
      call check_fill(symbolic, most_entries, error)
      if (allocated(error)) return
      call find_structure(pattern, order, parent, entries, symbolic, status)
      if (status /= 0) call no_memory(error)
      symbolic%pattern = pattern
   end subroutine analyze

   !> Fails if columns have more than `most_entries` entries on average (error_library).
   subroutine check_fill(symbolic, most_entries, error)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: most_entries
      type(error_type), allocatable, intent(out) :: error

      if (symbolic%entries_a_column() > most_entries) call new_error(error, error_library, &
         "high fill, "//text(symbolic%entries_a_column())//" entries a column")
   end subroutine check_fill

   ! Computes the supernodes and their rows: row k has entries in all supernodes on the tree path from each entry of row k of A
   ! to the diagonal.
   subroutine find_structure(pattern, order, parent, entries, symbolic, status)
      type(compressed_pattern_type), intent(in) :: pattern
      integer, intent(in) :: order(:), parent(:), entries(:)
      type(symbolic_type), intent(inout) :: symbolic
      integer, intent(out) :: status
      integer, allocatable :: sequence(:), above(:)
      ! The vertices as they stand now, the place of each among them, its first column; of each supernode, the last vertex that
      ! was seen to have rows there.
      integer, allocatable :: vertex(:), place(:), column(:), seen(:)
      integer(long), allocatable :: next(:)
      integer :: nodes, s, k

      call find_supernodes(parent, entries, pattern%weight(order), sequence, symbolic%first, above)
      vertex = order(sequence)
      allocate (place(size(vertex)), column(size(vertex) + 1))
      symbolic%order = pattern%unknowns(vertex)
      symbolic%position(symbolic%order) = [(k, k=1, size(symbolic%order))]
      place(vertex) = [(k, k=1, size(vertex))]
      column(1) = 1
      do k = 1, size(vertex)
         column(k + 1) = column(k) + pattern%weight(vertex(k))
      end do
      nodes = size(above)
      allocate (symbolic%supernode(size(symbolic%order)), symbolic%start(nodes + 1), next(nodes), seen(nodes), &
         stat=status)
      if (status /= 0) return
      do s = 1, nodes
         symbolic%supernode(symbolic%first(s):symbolic%first(s + 1) - 1) = s
      end do
      next = 0
      call visit(counting=.true.)
      symbolic%start(1) = 1
      do s = 1, nodes
         symbolic%start(s + 1) = symbolic%start(s) + next(s)
      end do
      allocate (symbolic%row(symbolic%start(nodes + 1) - 1), stat=status)
      if (status /= 0) return
      next = symbolic%start(:nodes)
      call visit(counting=.false.)

   contains

      subroutine visit(counting)
         logical, intent(in) :: counting
         integer :: k, p

         seen = 0
         do k = 1, size(vertex)
            seen(symbolic%supernode(column(k + 1) - 1)) = k
            call climb(k, k, counting)
            do p = pattern%start(vertex(k)), pattern%start(vertex(k) + 1) - 1
               if (place(pattern%neighbour(p)) < k) call climb(place(pattern%neighbour(p)), k, counting)
            end do
         end do
      end subroutine visit

      ! Upwards from vertex `from`, in the rows of vertex k.
      subroutine climb(from, k, counting)
         integer, intent(in) :: from, k
         logical, intent(in) :: counting
         integer :: node, row

         node = symbolic%supernode(column(from))
         do while (seen(node) /= k)
            seen(node) = k
            do row = max(column(k), symbolic%first(node + 1)), column(k + 1) - 1
               if (.not. counting) symbolic%row(next(node)) = row
               next(node) = next(node) + 1
            end do
            node = above(node)
         end do
      end subroutine climb
   end subroutine find_structure

   subroutine no_memory(error)
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_memory, "no memory for the LDL^T factors")
   end subroutine no_memory

   pure integer function entries_a_column(self)
      class(symbolic_type), intent(in) :: self

      entries_a_column = int(self%factor_entries/max(size(self%position), 1))
   end function entries_a_column

   pure integer function parent(self, s)
      class(symbolic_type), intent(in) :: self
      integer, intent(in) :: s

      parent = 0
      if (self%start(s) < self%start(s + 1)) parent = self%supernode(self%row(self%start(s)))
   end function parent

   pure real(wp) function factor_bytes(self, of_number, of_entry) result(bytes)
      class(symbolic_type), intent(in) :: self
      !> Bytes of a number; absent: of a real one.
      real(wp), intent(in), optional :: of_number
      !> Of an entry of L; absent: of a number.
      real(wp), intent(in), optional :: of_entry
      real(wp) :: entries, most_entries, number, entry
      integer :: s, columns, rows

      number = real_bytes
      if (present(of_number)) number = of_number
      entry = number
      if (present(of_entry)) entry = of_entry
      entries = 0
      most_entries = 0
      do s = 1, size(self%first) - 1
         columns = self%first(s + 1) - self%first(s)
         rows = int(self%start(s + 1) - self%start(s))
         entries = entries + real(columns, wp)*((columns - 1)/2.0_wp + rows)
         most_entries = max(most_entries, real(columns, wp)*(columns + rows))
      end do
      bytes = entry*entries + number*(2*most_entries + size(self%order)) + self%update_bytes(number) + &
         integer_bytes*(real(size(self%row), wp) + 6*size(self%order))
   end function factor_bytes

   pure real(wp) function update_bytes(self, of_number) result(bytes)
      class(symbolic_type), intent(in) :: self
      !> As in `bytes`.
      real(wp), intent(in), optional :: of_number
      ! What a supernode drops, that of the child that gives it its own, its own, and of all at a time.
      real(wp), allocatable :: dropped(:), given(:)
      real(wp) :: own, all, number
      integer :: s

      number = real_bytes
      if (present(of_number)) number = of_number
      allocate (dropped(0:size(self%first) - 1), given(0:size(self%first) - 1), source=0.0_wp)
      bytes = 0
      all = 0
      do s = 1, size(self%first) - 1
         own = given(s)
         if (.not. own > 0) own = number*triangle_entries(self%rows_below(s))
         all = all + own - given(s)
         bytes = max(bytes, all)
         all = all - dropped(s)
         if (self%rows_below(s) == 0) all = all - own
         associate (parent => self%parent(s))
            if (self%gives_update(s)) then
               dropped(parent) = dropped(parent) + given(parent)
               given(parent) = own
            else
               dropped(parent) = dropped(parent) + own
            end if
         end associate
      end do
   end function update_bytes

   !> Entries of the lower triangle of a matrix of n rows, stored in blocks of `block_columns` columns: dense matrices with the rows
   !> from their first column on.
   pure integer(long) function triangle_entries(n)
      integer, intent(in) :: n
      integer(long) :: wide, last

      wide = n - mod(n, block_columns)
      last = n - wide
      triangle_entries = (wide*(n + last + block_columns))/2 + last**2
   end function triangle_entries

   pure logical function gives_update(self, s)
      class(symbolic_type), intent(in) :: self
      integer, intent(in) :: s

      gives_update = .false.
      associate (parent => self%parent(s))
         if (parent > 0) gives_update = &
            self%rows_below(s) == self%rows_below(parent) + self%first(parent + 1) - self%first(parent)
      end associate
   end function gives_update

   pure integer function rows_below(self, s)
      class(symbolic_type), intent(in) :: self
      integer, intent(in) :: s

      rows_below = int(self%start(s + 1) - self%start(s))
   end function rows_below

   pure integer function most_rows(self)
      class(symbolic_type), intent(in) :: self

      associate (last => size(self%start))
         most_rows = int(maxval([0_long, self%start(2:last) - self%start(:last - 1)]))
      end associate
   end function most_rows
end module kschur_symbolic
