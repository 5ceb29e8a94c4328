!> Pairs vectors of two sets of subspaces by principal angles (Bjorck, Golub, Math. Comp. 27 (1973)), independently of the bases
!> of the subspaces.
module kschur_principal_pairs
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesvd
   use kschur_sorting, only: positions
   implicit none
   private
   public :: pair_spaces

contains

   !> Pairs the directions of two spaces with the largest singular value first, until none is above `least`. Rotated vectors
   !> keep positions if possible: each takes that of the vector it has the largest component of.
   subroutine pair_spaces(c, before, after, least, match, turn_before, turn_after)
      !> Component of vector j after along vector i before; bases are orthonormal within each space.
      complex(wp), intent(in) :: c(:, :)
      !> For each vector, the first one of its space.
      integer, intent(in) :: before(:), after(:)
      real(wp), intent(in) :: least
      !> For each rotated vector before its partner after; 0: none.
      integer, allocatable, intent(out) :: match(:)
      !> Unitary: columns are the rotated vectors in terms of the given ones.
      complex(wp), allocatable, intent(out) :: turn_before(:, :), turn_after(:, :)
      !> Largest singular value of each pair of spaces, stored at their first vectors; number of paired directions of each.
      real(wp) :: largest(size(before), size(after))
      integer :: used_before(size(before)), used_after(size(after)), partner(size(before)), to(0:size(after)), best(2), i, j

      allocate (turn_before, source=identity(size(before)))
      allocate (turn_after, source=identity(size(after)))
      used_before = 0
      used_after = 0
      partner = 0
      do j = 1, size(after)
         do i = 1, size(before)
            largest(i, j) = largest_of(i, j)
         end do
      end do
      do while (any(largest >= least))
         best = maxloc(largest)
         call pair_first(best(1), best(2))
         do j = 1, size(after)
            largest(best(1), j) = largest_of(best(1), j)
         end do
         do i = 1, size(before)
            largest(i, best(2)) = largest_of(i, best(2))
         end do
      end do
      partner = partner(places_kept(before, turn_before))
      to(0) = 0
      to(places_kept(after, turn_after)) = [(j, j=1, size(after))]
      turn_before = turn_before(:, places_kept(before, turn_before))
      turn_after = turn_after(:, places_kept(after, turn_after))
      allocate (match(size(partner)), source=to(partner))

   contains

      ! Largest singular value of the directions left in two spaces, given by their first vectors. Negative if a space has none
      ! left, or the index is not its first. The result has a name of its own: otherwise gfortran takes the address of the
      ! internal function, which needs an executable stack.
      real(wp) function largest_of(i, j) result(value)
         integer, intent(in) :: i, j
         complex(wp), allocatable :: w(:, :), z(:, :)

         value = -1
         if (before(i) /= i .or. after(j) /= j) return
         if (used_before(i) == count(before == i) .or. used_after(j) == count(after == j)) return
         call decompose(i, j, w, z, value)
      end function largest_of

      ! Pairs the singular vectors of the largest singular value; the others become the remaining directions of the two spaces.
      subroutine pair_first(i, j)
         integer, intent(in) :: i, j
         complex(wp), allocatable :: w(:, :), z(:, :)
         real(wp) :: value

         call decompose(i, j, w, z, value)
         associate (rows => unpaired_of(before, used_before, i), columns => unpaired_of(after, used_after, j), &
            of_before => positions(before == i), of_after => positions(after == j))
            partner(rows(1)) = columns(1)
            turn_before(of_before, rows) = matmul(turn_before(of_before, rows), w)
            turn_after(of_after, columns) = matmul(turn_after(of_after, columns), z)
         end associate
         used_before(i) = used_before(i) + 1
         used_after(j) = used_after(j) + 1
      end subroutine pair_first

      ! Singular value decomposition of the components between the directions left in two spaces.
      subroutine decompose(i, j, w, z, value)
         integer, intent(in) :: i, j
         complex(wp), allocatable, intent(out) :: w(:, :), z(:, :)
         real(wp), intent(out) :: value

         associate (f => turn_before(positions(before == i), unpaired_of(before, used_before, i)), &
            g => turn_after(positions(after == j), unpaired_of(after, used_after, j)))
            call singular_vectors(matmul(conjg(transpose(f)), &
               matmul(c(positions(before == i), positions(after == j)), g)), w, z, value)
         end associate
      end subroutine decompose
   end subroutine pair_spaces

   ! Positions of the unpaired rotated vectors of a space.
   pure function unpaired_of(space, used, i)
      integer, intent(in) :: space(:), used(:), i
      integer :: unpaired_of(count(space == i) - used(i))

      associate (members => positions(space == i))
         unpaired_of = members(used(i) + 1:)
      end associate
   end function unpaired_of

   ! For each vector, the rotated one that takes its position: the one with the largest component along it.
   pure function places_kept(space, turn) result(from)
      integer, intent(in) :: space(:)
      complex(wp), intent(in) :: turn(:, :)
      integer :: from(size(space))
      logical :: free(size(space), size(space))
      integer :: k, place(2)

      free = spread(space, 2, size(space)) == spread(space, 1, size(space))
      do k = 1, size(space)
         place = maxloc(abs(turn), free)
         from(place(1)) = place(2)
         free(place(1), :) = .false.
         free(:, place(2)) = .false.
      end do
   end function places_kept

   ! Singular value decomposition A = W S Z^*, W and Z square, and the largest singular value. For a 1 x 1 matrix W = Z = 1.
   subroutine singular_vectors(a, w, z, largest)
      complex(wp), intent(in) :: a(:, :)
      complex(wp), allocatable, intent(out) :: w(:, :), z(:, :)
      real(wp), intent(out) :: largest
      complex(wp) :: copy(size(a, 1), size(a, 2)), work(4*(size(a, 1) + size(a, 2)))
      real(wp) :: values(min(size(a, 1), size(a, 2))), rwork(5*size(values))
      integer :: info

      allocate (w, source=identity(size(a, 1)))
      allocate (z, source=identity(size(a, 2)))
      largest = abs(a(1, 1))
      if (size(a) == 1) return
      copy = a
      call zgesvd("A", "A", size(a, 1), size(a, 2), copy, size(a, 1), values, w, size(w, 1), z, size(z, 1), work, size(work), &
         rwork, info)
      z = conjg(transpose(z))
      largest = values(1)
   end subroutine singular_vectors

   pure function identity(n)
      integer, intent(in) :: n
      complex(wp) :: identity(n, n)
      integer :: i

      identity = 0
      do i = 1, n
         identity(i, i) = 1
      end do
   end function identity
end module kschur_principal_pairs
