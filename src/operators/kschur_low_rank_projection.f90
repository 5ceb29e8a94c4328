!> Projected problem of the low-rank form: small and dense, linear in (x, v).
!>
!> On the null space of the constraints, with A = K_s - s M and C = A^{-1} M, A^{-1} P(lambda) is
!>
!>     p(lambda) + c(lambda) C + F (lambda S + T + i U),   p = 1 + beta lambda + i g,  c = lambda^2 + alpha lambda + s p
!>
!> with the responses F = A^{-1} B. In a space with M-orthonormal basis V that contains F, only C maps out of the space, and its
!> residual block is known from the Lanczos decomposition.
module kschur_low_rank_projection
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_dense_eigenpairs, only: dense_eigenpairs_type, matrix_eigenpairs
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_local_forces, only: local_forces_type
   use kschur_projected, only: symmetric_eigenvectors
   use kschur_sorting, only: ascending_order
   use kschur_spectral_map, only: spectral_map_type
   use kschur_staircase, only: root_space_type, zero_and_infinite
   use kschur_tolerances, only: twelve_digits
   implicit none
   private
   public :: projection_type, new_projection

   !> Undamped part in the space, its Ritz pairs, and the local forces.
   type :: projection_type
      !> Ritz values of C, and their residuals relative to them.
      real(wp), allocatable :: values(:), residuals(:)
      !> Ritz vectors in terms of the basis, and the residual block applied to each, k and q rows.
      real(wp), allocatable :: vectors(:, :), remainder(:, :)
      !> F (r columns), S and T + i U (r rows) in terms of the Ritz vectors.
      real(wp), allocatable :: responses(:, :), damping(:, :)
      complex(wp), allocatable :: stiffness(:, :)
      !> theta and lambda of the undamped part; s.
      type(spectral_map_type) :: map
      real(wp) :: shift = 0
   contains
      !> Eigenpairs of the damped problem in the space.
      procedure :: eigenpairs
      !> Norm of the residual of A^{-1} P(lambda), relative to p(lambda), for a combination of Ritz vectors.
      procedure :: residual
   end type projection_type

contains

   !> Projects the problem on the space of a Lanczos decomposition: computes its undamped Ritz pairs, and the local forces in terms
   !> of these.
   subroutine new_projection(projection, d, responses, forces, map, shift, error)
      type(projection_type), intent(out) :: projection
      class(block_decomposition_type), intent(in) :: d
      !> F in terms of the basis.
      real(wp), intent(in) :: responses(:, :)
      type(local_forces_type), intent(in) :: forces
      type(spectral_map_type), intent(in) :: map
      !> s.
      real(wp), intent(in) :: shift
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: motion(:, :)
      integer :: k, j

      projection%map = map
      projection%shift = shift
      k = d%expanded
      allocate (projection%vectors, source=(d%couplings(:k, :k) + transpose(d%couplings(:k, :k)))/2)
      call symmetric_eigenvectors(projection%vectors, projection%values, error)
      if (allocated(error)) return
      associate (u => projection%vectors)
         allocate (projection%remainder, source=matmul(d%couplings(k + 1:d%vectors, :k), u))
         allocate (projection%responses, source=matmul(transpose(u), responses(:k, :)))
         allocate (motion, source=matmul(d%basis%rows(forces%columns, k), u))
         allocate (projection%damping, source=matmul(forces%damping, motion))
         allocate (projection%stiffness, source=cmplx(matmul(forces%stiffness, motion), matmul(forces%loss, motion), wp))
      end associate
      allocate (projection%residuals, source=[(norm2(projection%remainder(:, j))/ &
         max(abs(projection%values(j)), epsilon(1.0_wp)*d%scale, tiny(1.0_wp)), j=1, k)])
   end subroutine new_projection

   !> Solves the projected damped problem: computes mu = 1/(lambda - tau), and states (x, v) in terms of the Ritz vectors, v =
   !> lambda/unit x. Excludes the given root space of the eigenvalue zero.
   subroutine eigenpairs(self, tau, unit, zero, pairs, error)
      class(projection_type), intent(in) :: self
      real(wp), intent(in) :: tau, unit
      !> Its states in terms of the Ritz vectors.
      type(root_space_type), intent(in) :: zero
      type(dense_eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      type(root_space_type) :: none
      type(invariant_type) :: zero_space
      complex(wp), allocatable :: matrix(:, :), lossy(:, :)
      real(wp), allocatable :: ordered(:, :)
      real(wp) :: factors(2*size(self%values))
      integer :: order(2*size(self%values)), k, j

      k = size(self%values)
      call make_matrix(self, tau, unit, matrix, error)
      if (allocated(error)) return
      ! LAPACK may not terminate on NaN.
      if (.not. all(abs(matrix) <= huge(1.0_wp))) then
         call new_error(error, error_singular, "the projected problem is singular at the shift: move the shift a little")
         return
      end if
      ! Coordinates of `new_energy_basis`: positions and velocities of equal energy, slowest motions first.
      order(::2) = ascending_order(-abs(self%values))
      order(2::2) = k + order(::2)
      factors(::2) = sqrt(max(abs(self%values(order(::2))), epsilon(1.0_wp)**2*maxval(abs(self%values)), tiny(1.0_wp)))
      factors(2::2) = 1/unit
      zero_space = zero_and_infinite(zero, none, 2*k, cmplx(tau, 0, wp), unit, oscillator=.false.)
      do j = 1, size(zero_space%vectors, 2)
         zero_space%vectors(:, j) = zero_space%vectors(order, j)/factors
      end do
      if (self%map%upper) then
         allocate (lossy(2*k, 2*k))
         do j = 1, 2*k
            lossy(:, j) = matrix(order, order(j))*(factors(j)/factors)
         end do
         call matrix_eigenpairs(lossy, zero_space, twelve_digits, pairs, error)
         if (allocated(error)) return
         do j = 1, 2*k
            matrix(order, j) = factors*pairs%complex_basis(:, j)
         end do
         call move_alloc(matrix, pairs%complex_basis)
         return
      end if
      allocate (ordered(2*k, 2*k))
      do j = 1, 2*k
         ordered(:, j) = real(matrix(order, order(j)), wp)*(factors(j)/factors)
      end do
      call matrix_eigenpairs(ordered, zero_space, twelve_digits, pairs, error)
      if (allocated(error)) return
      allocate (ordered(2*k, 2*k))
      do j = 1, 2*k
         ordered(order, j) = factors*pairs%basis(:, j)
      end do
      call move_alloc(ordered, pairs%basis)
   end subroutine eigenpairs

   ! Matrix of the map (x, v) -> (x+, v+), real without losses: with D = (p(tau) + c(tau) C)^{-1} and G = tau S + T + i U,
   !
   !     x+ = -P^{-1} (unit C v + ((tau + alpha + beta s) C + beta) x) - P^{-1} F S x,  v+ = (x + tau x+)/unit
   !
   ! P^{-1} = D - D F (1 + G D F)^{-1} G D (Woodbury) keeps digits that strong dampers would swamp.
   subroutine make_matrix(self, tau, unit, matrix, error)
      type(projection_type), intent(in) :: self
      real(wp), intent(in) :: tau, unit
      complex(wp), allocatable, intent(out) :: matrix(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: d(:), g(:, :), df(:, :), inverse(:, :)
      complex(wp) :: p
      integer :: k, r, j, pivots(size(self%responses, 2)), info

      k = size(self%values)
      r = size(self%responses, 2)
      associate (alpha => self%map%alpha, beta => self%map%beta, s => self%shift, t => self%values)
         p = self%map%reaction(cmplx(tau, 0, wp))
         allocate (d, source=1/(p + (tau*(tau + alpha) + s*p)*t))
         allocate (df(k, r))
         do j = 1, r
            df(:, j) = d*self%responses(:, j)
         end do
         ! (1 + G D F)^{-1} [G D, S], with rows equilibrated.
         allocate (g(r, r + 2*k))
         g(:, r + 1:r + k) = tau*self%damping + self%stiffness
         g(:, :r) = matmul(g(:, r + 1:r + k), df)
         do j = 1, r
            g(j, j) = g(j, j) + 1
         end do
         do j = 1, k
            g(:, r + j) = g(:, r + j)*d(j)
         end do
         g(:, r + k + 1:) = self%damping
         do j = 1, r
            g(j, :) = g(j, :)/maxval(abs(g(j, :)))
         end do
         if (r > 0) then
            call zgesv(r, 2*k, g, r, pivots, g(:, r + 1:), r, info)
            if (info /= 0) call new_error(error, error_singular, &
               "the projected problem is singular at the shift: move the shift a little")
            if (allocated(error)) return
         end if
         allocate (inverse, source=-matmul(df, g(:, r + 1:r + k)))
         do j = 1, k
            inverse(j, j) = inverse(j, j) + d(j)
         end do
         allocate (matrix(2*k, 2*k))
         matrix(:k, :k) = -matmul(df, g(:, r + k + 1:))
         do j = 1, k
            matrix(:k, j) = matrix(:k, j) - inverse(:, j)*((tau + alpha + beta*s)*t(j) + beta)
            matrix(:k, k + j) = -unit*t(j)*inverse(:, j)
         end do
         matrix(k + 1:, :) = (tau/unit)*matrix(:k, :)
         do j = 1, k
            matrix(k + j, j) = matrix(k + j, j) + 1/unit
         end do
      end associate
   end subroutine make_matrix

   pure real(wp) function residual(self, lambda, x)
      class(projection_type), intent(in) :: self
      complex(wp), intent(in) :: lambda, x(:)
      complex(wp) :: p, c
      real(wp) :: parts(size(x), 2), remainders(size(self%remainder, 1), 2)

      p = self%map%reaction(lambda)
      c = lambda*(lambda + self%map%alpha) + self%shift*p
      parts(:, 1) = real(x, wp)
      parts(:, 2) = aimag(x)
      remainders = matmul(self%remainder, parts)
      residual = abs(c)*norm2(remainders)/max(abs(p)*norm2(abs(x)), tiny(1.0_wp))
   end function residual
end module kschur_low_rank_projection
