!> Spaces of two bases paired by principal angles (Bjorck, Golub, Math. Comp. 27 (1973)): vectors of one space have any basis,
!> and what is paired must not depend on it.
module kschur_principal_pairs
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesvd
   use kschur_sorting, only: positions
   implicit none
   private
   public :: pair_spaces

contains

   !> Pairs the directions of spaces that share most, the largest singular value first, until none is above `least`. Vectors
   !> keep their places as far as they can: each direction gets that of the vector which it has most of.
   subroutine pair_spaces(c, before, after, least, match, turn_before, turn_after)
      !> What vector j after has of vector i before, of bases that are orthonormal within each space.
      complex(wp), intent(in) :: c(:, :)
      !> For each vector the first one of its space.
      integer, intent(in) :: before(:), after(:)
      real(wp), intent(in) :: least
      !> For each turned vector before its partner after; 0: none.
      integer, allocatable, intent(out) :: match(:)
      !> Unitary: the turned vectors in terms of those as given, a column each.
      complex(wp), allocatable, intent(out) :: turn_before(:, :), turn_after(:, :)
      !> Singular values of spaces, at their first vectors; how many directions of each are paired.
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
         call take(best(1), best(2))
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
      allocate (match, source=to(partner))

   contains

      ! Below zero where one of the spaces has no direction left, or begins elsewhere. Of a result without a name of its own
      ! that is an argument gfortran takes the address of the function, for which it wants an executable stack.
      real(wp) function largest_of(i, j) result(value)
         integer, intent(in) :: i, j
         complex(wp), allocatable :: w(:, :), z(:, :)

         value = -1
         if (before(i) /= i .or. after(j) /= j) return
         if (used_before(i) == count(before == i) .or. used_after(j) == count(after == j)) return
         call decompose(i, j, w, z, value)
      end function largest_of

      ! The first singular vectors are paired, the others span what is left.
      subroutine take(i, j)
         integer, intent(in) :: i, j
         complex(wp), allocatable :: w(:, :), z(:, :)
         real(wp) :: value

         call decompose(i, j, w, z, value)
         associate (rows => left_of(before, used_before, i), columns => left_of(after, used_after, j), &
            of_before => positions(before == i), of_after => positions(after == j))
            partner(rows(1)) = columns(1)
            turn_before(of_before, rows) = matmul(turn_before(of_before, rows), w)
            turn_after(of_after, columns) = matmul(turn_after(of_after, columns), z)
         end associate
         used_before(i) = used_before(i) + 1
         used_after(j) = used_after(j) + 1
      end subroutine take

      subroutine decompose(i, j, w, z, value)
         integer, intent(in) :: i, j
         complex(wp), allocatable, intent(out) :: w(:, :), z(:, :)
         real(wp), intent(out) :: value

         associate (f => turn_before(positions(before == i), left_of(before, used_before, i)), &
            g => turn_after(positions(after == j), left_of(after, used_after, j)))
            call singular_vectors(matmul(conjg(transpose(f)), &
               matmul(c(positions(before == i), positions(after == j)), g)), w, z, value)
         end associate
      end subroutine decompose
   end subroutine pair_spaces

   ! The turned vectors of a space that are not paired.
   pure function left_of(space, used, i)
      integer, intent(in) :: space(:), used(:), i
      integer :: left_of(count(space == i) - used(i))

      associate (members => positions(space == i))
         left_of = members(used(i) + 1:)
      end associate
   end function left_of

   ! For each vector the turned one of its space that gets its place: which has most of it.
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

   ! A = W S Z^*, W and Z square, and the largest singular value. A single number keeps its vectors.
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
