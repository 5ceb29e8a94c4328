!> Solvers kept for reuse of their analysis after their factors are no longer needed.
module kschur_spare_solvers
   use kschur_linear_solver, only: complex_linear_solver_type, real_linear_solver_type
   implicit none
   private
   public :: spare_solvers_type

   !> One of each kind at most.
   type :: spare_solvers_type
      class(real_linear_solver_type), allocatable :: real
      class(complex_linear_solver_type), allocatable :: complex
   contains
      !> Frees the factors; deallocates solvers that keep no analysis.
      procedure :: forget_factors
      !> Moves the solvers to `other`.
      procedure :: move_to
      !> Deallocates the solvers.
      procedure :: clear
   end type spare_solvers_type

contains

   subroutine forget_factors(self)
      class(spare_solvers_type), intent(inout) :: self
      logical :: kept

      if (allocated(self%real)) then
         call self%real%forget_factors(kept)
         self%real%solve_seconds = 0
         if (.not. kept) deallocate (self%real)
      end if
      if (allocated(self%complex)) then
         call self%complex%forget_factors(kept)
         self%complex%solve_seconds = 0
         if (.not. kept) deallocate (self%complex)
      end if
   end subroutine forget_factors

   subroutine move_to(self, other)
      class(spare_solvers_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: other

      call move_alloc(self%real, other%real)
      call move_alloc(self%complex, other%complex)
   end subroutine move_to

   subroutine clear(self)
      class(spare_solvers_type), intent(inout) :: self

      if (allocated(self%real)) deallocate (self%real)
      if (allocated(self%complex)) deallocate (self%complex)
   end subroutine clear
end module kschur_spare_solvers
