!> Unknowns of one mesh node whose neighbours are not the same. On a regular mesh couplings between directions cancel,
!> and are not stored; but whatever is left, the neighbours of neighbours are the same for all unknowns of a node.
module kschur_mesh_nodes
   use, intrinsic :: iso_fortran_env, only: int16
   use kschur_kinds, only: wp, long
   use kschur_quotient_graph, only: graph_type
   use kschur_random, only: random_vector
   implicit none
   private
   public :: find_mesh_nodes

   ! Sets are told apart by the least of so many random numbers of their members: two that share the part s of the members
   ! of both have all in common with a probability of s^16 (A. Broder, Proc. Compression and Complexity of Sequences (1997)).
   integer, parameter :: marks = 16
   ! Unknowns of a node; larger groups are all that hangs on one unknown that touches them.
   integer, parameter :: most_unknowns = 6

contains

   !> Groups of the first vertices of a graph, those with the same neighbours of neighbours; the others stay alone.
   subroutine find_mesh_nodes(graph, weight, groups, group)
      type(graph_type), intent(in) :: graph
      !> Unknowns of each of the first vertices.
      integer, intent(in) :: weight(:)
      !> How many there are, and the one of each vertex.
      integer, intent(out) :: groups
      integer, allocatable, intent(out) :: group(:)
      integer(int16), allocatable :: own(:, :), near(:, :)
      ! Vertex v is next in the chain of those whose marks fall on one head; the first of those that have the marks of
      ! vertex v; of this one, the unknowns of all of them.
      integer, allocatable :: head(:), next(:), alike(:), unknowns(:)
      real(wp) :: dice(marks)
      integer(long) :: state
      integer :: v, r

      allocate (group(size(graph%start) - 1))
      allocate (own(marks, size(group)), near(marks, size(group)))
      state = 1
      do v = 1, size(group)
         call random_vector(state, dice)
         own(:, v) = int(huge(own)*abs(dice), int16)
      end do
      call look_around(graph, own, near)
      call look_around(graph, near, own)
      allocate (head(size(group)), next(size(group)), alike(size(group)), unknowns(size(group)), source=0)
      do v = 1, size(weight)
         associate (place => head(1 + modulo(mixed(own(:, v)), size(head))))
            r = place
            do while (r > 0)
               if (all(own(:, r) == own(:, v))) exit
               r = next(r)
            end do
            if (r == 0) then
               next(v) = place
               place = v
               r = v
            end if
         end associate
         alike(v) = r
         unknowns(r) = unknowns(r) + weight(v)
      end do
      groups = 0
      do v = 1, size(group)
         if (v <= size(weight)) then
            r = alike(v)
            if (unknowns(r) > most_unknowns) r = v
         else
            r = v
         end if
         if (r == v) then
            groups = groups + 1
            group(v) = groups
         else
            group(v) = group(r)
         end if
      end do
   end subroutine find_mesh_nodes

   ! The least of each vertex and its neighbours.
   pure subroutine look_around(graph, own, least)
      type(graph_type), intent(in) :: graph
      integer(int16), contiguous, intent(in) :: own(:, :)
      integer(int16), contiguous, intent(out) :: least(:, :)
      integer(int16) :: low(marks)
      integer :: v, p

      do v = 1, size(own, 2)
         low = own(:marks, v)
         do p = graph%start(v), graph%start(v + 1) - 1
            low = min(low, own(:marks, graph%neighbour(p)))
         end do
         least(:, v) = low
      end do
   end subroutine look_around

   pure integer function mixed(numbers)
      integer(int16), intent(in) :: numbers(:)
      integer :: i

      mixed = 0
      do i = 1, size(numbers)
         mixed = ieor(ishftc(mixed, 5), int(numbers(i)))
      end do
   end function mixed
end module kschur_mesh_nodes
