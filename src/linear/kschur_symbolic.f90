!> The symbolic factorisation of SuiteSparse's LDL: where L will have entries.
!> T. A. Davis, Algorithm 849, ACM TOMS 31 (2005), doi 10.1145/1114268.1114277.
module kschur_symbolic
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_minimum_degree, only: minimum_degree_order
   use kschur_ordering, only: elimination_order
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: text
   implicit none
   private
   public :: symbolic_type, analyze, low_fill

   !> At more entries a column of the factor the dense fronts of MUMPS pay:
   !> benchmarks/inner.f90 finds one solve level at 100 to 150, LDL the slower to factor.
   integer, parameter :: low_fill = 80

   !> All 0-based.
   type :: symbolic_type
      !> Unknown order(k) is the k-th to be eliminated, position(i) is the place of unknown i.
      integer(c_int), allocatable :: order(:), position(:)
      !> The elimination tree; -1 at a root.
      integer(c_int), allocatable :: parent(:)
      !> Column k of L, without its unit diagonal, holds entries(k) entries from start(k) on.
      integer(c_int), allocatable :: start(:), entries(:)
      !> All entries of L.
      integer(long) :: factor_entries = 0
   contains
      procedure :: entries_a_column
      !> How often an entry is read while L is found row by row.
      procedure :: readings
   end type symbolic_type

   interface
      subroutine ldl_symbolic(n, start, row, lower_start, parent, entries, flag, order, position) bind(C)
         import :: c_int
         integer(c_int), value :: n
         integer(c_int), intent(in) :: start(*), row(*), order(*)
         integer(c_int), intent(out) :: lower_start(*), parent(*), entries(*), flag(*), position(*)
      end subroutine ldl_symbolic
   end interface

contains

   !> Of a symmetric matrix, in the order of `structure` where it is known, else in that of AMD, or of METIS where there
   !> are multipliers. Fails where a column has more than so many entries (error_library).
   subroutine analyze(matrix, structure, most_entries, symbolic, error)
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(in) :: most_entries
      type(symbolic_type), intent(out) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: position(:)

      if (structure%multipliers > 0 .or. allocated(structure%position)) then
         ! A multiplier before the unknowns it touches would be a penalty that drowns their stiffness.
         call elimination_order(matrix%row_start, matrix%column, structure, position, error)
      else
         call minimum_degree_order(matrix%row_start, matrix%column, position, error)
      end if
      if (.not. allocated(error)) call find_columns(matrix%row_start, matrix%column, position, symbolic, error)
      if (allocated(error)) return
      if (symbolic%entries_a_column() > most_entries) then
         call new_error(error, error_library, "high fill, "//text(symbolic%entries_a_column())//" entries a column")
      else if (symbolic%factor_entries >= huge(1_c_int)) then
         call new_error(error, error_library, "the factor has more than "//text(huge(1_c_int))//" entries")
      end if
   end subroutine analyze

   subroutine find_columns(row_start, column, position, symbolic, error)
      integer, intent(in) :: row_start(:), column(:), position(:)
      type(symbolic_type), intent(out) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      integer(c_int), allocatable :: flag(:)
      integer :: n, i, status

      n = size(position)
      associate (s => symbolic)
         allocate (s%order(n), s%position(n), s%parent(n), s%start(n + 1), s%entries(n), flag(n), stat=status)
         if (status /= 0) then
            call new_error(error, error_memory, "no memory for the LDL^T factors")
            return
         end if
         do i = 1, n
            s%order(position(i)) = i - 1
         end do
         call ldl_symbolic(n, row_start - 1, column - 1, s%start, s%parent, s%entries, flag, s%order, s%position)
         ! `start` counts in 32 bits and may have overflowed; the columns have not.
         s%factor_entries = n + sum(int(s%entries, long))
      end associate
   end subroutine find_columns

   pure integer function entries_a_column(self)
      class(symbolic_type), intent(in) :: self

      entries_a_column = int(self%factor_entries/max(size(self%order), 1))
   end function entries_a_column

   pure real(wp) function readings(self)
      class(symbolic_type), intent(in) :: self

      readings = sum(real(self%entries, wp)**2)/max(2*sum(real(self%entries, wp)), 1.0_wp)
   end function readings
end module kschur_symbolic
