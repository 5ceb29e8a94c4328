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

   !> The distributed M, R and K. The constraints are not distributed.
   type :: row_problem_type
      type(row_matrix_type) :: mass, damping, stiffness
      ! Whether the entries of the whole M and K, and of R, are freed.
      logical, private :: away = .false., damping_away = .false.
   contains
      !> Distributes the rows.
      procedure :: share
      !> Frees the entries of the whole matrices while other arrays need the memory; products remain available.
      procedure :: put_away
      !> Frees the entries of the whole R alone, and restores those of M and K, if they were freed. Fails if memory is short.
      procedure :: hold_undamped
      !> Restores the entries of the whole matrices, if they were freed. Fails if memory is short.
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

   subroutine put_away(self)
      class(row_problem_type), intent(inout) :: self

      call put_damping_away(self)
      if (self%away) return
      call self%mass%put_away()
      call self%stiffness%put_away()
      self%away = .true.
   end subroutine put_away

   subroutine put_damping_away(self)
      class(row_problem_type), intent(inout) :: self

      if (.not. self%damping_away) call self%damping%put_away()
      self%damping_away = .true.
   end subroutine put_damping_away

   subroutine hold_undamped(self, error)
      class(row_problem_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: failure

      call put_damping_away(self)
      if (.not. self%away) return
      call self%mass%bring_back(failure)
      if (.not. allocated(failure)) call self%stiffness%bring_back(failure)
      self%away = allocated(failure)
      if (allocated(failure)) call move_alloc(failure, error)
   end subroutine hold_undamped

   subroutine bring_back(self, error)
      class(row_problem_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: failure

      if (self%away) call self%hold_undamped(failure)
      if (.not. allocated(failure) .and. self%damping_away) then
         call self%damping%bring_back(failure)
         self%damping_away = allocated(failure)
      end if
      if (allocated(failure)) call move_alloc(failure, error)
   end subroutine bring_back

   impure elemental subroutine finish(self)
      type(row_problem_type), intent(inout) :: self

      call self%mass%forget()
      call self%damping%forget()
      call self%stiffness%forget()
   end subroutine finish
end module kschur_row_problem
