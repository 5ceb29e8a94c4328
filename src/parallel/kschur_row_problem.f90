!> M, R and K of the iterated problem, with rows distributed over the processes, for products. While other arrays need the
!> memory, the first process does not keep the whole matrices.
module kschur_row_problem
   use kschur_error, only: error_type
   use kschur_processes, only: processes_type
   use kschur_row_matrix, only: row_matrix_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: row_problem_type

   !> Choices of M, R and K.
   logical, parameter, public :: mass_alone(3) = [.true., .false., .false.], undamped(3) = [.true., .false., .true.], &
      all_three(3) = .true.

   !> The distributed M, R and K. The constraints are not distributed.
   type :: row_problem_type
      type(row_matrix_type) :: mass, damping, stiffness
      ! Whether the entries of each whole matrix are freed.
      logical, private :: away(3) = .false.
   contains
      !> Distributes the rows.
      procedure :: share
      !> Frees the entries of chosen whole matrices while other arrays need the memory; products remain available.
      procedure :: put_away
      !> Restores the entries of chosen whole matrices, if they were freed. Fails if memory is short.
      procedure :: bring_back
      final :: finish
   end type row_problem_type

contains

   subroutine share(self, mass, damping, stiffness, processes, error)
      class(row_problem_type), intent(inout) :: self
      !> The matrices must outlive this object.
      type(csr_matrix_type), target, intent(inout) :: mass, damping, stiffness
      !> Processes of the solve; not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      call self%mass%share(mass, processes, error)
      if (.not. allocated(error)) call self%damping%share(damping, processes, error)
      if (.not. allocated(error)) call self%stiffness%share(stiffness, processes, error)
   end subroutine share

   subroutine put_away(self, chosen)
      class(row_problem_type), intent(inout) :: self
      logical, intent(in) :: chosen(3)

      associate (going => chosen .and. .not. self%away)
         if (going(1)) call self%mass%put_away()
         if (going(2)) call self%damping%put_away()
         if (going(3)) call self%stiffness%put_away()
      end associate
      self%away = self%away .or. chosen
   end subroutine put_away

   subroutine bring_back(self, chosen, error)
      class(row_problem_type), intent(inout) :: self
      logical, intent(in) :: chosen(3)
      type(error_type), allocatable, intent(inout) :: error
      integer :: i

      do i = 1, 3
         if (allocated(error)) return
         if (.not. (chosen(i) .and. self%away(i))) cycle
         if (i == 1) call self%mass%bring_back(error)
         if (i == 2) call self%damping%bring_back(error)
         if (i == 3) call self%stiffness%bring_back(error)
         self%away(i) = allocated(error)
      end do
   end subroutine bring_back

   impure elemental subroutine finish(self)
      type(row_problem_type), intent(inout) :: self

      call self%mass%forget()
      call self%damping%forget()
      call self%stiffness%forget()
   end subroutine finish
end module kschur_row_problem
