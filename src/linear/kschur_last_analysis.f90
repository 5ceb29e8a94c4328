!> The symbolic factorisation of the matrix that was analysed last, which serves the next one of the same pattern: those of a
!> stiffness, at a shift, and at each count of eigenvalues mostly have one.
module kschur_last_analysis
   use kschur_error, only: error_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: analyze, check_fill, symbolic_type
   implicit none
   private
   public :: analyze_once, last_analysis_type

   !> One thread at a time may use it.
   type :: last_analysis_type
      private
      integer, allocatable :: row_start(:), column(:), position(:)
      integer :: multipliers = 0
      type(symbolic_type), allocatable :: symbolic
   end type last_analysis_type

contains

   !> As `analyze`; looks first whether the last analysis was of the same pattern, and becomes the last one.
   subroutine analyze_once(last, matrix, structure, most_entries, symbolic, error)
      !> Disassociated: nothing is remembered.
      type(last_analysis_type), pointer, intent(in) :: last
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(in) :: most_entries
      type(symbolic_type), intent(out) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      logical :: known

      known = associated(last)
      if (known) known = serves(last, matrix, structure)
      if (known) then
         call check_fill(last%symbolic, most_entries, error)
         if (.not. allocated(error)) symbolic = last%symbolic
         return
      end if
      call analyze(matrix, structure, most_entries, symbolic, error)
      if (allocated(error) .or. .not. associated(last)) return
      last%row_start = matrix%row_start
      last%column = matrix%column
      last%multipliers = structure%multipliers
      if (allocated(last%position)) deallocate (last%position)
      if (allocated(structure%position)) last%position = structure%position
      if (allocated(last%symbolic)) deallocate (last%symbolic)
      allocate (last%symbolic, source=symbolic)
   end subroutine analyze_once

   ! Whether the pattern is the same, and what is known of the order.
   pure logical function serves(last, matrix, structure)
      type(last_analysis_type), intent(in) :: last
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure

      serves = allocated(last%column) .and. (allocated(last%position) .eqv. allocated(structure%position)) .and. &
         last%multipliers == structure%multipliers
      if (serves) serves = size(last%row_start) == size(matrix%row_start) .and. size(last%column) == size(matrix%column)
      if (serves) serves = all(last%row_start == matrix%row_start) .and. all(last%column == matrix%column)
      if (serves .and. allocated(last%position)) serves = all(last%position == structure%position)
   end function serves
end module kschur_last_analysis
