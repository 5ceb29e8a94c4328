!> Reuse of the last symbolic factorisation by matrices whose pattern differs at most on the diagonal: stiffness, shifted
!> matrix, and those of eigenvalue counts mostly share it. Also reuses the memory of earlier factors, since returning it to the
!> system and allocating it again costs a noticeable part of a factorisation.
module kschur_last_analysis
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_symbolic, only: analyze, check_fill, symbolic_type
   implicit none
   private
   public :: analyze_once, last_analysis_type

   !> For one thread at a time.
   type :: last_analysis_type
      private
      integer, allocatable :: position(:)
      ! Of the matrix: entries off the diagonal, multipliers.
      integer :: entries = 0, multipliers = 0
      type(symbolic_type), allocatable :: symbolic
      real(wp), allocatable :: room(:)
   contains
      !> Takes over the memory of factors that are no longer needed.
      procedure :: keep_room
      !> Hands it to new factors; not allocated if there is none.
      procedure :: take_room
      !> Frees it, if no factors of this kind follow.
      procedure :: drop_room
   end type last_analysis_type

contains

   subroutine keep_room(self, lower)
      class(last_analysis_type), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: lower(:)

      call move_alloc(lower, self%room)
   end subroutine keep_room

   subroutine take_room(self, lower)
      class(last_analysis_type), intent(inout) :: self
      real(wp), allocatable, intent(out) :: lower(:)

      call move_alloc(self%room, lower)
   end subroutine take_room

   subroutine drop_room(self)
      class(last_analysis_type), intent(inout) :: self

      if (allocated(self%room)) deallocate (self%room)
   end subroutine drop_room

   !> As `analyze`, but reuses the last analysis if it has the same pattern; stores the new one.
   subroutine analyze_once(last, matrix, structure, most_entries, symbolic, error)
      !> Disassociated: nothing is reused.
      type(last_analysis_type), pointer, intent(in) :: last
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      integer, intent(in) :: most_entries
      type(symbolic_type), intent(out) :: symbolic
      type(error_type), allocatable, intent(out) :: error
      logical :: same

      same = associated(last)
      if (same) same = has_same_pattern(last, matrix, structure)
      if (same) then
         call check_fill(last%symbolic, most_entries, error)
         if (.not. allocated(error)) symbolic = last%symbolic
         return
      end if
      call analyze(matrix, structure, most_entries, symbolic, error)
      if (allocated(error) .or. .not. associated(last)) return
      last%entries = symbolic%pattern%entries_within(matrix%row_start, matrix%column)
      last%multipliers = structure%multipliers
      if (allocated(last%position)) deallocate (last%position)
      if (allocated(structure%position)) last%position = structure%position
      if (allocated(last%symbolic)) deallocate (last%symbolic)
      allocate (last%symbolic, source=symbolic)
   end subroutine analyze_once

   ! Whether the last analysis had the same pattern, except on the diagonal, and the same given order.
   pure logical function has_same_pattern(last, matrix, structure)
      type(last_analysis_type), intent(in) :: last
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure

      has_same_pattern = allocated(last%symbolic) .and. (allocated(last%position) .eqv. allocated(structure%position)) .and. &
         last%multipliers == structure%multipliers
      if (has_same_pattern) has_same_pattern = size(last%symbolic%position) == matrix%rows
      if (has_same_pattern .and. allocated(last%position)) has_same_pattern = all(last%position == structure%position)
      ! L has the diagonal anyway: the block of the constraints has diagonal entries only if it is regularised.
      if (has_same_pattern) has_same_pattern = last%entries == &
         last%symbolic%pattern%entries_within(matrix%row_start, matrix%column)
   end function has_same_pattern
end module kschur_last_analysis
