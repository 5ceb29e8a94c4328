!> Backward errors of eigenpairs of a problem whose rows are distributed. This build has one process with all rows; `with/mpi` has
!> the module for several.
module kschur_shared_judgement
   use kschur_backward_error, only: judge_as_given
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   use kschur_shared_problem, only: shared_problem_type
   implicit none
   private
   public :: judge_by_rows

contains

   !> As `judge_as_given`.
   subroutine judge_by_rows(shared, processes, norms, pairs, is_rigid, errors, bounds, error)
      type(shared_problem_type), intent(inout) :: shared
      type(processes_type), intent(in) :: processes
      !> Those of the whole matrices, by `norms_of`.
      real(wp), intent(in) :: norms(4)
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: is_rigid(:)
      real(wp), intent(out) :: errors(:), bounds(:)
      !> Fails if a process runs out of memory.
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, known => norms, none => error)
      end associate
      call judge_as_given(shared%problem, pairs, is_rigid, errors, bounds)
   end subroutine judge_by_rows
end module kschur_shared_judgement
