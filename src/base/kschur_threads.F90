!> The threads of one solve. OpenMP keeps their number for each thread that solves, so that those of a caller do not
!> disturb each other; what is summed is summed in panels whose size does not depend on it, so that it does not change
!> a digit.
module kschur_threads
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur_error, only: error_type, new_error, error_memory
#ifdef _OPENMP
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_thread_num, omp_in_parallel, &
      omp_set_num_threads
#endif
   implicit none
   private
   public :: enter_solve, leave_solve, set_blas_threads, team_size, thread_number

   !> Rows of a panel: with fewer rows than two of them nothing is worth a thread.
   integer, parameter, public :: panel_rows = 2048
   !> A solve has no more, whatever is asked for.
   integer, parameter, public :: most_threads = 4096
   !> For `enter_solve`, where there is little to do.
   integer, parameter, public :: one_thread = 1

   ! Unknowns of a problem. Threads wait for each other some thousand times in a solve; where others use the cores as well,
   ! that takes longer than all that there is to do in a smaller one.
   integer, parameter :: worth_threads = 10000

   interface
      integer(c_int) function c_enter_solve() bind(c, name="kschur_enter_solve")
         import :: c_int
      end function c_enter_solve

      subroutine c_leave_solve() bind(c, name="kschur_leave_solve")
      end subroutine c_leave_solve

      integer(c_int) function c_prepare_threads(threads) bind(c, name="kschur_prepare_threads")
         import :: c_int
         integer(c_int), value :: threads
      end function c_prepare_threads

      subroutine c_leave_signals() bind(c, name="kschur_leave_signals")
      end subroutine c_leave_signals

      subroutine c_make_heap() bind(c, name="kschur_make_heap")
      end subroutine c_make_heap

      !> Threads of the BLAS, for a factorisation that is made of large products; one before and after it.
      subroutine set_blas_threads(threads) bind(c, name="kschur_set_blas_threads")
         import :: c_int
         integer(c_int), value :: threads
      end subroutine set_blas_threads
   end interface

contains

   !> Gives this thread its share of the cores: as many threads as were asked for, or as the process may use divided by
   !> the solves that run at the same time; of a small problem one, as where there is no memory for more. The BLAS has one
   !> thread from now on. Within another solve nothing changes. Fails where there is no memory for one; to be left in any case.
   subroutine enter_solve(asked, unknowns, before, error)
      !> 0: as many as there are.
      integer, intent(in) :: asked
      integer, intent(in) :: unknowns
      !> For `leave_solve`.
      integer, intent(out) :: before
      type(error_type), allocatable, intent(out) :: error
      integer :: solves, threads

      solves = int(c_enter_solve())
      before = team_size()
      if (solves == 0) return
      threads = 1
#ifdef _OPENMP
      if (omp_in_parallel()) return
      if (asked > 0) then
         threads = min(asked, most_threads)
      else if (unknowns >= worth_threads) then
         threads = max(min(before, omp_get_num_procs())/solves, 1)
      end if
#else
      associate (unused => asked, unused_too => unknowns)
      end associate
#endif
      threads = int(c_prepare_threads(int(threads, c_int)))
      if (threads > 0) then
         call start_team(threads)
      else
         call new_error(error, error_memory, "no memory for the buffers of the BLAS")
      end if
   end subroutine enter_solve

   ! OpenMP starts its threads when they are first used, and each makes its heap when it first needs one. Signals are for
   ! the thread of the caller.
   subroutine start_team(threads)
      integer, intent(in) :: threads

#ifdef _OPENMP
      call omp_set_num_threads(threads)
#else
      associate (unused => threads)
      end associate
#endif
      !$omp parallel
      if (thread_number() > 1) call c_leave_signals()
      call c_make_heap()
      !$omp end parallel
   end subroutine start_team

   !> Gives back what it took.
   subroutine leave_solve(before)
      integer, intent(in) :: before

#ifdef _OPENMP
      if (.not. omp_in_parallel()) call omp_set_num_threads(before)
#else
      associate (unused => before)
      end associate
#endif
      call c_leave_solve()
   end subroutine leave_solve

   !> So many threads work on what is parallel now.
   integer function team_size()
      team_size = 1
#ifdef _OPENMP
      if (.not. omp_in_parallel()) team_size = omp_get_max_threads()
#endif
   end function team_size

   !> Which of them is working, from 1.
   integer function thread_number()
      thread_number = 1
#ifdef _OPENMP
      thread_number = omp_get_thread_num() + 1
#endif
   end function thread_number
end module kschur_threads
