!> Refinement of single eigenpairs by Newton's method with residuals in extended precision.
module kschur_pair_refinement
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_lapack, only: zgesv
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: known_well, slow_refinement
   implicit none
   private
   public :: refine_pair

contains

   !> Refines a simple eigenpair by Newton's method, in each step solving
   !>
   !>     [P(lambda) Cq^T P'(lambda) phi; Cq 0 0; phi^* 0 0] [d phi; d xi; d lambda] = -[P(lambda) phi + Cq^T xi; Cq phi; 0],
   !>
   !> with a dense factorization, scaled such that all entries of shape and multipliers are of one size (Tisseur, SIAM J. Matrix
   !> Anal. Appl. 22 (2001)). Shape and eigenvalue are corrected together, as rounding of the shape would limit the eigenvalue
   !> otherwise.
   subroutine refine_pair(problem, transposed, pair, max_change, change)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      !> One pair, with a complex shape of unit norm; unchanged if the iteration does not converge.
      type(eigenpairs_type), intent(inout) :: pair
      !> Largest change of lambda (1/s): beyond it lies another eigenvalue.
      real(wp), intent(in) :: max_change
      !> The last correction of eigenvalue or shape, relative to them; `huge`: convergence to another eigenvalue, or a failed solve.
      real(wp), intent(out) :: change
      integer, parameter :: steps = 10
      complex(wp) :: phi(pair%rows()), xi(size(pair%xi, 1)), x(pair%rows() + size(pair%xi, 1) + 1), lambda
      real(wp) :: length, correction
      integer :: n, m, step
      logical :: solved

      n = size(phi)
      m = size(xi)
      lambda = pair%lambda(1)
      phi = pair%phi(:, 1)
      xi = pair%xi(:, 1)
      change = huge(1.0_wp)
      do step = 1, steps
         call find_correction(problem, transposed, lambda, phi, xi, x, solved)
         if (.not. solved) exit
         correction = max(abs(x(n + m + 1))/abs(lambda), norm2(abs(x(:n))))
         if (.not. correction <= slow_refinement*change) exit
         change = correction
         phi = phi + x(:n)
         length = norm2(abs(phi))
         phi = phi/length
         xi = (xi + x(n + 1:n + m))/length
         lambda = lambda + x(n + m + 1)
         if (change <= epsilon(1.0_wp)) exit
      end do
      if (abs(lambda - pair%lambda(1)) > max_change) change = huge(1.0_wp)
      ! The correction stagnated above `known_well`: no convergence.
      if (change > known_well) return
      associate (before => pair%lambda(1))
         ! Newton steps from an axis stay on it; what leads off it is rounding.
         if (.not. abs(aimag(before)) > 0) then
            lambda = real(lambda, wp)
            phi = real(phi, wp)
            xi = real(xi, wp)
         else if (.not. abs(real(before, wp)) > 0) then
            lambda = cmplx(0, aimag(lambda), wp)
         end if
      end associate
      pair%lambda(1) = lambda
      pair%phi(:, 1) = phi
      pair%xi(:, 1) = xi
   end subroutine refine_pair

   ! Computes a Newton correction: forms the bordered matrix of `refine_pair`, scales its rows and columns, and solves by LAPACK's
   ! zgesv.
   subroutine find_correction(problem, transposed, lambda, phi, xi, x, solved)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: transposed
      complex(wp), intent(in) :: lambda, phi(:), xi(:)
      !> d phi, d xi and d lambda, one above the other.
      complex(wp), intent(out) :: x(:)
      logical, intent(out) :: solved
      complex(wp) :: a(size(x), size(x)), slope(size(phi), 1), shape(size(phi), 1), rhs(size(x), 1)
      real(wp) :: columns(size(x)), rows(size(x))
      integer :: pivots(size(x)), n, m, order, i, info

      n = size(phi)
      m = size(xi)
      order = size(x)
      shape(:, 1) = phi
      slope = 0
      call problem%mass%add_product(2*lambda, shape, slope)
      call problem%damping%add_product((1.0_wp, 0.0_wp), shape, slope)
      a = 0
      call add_entries(problem%mass, lambda**2, a(:n, :n))
      call add_entries(problem%damping, lambda, a(:n, :n))
      call add_entries(problem%stiffness, (1.0_wp, 0.0_wp), a(:n, :n))
      if (allocated(problem%loss)) call add_entries(problem%loss, (0.0_wp, 1.0_wp), a(:n, :n))
      call add_entries(problem%constraints, (1.0_wp, 0.0_wp), a(n + 1:n + m, :n))
      a(:n, n + 1:n + m) = transpose(a(n + 1:n + m, :n))
      a(:n, order) = slope(:, 1)
      a(order, :n) = conjg(phi)
      columns = [powers_of_two(abs(phi)), powers_of_two(abs(xi)), powers_of_two([abs(lambda)])]
      do i = 1, order
         a(:, i) = a(:, i)*columns(i)
      end do
      rows = [(1/powers_of_two([maxval(abs(a(i, :)))]), i=1, order)]
      rhs(:n, 1) = residual_of(problem, transposed, lambda, phi, xi)
      rhs(n + 1:n + m, 1) = violations_of(problem%constraints, phi)
      rhs(order, 1) = 0
      rhs(:, 1) = -rows*rhs(:, 1)
      do i = 1, order
         a(:, i) = rows*a(:, i)
      end do
      call zgesv(order, 1, a, order, pivots, rhs, order, info)
      solved = info == 0
      x = columns*rhs(:, 1)
   end subroutine find_correction

   ! Scale factors of nonnegative sizes: the next greater power of two of each, where sizes below epsilon times the largest are
   ! raised to that; all 1 if all sizes are zero.
   pure function powers_of_two(sizes) result(units)
      real(wp), intent(in) :: sizes(:)
      real(wp) :: units(size(sizes))

      units = 1
      if (size(sizes) == 0) return
      if (maxval(sizes) > 0) units = scale(1.0_wp, exponent(max(sizes, epsilon(1.0_wp)*maxval(sizes))))
   end function powers_of_two

   ! Adds factor times a sparse matrix to a dense one.
   pure subroutine add_entries(matrix, factor, dense)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: factor
      complex(wp), intent(inout) :: dense(:, :)
      integer :: i, k

      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (entry => dense(i, matrix%column(k)))
               entry = entry + factor*matrix%value(k)
            end associate
         end do
      end do
   end subroutine add_entries

   ! The residual P(lambda) phi + Cq^T xi, summed in extended precision.
   function residual_of(problem, transposed, lambda, phi, xi)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: transposed
      complex(wp), intent(in) :: lambda, phi(:), xi(:)
      complex(wp) :: residual_of(size(phi))
      complex(xp) :: root, force
      integer :: i

      root = lambda
      do i = 1, size(phi)
         force = root*(root*row_product(problem%mass, i, phi) + row_product(problem%damping, i, phi)) &
            + row_product(problem%stiffness, i, phi) + row_product(transposed, i, xi)
         if (allocated(problem%loss)) force = force + (0.0_xp, 1.0_xp)*row_product(problem%loss, i, phi)
         residual_of(i) = cmplx(force, kind=wp)
      end do
   end function residual_of

   ! The constraint violation Cq phi, summed in extended precision.
   function violations_of(constraints, phi)
      type(csr_matrix_type), intent(in) :: constraints
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: violations_of(constraints%rows)
      integer :: i

      do i = 1, constraints%rows
         violations_of(i) = cmplx(row_product(constraints, i, phi), kind=wp)
      end do
   end function violations_of

   ! Row i of a matrix times a vector, in extended precision.
   pure complex(xp) function row_product(matrix, i, x) result(total)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i
      complex(wp), intent(in) :: x(:)
      integer :: k

      total = 0
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
         total = total + matrix%value(k)*cmplx(x(matrix%column(k)), kind=xp)
      end do
   end function row_product
end module kschur_pair_refinement
