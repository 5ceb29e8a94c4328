!> The pattern of a symmetric matrix by vertices: unknowns that stand one after the other in the order of elimination and
!> have the same neighbours, as those of a mesh node do, have the same rows in L too, and are one vertex.
module kschur_compressed_pattern
   implicit none
   private
   public :: compressed_pattern_type

   !> Vertices are numbered in the order of elimination.
   type :: compressed_pattern_type
      !> The neighbours of vertex v are neighbour(start(v):start(v+1)-1), itself left out; it has weight(v) unknowns.
      integer, allocatable :: start(:), neighbour(:), weight(:)
      ! The unknowns in the order of elimination, those of vertex v from first(v) on.
      integer, allocatable, private :: order(:), first(:)
   contains
      procedure :: compress
      !> The unknowns of vertices, one vertex after the other.
      procedure :: unknowns
      !> Number of entries of another pattern off the diagonal, if all of them are in this one; else -1.
      procedure :: entries_within
   end type compressed_pattern_type

contains

   !> Of a symmetric pattern (CSR, 1-based, columns ascending), unknown i of which is eliminated as number position(i).
   subroutine compress(self, row_start, column, position)
      class(compressed_pattern_type), intent(out) :: self
      integer, intent(in) :: row_start(:), column(:), position(:)
      integer, allocatable :: vertex(:), seen(:)
      integer :: n, k, v, p, vertices, pass, edges

      n = size(position)
      allocate (self%order(n), vertex(n))
      self%order(position) = [(k, k=1, n)]
      vertices = 0
      do k = 1, n
         if (k == 1) then
            vertices = 1
         else if (.not. are_same(self%order(k - 1), self%order(k))) then
            vertices = vertices + 1
         end if
         vertex(self%order(k)) = vertices
      end do
      allocate (self%weight(vertices), self%first(vertices), seen(vertices), source=0)
      do k = n, 1, -1
         v = vertex(self%order(k))
         self%first(v) = k
         self%weight(v) = self%weight(v) + 1
      end do
      allocate (self%start(vertices + 1))
      do pass = 1, 2
         edges = 0
         seen = 0
         do v = 1, vertices
            self%start(v) = edges + 1
            seen(v) = v
            associate (i => self%order(self%first(v)))
               do p = row_start(i), row_start(i + 1) - 1
                  if (seen(vertex(column(p))) == v) cycle
                  seen(vertex(column(p))) = v
                  edges = edges + 1
                  if (pass == 2) self%neighbour(edges) = vertex(column(p))
               end do
            end associate
         end do
         self%start(vertices + 1) = edges + 1
         if (pass == 1) allocate (self%neighbour(edges))
      end do

   contains

      ! Whether two unknowns have the same neighbours, each other among them.
      pure logical function are_same(i, j)
         integer, intent(in) :: i, j

         associate (a => column(row_start(i):row_start(i + 1) - 1), b => column(row_start(j):row_start(j + 1) - 1))
            are_same = size(a) == size(b)
            if (are_same) are_same = all(a == b)
            if (are_same) are_same = any(a == i) .and. any(a == j)
         end associate
      end function are_same
   end subroutine compress

   pure function unknowns(self, vertices)
      class(compressed_pattern_type), intent(in) :: self
      integer, intent(in) :: vertices(:)
      integer :: unknowns(sum(self%weight(vertices)))
      integer :: k, i, at

      at = 0
      do k = 1, size(vertices)
         associate (v => vertices(k))
            do i = 0, self%weight(v) - 1
               at = at + 1
               unknowns(at) = self%order(self%first(v) + i)
            end do
         end associate
      end do
   end function unknowns

   pure integer function entries_within(self, row_start, column) result(entries)
      class(compressed_pattern_type), intent(in) :: self
      !> CSR, 1-based, as many rows.
      integer, intent(in) :: row_start(:), column(:)
      integer :: vertex(size(self%order)), seen(size(self%weight)), v, k, p

      do v = 1, size(seen)
         vertex(self%order(self%first(v):self%first(v) + self%weight(v) - 1)) = v
      end do
      seen = 0
      entries = 0
      do v = 1, size(seen)
         seen(v) = v
         seen(self%neighbour(self%start(v):self%start(v + 1) - 1)) = v
         do k = self%first(v), self%first(v) + self%weight(v) - 1
            associate (i => self%order(k))
               do p = row_start(i), row_start(i + 1) - 1
                  if (column(p) == i) cycle
                  entries = entries + 1
                  if (seen(vertex(column(p))) /= v) entries = -1
                  if (entries < 0) return
               end do
            end associate
         end do
      end do
   end function entries_within
end module kschur_compressed_pattern
