!> Shapes and multipliers of the low-rank form.
module kschur_low_rank_shapes
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgemm
   use kschur_local_forces, only: local_forces_type
   use kschur_spectral_map, only: spectral_map_type
   use kschur_symmetric_transform, only: symmetric_shift_invert_type
   implicit none
   private
   public :: combine, recover_shapes

   ! Shapes that are computed at a time, and rows.
   integer, parameter :: block = 8, panel = 256

contains

   !> X = V U Y, Y complex, a panel of rows at a time.
   subroutine combine(n, k, v, u, y, x)
      integer, intent(in) :: n, k
      real(wp), intent(in) :: v(n, k)
      real(wp), intent(in) :: u(:, :)
      complex(wp), intent(in) :: y(:, :)
      complex(wp), intent(out) :: x(:, :)
      real(wp) :: w(size(u, 1), 2*size(y, 2)), parts(panel, 2*size(y, 2))
      integer :: c, first, rows

      c = size(y, 2)
      if (k == 0 .or. c == 0) return
      w = matmul(u, reshape([real(y, wp), aimag(y)], [k, 2*c]))
      do first = 1, n, panel
         rows = min(panel, n - first + 1)
         call dgemm("N", "N", rows, 2*c, k, 1.0_wp, v(first, 1), n, w, k, 0.0_wp, parts, panel)
         x(first:first + rows - 1, :) = cmplx(parts(:rows, :c), parts(:rows, c + 1:), wp)
      end do
   end subroutine combine

   !> One more application of the undamped operator, which leaves nothing of infinite eigenvalues:
   !>
   !>     (1 + beta lambda) (phi, xi') = -[K_s - s M, Cq^T; Cq, 0]^{-1} (c(lambda) M x + B (lambda S + T) x, 0)
   !>
   !> with xi = (1 + beta lambda) xi'; phi is scaled to unit norm.
   subroutine recover_shapes(operator, forces, map, shift, lambda, pairs, error)
      class(symmetric_shift_invert_type), intent(inout) :: operator
      type(local_forces_type), intent(in) :: forces
      !> Of the undamped part, and s.
      type(spectral_map_type), intent(in) :: map
      real(wp), intent(in) :: shift
      complex(wp), intent(in) :: lambda(:)
      !> With the shapes x; multipliers are set.
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: parts(:, :), xi(:, :)
      complex(wp), allocatable :: f(:, :)
      complex(wp) :: p
      real(wp) :: length
      integer :: n, first, last, c, i, j

      n = size(pairs%phi, 1)
      do first = 1, size(lambda), block
         last = min(first + block - 1, size(lambda))
         c = last - first + 1
         allocate (f(n, c), parts(n, 2*c), xi(size(operator%factors), 2*c))
         do j = 1, c
            i = first + j - 1
            p = map%reaction(lambda(i))
            f(:, j) = 0
            call operator%problem%mass%add_product(-(lambda(i)*(lambda(i) + map%alpha) + shift*p), pairs%phi(:, i:i), &
               f(:, j:j))
            call forces%add_forces(-1.0_wp, lambda(i), pairs%phi(:, i), f(:, j))
         end do
         parts(:, :c) = real(f, wp)
         parts(:, c + 1:) = aimag(f)
         call operator%respond(parts, xi, error)
         if (allocated(error)) return
         do j = 1, c
            p = map%reaction(lambda(first + j - 1))
            associate (phi => pairs%phi(:, first + j - 1))
               phi = cmplx(parts(:, j), parts(:, c + j), wp)
               length = norm2(abs(phi))
               if (.not. length > 0) cycle
               phi = phi/length
               pairs%xi(:, first + j - 1) = cmplx(xi(:, j), xi(:, c + j), wp)*(p/length)
            end associate
         end do
         deallocate (f, parts, xi)
      end do
   end subroutine recover_shapes
end module kschur_low_rank_shapes
