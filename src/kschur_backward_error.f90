!> How well eigenpairs satisfy a modal problem. Residuals are summed in more than the working
!> precision: of a low mode of a stiff structure that leaves nothing but rounding.
module kschur_backward_error
   use kschur_kinds, only: wp, xp
   use kschur_lapack, only: dznrm2
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   implicit none
   private
   public :: append_pairs, backward_errors, eigenpairs_type

   ! Rounding of the factored matrix moves eigenvalues by less than this, relative to their size.
   real(wp), parameter :: rounded = 1.0e-3_wp
   ! Two roots of one shape closer than this, relative to their size, are not told apart by it.
   real(wp), parameter :: critical = 1.0e-4_wp

   !> Eigenpairs of a modal problem.
   type :: eigenpairs_type
      !> Eigenvalues (1/s).
      complex(wp), allocatable :: lambda(:)
      !> Shapes, n x k.
      complex(wp), allocatable :: phi(:, :)
      !> Multipliers, m x k.
      complex(wp), allocatable :: xi(:, :)
   end type eigenpairs_type

contains

   !> Puts more pairs of the same problem behind those there are.
   subroutine append_pairs(pairs, more)
      type(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type), intent(in) :: more

      if (size(more%lambda) == 0) return
      pairs%phi = reshape([pairs%phi, more%phi], [size(more%phi, 1), size(pairs%lambda) + size(more%lambda)])
      pairs%xi = reshape([pairs%xi, more%xi], [size(more%xi, 1), size(pairs%lambda) + size(more%lambda)])
      pairs%lambda = [pairs%lambda, more%lambda]
   end subroutine append_pairs

   !> Backward error of each pair: the larger of the normwise residual
   !> ||P(lambda) phi + Cq^T xi|| / ((|lambda|^2 ||M|| + |lambda| ||R|| + ||K||) ||phi||)
   !> and the constraint violation ||Cq phi|| / (||Cq|| ||phi||), with
   !> 2-norms of vectors and infinity norms of the matrices as given.
   function backward_errors(problem, pairs, functionals) result(errors)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      !> The eigenvalues on entry; of a symmetric problem values of Rayleigh's functional on return:
      !> wrong by the square of the error of a shape, and without the rounding of the factored matrix.
      complex(wp), intent(inout), optional :: functionals(:)
      real(wp) :: errors(size(pairs%lambda))
      type(csr_matrix_type) :: transposed
      ! P(lambda) phi + Cq^T xi and P'(lambda) phi, Cq phi.
      complex(wp), allocatable :: residual(:), derivative(:), violation(:)
      real(wp) :: inertia
      real(wp) :: mass, damping, stiffness, constraints, size_of_phi, level
      integer :: n, j

      mass = problem%mass%infinity_norm()
      damping = problem%damping%infinity_norm()
      stiffness = problem%stiffness%infinity_norm()
      constraints = problem%constraints%infinity_norm()
      transposed = transpose_csr(problem%constraints)
      n = problem%unknowns()
      allocate (residual(n), derivative(n), violation(problem%multipliers()))
      do j = 1, size(errors)
         associate (lambda => pairs%lambda(j), phi => pairs%phi(:, j), xi => pairs%xi(:, j))
            size_of_phi = dznrm2(n, phi, 1)
            call evaluate(problem, transposed, lambda, phi, xi, residual, derivative, inertia)
            if (present(functionals) .and. problem%symmetric) &
               call correct(functionals(j), inertia, sum(phi*derivative), sum(phi*residual))
            level = (abs(lambda)**2*mass + abs(lambda)*damping + stiffness)*size_of_phi
            ! Without stiffness a zero eigenvalue has no level: its residual is exact or it is none.
            errors(j) = dznrm2(n, residual, 1)
            if (level > 0) errors(j) = errors(j)/level
            if (size(violation) > 0) then
               call multiply(problem%constraints, phi, violation)
               errors(j) = max(errors(j), dznrm2(size(violation), violation, 1)/(constraints*size_of_phi))
            end if
            if (.not. errors(j) >= 0) errors(j) = huge(1.0_wp)
         end associate
      end do
   end function backward_errors

   ! A step of Newton's on phi^T P(lambda) phi = 0, where it is a small one. At critical damping the
   ! slope is none. (phi^T: the left vector of a symmetric problem is the conjugate of phi.)
   pure subroutine correct(lambda, inertia, slope, remainder)
      complex(wp), intent(inout) :: lambda
      real(wp), intent(in) :: inertia
      complex(wp), intent(in) :: slope, remainder

      if (abs(slope) > critical*inertia .and. abs(remainder) < rounded*abs(lambda*slope)) &
         lambda = lambda - remainder/slope
   end subroutine correct

   pure subroutine evaluate(problem, transposed, lambda, phi, xi, residual, derivative, inertia)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      complex(wp), intent(in) :: lambda, phi(:), xi(:)
      complex(wp), intent(out) :: residual(:), derivative(:)
      !> |lambda| |phi|^T |M phi|.
      real(wp), intent(out) :: inertia
      complex(xp) :: s, mass, damping
      logical :: is_real
      integer :: i

      s = lambda
      inertia = 0
      is_real = all(.not. abs(aimag(phi)) > 0)
      do i = 1, size(phi)
         mass = row_product(problem%mass, i, phi, is_real)
         damping = row_product(problem%damping, i, phi, is_real)
         residual(i) = cmplx(s*(s*mass + damping) + row_product(problem%stiffness, i, phi, is_real) &
            + row_product(transposed, i, xi, .false.), kind=wp)
         derivative(i) = cmplx(2*s*mass + damping, kind=wp)
         inertia = inertia + abs(phi(i)*cmplx(s*mass, kind=wp))
      end do
   end subroutine evaluate

   pure subroutine multiply(matrix, x, y)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: x(:)
      complex(wp), intent(out) :: y(:)
      integer :: i

      do i = 1, size(y)
         y(i) = cmplx(row_product(matrix, i, x, .false.), kind=wp)
      end do
   end subroutine multiply

   ! Entry i of A x.
   pure complex(xp) function row_product(matrix, i, x, is_real) result(total)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i
      complex(wp), intent(in) :: x(:)
      !> Whether x has no imaginary part: that saves half of the work.
      logical, intent(in) :: is_real
      real(xp) :: re, im, entry
      integer :: k

      re = 0
      im = 0
      if (is_real) then
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            re = re + real(matrix%value(k), xp)*real(x(matrix%column(k)), wp)
         end do
         total = cmplx(re, im, xp)
         return
      end if
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
         entry = matrix%value(k)
         re = re + entry*real(x(matrix%column(k)), wp)
         im = im + entry*aimag(x(matrix%column(k)))
      end do
      total = cmplx(re, im, xp)
   end function row_product
end module kschur_backward_error
