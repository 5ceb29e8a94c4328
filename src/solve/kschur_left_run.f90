!> Left vectors are conjugated modes of the transposed problem: the modes themselves where the problem is symmetric.
module kschur_left_run
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type, take_cancelled
   use kschur_examination, only: find_rigid, suppose_none
   use kschur_left, only: inverse_iteration_type, set_left_modes
   use kschur_modes, only: modes_type, no_modes
   use kschur_outcome, only: reason_cancelled
   use kschur_problem, only: modal_problem_type
   use kschur_scaling, only: constraint_factors, first_scale
   use kschur_search, only: find_modes
   use kschur_shapes, only: orthonormalize_zeros
   use kschur_transposed, only: transpose_problem
   implicit none
   private
   public :: find_left_modes

contains

   !> Sets the left vectors and condition numbers of modes.
   subroutine find_left_modes(s, modes, error)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      type(solve_context_type), target :: adjoint
      type(modal_problem_type), target :: transposed
      type(modes_type) :: found
      type(inverse_iteration_type) :: inverse
      logical :: cancelled

      call s%announce_phase("left vectors")
      call s%bring_problem_back(error)
      if (allocated(error)) return
      if (s%problem%symmetric .or. size(modes%lambda) == 0) then
         call set_left_modes(s%problem, s%problem, modes%eigenpairs_type, modes, s%effort, error)
         return
      end if
      call transpose_problem(s%problem, transposed, error)
      if (allocated(error)) return
      if (allocated(s%transform)) then
         call begin_transposed(s, transposed, adjoint, error)
         if (.not. allocated(error)) call find_modes(adjoint, found, error)
         call take_cancelled(error, cancelled)
         if (allocated(error)) return
         if (cancelled) found = no_modes(transposed%unknowns(), transposed%multipliers())
         if (cancelled) found%reason = reason_cancelled
      else
         ! Nothing was iterated.
         found = no_modes(transposed%unknowns(), transposed%multipliers())
      end if
      if (found%reason == reason_cancelled) then
         call set_left_modes(s%problem, transposed, found, modes, s%effort, error)
      else
         allocate (inverse%solver, source=s%inner%complex)
         allocate (inverse%factors, source=constraint_factors(transposed, s%options%constraint_scaling, s%shift))
         inverse%reference = max(abs(s%shift), first_scale(transposed))
         call set_left_modes(s%problem, transposed, found, modes, s%effort, error, inverse)
      end if
      call adjoint%drop_transform()
      call s%effort%add_effort(adjoint%effort)
   end subroutine find_left_modes

   ! The same for the transposed problem, with the same reduction, on the same factors.
   subroutine begin_transposed(s, transposed, adjoint, error)
      type(solve_context_type), target, intent(in) :: s
      type(modal_problem_type), target, intent(in) :: transposed
      type(solve_context_type), target, intent(inout) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: rigid

      allocate (adjoint%notes(0))
      adjoint%problem => transposed
      adjoint%options = s%options
      adjoint%inner = s%inner
      adjoint%monitor => s%monitor
      adjoint%checkpoint => s%checkpoint
      adjoint%formulation = s%formulation
      adjoint%dense = s%dense
      adjoint%plan = s%plan
      adjoint%shift = s%shift
      adjoint%known%redundant = s%known%redundant - s%plan%redundant
      call transpose_problem(s%work, adjoint%work, error)
      if (allocated(error)) return
      if (size(s%known%rigid%lambda) > 0) then
         ! There are as many from the left.
         call find_rigid(adjoint%work, adjoint%formulation, s%options%modes, adjoint%inner, adjoint%known, adjoint%effort, error)
      else
         call suppose_none(adjoint%work, adjoint%known)
      end if
      if (allocated(error)) return
      call adjoint%drop_stiffness()
      rigid = adjoint%known%rigid
      call adjoint%expand(rigid)
      call orthonormalize_zeros(rigid)
      adjoint%known%rigid = rigid
      adjoint%known%total = s%known%total
      call s%transform%transposed(adjoint%work, adjoint%known%deflation, adjoint%inner%complex, adjoint%transform, error)
      if (allocated(error)) return
      if (.not. adjoint%transform%borrows) call adjoint%effort%add_factors(adjoint%transform%linear_solver())
   end subroutine begin_transposed
end module kschur_left_run
