!> Products of the matrices of a modal problem with a few eigenpairs at a time, in one pass over each matrix, and norms and forms of
!> these. For Rayleigh's functional forces are summed in extended precision: those of a low mode of a stiff structure cancel to
!> rounding in working precision. Residuals do not need that: their rounding is below that of the matrices.
module kschur_products
   use kschur_constraint_products, only: constraint_products_type, multiply_constraints
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
      real(wp), allocatable :: length(:)
      type(constraint_products_type) :: constraints
      !> Coefficients of Rayleigh's functional of a symmetric problem, 3 x pairs: phi^T M phi, phi^T R phi and, if forces were
      !> summed in extended precision, phi^T (K phi + i H phi + Cq^T xi) + xi^T Cq phi.
      complex(xp), allocatable :: forms(:, :)
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
      call allocate_products(products, n, merge(1, 2, pairs%is_real()))
      !$omp parallel do schedule(static) if (n > panel_rows)
      do i = 1, n, block_rows
         call multiply_rows(problem, transposed, i, min(i + block_rows - 1, n), before, phi, xi, extended, products)
      end do
      !$omp end parallel do
      call set_norms_and_forms(problem, phi, xi, last - first + 1, extended, products)
   end subroutine multiply_pairs

   ! Computes rows first..last of the products, of those here.
   subroutine multiply_rows(problem, transposed, first, last, before, phi, xi, extended, products)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(in) :: transposed
      integer, intent(in) :: first, last, before
      real(wp), contiguous, intent(in) :: phi(:, :), xi(:, :, :)
      logical, intent(in) :: extended
      type(products_type), intent(inout) :: products
      real(wp), dimension(lanes, block_rows) :: mass, damping, stiffness, static_forces, imaginary
      real(xp) :: sums(lanes, block_rows)
      integer :: k, l

      k = last - first + 1
      call multiply(problem%mass, first, last, phi, mass)
      if (extended) then
         sums = 0
         call add_extended(problem%stiffness, first, last, phi, sums)
         stiffness = real(sums, wp)
         call add_extended(transposed, first, last, xi(:, :, 1), sums)
         static_forces = real(sums, wp)
      else
         call multiply(problem%stiffness, first, last, phi, stiffness)
         call multiply(transposed, first, last, xi(:, :, 1), static_forces)
         static_forces(:, :k) = stiffness(:, :k) + static_forces(:, :k)
      end if
      if (extended .and. problem%damping_kind == damping_general) then
         sums = 0
         call add_extended(problem%damping, first, last, phi, sums)
         damping = real(sums, wp)
      else if (extended .or. problem%damping_kind == damping_none) then
         ! R = alpha M + beta K, to rounding.
         damping(:, :k) = problem%alpha*mass(:, :k) + problem%beta*stiffness(:, :k)
      else
         ! A residual is to show that rounding.
         call multiply(problem%damping, first, last, phi, damping)
      end if
      do l = 1, lanes
         products%phi(first:last, l) = phi(l, before + first:before + last)
         products%mass(first:last, l) = mass(l, :k)
         products%damping(first:last, l) = damping(l, :k)
         if (products%parts == 2) products%static_forces(first:last, l) = static_forces(l, :k)
      end do
      if (products%parts == 1) then
         call multiply(transposed, first, last, xi(:, :, 2), imaginary)
         do l = 1, lanes
            products%static_forces(first:last, 2*l - 1) = static_forces(l, :k)
            products%static_forces(first:last, 2*l) = imaginary(l, :k)
         end do
      end if
      if (allocated(problem%loss)) call add_loss(problem%loss, first, last, phi, extended, products%static_forces)
   end subroutine multiply_rows

   ! Adds i H phi to the static forces: the real part of phi gives imaginary forces, the imaginary part negative real ones.
   subroutine add_loss(loss, first, last, phi, extended, static_forces)
      type(csr_matrix_type), intent(in) :: loss
      integer, intent(in) :: first, last
      real(wp), contiguous, intent(in) :: phi(:, :)
      logical, intent(in) :: extended
      real(wp), intent(inout) :: static_forces(:, :)
      real(wp) :: forces(lanes, block_rows)
      real(xp) :: sums(lanes, block_rows)
      integer :: l, to

      if (extended) then
         sums = 0
         call add_extended(loss, first, last, phi, sums)
         forces = real(sums, wp)
      else
         call multiply(loss, first, last, phi, forces)
      end if
      do l = 1, lanes
         to = merge(2*l, l - (-1)**l, size(static_forces, 2) > lanes)
         static_forces(first:last, to) = static_forces(first:last, to) - sign(1, l - to)*forces(l, :last - first + 1)
      end do
   end subroutine add_loss

   ! Computes norms, constraint products and forms of each pair from its products.
   subroutine set_norms_and_forms(problem, phi, xi, pairs, extended, products)
      type(modal_problem_type), intent(in) :: problem
      real(wp), contiguous, intent(in) :: phi(:, :), xi(:, :, :)
      integer, intent(in) :: pairs
      logical, intent(in) :: extended
      type(products_type), intent(inout) :: products
      complex(xp) :: forms(3)
      ! The square of the norm, and the parts of the forms.
      real(xp) :: sums(7, pairs)
      integer :: l

      associate (parts => products%parts)
         call multiply_constraints(problem%constraints, phi, xi, parts, pairs, products%constraints)
         sums = 0
         !$omp parallel do schedule(static) private(forms) if (problem%unknowns() > panel_rows)
         do l = 1, pairs
            sums(1, l) = sum(real(products%phi(:, parts*(l - 1) + 1:parts*l), xp)**2)
            if (.not. problem%symmetric) cycle
            forms = forms_of(products, l, extended)
            sums(2:4, l) = real(forms, xp)
            sums(5:7, l) = aimag(forms)
         end do
         !$omp end parallel do
      end associate
      call products%sums%add_up(sums)
      products%length = real(sqrt(sums(1, :)), wp)
      products%forms = cmplx(sums(2:4, :), sums(5:7, :), xp)
   end subroutine set_norms_and_forms

   ! Allocates the products for shapes of one or two parts, unless they are already.
   pure subroutine allocate_products(products, n, parts)
      type(products_type), intent(inout) :: products
      integer, intent(in) :: n, parts

      if (allocated(products%mass)) then
         if (products%parts == parts) return
         deallocate (products%mass, products%damping, products%static_forces)
      end if
      products%parts = parts
      if (.not. allocated(products%phi)) allocate (products%phi(n, lanes))
      allocate (products%mass(n, lanes), products%damping(n, lanes), products%static_forces(n, 2*lanes/parts))
   end subroutine allocate_products

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

   ! Adds the product of rows first..last of a matrix with packed columns x, in extended precision.
   pure subroutine add_extended(matrix, first, last, x, sums)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: first, last
      real(wp), intent(in) :: x(lanes, matrix%columns)
      real(xp), intent(inout) :: sums(lanes, block_rows)
      real(xp) :: entry, row(lanes)
      integer :: i, k

      do i = first, last
         row = sums(:, i - first + 1)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            entry = matrix%value(k)
            row = row + entry*x(:, matrix%column(k))
         end do
         sums(:, i - first + 1) = row
      end do
   end subroutine add_extended

   ! The coefficients of Rayleigh's functional of pair l; the last one is 0 unless forces were summed in extended precision.
   pure function forms_of(products, l, extended) result(forms)
      type(products_type), intent(in) :: products
      integer, intent(in) :: l
      logical, intent(in) :: extended
      complex(xp) :: forms(3)

      associate (first => products%parts*(l - 1) + 1, last => products%parts*l)
         forms(1) = bilinear(products%phi(:, first:last), products%mass(:, first:last))
         forms(2) = bilinear(products%phi(:, first:last), products%damping(:, first:last))
         forms(3) = 0
         if (extended) forms(3) = bilinear(products%phi(:, first:last), products%static_forces(:, 2*l - 1:2*l)) + &
            products%constraints%work_of(l)
      end associate
   end function forms_of

   ! x^T y (not x^* y) of complex vectors given by their real and imaginary parts.
   pure complex(xp) function bilinear(x, y)
      real(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      real(xp) :: sums(2, 2)
      integer :: i, j

      sums = 0
      do j = 1, size(y, 2)
         do i = 1, size(x, 2)
            sums(i, j) = sum(real(x(:, i), xp)*y(:, j))
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
         squares(i) = square_of_combination(self, l, weights, static_weight, (i - 1)*panel_rows + 1, min(i*panel_rows, n))
      end do
      !$omp end parallel do
      total = sum(squares)
      call self%sums%add_up(total)
      norm = real(sqrt(total(1, 1)), wp)
   end function norm_of_forces

   ! The sum of squares of rows first..last of the combination in `norm_of_forces`.
   pure real(xp) function square_of_combination(self, l, weights, static_weight, first, last) result(square)
      type(products_type), intent(in) :: self
      integer, intent(in) :: l, first, last
      complex(wp), intent(in) :: weights(2)
      real(wp), intent(in) :: static_weight
      real(wp) :: sums(last - first + 1, 2)

      associate (m => self%mass(first:last, self%parts*(l - 1) + 1), r => self%damping(first:last, self%parts*(l - 1) + 1), &
         f => self%static_forces(first:last, 2*l - 1:2*l))
         sums(:, 1) = real(weights(1), wp)*m + real(weights(2), wp)*r + static_weight*f(:, 1)
         sums(:, 2) = aimag(weights(1))*m + aimag(weights(2))*r + static_weight*f(:, 2)
      end associate
      if (self%parts == 2) then
         associate (m => self%mass(first:last, 2*l), r => self%damping(first:last, 2*l))
            sums(:, 1) = sums(:, 1) - aimag(weights(1))*m - aimag(weights(2))*r
            sums(:, 2) = sums(:, 2) + real(weights(1), wp)*m + real(weights(2), wp)*r
         end associate
      end if
      square = sum(real(sums, xp)**2)
   end function square_of_combination
end module kschur_products
