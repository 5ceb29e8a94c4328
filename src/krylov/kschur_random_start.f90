!> The probability that a Krylov space with random start vectors has missed an eigenvalue (docs/theory.md, section 12).
!>
!> Let C V = V T + W N with C self-adjoint and B-orthonormal [V, W], and T s = theta s. An eigenvector x of C to mu has the
!> component v^T B x = (N s)^T (W^T B x)/(mu - theta) along the Ritz vector v = V s, where W^T B x is at most 1 long. If an
!> eigenvalue above a border is missing among the Ritz values there, then a vector u of eigenvectors near it is orthogonal to the
!> Ritz vectors near it. It has small components along all others: along those above the border as their residuals N s are small,
!> along those below as these are far away. So u is nearly orthogonal to the start vectors, which are in the space.
module kschur_random_start
   use kschur_kinds, only: wp
   use kschur_sorting, only: ascending_order
   implicit none
   private
   public :: random_start_type

   !> The Ritz pairs of a space that contains C^f X, with random X: independent entries, uniform in (-1, 1).
   type :: random_start_type
      !> Ritz values.
      real(wp), allocatable :: values(:)
      !> Components of each Ritz vector along C^f X, and its residual N s, as columns.
      real(wp), allocatable :: first(:, :), last(:, :)
      !> f
      integer :: filter = 0
      !> Norm of what was discarded from the residuals.
      real(wp) :: discarded = 0
   contains
      procedure :: chance_of_missing
   end type random_start_type

contains

   !> Bounds the probability that more eigenvalues than Ritz values lie above a border, or any below its negative. Let m - 1 Ritz
   !> values be near the one that is missing. Of the first set of m consecutive eigenvalues that is not found as a whole, which
   !> begins at one of the k + 1 first, m rows x^T B X are dependent but for sqrt(m) times the length of u^T B X: one is so near to
   !> the span of the others, in the p - m + 1 dimensions that these leave of p. Each row is as good as normally distributed,
   !> independent of the others with a variance of at least b/3, b the smallest eigenvalue of B.
   pure real(wp) function chance_of_missing(self, border, separation, least) result(chance)
      class(random_start_type), intent(in) :: self
      !> Positive; Ritz values above it have converged. Near a Ritz value, or with one below its negative, nothing is known.
      real(wp), intent(in) :: border
      !> Distance of eigenvalues, relative to them, from which on they are not near.
      real(wp), intent(in) :: separation
      !> b
      real(wp), intent(in) :: least
      ! Of the Ritz values above the border, ascending: those of a cluster have equal numbers.
      integer, allocatable :: order(:), cluster(:)
      real(wp) :: below, noise
      integer :: c, i

      chance = 1
      if (any(abs(self%values - border) <= separation*border .or. self%values < -border)) return
      order = ascending_order(self%values)
      order = pack(order, self%values(order) > border)
      if (size(order) == 0) return
      allocate (cluster(size(order)), source=1)
      do i = 2, size(order)
         cluster(i) = cluster(i - 1)
         if (self%values(order(i)) - self%values(order(i - 1)) > 2*separation*self%values(order(i))) cluster(i) = cluster(i) + 1
      end do
      ! Rounding of the vectors s, as long as N in N s.
      noise = max(epsilon(1.0_wp)*norm2(self%last), self%discarded)
      below = beyond_border(self, border)
      ! One that is near to none.
      chance = chance_of(1, [integer ::], separation*self%values(order))
      do c = 1, maxval([0, cluster])
         associate (members => pack(order, cluster == c))
            chance = chance + chance_of(size(members) + 1, members, [(minval(abs(self%values(order(i)) - &
               self%values(members)))/2, i=1, size(order))])
         end associate
      end do
      chance = min(chance, 1.0_wp)

   contains

      ! That one of m consecutive eigenvalues is missing; `distances` is how far it is from each Ritz value in `order` at least.
      pure real(wp) function chance_of(m, members, distances) result(chance)
         integer, intent(in) :: m, members(:)
         real(wp), intent(in) :: distances(:)
         real(wp) :: length
         integer :: p, i

         p = size(self%first, 1)
         chance = 1
         if (m > p) return
         length = sqrt(real(size(self%last, 1), wp))*below
         do i = 1, size(order)
            if (all(members /= order(i))) length = length + &
               norm2(self%first(:, order(i)))*max(norm2(self%last(:, order(i))), noise)/distances(i)
         end do
         ! u^T B C^f X is at least border^f times as long as u^T B X.
         length = length/border**self%filter*sqrt(3*m/least)
         chance = (size(self%values) + 1)*m*chance_of_length(length, p - m + 1)
      end function chance_of
   end function chance_of_missing

   ! The largest part of the start vectors along Ritz vectors below the border, for any eigenvalue above it or below its negative:
   ! largest next to these, as it falls off like a product of distances, and sampled for certainty.
   pure real(wp) function beyond_border(self, border)
      type(random_start_type), intent(in) :: self
      real(wp), intent(in) :: border
      integer, parameter :: samples = 12
      real(wp), allocatable :: part(:, :)
      real(wp) :: mu
      integer :: i, j, k

      beyond_border = 0
      allocate (part(size(self%first, 1), size(self%last, 1)))
      do i = -samples, samples
         mu = border
         if (i > 0) mu = border + (maxval(self%values) - border)*4.0_wp**(i - samples)
         if (i < 0) mu = -border*4.0_wp**(-1 - i)
         part = 0
         do j = 1, size(self%values)
            if (self%values(j) > border) cycle
            do k = 1, size(part, 2)
               part(:, k) = part(:, k) + self%first(:, j)*(self%last(k, j)/(mu - self%values(j)))
            end do
         end do
         beyond_border = max(beyond_border, norm2(part))
      end do
   end function beyond_border

   ! Bounds the probability that a vector of k normally distributed numbers is at most so long: the volume of the ball times the
   ! largest density.
   pure real(wp) function chance_of_length(length, k) result(chance)
      real(wp), intent(in) :: length
      integer, intent(in) :: k

      chance = (length/sqrt(2.0_wp))**k/gamma(k/2.0_wp + 1)
   end function chance_of_length
end module kschur_random_start
