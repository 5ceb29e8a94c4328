!> Symbolic LDL^T factorisation: elimination order and pattern of L.
module kschur_symbolic
   use kschur_elimination_tree, only: count_entries, find_parents, find_postorder
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_memory, only: integer_bytes, real_bytes
   use kschur_minimum_degree, only: minimum_degree_order
   use kschur_ordering, only: elimination_order
   use kschur_sparse, only: csr_matrix_type, linear_combination, transpose_csr
   use kschur_supernodes, only: find_supernodes
   use kschur_text, only: text
   implicit none
   private
   public :: symbolic_type, analyze, check_fill

   ! Multiplications for each entry of a matrix above which METIS is tried too: nested dissection, which costs about a thousand
   ! for each entry, pays off for solids.
   real(wp), parameter :: solid_work = 4000

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
   contains
      procedure :: entries_a_column
      !> Largest number of rows below the diagonal block of a supernode.
      procedure :: most_rows
      !> Memory in bytes of the factors, their row indices, and the work arrays of one thread.
      procedure :: bytes => factor_bytes
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
      type(symbolic_type) :: dissected
      integer, allocatable :: parent(:), entries(:)
      logical :: free
      integer :: status

      ! A matrix that is symmetric to rounding may have a tiny entry on one side only.
      if (.not. matrix%has_symmetric_pattern()) then
         call analyze(linear_combination(1.0_wp, matrix, 1.0_wp, transpose_csr(matrix)), structure, most_entries, symbolic, &
            error)
         return
      end if
      ! A multiplier eliminated before the unknowns it constrains would act as a penalty that swamps their stiffness.
      free = structure%multipliers == 0 .and. .not. allocated(structure%position)
      if (free) then
         call minimum_degree_order(matrix%row_start, matrix%column, symbolic%position, error)
      else
         call elimination_order(matrix%row_start, matrix%column, structure, symbolic%position, error)
      end if
      if (.not. allocated(error)) call find_tree(matrix, symbolic, parent, entries, error)
      if (allocated(error)) return
      if (free .and. symbolic%operations > solid_work*matrix%nonzeros()) then
         call elimination_order(matrix%row_start, matrix%column, structure, dissected%position, error)
         if (.not. allocated(error)) call find_tree(matrix, dissected, parent, entries, error)
         if (allocated(error)) return
         if (dissected%operations < symbolic%operations) then
            symbolic = dissected
         else
            call find_tree(matrix, symbolic, parent, entries, error)
            if (allocated(error)) return
         end if
      end if
      call check_fill(symbolic, most_entries, error)
      if (allocated(error)) return
      call find_structure(matrix, parent, entries, symbolic, status)
      if (status /= 0) call no_memory(error)
   end subroutine analyze

   !> Fails if columns have more than `most_entries` entries on average (error_library).
   subroutine check_fill(symbolic, most_entries, error)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: most_entries
      type(error_type), allocatable, intent(out) :: error

      if (symbolic%entries_a_column() > most_entries) call new_error(error, error_library, &
         "high fill, "//text(symbolic%entries_a_column())//" entries a column")
   end subroutine check_fill

   ! Computes the elimination tree and column counts, and postorders them.
   subroutine find_tree(matrix, symbolic, parent, entries, error)
      type(csr_matrix_type), intent(in) :: matrix
      !> Has a position; is reordered.
      type(symbolic_type), intent(inout) :: symbolic
      integer, allocatable, intent(out) :: parent(:), entries(:)
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: sequence(:), rank(:)
      integer :: k, n, status

      n = matrix%rows
      allocate (parent(n), entries(n), sequence(n), rank(n), stat=status)
      if (status /= 0) then
         call no_memory(error)
         return
      end if
      symbolic%order = [(k, k=1, n)]
      symbolic%order(symbolic%position) = symbolic%order
      call find_parents(matrix%row_start, matrix%column, symbolic%order, symbolic%position, parent)
      call find_postorder(parent, sequence)
      call reorder(symbolic, sequence)
      rank(sequence) = [(k, k=1, n)]
      parent = parent(sequence)
      do k = 1, n
         if (parent(k) > 0) parent(k) = rank(parent(k))
      end do
      call count_entries(matrix%row_start, matrix%column, symbolic%order, symbolic%position, parent, entries)
      symbolic%factor_entries = sum(int(entries, long))
      symbolic%operations = sum(real(entries, wp)**2)/2
   end subroutine find_tree

   ! Computes the supernodes and their rows: row k has entries in all supernodes on the tree path from each entry of row k of A
   ! to the diagonal.
   subroutine find_structure(matrix, parent, entries, symbolic, status)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: parent(:), entries(:)
      type(symbolic_type), intent(inout) :: symbolic
      integer, intent(out) :: status
      integer, allocatable :: sequence(:), above(:)
      integer(long), allocatable :: next(:)
      integer :: nodes, s

      call find_supernodes(parent, entries, sequence, symbolic%first, above)
      call reorder(symbolic, sequence)
      nodes = size(above)
      allocate (symbolic%supernode(matrix%rows), symbolic%start(nodes + 1), next(nodes), stat=status)
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
         integer :: seen(nodes)
         integer :: i, k, p, s

         seen = 0
         do k = 1, matrix%rows
            seen(symbolic%supernode(k)) = k
            do p = matrix%row_start(symbolic%order(k)), matrix%row_start(symbolic%order(k) + 1) - 1
               i = symbolic%position(matrix%column(p))
               if (i > k) cycle
               s = symbolic%supernode(i)
               do while (seen(s) /= k)
                  seen(s) = k
                  if (.not. counting) symbolic%row(next(s)) = k
                  next(s) = next(s) + 1
                  s = above(s)
               end do
            end do
         end do
      end subroutine visit
   end subroutine find_structure

   ! Applies a permutation to the elimination order.
   subroutine reorder(symbolic, sequence)
      type(symbolic_type), intent(inout) :: symbolic
      integer, intent(in) :: sequence(:)
      integer :: k

      symbolic%order = symbolic%order(sequence)
      symbolic%position(symbolic%order) = [(k, k=1, size(sequence))]
   end subroutine reorder

   subroutine no_memory(error)
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_memory, "no memory for the LDL^T factors")
   end subroutine no_memory

   pure integer function entries_a_column(self)
      class(symbolic_type), intent(in) :: self

      entries_a_column = int(self%factor_entries/max(size(self%order), 1))
   end function entries_a_column

   pure real(wp) function factor_bytes(self) result(bytes)
      class(symbolic_type), intent(in) :: self
      real(wp) :: entries, most_entries
      integer :: s, columns, rows

      entries = 0
      most_entries = 0
      do s = 1, size(self%first) - 1
         columns = self%first(s + 1) - self%first(s)
         rows = int(self%start(s + 1) - self%start(s))
         entries = entries + real(columns, wp)*((columns - 1)/2.0_wp + rows)
         most_entries = max(most_entries, real(columns, wp)*(columns + rows))
      end do
      bytes = real_bytes*(entries + 2*most_entries + size(self%order)) + &
         integer_bytes*(real(size(self%row), wp) + 6*size(self%order))
   end function factor_bytes

   pure integer function most_rows(self)
      class(symbolic_type), intent(in) :: self

      associate (last => size(self%start))
         most_rows = int(maxval([0_long, self%start(2:last) - self%start(:last - 1)]))
      end associate
   end function most_rows
end module kschur_symbolic
