!> The probability that a Krylov space with random start vectors has missed an eigenvalue (docs/theory.md, sections 6 and 12).
!>
!> Let C V = V T + W N, T s = theta s and psi^* C = mu psi^*. Then psi^* v = (psi^* W) N s/(mu - theta) for the Ritz vector
!> v = V s, where |psi^* W| <= 1 if [V, W] is orthonormal, in the inner product of a metric B if C is self-adjoint there and
!> psi = B x. Let an eigenvalue be missing among the Ritz values of a region. Then a combination psi of left vectors of eigenvalues
!> near it is orthogonal to the Ritz vectors near it. Its components along all others are small: along those in the region as
!> their residuals N s are small, along the rest as these are far away. So psi is nearly orthogonal to the start vectors, which
!> are in the space.
module kschur_random_start
   use kschur_kinds, only: wp
   implicit none
   private
   public :: random_start_type

   !> The Ritz pairs of a space that contains C^f X, with random X: independent entries, uniform in (-1, 1).
   type :: random_start_type
      !> Ritz values.
      complex(wp), allocatable :: values(:)
      !> Components of C^f X along each Ritz vector, and the residual N s of that, as columns.
      complex(wp), allocatable :: first(:, :), last(:, :)
      !> f
      integer :: filter = 0
      !> Norm of what was discarded from the residuals.
      real(wp) :: discarded = 0
   contains
      procedure :: chance_of_missing
      procedure :: chance_in_region
   end type random_start_type

contains

   !> Bounds the probability that more eigenvalues than Ritz values of a self-adjoint operator lie above a border, or any below its
   !> negative.
   pure real(wp) function chance_of_missing(self, border, separation, least) result(chance)
      class(random_start_type), intent(in) :: self
      !> Positive; Ritz values above it have converged. Near a Ritz value, or with one below its negative, nothing is known.
      real(wp), intent(in) :: border
      !> Distance of eigenvalues, relative to them, from which on they are not near.
      real(wp), intent(in) :: separation
      !> The smallest eigenvalue of the metric.
      real(wp), intent(in) :: least
      ! The part along the rest falls off like a product of distances from the border on, and is sampled for certainty.
      integer, parameter :: samples = 12
      real(wp) :: values(size(self%values)), points(-samples:samples)
      integer :: i

      chance = 1
      values = real(self%values, wp)
      if (any(abs(values - border) <= separation*border .or. values < -border)) return
      points(0) = border
      points(1:) = [(border + (maxval(values) - border)*4.0_wp**(i - samples), i=1, samples)]
      points(:-1) = [(-border*4.0_wp**(-1 - i), i=-samples, -1)]
      chance = self%chance_in_region(values > border, cmplx(points, kind=wp), separation, 3/least)
   end function chance_of_missing

   !> Bounds the probability that more eigenvalues than Ritz values lie in a region. Let m - 1 Ritz values be near the one that is
   !> missing. Of the first set of m consecutive eigenvalues that is not found as a whole, which begins at one of the k + 1 first, m
   !> rows psi^* X are dependent but for sqrt(m) times the length of one such row: one is so near to the span of the others, in the
   !> p - m + 1 dimensions that these leave of p. Each row is as good as normally distributed, independent of the others.
   pure real(wp) function chance_in_region(self, inside, border, separation, spread) result(chance)
      class(random_start_type), intent(in) :: self
      !> Marks the Ritz values in the region, which have converged, and more if they have.
      logical, intent(in) :: inside(:)
      !> Points of the border of the region, or of the region, at which what has not converged shows most.
      complex(wp), intent(in) :: border(:)
      !> Distance of eigenvalues, relative to them, from which on they are not near.
      real(wp), intent(in) :: separation
      !> Inverse of the smallest variance of a component of psi^* X.
      real(wp), intent(in) :: spread
      ! Those inside, and the cluster of each: neighbours have equal numbers.
      integer, allocatable :: members(:), cluster(:)
      real(wp) :: rest, noise
      integer :: c, i, j

      chance = 1
      members = pack([(i, i=1, size(inside))], inside)
      if (size(members) == 0 .or. size(border) == 0) return
      cluster = [(i, i=1, size(members))]
      do i = 2, size(members)
         do j = 1, i - 1
            associate (a => self%values(members(i)), b => self%values(members(j)))
               if (abs(a - b) > 2*separation*max(abs(a), abs(b))) cycle
            end associate
            where (cluster == cluster(j)) cluster = cluster(i)
         end do
      end do
      ! Rounding of the vectors s, as long as N in N s.
      noise = max(epsilon(1.0_wp)*norm2(abs(self%last)), self%discarded)
      rest = part_of_the_rest(self, inside, border)
      ! One that is near to none.
      chance = chance_of(1, 0, separation*abs(self%values(members)))
      do c = 1, size(members)
         if (count(cluster == c) == 0) cycle
         associate (near => self%values(pack(members, cluster == c)))
            chance = chance + chance_of(size(near) + 1, c, [(minval(abs(self%values(members(i)) - near))/2, i=1, size(members))])
         end associate
      end do
      chance = min(chance, 1.0_wp)

   contains

      ! That one of m eigenvalues is missing, of those near a cluster; `distances` is how far it is from each Ritz value inside.
      pure real(wp) function chance_of(m, near, distances) result(chance)
         integer, intent(in) :: m, near
         real(wp), intent(in) :: distances(:)
         real(wp) :: length
         integer :: p, i

         p = size(self%first, 1)
         chance = 1
         if (m > p) return
         length = sqrt(real(size(self%last, 1), wp))*rest
         do i = 1, size(members)
            if (cluster(i) /= near) length = length + &
               norm2(abs(self%first(:, members(i))))*max(norm2(abs(self%last(:, members(i)))), noise)/distances(i)
         end do
         ! psi^* C^f X is at least |mu|^f times as long as psi^* X.
         length = length/minval(abs(border))**self%filter*sqrt(m*spread)
         chance = (size(self%values) + 1)*m*chance_of_length(length, p - m + 1)
      end function chance_of
   end function chance_in_region

   ! The largest part of the start vectors along Ritz vectors outside of the region, for an eigenvalue at any of these points.
   pure real(wp) function part_of_the_rest(self, inside, points) result(largest)
      type(random_start_type), intent(in) :: self
      logical, intent(in) :: inside(:)
      complex(wp), intent(in) :: points(:)
      complex(wp) :: part(size(self%first, 1), size(self%last, 1))
      real(wp) :: length
      integer :: i, j, k

      largest = 0
      do i = 1, size(points)
         part = 0
         do j = 1, size(self%values)
            if (inside(j)) cycle
            do k = 1, size(part, 2)
               part(:, k) = part(:, k) + self%first(:, j)*(self%last(k, j)/(points(i) - self%values(j)))
            end do
         end do
         length = norm2(abs(part))
         if (.not. length <= huge(1.0_wp)) length = huge(1.0_wp)
         largest = max(largest, length)
      end do
   end function part_of_the_rest

   ! Bounds the probability that a vector of k normally distributed numbers is at most so long: the volume of the ball times the
   ! largest density.
   pure real(wp) function chance_of_length(length, k) result(chance)
      real(wp), intent(in) :: length
      integer, intent(in) :: k

      chance = (length/sqrt(2.0_wp))**k/gamma(k/2.0_wp + 1)
   end function chance_of_length
end module kschur_random_start
