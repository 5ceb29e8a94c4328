!> The eigenvalue zero of a problem whose rigid motions are not M-orthogonal to the other modes: right vectors, and
!> the next vectors of their Jordan chains, which an iteration would see as a ring of radius sqrt(epsilon).
module kschur_zero_space
   use kschur_error, only: error_type, error_library, new_error
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   use kschur_problem, only: modal_problem_type
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   implicit none
   private
   public :: zero_space_type, find_zero_space

   !> Rigid motions N and chains: K x + Cq^T xi = -R N c, Cq x = 0, so that (lambda - 0) has the chain
   !> phi_0 = N c, phi_1 = x (Gohberg, Lancaster, Rodman, Matrix Polynomials (1982), section 1.4).
   type :: zero_space_type
      !> N, n x k.
      real(wp), allocatable :: motions(:, :)
      !> x, n x p, and c, k x p; p = 0 where nothing was looked for.
      real(wp), allocatable :: chained(:, :), combinations(:, :)
   contains
      procedure :: invariant
   end type zero_space_type

contains

   !> The zero space of some rigid motions, with chains of length two as far as there are any: c is a null vector of
   !> W^T R N, W the left rigid motions.
   subroutine find_zero_space(space, problem, stiffness, motions, left, error)
      type(zero_space_type), intent(out) :: space
      type(modal_problem_type), intent(in) :: problem
      !> Of the problem, factored.
      type(scaled_stiffness_type), intent(inout) :: stiffness
      !> N and W, n x k; W of another number of columns is not known.
      real(wp), intent(in) :: motions(:, :), left(:, :)
      type(error_type), allocatable, intent(out) :: error
      ! Of the terms that a force, and an element of W^T R N, is made of.
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp), allocatable :: forces(:, :), terms(:, :), coupling(:, :), null_vectors(:, :)
      real(wp) :: level
      integer :: n, k, j

      n = problem%unknowns()
      k = size(motions, 2)
      allocate (space%motions, source=motions)
      allocate (space%chained(n, 0), space%combinations(k, 0))
      if (k == 0 .or. size(left, 2) /= k) return
      allocate (forces(n, k), terms(n, k), source=0.0_wp)
      call problem%damping%add_product(1.0_wp, motions, forces)
      call add_magnitudes(problem, abs(motions), terms)
      where (abs(forces) <= rounding*terms) forces = 0
      allocate (coupling(k, k), source=matmul(transpose(left), forces))
      level = maxval(matmul(transpose(abs(left)), terms))
      call find_null_vectors(coupling, rounding*level, null_vectors, error)
      if (allocated(error)) return
      deallocate (space%chained, space%combinations)
      allocate (space%combinations, source=null_vectors)
      allocate (space%chained(n, size(null_vectors, 2)), source=matmul(forces, null_vectors))
      do j = 1, size(space%chained, 2)
         if (.not. any(abs(space%chained(:, j)) > 0)) cycle
         call deform(problem, stiffness, motions, space%chained(:, j), error)
         if (allocated(error)) return
      end do
   end subroutine find_zero_space

   ! |R| x.
   subroutine add_magnitudes(problem, x, y)
      type(modal_problem_type), intent(in) :: problem
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: y(:, :)
      integer :: i, j, k

      associate (r => problem%damping)
         do j = 1, size(x, 2)
            do i = 1, r%rows
               do k = r%row_start(i), r%row_start(i + 1) - 1
                  y(i, j) = y(i, j) + abs(r%value(k))*x(r%column(k), j)
               end do
            end do
         end do
      end associate
   end subroutine add_magnitudes

   ! An orthonormal basis of the null space of a small square matrix.
   subroutine find_null_vectors(matrix, negligible, null_vectors, error)
      real(wp), intent(in) :: matrix(:, :), negligible
      real(wp), allocatable, intent(out) :: null_vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: a(:, :), singular(:), vt(:, :), work(:)
      real(wp) :: none(1, 1)
      integer :: k, rank, info

      k = size(matrix, 1)
      allocate (a, source=matrix)
      allocate (singular(k), vt(k, k), work(10*k))
      call dgesvd("N", "A", k, k, a, k, singular, none, 1, vt, k, work, size(work), info)
      if (info /= 0) then
         call new_error(error, error_library, "LAPACK's dgesvd did not converge")
         return
      end if
      rank = count(singular > negligible)
      allocate (null_vectors(k, k - rank), source=transpose(vt(rank + 1:, :)))
   end subroutine find_null_vectors

   ! f := the x with K x + Cq^T xi = -f, Cq x = 0 that has nothing of the rigid motions; one step of refinement
   ! takes out what the regularised factors changed.
   subroutine deform(problem, stiffness, motions, f, error)
      type(modal_problem_type), intent(in) :: problem
      type(scaled_stiffness_type), intent(inout) :: stiffness
      real(wp), intent(in) :: motions(:, :)
      real(wp), intent(inout) :: f(:)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: refinements = 2
      real(wp), allocatable :: rhs(:, :), x(:, :), residual(:, :), rigid(:, :)
      integer :: n, step, j, pass

      n = problem%unknowns()
      allocate (rigid, source=motions)
      do j = 1, size(rigid, 2)
         rigid(:, j) = motions(:, j)/stiffness%scaling
         do pass = 1, 2
            rigid(:, j) = rigid(:, j) - matmul(rigid(:, :j - 1), matmul(rigid(:, j), rigid(:, :j - 1)))
         end do
         rigid(:, j) = rigid(:, j)/norm2(rigid(:, j))
      end do
      allocate (rhs(n + problem%multipliers(), 1), x(n + problem%multipliers(), 1), source=0.0_wp)
      rhs(:n, 1) = -stiffness%scaling*f
      do step = 0, refinements
         residual = rhs - stiffness%forces(x, .false.)
         call stiffness%solver%solve(residual, error)
         if (allocated(error)) return
         x = x + residual
         do pass = 1, 2
            x(:n, 1) = x(:n, 1) - matmul(rigid, matmul(x(:n, 1), rigid))
         end do
      end do
      f = stiffness%scaling*x(:n, 1)
   end subroutine deform

   !> The states (phi, lambda/unit phi, ...) of the zero space as an invariant subspace of shift-invert at sigma,
   !> mu = 1/(theta - sigma); without the chains where states are (phi, ...) alone.
   function invariant(self, order, shift, unit, damped)
      class(zero_space_type), intent(in) :: self
      !> Length of the states.
      integer, intent(in) :: order
      !> sigma, a theta.
      complex(wp), intent(in) :: shift
      !> Unit of lambda in the second part of a state (1/s).
      real(wp), intent(in) :: unit
      !> Whether theta is lambda and states have a second part.
      logical, intent(in) :: damped
      type(invariant_type) :: invariant
      integer :: n, k, p, j

      n = 0
      k = 0
      p = 0
      if (allocated(self%motions)) then
         n = size(self%motions, 1)
         k = size(self%motions, 2)
         if (damped) p = size(self%chained, 2)
      end if
      allocate (invariant%vectors(order, k + p), source=0.0_wp)
      allocate (invariant%projected(k + p, k + p), source=(0.0_wp, 0.0_wp))
      if (k > 0) invariant%vectors(:n, :k) = self%motions
      do j = 1, k + p
         invariant%projected(j, j) = -1/shift
      end do
      if (p == 0) return
      invariant%vectors(:n, k + 1:) = self%chained
      invariant%vectors(n + 1:2*n, k + 1:) = matmul(self%motions, self%combinations)/unit
      invariant%projected(:k, k + 1:) = -self%combinations/shift**2
   end function invariant
end module kschur_zero_space
