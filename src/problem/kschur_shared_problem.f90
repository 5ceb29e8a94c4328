!> A problem whose matrices are distributed by rows. This build has one process with all rows; `with/mpi` has the module for
!> several.
module kschur_shared_problem
   use kschur_error, only: error_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: shared_problem_type

   !> Created by `read_hdf5_shared_problem`.
   type :: shared_problem_type
      !> The problem, in the first process.
      type(modal_problem_type) :: problem
      !> With several processes: local rows of M, R, K and H, and total numbers of rows.
      type(modal_problem_type) :: rows
      integer :: all_rows(4) = 0
   contains
      !> Gathers the whole matrices in the first process, unchecked.
      procedure, nopass :: assemble
      !> Fails if the processes that share it differ from those of the solve.
      procedure, nopass :: check
      !> Whether the processes of a solve share its rows.
      procedure, nopass :: is_distributed
      !> Frees the entries of the whole M, R and K in the first process, while other arrays need the memory; restores them.
      procedure, nopass :: put_away
      procedure, nopass :: bring_back
   end type shared_problem_type

contains

   subroutine assemble(processes, error)
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => processes, none => error)
      end associate
   end subroutine assemble

   subroutine check(processes, error)
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => processes, unchanged => error)
      end associate
   end subroutine check

   logical function is_distributed(processes)
      type(processes_type), pointer, intent(in) :: processes

      associate (unused => processes)
      end associate
      is_distributed = .false.
   end function is_distributed

   subroutine put_away(processes)
      type(processes_type), pointer, intent(in) :: processes

      associate (unused => processes)
      end associate
   end subroutine put_away

   subroutine bring_back(processes, error)
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => processes, unchanged => error)
      end associate
   end subroutine bring_back
end module kschur_shared_problem
