!> Root spaces as subspaces that shift-invert leaves invariant.
module kschur_root_invariant
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_root_space, only: root_space_type
   implicit none
   private
   public :: undamped_zeros, zero_and_infinite

contains

   !> The states (phi, lambda/unit phi, ...) of the root spaces of zero and of infinity as an invariant subspace of
   !> shift-invert at sigma. With A Z = B Z J it is T = (J - sigma)^{-1}, with B Z = A Z J it is (1 - sigma J)^{-1} J.
   function zero_and_infinite(zero, infinite, order, shift, unit, oscillator) result(invariant)
      !> That of infinity is the one of the reversed polynomial, whose states are (lambda phi, phi).
      type(root_space_type), intent(in) :: zero, infinite
      !> Length of the states.
      integer, intent(in) :: order
      !> sigma, a theta.
      complex(wp), intent(in) :: shift
      !> Unit of lambda in the second part of a state (1/s).
      real(wp), intent(in) :: unit
      !> Whether states are phi alone.
      logical, intent(in) :: oscillator
      type(invariant_type) :: invariant
      integer :: n, k, s

      k = zero%states()
      s = k + infinite%states()
      allocate (invariant%vectors(order, s))
      allocate (invariant%projected(s, s))
      invariant%vectors = 0
      invariant%projected = 0
      if (k > 0) then
         n = size(zero%x, 1)
         invariant%vectors(:n, :k) = zero%x
         if (.not. oscillator) invariant%vectors(n + 1:2*n, :k) = zero%v/unit
         invariant%projected(:k, :k) = inverse(zero%links - shift*identity(k))
      end if
      if (s == k) return
      n = size(infinite%x, 1)
      if (oscillator) then
         invariant%vectors(:n, k + 1:) = infinite%x
      else
         invariant%vectors(:n, k + 1:) = infinite%v
         invariant%vectors(n + 1:2*n, k + 1:) = infinite%x/unit
      end if
      invariant%projected(k + 1:, k + 1:) = matmul(inverse(identity(s - k) - shift*infinite%links), infinite%links)
   end function zero_and_infinite

   !> The root space of lambda = 0 that rigid motions without damping have at least: (phi, 0), and (0, phi) next in
   !> its chain.
   pure function undamped_zeros(motions) result(space)
      !> n x k.
      real(wp), intent(in) :: motions(:, :)
      type(root_space_type) :: space
      integer :: n, k, j

      n = size(motions, 1)
      k = size(motions, 2)
      allocate (space%x(n, 2*k), space%v(n, 2*k), space%links(2*k, 2*k), source=0.0_wp)
      space%x(:, :k) = motions
      space%v(:, k + 1:) = motions
      do j = 1, k
         space%links(j, k + j) = 1
      end do
   end function undamped_zeros

   pure function identity(n)
      integer, intent(in) :: n
      complex(wp) :: identity(n, n)
      integer :: i

      identity = 0
      do i = 1, n
         identity(i, i) = 1
      end do
   end function identity

   ! Of an upper triangular matrix.
   pure function inverse(a) result(b)
      complex(wp), intent(in) :: a(:, :)
      complex(wp) :: b(size(a, 1), size(a, 1))
      integer :: i

      b = identity(size(a, 1))
      do i = size(a, 1), 1, -1
         b(i, :) = (b(i, :) - matmul(a(i, i + 1:), b(i + 1:, :)))/a(i, i)
      end do
   end function inverse
end module kschur_root_invariant
