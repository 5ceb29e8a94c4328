!> Mode shapes and multipliers of the low-rank form.
module kschur_low_rank_shapes
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_local_forces, only: local_forces_type
   use kschur_spectral_map, only: spectral_map_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   implicit none
   private
   public :: recover_shapes, responses_type

   ! Shapes computed at a time.
   integer, parameter :: block = 8

   !> Responses to unit local forces.
   type :: responses_type
      !> F, n x r, and multipliers, m x r.
      real(wp), allocatable :: shapes(:, :), multipliers(:, :)
   end type responses_type

contains

   !> Recovers shapes and multipliers by one more application of the undamped operator, which removes components of infinite
   !> eigenvalues. With G = lambda S + T + i U and p = 1 + beta lambda + i g,
   !>
   !>     p (phi, xi/p) = (z, zeta) - (F, Xi) y,   (z, zeta) = -[K_s - s M, Cq^T; Cq, 0]^{-1} (c(lambda) M x, 0),
   !>     (p + G F) y = G z
   !>
   !> The local forces y are computed from z, not from x, whose motion at a strong damper is a rounding error.
   subroutine recover_shapes(operator, forces, responses, map, shift, lambda, pairs, error)
      class(symmetric_shift_invert_type), intent(inout) :: operator
      type(local_forces_type), intent(in) :: forces
      !> F and its multipliers Xi.
      type(responses_type), intent(in) :: responses
      !> Spectral map of the undamped part, and s.
      type(spectral_map_type), intent(in) :: map
      real(wp), intent(in) :: shift
      complex(wp), intent(in) :: lambda(:)
      !> Has the shapes x on entry; multipliers are set, and shapes normalised.
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: parts(:, :), momenta(:, :), xi(:, :)
      complex(wp), allocatable :: y(:)
      complex(wp) :: p
      real(wp) :: length
      integer :: n, first, last, c, i, j, k

      n = size(pairs%phi, 1)
      allocate (y(forces%rank()))
      do first = 1, size(lambda), block
         last = min(first + block - 1, size(lambda))
         c = last - first + 1
         allocate (parts(n, 2*c), momenta(n, 2*c))
         allocate (xi(size(operator%factors), 2*c), source=0.0_wp)
         parts(:, :c) = real(pairs%phi(:, first:last), wp)
         parts(:, c + 1:) = aimag(pairs%phi(:, first:last))
         momenta = 0
         call operator%problem%mass%add_product(1.0_wp, parts, momenta)
         do j = 1, c
            i = first + j - 1
            p = -(lambda(i)*(lambda(i) + map%alpha) + shift*map%reaction(lambda(i)))
            parts(:, j) = real(p, wp)*momenta(:, j) - aimag(p)*momenta(:, c + j)
            parts(:, c + j) = aimag(p)*momenta(:, j) + real(p, wp)*momenta(:, c + j)
         end do
         call operator%respond(parts, xi, error)
         if (allocated(error)) return
         do j = 1, c
            i = first + j - 1
            p = map%reaction(lambda(i))
            pairs%phi(:, i) = cmplx(parts(:, j), parts(:, c + j), wp)
            pairs%xi(:, i) = cmplx(xi(:, j), xi(:, c + j), wp)
            call find_forces(forces, responses%shapes(forces%columns, :), lambda(i), p, pairs%phi(forces%columns, i), y)
            do k = 1, size(y)
               pairs%phi(:, i) = pairs%phi(:, i) - responses%shapes(:, k)*y(k)
               pairs%xi(:, i) = pairs%xi(:, i) - responses%multipliers(:, k)*y(k)
            end do
            length = norm2(abs(pairs%phi(:, i)))
            if (.not. length > 0) cycle
            pairs%phi(:, i) = pairs%phi(:, i)/length
            pairs%xi(:, i) = pairs%xi(:, i)*(p/length)
         end do
         deallocate (parts, momenta, xi)
      end do
   end subroutine recover_shapes

   ! Solves (p + G F) y = G z with equilibrated rows; zero if that is singular.
   subroutine find_forces(forces, at_columns, lambda, p, z, y)
      type(local_forces_type), intent(in) :: forces
      !> Rows of F that G multiplies.
      real(wp), intent(in) :: at_columns(:, :)
      complex(wp), intent(in) :: lambda, p
      !> Rows of z that G multiplies.
      complex(wp), intent(in) :: z(:)
      complex(wp), intent(out) :: y(:)
      complex(wp) :: g(size(y), size(z)), a(size(y), size(y)), response(size(z), size(y))
      real(wp) :: level
      integer :: r, i, info, pivots(size(y))

      r = size(y)
      if (r == 0) return
      g = lambda*forces%damping + cmplx(forces%stiffness, forces%loss, wp)
      response = at_columns
      a = matmul(g, response)
      y = matmul(g, z)
      do i = 1, r
         a(i, i) = a(i, i) + p
         level = maxval(abs(a(i, :)))
         a(i, :) = a(i, :)/level
         y(i) = y(i)/level
      end do
      call zgesv(r, 1, a, r, pivots, y, r, info)
      if (info /= 0) y = 0
   end subroutine find_forces
end module kschur_low_rank_shapes
