!> The symbolic factorisation of the matrix that was analysed last, which serves the next one of the same pattern, but for the
!> diagonal: those of a stiffness, at a shift, and at each count of eigenvalues mostly have one. And the room of factors that
!> were left, where those of the next matrix find their place: to give it back to the system and to ask for as much again costs
!> a part of a factorisation.
module kschur_last_analysis
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
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
      real(wp), allocatable :: room(:)
   contains
      !> Keeps the room of factors that nobody needs any more.
      procedure :: keep_room
      !> Hands it on; nothing is allocated where there is none.
      procedure :: take_room
      !> Gives it back to the system, where what comes next has no factors of this kind.
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

   ! Whether the pattern is the same, but for the diagonal, and what is known of the order.
   pure logical function serves(last, matrix, structure)
      type(last_analysis_type), intent(in) :: last
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure

      serves = allocated(last%column) .and. (allocated(last%position) .eqv. allocated(structure%position)) .and. &
         last%multipliers == structure%multipliers
      if (serves) serves = size(last%row_start) == size(matrix%row_start)
      if (serves) serves = are_alike(last%row_start, last%column, matrix%row_start, matrix%column)
      if (serves .and. allocated(last%position)) serves = all(last%position == structure%position)
   end function serves

   ! Whether two patterns differ on the diagonal at most, which L has anyway: one matrix has regularised constraints,
   ! another none of their entries.
   pure logical function are_alike(row_start, column, other_start, other)
      integer, intent(in) :: row_start(:), column(:), other_start(:), other(:)
      integer :: i, k, l

      are_alike = .false.
      do i = 1, size(row_start) - 1
         k = row_start(i)
         do l = other_start(i), other_start(i + 1) - 1
            if (other(l) == i) cycle
            call pass_diagonal(k)
            if (k == row_start(i + 1)) return
            if (column(k) /= other(l)) return
            k = k + 1
         end do
         call pass_diagonal(k)
         if (k < row_start(i + 1)) return
      end do
      are_alike = .true.

   contains

      pure subroutine pass_diagonal(k)
         integer, intent(inout) :: k

         if (k == row_start(i + 1)) return
         if (column(k) == i) k = k + 1
      end subroutine pass_diagonal
   end function are_alike
end module kschur_last_analysis
