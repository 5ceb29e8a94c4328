!> Threads of one solve. OpenMP keeps the number of threads for each calling thread, so that concurrent solves are independent.
!> Sums are formed in panels of fixed size, in order, so that results do not depend on the number of threads.
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

   !> Rows of a panel of work; below two panels a loop runs on one thread.
   integer, parameter, public :: panel_rows = 2048
   !> Upper bound of the threads of a solve, whatever is asked for.
   integer, parameter, public :: most_threads = 4096
   !> Argument of `enter_solve` for small work.
   integer, parameter, public :: one_thread = 1

   ! Smallest number of unknowns for which a solve uses several threads. A solve has thousands of synchronisations, which on
   ! busy cores take longer than all work of a smaller problem.
   integer, parameter :: least_threaded_unknowns = 10000

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

      subroutine c_block_signals() bind(c, name="kschur_block_signals")
      end subroutine c_block_signals

      subroutine c_make_heap() bind(c, name="kschur_make_heap")
      end subroutine c_make_heap

      !> Sets the number of threads of the BLAS: several during a factorisation made of large products, else one.
      subroutine set_blas_threads(threads) bind(c, name="kschur_set_blas_threads")
         import :: c_int
         integer(c_int), value :: threads
      end subroutine set_blas_threads
   end interface

contains

   !> Sets the number of threads of this solve: `asked`, or the available cores divided by the number of concurrent solves; one
   !> for a small problem or if memory is short. Sets the BLAS to one thread. A nested solve changes nothing. Fails if there is
   !> no memory for one thread. Call `leave_solve` in any case.
   subroutine enter_solve(asked, unknowns, before, error)
      !> 0: share of the available cores.
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
      else if (unknowns >= least_threaded_unknowns) then
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

   ! Starts the threads of OpenMP and their malloc arenas now, while memory is known to suffice; blocks SIGINT and SIGTERM in all
   ! but the calling thread.
   subroutine start_team(threads)
      integer, intent(in) :: threads

#ifdef _OPENMP
      call omp_set_num_threads(threads)
#else
      associate (unused => threads)
      end associate
#endif
      !$omp parallel
      if (thread_number() > 1) call c_block_signals()
      call c_make_heap()
      !$omp end parallel
   end subroutine start_team

   !> Restores the number of threads before the solve.
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

   !> Number of threads of the current parallel region, or of the next one.
   integer function team_size()
      team_size = 1
#ifdef _OPENMP
      if (.not. omp_in_parallel()) team_size = omp_get_max_threads()
#endif
   end function team_size

   !> Number of this thread, from 1.
   integer function thread_number()
      thread_number = 1
#ifdef _OPENMP
      thread_number = omp_get_thread_num() + 1
#endif
   end function thread_number
end module kschur_threads
