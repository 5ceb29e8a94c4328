!> Undamped eigenvalues in quadruple precision of the matrices of a problem as they are:
!> what is left of an error against them is the error of the method in double precision.
module quad_reference
   use, intrinsic :: iso_fortran_env, only: real128
   use kschur, only: csr_matrix_type, modal_problem_type, wp
   implicit none
   private
   public :: elimination_type, new_elimination, quad_rayleigh_quotients, quad_squared_frequencies

   !> Unknowns that the constraints make depend on others: x = T y.
   type :: elimination_type
      !> Number of independent unknowns.
      integer :: free = 0
      !> Row i of T: x(i) = sum of factor(k) y(place(k)) for k in start(i) ... start(i + 1) - 1.
      integer, allocatable :: start(:), place(:)
      real(real128), allocatable :: factor(:)
   contains
      !> The triplets of T^T A T.
      procedure :: reduce
   end type elimination_type

contains

   !> Solves Cq x = 0 for the first unknown of each constraint whose coefficient is not
   !> small; what vanishes follows from other constraints. Few rows or few columns: the
   !> rows become dense.
   subroutine new_elimination(constraints, self)
      type(csr_matrix_type), intent(in) :: constraints
      type(elimination_type), intent(out) :: self
      real(real128), parameter :: vanishing = 1.0e-24_real128, small = 0.1_real128
      real(real128), allocatable :: rows(:, :)
      real(real128) :: level
      integer, allocatable :: place(:), row_of(:), place_of(:)
      real(real128), allocatable :: factor(:)
      integer :: m, n, r, i, j, k, pivot

      m = constraints%rows
      n = constraints%columns
      allocate (rows(n, m), source=0.0_real128)
      do r = 1, m
         do k = constraints%row_start(r), constraints%row_start(r + 1) - 1
            rows(constraints%column(k), r) = constraints%value(k)
         end do
      end do
      ! Gauss and Jordan.
      allocate (row_of(n), place_of(n), source=0)
      do r = 1, m
         level = maxval(abs(rows(:, r)))
         rows(:, r) = rows(:, r)/level
         do j = 1, n
            if (row_of(j) == 0 .or. .not. abs(rows(j, r)) > 0) cycle
            rows(:, r) = rows(:, r) - rows(j, r)*rows(:, row_of(j))
         end do
         level = maxval(abs(rows(:, r)))
         if (level < vanishing) cycle
         where (abs(rows(:, r)) < vanishing) rows(:, r) = 0
         do pivot = 1, n
            if (abs(rows(pivot, r)) >= small*level) exit
         end do
         rows(:, r) = rows(:, r)/rows(pivot, r)
         do i = 1, r - 1
            if (.not. abs(rows(pivot, i)) > 0) cycle
            rows(:, i) = rows(:, i) - rows(pivot, i)*rows(:, r)
            where (abs(rows(:, i)) < vanishing) rows(:, i) = 0
         end do
         row_of(pivot) = r
      end do

      self%free = count(row_of == 0)
      place_of = unpack([(j, j=1, self%free)], row_of == 0, place_of)
      allocate (self%start(n + 1), place(0), factor(0))
      self%start(1) = 1
      do i = 1, n
         if (row_of(i) == 0) then
            place = [place, place_of(i)]
            factor = [factor, 1.0_real128]
         else
            associate (row => rows(:, row_of(i)))
               place = [place, pack(place_of, place_of > 0 .and. abs(row) > 0)]
               factor = [factor, -pack(row, place_of > 0 .and. abs(row) > 0)]
            end associate
         end if
         self%start(i + 1) = size(place) + 1
      end do
      call move_alloc(place, self%place)
      call move_alloc(factor, self%factor)
   end subroutine new_elimination

   !> The triplets of T^T A T, several to a place.
   subroutine reduce(self, matrix, row, column, value)
      class(elimination_type), intent(in) :: self
      type(csr_matrix_type), intent(in) :: matrix
      integer, allocatable, intent(out) :: row(:), column(:)
      real(real128), allocatable, intent(out) :: value(:)
      integer :: i, k, a, b, entries, pass

      do pass = 1, 2
         entries = 0
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               do a = self%start(i), self%start(i + 1) - 1
                  do b = self%start(matrix%column(k)), self%start(matrix%column(k) + 1) - 1
                     entries = entries + 1
                     if (pass == 1) cycle
                     row(entries) = self%place(a)
                     column(entries) = self%place(b)
                     value(entries) = self%factor(a)*matrix%value(k)*self%factor(b)
                  end do
               end do
            end do
         end do
         if (pass == 1) allocate (row(entries), column(entries), value(entries))
      end do
   end subroutine reduce

   !> omega^2, ascending; M and K symmetric, M positive definite on the motions that the
   !> constraints allow. Some hundreds of unknowns take seconds.
   subroutine quad_squared_frequencies(problem, values)
      type(modal_problem_type), intent(in) :: problem
      real(real128), allocatable, intent(out) :: values(:)
      type(elimination_type) :: elimination
      real(real128), allocatable :: mass(:, :), stiffness(:, :), off_diagonal(:)

      call new_elimination(problem%constraints, elimination)
      call dense(elimination, problem%mass, mass)
      call dense(elimination, problem%stiffness, stiffness)
      call cholesky(mass)
      call congruence(mass, stiffness)
      call tridiagonalize(stiffness, values, off_diagonal)
      call implicit_ql(values, off_diagonal)
      call sort(values)
   end subroutine quad_squared_frequencies

   !> phi^* K phi/phi^* M phi, summed in quadruple precision: wrong by the square of the
   !> error of phi.
   subroutine quad_rayleigh_quotients(problem, phi, values)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: phi(:, :)
      real(real128), allocatable, intent(out) :: values(:)
      integer :: j

      allocate (values(size(phi, 2)))
      do j = 1, size(values)
         values(j) = form(problem%stiffness, phi(:, j))/form(problem%mass, phi(:, j))
      end do
   end subroutine quad_rayleigh_quotients

   real(real128) function form(matrix, phi)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: phi(:)
      complex(real128) :: row
      integer :: i, k

      form = 0
      do i = 1, matrix%rows
         row = 0
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            row = row + real(matrix%value(k), real128)*cmplx(phi(matrix%column(k)), kind=real128)
         end do
         form = form + real(conjg(cmplx(phi(i), kind=real128))*row, real128)
      end do
   end function form

   subroutine dense(elimination, matrix, full)
      type(elimination_type), intent(in) :: elimination
      type(csr_matrix_type), intent(in) :: matrix
      real(real128), allocatable, intent(out) :: full(:, :)
      integer, allocatable :: row(:), column(:)
      real(real128), allocatable :: value(:)
      integer :: k

      call elimination%reduce(matrix, row, column, value)
      allocate (full(elimination%free, elimination%free), source=0.0_real128)
      do k = 1, size(value)
         full(row(k), column(k)) = full(row(k), column(k)) + value(k)
      end do
      full = (full + transpose(full))/2
   end subroutine dense

   ! A = L L^T, L in the lower half.
   subroutine cholesky(a)
      real(real128), intent(inout) :: a(:, :)
      integer :: j, k

      do j = 1, size(a, 1)
         a(j, j) = sqrt(a(j, j))
         a(j + 1:, j) = a(j + 1:, j)/a(j, j)
         do k = j + 1, size(a, 1)
            a(k:, k) = a(k:, k) - a(k, j)*a(k:, j)
         end do
      end do
   end subroutine cholesky

   ! A := L^-1 A L^-T.
   subroutine congruence(l, a)
      real(real128), intent(in) :: l(:, :)
      real(real128), intent(inout) :: a(:, :)
      integer :: pass, i, j

      do pass = 1, 2
         do j = 1, size(a, 2)
            do i = 1, size(a, 1)
               a(i, j) = a(i, j)/l(i, i)
               if (abs(a(i, j)) > 0) a(i + 1:, j) = a(i + 1:, j) - a(i, j)*l(i + 1:, i)
            end do
         end do
         a = transpose(a)
      end do
   end subroutine congruence

   ! Householder's reduction of a symmetric matrix.
   subroutine tridiagonalize(a, diagonal, off_diagonal)
      real(real128), intent(inout) :: a(:, :)
      real(real128), allocatable, intent(out) :: diagonal(:), off_diagonal(:)
      real(real128), allocatable :: v(:), w(:)
      real(real128) :: length
      integer :: n, j, k

      n = size(a, 1)
      allocate (diagonal(n), off_diagonal(n))
      off_diagonal = 0
      do j = 1, n - 1
         length = norm2(a(j + 1:, j))
         off_diagonal(j) = length
         if (.not. norm2(a(j + 2:, j)) > 0) then
            off_diagonal(j) = a(j + 1, j)
            cycle
         end if
         v = a(j + 1:, j)
         v(1) = v(1) + sign(length, v(1))
         v = v/norm2(v)
         off_diagonal(j) = -sign(length, a(j + 1, j))
         w = matmul(a(j + 1:, j + 1:), v)
         w = w - dot_product(v, w)*v
         do k = j + 1, n
            a(j + 1:, k) = a(j + 1:, k) - 2*(v*w(k - j) + w*v(k - j))
         end do
      end do
      diagonal = [(a(j, j), j=1, n)]
   end subroutine tridiagonalize

   ! QL with implicit shifts (Dubrulle, Martin, Wilkinson, Numer. Math. 12 (1968)).
   subroutine implicit_ql(d, e)
      real(real128), intent(inout) :: d(:), e(:)
      real(real128) :: g, r, s, c, p, f, b
      integer :: n, l, m, i

      n = size(d)
      do l = 1, n
         do
            do m = l, n - 1
               if (abs(e(m)) <= epsilon(g)*(abs(d(m)) + abs(d(m + 1)))*0.5_real128) exit
            end do
            if (m == l) exit
            g = (d(l + 1) - d(l))/(2*e(l))
            r = hypot(g, 1.0_real128)
            g = d(m) - d(l) + e(l)/(g + sign(r, g))
            s = 1
            c = 1
            p = 0
            do i = m - 1, l, -1
               f = s*e(i)
               b = c*e(i)
               r = hypot(f, g)
               e(i + 1) = r
               if (.not. r > 0) then
                  d(i + 1) = d(i + 1) - p
                  e(m) = 0
                  exit
               end if
               s = f/r
               c = g/r
               g = d(i + 1) - p
               r = (d(i) - g)*s + 2*c*b
               p = s*r
               d(i + 1) = g + p
               g = c*r - b
            end do
            if (i >= l) cycle
            d(l) = d(l) - p
            e(l) = g
            e(m) = 0
         end do
      end do
   end subroutine implicit_ql

   subroutine sort(values)
      real(real128), intent(inout) :: values(:)
      real(real128) :: least
      integer :: i, at

      do i = 1, size(values) - 1
         at = i - 1 + minloc(values(i:), 1)
         least = values(at)
         values(at) = values(i)
         values(i) = least
      end do
   end subroutine sort
end module quad_reference
