!> Begins and ends collective steps on a distributed block Lanczos decomposition. The first process requests a step, and broadcasts
!> what it has changed in the decomposition since the last one.
module kschur_together
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_kinds, only: wp, long
   use kschur_row_sums, only: row_sums_type
   implicit none
   private
   public :: begin_together, end_together, join_together

   !> Codes of the steps.
   integer, parameter, public :: to_expand = 1, to_add_random = 2

contains

   !> Begins a step in the first process: requests it from the others, which call `join_together`, and sends them the state of the
   !> decomposition. Does nothing with one process.
   subroutine begin_together(d, what, arguments, limit)
      class(block_decomposition_type), intent(inout) :: d
      !> One of `to_*`.
      integer, intent(in) :: what
      !> At most two integer arguments, and a real one.
      integer, intent(in) :: arguments(:)
      real(wp), intent(in) :: limit
      real(wp) :: sent

      if (.not. d%team%is_several()) return
      call d%team%call_all([what, d%vectors, d%expanded, arguments])
      sent = limit
      call broadcast_state(d, sent)
   end subroutine begin_together

   !> Begins a requested step in another process: receives the state of the decomposition.
   subroutine join_together(d, vectors, expanded, limit)
      class(block_decomposition_type), intent(inout) :: d
      integer, intent(in) :: vectors, expanded
      real(wp), intent(out) :: limit
      real(wp), allocatable :: images(:, :)

      d%team = d%basis%team()
      d%vectors = vectors
      d%expanded = expanded
      if (allocated(d%couplings)) then
         if (size(d%couplings, 2) /= d%basis%room()) deallocate (d%couplings)
      end if
      if (.not. allocated(d%couplings)) allocate (d%couplings(d%basis%room(), d%basis%room()), source=0.0_wp)
      limit = 0
      call broadcast_state(d, limit)
      allocate (images, source=d%images(:, :vectors - expanded))
      call move_alloc(images, d%images)
   end subroutine join_together

   ! Broadcasts scalars of the decomposition in the first process, and the couplings of unexpanded vectors: no others are needed.
   subroutine broadcast_state(d, limit)
      class(block_decomposition_type), intent(inout) :: d
      real(wp), intent(inout) :: limit
      real(wp) :: state(6 + (d%vectors - d%expanded)*d%expanded)

      associate (outward => d%couplings(d%expanded + 1:d%vectors, :d%expanded))
         state = [limit, real(d%most, wp), real(d%random_state, wp), d%scale, d%metric_scale, d%longest, &
            reshape(outward, [size(outward)])]
         call d%team%send(state)
         limit = state(1)
         d%most = nint(state(2))
         d%random_state = nint(state(3), long)
         d%scale = state(4)
         d%metric_scale = state(5)
         d%longest = state(6)
         outward = reshape(state(7:), shape(outward))
      end associate
      if (allocated(d%images)) then
         if (size(d%images, 2) == 0) deallocate (d%images)
      end if
      if (.not. allocated(d%images)) allocate (d%images(d%team%rows(d%basis%length()), 0))
      d%sums = d%team%sums()
      call d%basis%work_collectively(.true.)
   end subroutine broadcast_state

   !> Ends a step in all processes: vectors are whole in the first process again.
   subroutine end_together(d)
      class(block_decomposition_type), intent(inout) :: d

      if (.not. d%team%is_several()) return
      call d%basis%work_collectively(.false.)
      d%sums = row_sums_type()
   end subroutine end_together
end module kschur_together
