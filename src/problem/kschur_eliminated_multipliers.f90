!> Recovers the multipliers of the constraints that presolve eliminated.
module kschur_eliminated_multipliers
   use kschur_confinement, only: condense, restore_multipliers
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_elimination, only: ties_type
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type, damping_general
   use kschur_sparse, only: csr_matrix_type, rows_of_csr
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: expand_multipliers

contains

   !> Computes the multipliers xi, m x k, of the original problem, such that P(lambda) phi + Cq^T xi = 0 up to the residual of
   !> the reduced problem, which appears at the masters. Redundant constraints get 0.
   subroutine expand_multipliers(ties, problem, pairs, xi)
      class(ties_type), intent(in) :: ties
      type(modal_problem_type), intent(in) :: problem
      !> Eigenvalues and multipliers of the reduced problem, with shapes from `expand_shapes`.
      class(eigenpairs_type), intent(in) :: pairs
      complex(wp), contiguous, intent(out) :: xi(:, :)
      ! Columns that are multiplied at a time.
      integer, parameter :: block = 4
      complex(wp), allocatable :: forces(:, :)
      ! Real and imaginary parts of complex shapes, so that a matrix is read once.
      real(wp), allocatable :: parts(:, :)
      type(csr_matrix_type), allocatable :: matrices(:)
      integer :: first, last, j, k

      !$omp parallel do schedule(static) if (size(xi, 1) > panel_rows)
      do j = 1, size(xi, 2)
         xi(:, j) = 0
         xi(ties%kept, j) = pairs%xi(:, j)
      end do
      !$omp end parallel do
      if (ties%eliminated == 0) return
      call take_rows(ties, problem, matrices)
      allocate (forces(problem%unknowns(), block), parts(problem%unknowns(), merge(0, 2*block, pairs%is_real())))
      do first = 1, size(xi, 2), block
         last = min(first + block - 1, size(xi, 2))
         call make_forces(ties, problem, matrices, pairs, first, last, parts, forces)
         !$omp parallel do schedule(static) private(k) if (problem%unknowns() > panel_rows)
         do j = first, last
            k = j - first + 1
            if (allocated(ties%confinement)) then
               call condense(ties%confinement, forces(:, k))
               call balance(ties%confinement%constraints, forces(:, k:k), xi(:, j:j))
               call restore_multipliers(ties%confinement, xi(:, j))
            else
               call balance(problem%constraints, forces(:, k:k), xi(:, j:j))
            end if
         end do
         !$omp end parallel do
      end do

   contains

      subroutine balance(constraints, force, xi)
         type(csr_matrix_type), intent(in) :: constraints
         complex(wp), contiguous, intent(inout) :: force(:, :), xi(:, :)

         if (size(ties%kept) > 0) call constraints%add_transposed_product((1.0_wp, 0.0_wp), xi, force)
         call balance_forces(ties, constraints, force(:, 1), xi(:, 1))
      end subroutine balance
   end subroutine expand_multipliers

   ! Extracts the rows of M, K, R and H of eliminated unknowns, the only ones needed. If R = alpha M + beta K, it needs no
   ! product of its own.
   subroutine take_rows(ties, problem, matrices)
      class(ties_type), intent(in) :: ties
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), allocatable, intent(out) :: matrices(:)
      integer :: last

      last = merge(3, 2, problem%damping_kind == damping_general)
      allocate (matrices(merge(last + 1, last, allocated(problem%loss))))
      associate (unknown => ties%unknown(:ties%eliminated))
         matrices(1) = rows_of_csr(problem%mass, unknown)
         matrices(2) = rows_of_csr(problem%stiffness, unknown)
         if (last == 3) matrices(3) = rows_of_csr(problem%damping, unknown)
         if (size(matrices) > last) matrices(last + 1) = rows_of_csr(problem%loss, unknown)
      end associate
   end subroutine take_rows

   ! Computes P(lambda) phi of pairs first..last on the eliminated unknowns; zero on others.
   subroutine make_forces(ties, problem, matrices, pairs, first, last, parts, forces)
      class(ties_type), intent(in) :: ties
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: matrices(:)
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: first, last
      !> Work space, with two columns for each complex pair.
      real(wp), contiguous, intent(inout) :: parts(:, :)
      complex(wp), contiguous, intent(out) :: forces(:, :)
      real(wp) :: products(ties%eliminated, (last - first + 1)*merge(1, 2, pairs%is_real()))
      complex(wp) :: weights(4)
      integer :: i, k, l

      k = last - first + 1
      if (.not. pairs%is_real()) then
         parts(:, :k) = real(pairs%phi(:, first:last), wp)
         parts(:, k + 1:2*k) = aimag(pairs%phi(:, first:last))
      end if
      forces = 0
      do l = 1, size(matrices)
         products = 0
         if (pairs%is_real()) then
            call matrices(l)%add_product(1.0_wp, pairs%real_phi(:, first:last), products)
         else
            call matrices(l)%add_product(1.0_wp, parts(:, :2*k), products)
         end if
         do i = 1, k
            associate (lambda => pairs%lambda(first + i - 1), unknown => ties%unknown(:ties%eliminated))
               weights = [lambda*(lambda + problem%alpha), 1 + lambda*problem%beta, (0.0_wp, 1.0_wp), (0.0_wp, 0.0_wp)]
               if (problem%damping_kind == damping_general) weights = [lambda**2, (1.0_wp, 0.0_wp), lambda, (0.0_wp, 1.0_wp)]
               if (pairs%is_real()) then
                  forces(unknown, i) = forces(unknown, i) + weights(l)*products(:, i)
               else
                  forces(unknown, i) = forces(unknown, i) + weights(l)*cmplx(products(:, i), products(:, k + i), wp)
               end if
            end associate
         end do
      end do
   end subroutine make_forces

   ! Computes the multipliers of eliminated constraints by back substitution, from the forces that they must balance.
   pure subroutine balance_forces(ties, constraints, force, xi)
      class(ties_type), intent(in) :: ties
      type(csr_matrix_type), intent(in) :: constraints
      !> P(lambda) phi + Cq^T xi; overwritten.
      complex(wp), intent(inout) :: force(:)
      complex(wp), intent(inout) :: xi(:)
      complex(wp) :: step
      integer :: above, e, i, k

      ! In reverse order of elimination, force(i) is the force on unknown i and all unknowns tied to it: only the row that
      ! eliminated i can balance it.
      do e = 1, ties%eliminated
         i = ties%unknown(e)
         above = ties%parent(i)
         if (above > 0) force(above) = force(above) + ties%ratio(i)*force(i)
      end do
      do e = ties%eliminated, 1, -1
         associate (row => ties%row(e), start => constraints%row_start)
            xi(row) = -force(ties%unknown(e))/ties%pivot(e)
            do k = start(row), start(row + 1) - 1
               step = constraints%value(k)*xi(row)
               above = constraints%column(k)
               do while (above > 0)
                  i = above
                  force(i) = force(i) + step
                  step = ties%ratio(i)*step
                  above = ties%parent(i)
                  if (above == i) exit
               end do
            end do
         end associate
      end do
   end subroutine balance_forces
end module kschur_eliminated_multipliers
