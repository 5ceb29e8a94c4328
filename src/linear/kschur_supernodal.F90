!> Multifrontal LDL^T without pivoting. Threads share independent parts of the elimination tree, and tiles of panels
!> above its leaves; neither the partition nor the digits depend on the number of threads.
module kschur_supernodal
   use kschur_common_supernodes, only: common_supernodes_type, common_updates_type
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_fronts, only: elimination_type, eliminate_supernode, front_type, supernodal_factors_type
   use kschur_kinds, only: wp, long
   use kschur_monitor, only: ask_monitor, is_stopped, monitor_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_subtrees, only: subtrees_type
   use kschur_supernodes, only: widest
   use kschur_symbolic, only: symbolic_type
   use kschur_threads, only: team_size, thread_number
   use kschur_update_memory, only: matrix_type
   implicit none
   private
   public :: eliminate

#define SCALAR real(wp)
#define ROUNDED real(single)
#define MATRIX_TYPE csr_matrix_type
#define ELIMINATE_COMMON eliminate_common
#include "kschur_supernodal.inc"

   ! Factors the common supernodes after the first `own` parts. None is factored if a part was stopped in any process.
   subroutine eliminate_common(symbolic, own, shared, factors, fronts, common, monitor)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: own
      type(elimination_type), intent(inout) :: shared
      type(supernodal_factors_type), intent(inout) :: factors
      !> One for each thread.
      type(front_type), intent(inout) :: fronts(:)
      class(common_supernodes_type), intent(inout) :: common
      class(monitor_type), optional, intent(inout) :: monitor
      type(common_updates_type), allocatable :: update(:)
      real(wp) :: none(0)
      integer :: s, status

      allocate (update(common%first - 1), stat=status)
      shared%no_memory = shared%no_memory .or. status /= 0
      if (common%any_of(any(shared%stopped(:own)) .or. shared%ended .or. shared%no_memory)) return
      do s = 1, size(update)
         if (symbolic%parent(s) < common%first) cycle
         associate (mine => shared%update(s))
            update(s)%matrix = mine%matrix
            update(s)%eliminated = mine%eliminated
            call move_alloc(mine%sum, update(s)%sum)
            mine%matrix = matrix_type()
         end associate
      end do
      call shared%plan%drop_spare()
      call free_stacks(fronts)
      associate (first => symbolic%first(common%first), offset => factors%offset(common%first:))
         if (allocated(shared%terms)) then
            call common%eliminate(shared%matrix, update, fronts(1)%enclosure, shared%terms(first:), offset, factors%lower, &
               factors%pivot(first:), shared%no_memory, monitor)
         else
            call common%eliminate(shared%matrix, update, fronts(1)%enclosure, none, offset, factors%lower, factors%pivot(first:), &
               shared%no_memory, monitor)
         end if
      end associate
   end subroutine eliminate_common
end module kschur_supernodal
