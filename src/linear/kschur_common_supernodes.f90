!> The supernodes at the top of an elimination tree that several processes share, each of which has the subtrees of a part of the
!> others: what they tell each other.
module kschur_common_supernodes
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: common_supernodes_type

   !> Calls are collective; one process leads and has the columns of these supernodes.
   type, abstract :: common_supernodes_type
      !> The first of them among the supernodes of this process, which they end.
      integer :: first = 1
      !> Rows of the whole matrix.
      integer :: unknowns = 0
      logical :: leads = .true.
   contains
      !> Allocates room for the updates of another process, of at most so many entries.
      procedure(make_room), deferred :: make_room
      !> Whether a condition holds in any process.
      procedure(any_of), deferred :: any_of
      !> Adds numbers of all processes, in a fixed order, in the one that leads.
      procedure(add_up), deferred :: add_up
      !> Adds rows of vectors, one after the other as many as there are right-hand sides, in the one that leads.
      procedure(exchange), deferred :: sum_rows
      !> Sends rows of vectors from the one that leads to the others.
      procedure(exchange), deferred :: spread_rows
   end type common_supernodes_type

   abstract interface
      subroutine make_room(self, entries, status)
         import :: common_supernodes_type, long
         class(common_supernodes_type), intent(inout) :: self
         integer(long), intent(in) :: entries
         !> 0 on success.
         integer, intent(out) :: status
      end subroutine make_room

      logical function any_of(self, here)
         import :: common_supernodes_type
         class(common_supernodes_type), intent(in) :: self
         logical, intent(in) :: here
      end function any_of

      subroutine add_up(self, is_empty, values)
         import :: common_supernodes_type, wp
         class(common_supernodes_type), intent(inout) :: self
         !> The values of this process are zero, whatever they say.
         logical, intent(in) :: is_empty
         real(wp), contiguous, intent(inout) :: values(:)
      end subroutine add_up

      subroutine exchange(self, rows)
         import :: common_supernodes_type, wp
         class(common_supernodes_type), intent(in) :: self
         real(wp), contiguous, intent(inout) :: rows(:, :)
      end subroutine exchange
   end interface
end module kschur_common_supernodes
