!> A problem that several processes share: each keeps some rows of its matrices. In this build there is one process, which has
!> them all; `with/mpi` has the module for several.
module kschur_shared_problem
   use kschur_error, only: error_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: shared_problem_type

   !> Made by `read_hdf5_shared_problem`.
   type :: shared_problem_type
      !> The problem, in the first process.
      type(modal_problem_type) :: problem
      !> Where there are several processes, the rows of M, R and K that this one has, and how many there are in all.
      type(modal_problem_type) :: rows
      integer :: all_rows(3) = 0
   contains
      !> The first process gets the matrices whole, unsettled.
      procedure, nopass :: assemble
      !> Fails where those that share it are not those that would solve it.
      procedure, nopass :: check
      !> The entries of M, R and K are with the processes only, and are in the first one again.
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
