!> Notes on properties of the matrices of a problem that are likely mistakes.
module kschur_suspicions
   use kschur_asymmetry, only: asymmetry_type, largest_asymmetry
   use kschur_notes, only: named
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: append_note, note_length
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude, text
   use kschur_tolerances, only: nearly_symmetric
   implicit none
   private
   public :: asymmetry_of, note_suspicions

contains

   !> Notes negative diagonal masses, unknowns without stiffness, damping and constraints, and nearly symmetric matrices.
   subroutine note_suspicions(problem, notes)
      !> The problem as given.
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      character(len=*), parameter :: negative = "the mass matrix M is negative on the diagonal, which makes modes that grow: ", &
         unheld = "neither stiffness, damping nor a constraint holds "
      logical :: chosen(problem%unknowns())

      chosen = problem%mass%diagonal() < 0
      if (any(chosen)) call append_note(notes, negative// &
         named("unknown", chosen, problem%index_base, note_length - len(negative)))
      chosen = are_unheld(problem)
      if (any(chosen)) call append_note(notes, unheld//named("unknown", chosen, problem%index_base, note_length - len(unheld)))
      if (.not. problem%symmetric) call note_asymmetry(problem, notes)
   end subroutine note_suspicions

   ! Notes an asymmetry so small that it is likely rounding of the input.
   subroutine note_asymmetry(problem, notes)
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      type(asymmetry_type) :: largest
      character(len=:), allocatable :: name

      call asymmetry_of(problem, largest, name)
      if (largest%part < nearly_symmetric) call append_note(notes, "the "//name//" is symmetric but for "// &
         magnitude(largest%part)//" of the entries, most at "//trim(entry_pair(largest, problem%index_base))// &
         "; if that is rounding, take its symmetric part: it is solved faster")
   end subroutine note_asymmetry

   !> Finds the largest relative asymmetry among the matrices of a problem.
   subroutine asymmetry_of(problem, largest, name)
      type(modal_problem_type), intent(in) :: problem
      type(asymmetry_type), intent(out) :: largest
      !> Name of the matrix that has it, as "stiffness matrix K".
      character(len=:), allocatable, intent(out) :: name

      name = "mass matrix M"
      largest = largest_asymmetry(problem%mass)
      call compare(problem%damping, "damping matrix R")
      call compare(problem%stiffness, "stiffness matrix K")
      if (allocated(problem%loss)) call compare(problem%loss, "loss matrix H")

   contains

      ! Keeps the asymmetry of another matrix if it is larger.
      subroutine compare(matrix, other_name)
         type(csr_matrix_type), intent(in) :: matrix
         character(len=*), intent(in) :: other_name
         type(asymmetry_type) :: other

         other = largest_asymmetry(matrix)
         if (other%part <= largest%part) return
         largest = other
         name = other_name
      end subroutine compare
   end subroutine asymmetry_of

   ! The positions of two mirrored entries, as "(3, 5) and (5, 3)".
   pure function entry_pair(asymmetry, base)
      type(asymmetry_type), intent(in) :: asymmetry
      integer, intent(in) :: base
      character(len=60) :: entry_pair
      character(len=20) :: row, column

      row = text(asymmetry%row + base - 1)
      column = text(asymmetry%column + base - 1)
      entry_pair = "("//trim(row)//", "//trim(column)//") and ("//trim(column)//", "//trim(row)//")"
   end function entry_pair

   ! Unknowns that have mass but no entry in any other matrix, of a problem with stiffness.
   pure function are_unheld(problem) result(unheld)
      type(modal_problem_type), intent(in) :: problem
      logical :: unheld(problem%unknowns())

      unheld = .false.
      if (problem%stiffness%is_zero()) return
      unheld = problem%mass%row_maxima() > 0 .and. .not. problem%stiffness%row_maxima() > 0 .and. &
         .not. problem%damping%row_maxima() > 0
      call exclude_columns(problem%stiffness)
      call exclude_columns(problem%damping)
      call exclude_columns(problem%constraints)
      if (.not. allocated(problem%loss)) return
      unheld = unheld .and. .not. problem%loss%row_maxima() > 0
      call exclude_columns(problem%loss)

   contains

      ! Excludes the unknowns with a nonzero column.
      pure subroutine exclude_columns(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         integer :: k

         do k = 1, matrix%nonzeros()
            if (abs(matrix%value(k)) > 0) unheld(matrix%column(k)) = .false.
         end do
      end subroutine exclude_columns
   end function are_unheld
end module kschur_suspicions
