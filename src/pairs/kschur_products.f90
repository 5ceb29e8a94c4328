!> Products of the matrices of a modal problem with a few eigenpairs at a time, in one pass over each matrix, and norms and forms of
!> these. For Rayleigh's functional forces are summed in extended precision: those of a low mode of a stiff structure cancel to
!> rounding in working precision. Residuals do not need that: their rounding is below that of the matrices.
module kschur_products
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_kinds, only: wp, xp
   use kschur_problem, only: damping_general, damping_none, modal_problem_type
   use kschur_row_sums, only: row_sums_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: multiply_pairs, pairs_at_once, pair_rows_type, products_type

   ! Number of real columns multiplied at a time; a complex column is two.
   integer, parameter :: lanes = 4
   ! Number of rows multiplied at a time.
   integer, parameter :: block_rows = 64

   !> Rows of a problem here, where several processes judge the same pairs together, each with its own. The first one has the pairs
   !> and the constraints, and alone gets results.
   type :: pair_rows_type
      !> Number of rows before those here.
      integer :: before = 0
      type(row_sums_type) :: sums
      !> Rows of Cq^T here.
      type(csr_matrix_type) :: transposed
      !> Norms of the whole matrices, as of `norms_of`.
      real(wp) :: norms(4) = 0
   end type pair_rows_type

   !> Products of a few pairs. Each pair has `parts` columns: the real and, of complex shapes, the imaginary part.
   type :: products_type
      integer :: parts = 1
      !> phi, M phi and R phi, n x parts of all pairs.
      real(wp), allocatable :: phi(:, :), mass(:, :), damping(:, :)
      !> Forces without inertia and damping, K phi + i H phi + Cq^T xi: real and imaginary part, n x 2 for each pair.
      real(wp), allocatable :: static_forces(:, :)
      !> ||phi|| of each pair.
      real(wp) :: length(lanes) = 0
      !> ||Cq phi|| of each pair, and the size of its reactions: the norm of |xi_r| ||Cq_r|| over the rows r.
      real(wp) :: violation(lanes) = 0, reaction(lanes) = 0
      !> Error of each eigenvalue by rounding of the entries of constraints, times phi^T P'(lambda) phi: the sum of
      !> epsilon |xi_r| (|Cq| |phi|)_r. The effect of the violation is removed by Rayleigh's functional.
      real(wp) :: effect(lanes) = 0
      !> Coefficients of Rayleigh's functional of a symmetric problem, for each pair: phi^T M phi, phi^T R phi and, if forces were
      !> summed in extended precision, phi^T (K phi + i H phi + Cq^T xi) + xi^T Cq phi.
      complex(xp) :: forms(3, lanes) = 0
      !> What adds up sums over rows.
      type(row_sums_type), private :: sums
   contains
      !> The norm of a combination of the forces of pair l.
      procedure :: norm_of_forces
   end type products_type

contains

   !> The number of pairs whose products are computed at a time.
   pure integer function pairs_at_once(pairs)
      class(eigenpairs_type), intent(in) :: pairs

      pairs_at_once = lanes/merge(1, 2, pairs%is_real())
   end function pairs_at_once

   !> Computes the products of pairs first..last, at most `pairs_at_once`, with their norms and forms.
   subroutine multiply_pairs(problem, transposed, pairs, first, last, extended, products, rows)
      type(modal_problem_type), intent(in) :: problem
      !> Cq^T.
      type(csr_matrix_type), intent(in) :: transposed
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: first, last
      !> Whether to sum forces, which may cancel, in extended precision, for Rayleigh's functional.
      logical, intent(in) :: extended
      type(products_type), intent(inout) :: products
      !> Where the rows of the problem and of Cq^T are only those of this process; absent: all are here.
      type(pair_rows_type), optional, intent(in) :: rows
      real(wp), allocatable :: phi(:, :), xi(:, :, :)
      ! xi^T Cq phi of each pair.
      complex(xp) :: work(lanes)
      integer :: n, i, before

      n = problem%unknowns()
      allocate (phi(lanes, problem%mass%columns), xi(lanes, transposed%columns, 2*pairs_at_once(pairs)/lanes))
      call pack_parts(pairs, first, last, phi, xi)
      before = 0
      if (present(rows)) then
         before = rows%before
         products%sums = rows%sums
         call rows%sums%send(size(phi), phi)
         call rows%sums%send(size(xi), xi)
      end if
      products%parts = merge(1, 2, pairs%is_real())
      if (.not. allocated(products%phi)) allocate (products%phi(n, lanes), products%mass(n, lanes), products%damping(n, lanes), &
         products%static_forces(n, 2*lanes))
      !$omp parallel do schedule(static) if (n > panel_rows)
      do i = 1, n, block_rows
         call multiply_rows(i, min(i + block_rows - 1, n))
      end do
      !$omp end parallel do
      call multiply_constraints(last - first + 1)
      call set_norms_and_forms(last - first + 1)

   contains

      ! Computes some rows of the products, of those here.
      subroutine multiply_rows(from, to)
         integer, intent(in) :: from, to
         real(wp), dimension(lanes, block_rows) :: mass, damping, stiffness, static_forces
         integer :: k, l, turned

         k = to - from + 1
         call multiply(problem%mass, from, to, phi, mass)
         if (extended) then
            call multiply_extended(problem%stiffness, from, to, phi, stiffness, transposed, xi(:, :, 1), static_forces)
         else
            call multiply(problem%stiffness, from, to, phi, stiffness)
            call multiply(transposed, from, to, xi(:, :, 1), static_forces)
            static_forces(:, :k) = stiffness(:, :k) + static_forces(:, :k)
         end if
         if (extended .and. problem%damping_kind == damping_general) then
            call multiply_extended(problem%damping, from, to, phi, damping)
         else if (extended .or. problem%damping_kind == damping_none) then
            ! R = alpha M + beta K, to rounding.
            damping(:, :k) = problem%alpha*mass(:, :k) + problem%beta*stiffness(:, :k)
         else
            ! A residual is to show that rounding.
            call multiply(problem%damping, from, to, phi, damping)
         end if
         do l = 1, lanes
            products%phi(from:to, l) = phi(l, before + from:before + to)
            products%mass(from:to, l) = mass(l, :k)
            products%damping(from:to, l) = damping(l, :k)
            products%static_forces(from:to, merge(l, 2*l - 1, products%parts == 2)) = static_forces(l, :k)
         end do
         if (products%parts == 1) then
            call multiply(transposed, from, to, xi(:, :, 2), static_forces)
            do l = 1, lanes
               products%static_forces(from:to, 2*l) = static_forces(l, :k)
            end do
         end if
         if (.not. allocated(problem%loss)) return
         ! i H phi: the real part of phi gives imaginary forces, the imaginary part negative real ones.
         if (extended) call multiply_extended(problem%loss, from, to, phi, stiffness)
         if (.not. extended) call multiply(problem%loss, from, to, phi, stiffness)
         do l = 1, lanes
            turned = merge(2*l, l - (-1)**l, products%parts == 1)
            products%static_forces(from:to, turned) = products%static_forces(from:to, turned) &
               - sign(1, l - turned)*stiffness(l, :k)
         end do
      end subroutine multiply_rows

      ! Computes violation, reactions and work of the constraints in one pass over Cq. Sums of row panels are added up in order, so
      ! that the result does not depend on the number of threads.
      subroutine multiply_constraints(pairs)
         integer, intent(in) :: pairs
         ! Squares of violations and of reactions, effects, and work, of each panel.
         real(xp) :: sums(pairs, 5, (problem%constraints%rows + panel_rows - 1)/panel_rows), totals(pairs, 5)
         real(xp) :: violations(lanes), terms(lanes), multiplier(2), row_square, reaction
         real(wp) :: magnitude(lanes)
         complex(xp) :: row_work
         integer :: from, to, i, j, k, l

         sums = 0
         !$omp parallel do schedule(static) &
         !$omp    private(from, to, j, k, l, terms, violations, magnitude, multiplier, row_square, reaction, row_work) &
         !$omp    if (size(sums, 3) > 1)
         do i = 1, size(sums, 3)
            do k = (i - 1)*panel_rows + 1, min(i*panel_rows, problem%constraints%rows)
               row_square = 0
               violations = 0
               magnitude = 0
               do j = problem%constraints%row_start(k), problem%constraints%row_start(k + 1) - 1
                  terms = real(problem%constraints%value(j), xp)*phi(:, problem%constraints%column(j))
                  violations = violations + terms
                  magnitude = magnitude + real(abs(terms), wp)
                  row_square = row_square + real(problem%constraints%value(j), xp)**2
               end do
               do l = 1, pairs
                  from = products%parts*(l - 1) + 1
                  to = products%parts*l
                  multiplier = reshape(xi(from:to, k, :), [2])
                  reaction = sum(multiplier**2)
                  row_work = cmplx(multiplier(1), multiplier(2), xp)* &
                     cmplx(violations(from), merge(violations(to), 0.0_xp, to > from), xp)
                  sums(l, :, i) = sums(l, :, i) + [sum(violations(from:to)**2), reaction*row_square, &
                     sqrt(reaction)*epsilon(1.0_wp)*norm2(magnitude(from:to)), real(row_work, xp), aimag(row_work)]
               end do
            end do
         end do
         !$omp end parallel do
         totals = sum(sums, 3)
         products%violation(:pairs) = real(sqrt(totals(:, 1)), wp)
         products%reaction(:pairs) = real(sqrt(totals(:, 2)), wp)
         products%effect(:pairs) = real(totals(:, 3), wp)
         work(:pairs) = cmplx(totals(:, 4), totals(:, 5), xp)
      end subroutine multiply_constraints

      ! Computes norms and forms of each pair from its products.
      subroutine set_norms_and_forms(pairs)
         integer, intent(in) :: pairs
         complex(xp) :: forms(3)
         ! The square of the norm, and the parts of the forms.
         real(xp) :: sums(7, pairs)
         integer :: l

         sums = 0
         !$omp parallel do schedule(static) private(forms) if (n > panel_rows)
         do l = 1, pairs
            associate (shape => products%phi(:, products%parts*(l - 1) + 1:products%parts*l), &
               mass => products%mass(:, products%parts*(l - 1) + 1:products%parts*l), &
               damping => products%damping(:, products%parts*(l - 1) + 1:products%parts*l))
               sums(1, l) = square_of(shape)
               if (.not. problem%symmetric) cycle
               forms = [bilinear(shape, mass), bilinear(shape, damping), (0.0_xp, 0.0_xp)]
               if (extended) forms(3) = bilinear(shape, products%static_forces(:, 2*l - 1:2*l)) + work(l)
            end associate
            sums(2:4, l) = real(forms, xp)
            sums(5:7, l) = aimag(forms)
         end do
         !$omp end parallel do
         call products%sums%add_up(sums)
         products%length(:pairs) = real(sqrt(sums(1, :)), wp)
         products%forms(:, :pairs) = cmplx(sums(2:4, :), sums(5:7, :), xp)
      end subroutine set_norms_and_forms
   end subroutine multiply_pairs

   ! Packs shapes and multipliers with the parts of each entry side by side: phi is lanes x n, xi is lanes x m x (2/parts), as
   ! multipliers of real shapes have their imaginary parts in a second slice. Unused lanes are zero.
   subroutine pack_parts(pairs, first, last, phi, xi)
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: first, last
      !> Unchanged in a process without shapes.
      real(wp), contiguous, intent(inout) :: phi(:, :), xi(:, :, :)
      integer :: i, used

      used = (last - first + 1)*merge(1, 2, pairs%is_real())
      !$omp parallel do schedule(static) if (size(phi, 2) > panel_rows)
      do i = 1, pairs%rows()
         phi(used + 1:, i) = 0
         if (pairs%is_real()) then
            phi(:used, i) = pairs%real_phi(i, first:last)
         else
            phi(1:used:2, i) = real(pairs%phi(i, first:last), wp)
            phi(2:used:2, i) = aimag(pairs%phi(i, first:last))
         end if
      end do
      !$omp end parallel do
      !$omp parallel do schedule(static) if (size(xi, 2) > panel_rows)
      do i = 1, size(pairs%xi, 1)
         xi(used + 1:, i, :) = 0
         if (pairs%is_real()) then
            xi(:used, i, 1) = real(pairs%xi(i, first:last), wp)
            xi(:used, i, 2) = aimag(pairs%xi(i, first:last))
         else
            xi(1:used:2, i, 1) = real(pairs%xi(i, first:last), wp)
            xi(2:used:2, i, 1) = aimag(pairs%xi(i, first:last))
         end if
      end do
      !$omp end parallel do
   end subroutine pack_parts

   ! Multiplies rows first..last of a matrix with packed columns x.
   pure subroutine multiply(matrix, first, last, x, product)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: first, last
      real(wp), intent(in) :: x(lanes, matrix%columns)
      real(wp), intent(out) :: product(lanes, block_rows)
      real(wp) :: sums(lanes)
      integer :: i, k

      do i = first, last
         sums = 0
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            sums = sums + matrix%value(k)*x(:, matrix%column(k))
         end do
         product(:, i - first + 1) = sums
      end do
   end subroutine multiply

   ! Multiplies rows first..last of a matrix with packed columns x, summed in extended precision, and optionally adds the product of
   ! another matrix with y before rounding, to `both`.
   pure subroutine multiply_extended(matrix, first, last, x, product, other, y, both)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: first, last
      real(wp), intent(in) :: x(lanes, matrix%columns)
      real(wp), intent(out) :: product(lanes, block_rows)
      type(csr_matrix_type), optional, intent(in) :: other
      real(wp), contiguous, optional, intent(in) :: y(:, :)
      real(wp), optional, intent(out) :: both(lanes, block_rows)
      real(xp) :: entry, sums(lanes)
      integer :: i, k

      do i = first, last
         sums = 0
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            entry = matrix%value(k)
            sums = sums + entry*x(:, matrix%column(k))
         end do
         product(:, i - first + 1) = real(sums, wp)
         if (.not. present(other)) cycle
         do k = other%row_start(i), other%row_start(i + 1) - 1
            entry = other%value(k)
            sums = sums + entry*y(:, other%column(k))
         end do
         both(:, i - first + 1) = real(sums, wp)
      end do
   end subroutine multiply_extended

   ! x^T y (not x^* y) of complex vectors given by their real and imaginary parts.
   pure complex(xp) function bilinear(x, y)
      real(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      real(xp) :: sums(2, 2)
      integer :: i, j

      sums = 0
      do j = 1, size(y, 2)
         do i = 1, size(x, 2)
            sums(i, j) = dot(x(:, i), y(:, j))
         end do
      end do
      bilinear = cmplx(sums(1, 1) - sums(2, 2), sums(1, 2) + sums(2, 1), xp)
   end function bilinear

   !> ||a M phi + b R phi + c (K phi + i H phi + Cq^T xi)|| of pair l: for a = lambda^2, b = lambda and c = 1 that of the residual.
   !> The sums of row panels are added up in order, so that the result does not depend on the number of threads.
   real(wp) function norm_of_forces(self, l, weights, static_weight) result(norm)
      class(products_type), intent(in) :: self
      integer, intent(in) :: l
      !> a and b; c.
      complex(wp), intent(in) :: weights(2)
      real(wp), intent(in) :: static_weight
      real(xp), allocatable :: squares(:)
      real(xp) :: total(1, 1)
      integer :: n, i

      n = size(self%static_forces, 1)
      allocate (squares((n + panel_rows - 1)/panel_rows))
      !$omp parallel do schedule(static) if (n > panel_rows)
      do i = 1, size(squares)
         squares(i) = square_of_rows((i - 1)*panel_rows + 1, min(i*panel_rows, n))
      end do
      !$omp end parallel do
      total = sum(squares)
      call self%sums%add_up(total)
      norm = real(sqrt(total(1, 1)), wp)

   contains

      ! The sum of squares of rows from..to.
      pure real(xp) function square_of_rows(from, to) result(square)
         integer, intent(in) :: from, to
         real(wp) :: forces(to - from + 1, 2)
         integer :: part

         forces = static_weight*self%static_forces(from:to, 2*l - 1:2*l)
         do part = 1, self%parts
            associate (m => self%mass(from:to, self%parts*(l - 1) + part), r => self%damping(from:to, self%parts*(l - 1) + part), &
               turned => weights*merge((1.0_wp, 0.0_wp), (0.0_wp, 1.0_wp), part == 1))
               forces(:, 1) = forces(:, 1) + real(turned(1), wp)*m + real(turned(2), wp)*r
               forces(:, 2) = forces(:, 2) + aimag(turned(1))*m + aimag(turned(2))*r
            end associate
         end do
         square = square_of(forces)
      end function square_of_rows
   end function norm_of_forces

   ! The square of the Frobenius norm, in extended precision, in which it does not overflow.
   pure real(xp) function square_of(x) result(total)
      real(wp), contiguous, intent(in) :: x(:, :)
      integer :: j

      total = 0
      do j = 1, size(x, 2)
         total = total + dot(x(:, j), x(:, j))
      end do
   end function square_of

   ! x^T y in extended precision, in four independent sums for speed.
   pure real(xp) function dot(x, y)
      real(wp), contiguous, intent(in) :: x(:), y(:)
      real(xp) :: first, second, third, fourth
      integer :: i, fours

      first = 0
      second = 0
      third = 0
      fourth = 0
      fours = size(x) - modulo(size(x), 4)
      do i = 1, fours, 4
         first = first + real(x(i), xp)*y(i)
         second = second + real(x(i + 1), xp)*y(i + 1)
         third = third + real(x(i + 2), xp)*y(i + 2)
         fourth = fourth + real(x(i + 3), xp)*y(i + 3)
      end do
      do i = fours + 1, size(x)
         first = first + real(x(i), xp)*y(i)
      end do
      dot = (first + second) + (third + fourth)
   end function dot
end module kschur_products
