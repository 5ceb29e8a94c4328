!> What in the matrices of a problem is likely not meant, in sentences.
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

   !> Masses that are negative, unknowns that nothing holds, and matrices that are nearly symmetric.
   subroutine note_suspicions(problem, notes)
      !> As given.
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      logical :: chosen(problem%unknowns())

      chosen = problem%mass%diagonal() < 0
      if (any(chosen)) call append_note(notes, "the mass matrix M is negative on the diagonal, which makes modes that grow: "// &
         named("unknown", chosen, problem%index_base))
      chosen = are_loose(problem)
      if (any(chosen)) call append_note(notes, "neither stiffness, damping nor a constraint holds "// &
         named("unknown", chosen, problem%index_base))
      if (.not. problem%symmetric) call note_asymmetry(problem, notes)
   end subroutine note_suspicions

   subroutine note_asymmetry(problem, notes)
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      type(asymmetry_type) :: largest
      character(len=:), allocatable :: name

      call asymmetry_of(problem, largest, name)
      if (largest%part < nearly_symmetric) call append_note(notes, "the "//name//" is symmetric but for "// &
         magnitude(largest%part)//" of the entries, most at "//trim(places(largest, problem%index_base))// &
         "; if that is rounding, take its symmetric part: it is solved faster")
   end subroutine note_asymmetry

   !> The largest asymmetry of the matrices of a problem.
   subroutine asymmetry_of(problem, largest, name)
      type(modal_problem_type), intent(in) :: problem
      type(asymmetry_type), intent(out) :: largest
      !> Which matrix has it, "stiffness matrix K".
      character(len=:), allocatable, intent(out) :: name

      name = "mass matrix M"
      largest = largest_asymmetry(problem%mass)
      call compare(problem%damping, "damping matrix R")
      call compare(problem%stiffness, "stiffness matrix K")
      if (allocated(problem%loss)) call compare(problem%loss, "loss matrix H")

   contains

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

   ! "(3, 5) and (5, 3)"
   pure function places(asymmetry, base)
      type(asymmetry_type), intent(in) :: asymmetry
      integer, intent(in) :: base
      character(len=60) :: places
      character(len=20) :: row, column

      row = text(asymmetry%row + base - 1)
      column = text(asymmetry%column + base - 1)
      places = "("//trim(row)//", "//trim(column)//") and ("//trim(column)//", "//trim(row)//")"
   end function places

   ! Unknowns with inertia, without an entry in any other matrix, beside others that have stiffness.
   pure function are_loose(problem) result(loose)
      type(modal_problem_type), intent(in) :: problem
      logical :: loose(problem%unknowns())

      loose = .false.
      if (problem%stiffness%is_zero()) return
      loose = problem%mass%row_maxima() > 0 .and. .not. problem%stiffness%row_maxima() > 0 .and. &
         .not. problem%damping%row_maxima() > 0
      call leave_columns_out(problem%stiffness)
      call leave_columns_out(problem%damping)
      call leave_columns_out(problem%constraints)
      if (.not. allocated(problem%loss)) return
      loose = loose .and. .not. problem%loss%row_maxima() > 0
      call leave_columns_out(problem%loss)

   contains

      pure subroutine leave_columns_out(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         integer :: k

         do k = 1, matrix%nonzeros()
            if (abs(matrix%value(k)) > 0) loose(matrix%column(k)) = .false.
         end do
      end subroutine leave_columns_out
   end function are_loose
end module kschur_suspicions
