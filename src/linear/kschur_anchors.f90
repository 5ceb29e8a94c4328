!> Unknowns that are eliminated after all multipliers, so that LDL^T factors of a stiffness exist whose bodies only constraints
!> hold.
module kschur_anchors
   use kschur_kinds, only: wp
   implicit none
   private
   public :: anchors_of, has_anchors, join, separate

   ! Most unknowns of each body that are its anchors: some nodes of a solid, more than lie on a line. At most one in so many of all
   ! unknowns is an anchor, which couples to all others: where there are more bodies none has any.
   integer, parameter :: each = 24, rarely = 32
   ! Most bodies, as anchors are searched for among all vertices for each.
   integer, parameter :: most_bodies = 32
   ! Largest distance of an unknown from joints, in edges of the graph: the softest deflection of a beam of so many elements is some
   ! 1e-8 of their stiffness, as the fourth power, which is taken for zero where it is a pivot.
   integer, parameter :: furthest_of_all = 100

contains

   !> Places of the anchors of each body in the order of elimination, from 1; 0 of all other unknowns. A body without its anchors
   !> is definite, and so is what its constraints leave of it: all pivots of unknowns are positive, those of multipliers negative,
   !> but for null vectors of the whole, whose pivots come last. Each anchor of a body is as far from its others as can be: held
   !> there, the body is stiff, and pivots hardly grow.
   pure function anchors_of(row_start, column, vertex, is_free) result(place)
      !> Pattern of a symmetric matrix in compressed rows, counted from 1, unknowns before multipliers.
      integer, intent(in) :: row_start(:), column(:)
      !> Vertex of each unknown, from 1: unknowns with the same neighbours may share one.
      integer, intent(in) :: vertex(:)
      !> Unknowns that no constraint touches: only these, as the motion of anchors is free until the last multiplier.
      logical, intent(in) :: is_free(:)
      integer :: place(size(vertex)), body(size(vertex))
      ! Of each vertex: an unknown, their number, the distance from the anchors, and whether it may be one.
      integer, dimension(maxval(vertex)) :: member, members, distance
      logical :: may_be(maxval(vertex))
      integer :: i, v, last, number

      place = 0
      body = separate(size(vertex))
      call join(row_start, column, body)
      if (.not. has_anchors(row_start, column, body, is_free)) return
      members = 0
      may_be = .true.
      do i = 1, size(vertex)
         v = vertex(i)
         member(v) = i
         members(v) = members(v) + 1
         may_be(v) = may_be(v) .and. is_free(i)
      end do
      distance = huge(1)
      last = 0
      do i = 1, size(vertex)
         if (body(i) /= i) cycle
         ! The first anchor, whose pivots are the last ones, is furthest from the joints about which the body may turn.
         call measure(row_start, column, vertex, member, pack([(v, v=1, size(member))], &
            body(member) == i .and. .not. may_be), distance)
         v = furthest()
         where (body(member) == i) distance = huge(1)
         last = last + each
         number = 0
         do while (v > 0)
            if (distance(v) == 0 .or. number + members(v) > each) exit
            where (vertex == v) place = last - number
            number = number + members(v)
            call measure(row_start, column, vertex, member, [v], distance)
            v = furthest()
         end do
      end do

   contains

      ! The vertex of body i that is furthest from its anchors; 0: none may be one. Of several any one: where each unknown of a
      ! node is a vertex of its own, the first ones would all be of the same direction.
      pure integer function furthest()
         real(wp), parameter :: golden = 0.618033988749895_wp
         integer :: k

         furthest = maxloc(distance + modulo(golden*[(k, k=1, size(distance))], 1.0_wp), 1, may_be .and. body(member) == i)
      end function furthest
   end function anchors_of

   !> Whether bodies have anchors: each has enough unknowns that no constraint touches, none further than `furthest_of_all` from
   !> those that one does, and there are few bodies.
   pure logical function has_anchors(row_start, column, body, is_free)
      integer, intent(in) :: row_start(:), column(:)
      !> The first unknown of the body of each unknown.
      integer, intent(in) :: body(:)
      logical, intent(in) :: is_free(:)
      integer, dimension(size(body)) :: free, distance, identity
      integer :: bodies, i

      free = 0
      bodies = 0
      do i = 1, size(body)
         identity(i) = i
         if (body(i) == i) bodies = bodies + 1
         if (is_free(i)) free(body(i)) = free(body(i)) + 1
      end do
      has_anchors = bodies <= most_bodies .and. each*rarely*bodies <= size(body) .and. count(free >= each) == bodies
      if (.not. has_anchors) return
      distance = furthest_of_all + 1
      call measure(row_start, column, identity, identity, pack(identity, .not. is_free), distance)
      has_anchors = all(distance <= furthest_of_all)
   end function has_anchors

   !> Bodies of one unknown each: the first unknown of the body of each unknown.
   pure function separate(unknowns) result(body)
      integer, intent(in) :: unknowns
      integer :: body(unknowns), i

      body = [(i, i=1, unknowns)]
   end function separate

   !> Joins the bodies that entries of a matrix couple.
   pure subroutine join(row_start, column, body)
      !> Columns of multipliers, behind those of unknowns, join nothing.
      integer, intent(in) :: row_start(:), column(:)
      !> The first unknown of the body of each unknown.
      integer, intent(inout) :: body(:)
      integer :: i, k, a, b

      do i = 1, size(body)
         do k = row_start(i), row_start(i + 1) - 1
            if (column(k) > size(body)) cycle
            a = i
            b = column(k)
            ! Halves the paths to both first unknowns.
            do while (body(a) /= a)
               body(a) = body(body(a))
               a = body(a)
            end do
            do while (body(b) /= b)
               body(b) = body(body(b))
               b = body(b)
            end do
            body(max(a, b)) = min(a, b)
         end do
      end do
      do i = 1, size(body)
         body(i) = body(body(i))
      end do
   end subroutine join

   ! Updates the least distances from some vertices by those from others.
   pure subroutine measure(row_start, column, vertex, member, from, distance)
      integer, intent(in) :: row_start(:), column(:), vertex(:), member(:), from(:)
      integer, intent(inout) :: distance(:)
      integer :: queue(size(member)), head, tail, a, b, k

      distance(from) = 0
      queue(:size(from)) = from
      head = 0
      tail = size(from)
      do while (head < tail)
         head = head + 1
         a = queue(head)
         do k = row_start(member(a)), row_start(member(a) + 1) - 1
            if (column(k) > size(vertex)) cycle
            b = vertex(column(k))
            if (distance(b) <= distance(a) + 1) cycle
            distance(b) = distance(a) + 1
            tail = tail + 1
            queue(tail) = b
         end do
      end do
   end subroutine measure
end module kschur_anchors
