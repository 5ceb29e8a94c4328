!> Small problems of every kind, as dense matrices, and all their eigenvalues by dense LAPACK.
module small_problems
   use dense_reference, only: dense_eigenvalues
   use kschur, only: csr_matrix_type, error_type, modal_problem_type, new_csr_from_triplets, new_modal_problem, wp
   implicit none
   private
   public :: matrices_type, chain, constrained, damped, diagonal, follower, free, long_rows, massless, n, of_nodes, problem_of, &
      proportional, sparse, spinning, tied, twice, upper_half_plane

   !> Unknowns of `chain`.
   integer, parameter :: n = 12

   !> The matrices of a problem, dense.
   type :: matrices_type
      real(wp), allocatable :: mass(:, :), damping(:, :), stiffness(:, :), constraints(:, :)
   end type matrices_type

contains

   !> One of each conjugate pair; a double zero is two small numbers to a dense method.
   subroutine upper_half_plane(problem, zeros, expected, finite)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: zeros
      complex(wp), allocatable, intent(out) :: expected(:)
      !> How many finite eigenvalues there are.
      integer, intent(out) :: finite
      complex(wp), allocatable :: values(:)
      real(wp) :: scale

      call dense_eigenvalues(problem, values)
      scale = maxval(abs(values))
      finite = size(values)
      values = pack(values, aimag(values) >= -1.0e-9_wp*scale .and. (zeros == 0 .or. abs(values) > 1.0e-5_wp*scale))
      allocate (expected(zeros + size(values)), source=[spread((0.0_wp, 0.0_wp), 1, zeros), values])
   end subroutine upper_half_plane

   !> Unequal masses and springs, held at one end, with some cross springs.
   function chain() result(matrices)
      type(matrices_type) :: matrices
      integer :: k

      allocate (matrices%mass(n, n), matrices%damping(n, n), matrices%stiffness(n, n), source=0.0_wp)
      allocate (matrices%constraints(0, n))
      do k = 1, n
         matrices%mass(k, k) = 1 + 0.1_wp*mod(7*k, 5)
         if (k < n) call spring(matrices%stiffness, k, k + 1, 1 + 0.3_wp*mod(3*k, 4))
         if (k < n - 4 .and. mod(k, 3) == 0) call spring(matrices%stiffness, k, k + 4, 0.4_wp)
      end do
      matrices%stiffness(1, 1) = matrices%stiffness(1, 1) + 1
   end function chain

   function free(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed

      changed = matrices
      changed%stiffness(1, 1) = changed%stiffness(1, 1) - 1
   end function free

   function massless(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed

      changed = matrices
      changed%mass(7, :) = 0
      changed%mass(:, 7) = 0
   end function massless

   !> A clamp, a tie, a row that they shorten, a long row.
   function constrained(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed
      real(wp) :: rows(4, n)

      rows = 0
      rows(1, 8) = 3
      rows(2, [2, 9]) = [1.0_wp, -2.0_wp]
      rows(3, [3, 8, 10]) = [1.0_wp, 0.4_wp, -0.8_wp]
      rows(4, [2, 4, 11, 12]) = [2.0_wp, 1.0_wp, -1.0_wp, 0.3_wp]
      changed = with_constraints(matrices, rows)
   end function constrained

   function long_rows(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed
      real(wp) :: rows(2, n)

      rows = 0
      rows(1, [4, 6, 11]) = [1.0_wp, -0.5_wp, -0.7_wp]
      rows(2, [3, 8, 10, 12]) = [2.0_wp, 1.0_wp, -1.0_wp, 0.3_wp]
      changed = with_constraints(matrices, rows)
   end function long_rows

   !> Rows that a motion of all as one satisfies.
   function tied(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed
      real(wp) :: rows(2, n)

      rows = 0
      rows(1, [2, 9]) = [1.0_wp, -1.0_wp]
      rows(2, [3, 6, 10]) = [0.5_wp, 0.5_wp, -1.0_wp]
      changed = with_constraints(matrices, rows)
   end function tied

   function with_constraints(matrices, rows) result(changed)
      type(matrices_type), intent(in) :: matrices
      real(wp), intent(in) :: rows(:, :)
      type(matrices_type) :: changed

      changed = matrices
      deallocate (changed%constraints)
      allocate (changed%constraints, source=rows)
   end function with_constraints

   !> Dampers between places that the springs do not join.
   function damped(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed

      changed = matrices
      call spring(changed%damping, 1, 5, 0.3_wp)
      call spring(changed%damping, 3, 7, 0.2_wp)
      call spring(changed%damping, 9, 12, 0.4_wp)
   end function damped

   function proportional(matrices, alpha, beta) result(changed)
      type(matrices_type), intent(in) :: matrices
      real(wp), intent(in), optional :: alpha, beta
      type(matrices_type) :: changed
      real(wp) :: factors(2)

      factors = [0.1_wp, 0.02_wp]
      if (present(alpha)) factors(1) = alpha
      if (present(beta)) factors(2) = beta
      changed = matrices
      changed%damping = factors(1)*matrices%mass + factors(2)*matrices%stiffness
   end function proportional

   function follower(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed

      changed = matrices
      changed%stiffness(1, 2) = changed%stiffness(1, 2) + 2
      changed%stiffness(2, 1) = changed%stiffness(2, 1) - 2
   end function follower

   function spinning(matrices) result(changed)
      type(matrices_type), intent(in) :: matrices
      type(matrices_type) :: changed
      integer :: k

      changed = matrices
      do k = 1, n - 3
         changed%damping(k, k + 3) = 0.5_wp + 0.1_wp*mod(k, 4)
         changed%damping(k + 3, k) = -changed%damping(k, k + 3)
      end do
   end function spinning

   function twice(part) result(both)
      type(matrices_type), intent(in) :: part
      type(matrices_type) :: both

      both = matrices_type(doubled(part%mass), doubled(part%damping), doubled(part%stiffness), doubled(part%constraints))
   end function twice

   pure function doubled(part) result(both)
      real(wp), intent(in) :: part(:, :)
      real(wp) :: both(2*size(part, 1), 2*size(part, 2))

      both = 0
      both(:size(part, 1), :size(part, 2)) = part
      both(size(part, 1) + 1:, size(part, 2) + 1:) = part
   end function doubled

   pure subroutine spring(matrix, a, b, stiffness)
      real(wp), intent(inout) :: matrix(:, :)
      integer, intent(in) :: a, b
      real(wp), intent(in) :: stiffness

      matrix([a, b], [a, b]) = matrix([a, b], [a, b]) + reshape([1, -1, -1, 1]*stiffness, [2, 2])
   end subroutine spring

   function problem_of(matrices) result(problem)
      type(matrices_type), intent(in) :: matrices
      type(modal_problem_type) :: problem
      type(error_type), allocatable :: error

      call new_modal_problem(problem, sparse(matrices%mass), sparse(matrices%stiffness), error, &
         sparse(matrices%damping), sparse(matrices%constraints))
   end function problem_of

   !> The entries of a dense matrix that are not zero.
   function sparse(dense) result(matrix)
      real(wp), intent(in) :: dense(:, :)
      type(csr_matrix_type) :: matrix
      type(error_type), allocatable :: error
      integer :: k, rows, columns

      rows = size(dense, 1)
      columns = size(dense, 2)
      call new_csr_from_triplets(matrix, rows, columns, &
         pack(spread([(k, k=1, rows)], 2, columns), abs(dense) > 0), &
         pack(spread([(k, k=1, columns)], 1, rows), abs(dense) > 0), pack(dense, abs(dense) > 0), error)
   end function sparse

   !> A matrix with so many unknowns in place of each: definite where it is, as the leading part of its product with
   !> 1 + [1 ... 1]^T [1 ... 1].
   function of_nodes(matrix, unknowns) result(whole)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: unknowns(:)
      type(csr_matrix_type) :: whole
      type(error_type), allocatable :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: before(size(unknowns)), i, j, k, a, b, n

      before = [(sum(unknowns(:i - 1)), i=1, size(unknowns))]
      n = size(matrix%column)*maxval(unknowns)**2
      allocate (row(n), column(n), value(n))
      n = 0
      do i = 1, size(unknowns)
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            j = matrix%column(k)
            do a = 1, unknowns(i)
               do b = 1, unknowns(j)
                  n = n + 1
                  row(n) = before(i) + a
                  column(n) = before(j) + b
                  value(n) = merge(2, 1, a == b)*matrix%value(k)
               end do
            end do
         end do
      end do
      call new_csr_from_triplets(whole, sum(unknowns), sum(unknowns), row(:n), column(:n), value(:n), error)
   end function of_nodes

   pure function diagonal(entries) result(matrix)
      real(wp), intent(in) :: entries(:)
      real(wp) :: matrix(size(entries), size(entries))
      integer :: k

      matrix = 0
      do k = 1, size(entries)
         matrix(k, k) = entries(k)
      end do
   end function diagonal
end module small_problems
