!> The sparsity pattern and structure of the matrix that was analysed last: a matrix with the same ones needs no new analysis.
module kschur_analysed_pattern
   use kschur_linear_solver, only: matrix_structure_type
   implicit none
   private
   public :: analysed_pattern_type

   !> CSR, 1-based; not allocated before the first analysis.
   type :: analysed_pattern_type
      private
      integer, allocatable :: row_start(:), column(:)
      type(matrix_structure_type) :: structure
   contains
      !> Stores the pattern and structure of a matrix.
      procedure :: keep
      !> Whether a matrix has the stored pattern and structure.
      procedure :: matches
   end type analysed_pattern_type

contains

   subroutine keep(self, row_start, column, structure)
      class(analysed_pattern_type), intent(inout) :: self
      integer, intent(in) :: row_start(:), column(:)
      type(matrix_structure_type), intent(in) :: structure

      self%row_start = row_start
      self%column = column
      self%structure = structure
   end subroutine keep

   pure logical function matches(self, row_start, column, structure)
      class(analysed_pattern_type), intent(in) :: self
      integer, intent(in) :: row_start(:), column(:)
      type(matrix_structure_type), intent(in) :: structure

      matches = .false.
      if (.not. allocated(self%column)) return
      associate (known => self%structure)
         matches = (known%symmetric .eqv. structure%symmetric) .and. known%multipliers == structure%multipliers .and. &
            (known%regular .eqv. structure%regular) .and. &
            are_same(known%node, structure%node) .and. are_same(known%position, structure%position) .and. &
            are_same(self%row_start, row_start) .and. are_same(self%column, column)
      end associate
   end function matches

   ! Whether two arrays are equal; two that are not allocated are.
   pure logical function are_same(a, b)
      integer, optional, intent(in) :: a(:), b(:)

      are_same = present(a) .eqv. present(b)
      if (.not. (are_same .and. present(a))) return
      are_same = size(a) == size(b)
      if (are_same) are_same = all(a == b)
   end function are_same
end module kschur_analysed_pattern
