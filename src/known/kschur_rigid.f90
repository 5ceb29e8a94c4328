!> Rigid-body motions and mechanisms: the shapes that the constraints allow and
!> that meet no stiffness, that is the eigenvalue zero, found before anything
!> else is.
module kschur_rigid
   use kschur_error, only: error_type, error_library, error_singular, new_error
   use kschur_kinds, only: wp, long
   use kschur_lapack, only: dgesvd
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_tall_products_real, only: column_length, inner_products, subtract_combinations
   implicit none
   private
   public :: find_rigid_motions, check_inertia

   integer, parameter :: iterations = 2, refinements = 2
   ! Solvers take so many right-hand sides for the price of one or two.
   integer, parameter :: together = 4
   ! A solution of this part of the inverse regularisation has a rigid motion, most likely.
   real(wp), parameter :: amplified = 1.0e-2_wp
   ! A force is rounding below this, in units of the norm of the scaled stiffness.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
   ! What rounding leaves of a unit vector that depends on others.
   real(wp), parameter :: dependent = 1.0e-10_wp

contains

   !> A basis of {phi : K phi + Cq^T xi = 0, Cq phi = 0}, k = 0 if there is no such
   !> motion, by inverse iteration on blocks of random vectors, with the adjoint in turn:
   !> an unsymmetric K may be far from normal. The rounding of K decides what is zero.
   subroutine find_rigid_motions(problem, stiffness, motions, multipliers, error, left)
      type(modal_problem_type), intent(in) :: problem
      !> Of the problem.
      type(scaled_stiffness_type), intent(inout) :: stiffness
      !> phi, n x k, and xi, m x k.
      real(wp), allocatable, intent(out) :: motions(:, :), multipliers(:, :)
      type(error_type), allocatable, intent(out) :: error
      !> Whether those of the transposed K are looked for.
      logical, optional, intent(in) :: left
      logical :: transposed
      ! Scaled motions above scaled multipliers.
      real(wp), allocatable :: found(:, :)
      integer(long) :: state
      integer :: block_size, n, i, before
      logical :: doubtful, alone

      n = problem%unknowns()
      transposed = .false.
      if (present(left)) transposed = left
      allocate (found(n + problem%multipliers(), 0))
      state = 1
      block_size = 1
      do
         before = size(found, 2)
         block_size = min(block_size, n - before)
         call find_more(stiffness, block_size, transposed, state, found, doubtful, error)
         if (allocated(error)) return
         ! A block tells better than a single vector what is zero.
         alone = block_size == 1
         if (size(found, 2) == n .or. (size(found, 2) < before + block_size .and. &
            .not. (doubtful .and. (alone .or. size(found, 2) > before)))) exit
         if (alone .or. size(found, 2) == before + block_size) block_size = together*max(1, size(found, 2)/together)
      end do
      allocate (motions(n, size(found, 2)), multipliers(problem%multipliers(), size(found, 2)))
      do i = 1, size(found, 2)
         motions(:, i) = stiffness%scaling*found(:n, i)
         multipliers(:, i) = stiffness%constraint_scaling*found(n + 1:, i)
      end do
   end subroutine find_rigid_motions

   !> Fails where a rigid motion has neither mass nor damping: then the problem is singular
   !> for every lambda.
   subroutine check_inertia(problem, motions, error)
      type(modal_problem_type), intent(in) :: problem
      !> A basis of all rigid motions, n x k.
      real(wp), intent(in) :: motions(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: forces(:, :), force(:), rotation(:, :)
      integer :: n, k

      n = size(motions, 1)
      k = size(motions, 2)
      if (k == 0) return
      allocate (forces(2*n, k + 1), source=0.0_wp)
      call problem%mass%add_product(1/problem%mass%infinity_norm(), motions, forces(:n, :k))
      if (.not. problem%damping%is_zero()) &
         call problem%damping%add_product(1/problem%damping%infinity_norm(), motions, forces(n + 1:, :k))
      call least_forces(forces, force, rotation, error)
      if (allocated(error)) return
      if (vanishes(problem%mass) .and. vanishes(problem%damping)) call new_error(error, error_singular, &
         "the problem is singular for every lambda: some motion has neither mass, damping nor stiffness; give it one of them, "// &
         "or a constraint that holds it")

   contains

      ! Whether A times the least motion is rounding: small beside its terms, or beside A.
      logical function vanishes(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp), parameter :: cancelled = 1.0e-12_wp, rounding = 4*epsilon(1.0_wp)
         real(wp) :: motion(n), term, total, terms, largest, magnitude
         integer :: i, j

         motion = matmul(motions, rotation(:, 1))
         largest = 0
         magnitude = 0
         do i = 1, n
            total = 0
            terms = 0
            do j = matrix%row_start(i), matrix%row_start(i + 1) - 1
               term = matrix%value(j)*motion(matrix%column(j))
               total = total + term
               terms = terms + abs(term)
            end do
            largest = max(largest, abs(total))
            magnitude = max(magnitude, terms)
         end do
         vanishes = largest <= max(cancelled*magnitude, rounding*matrix%infinity_norm()*maxval(abs(motion)))
      end function vanishes
   end subroutine check_inertia

   ! Adds up to `wanted` motions to those found: fewer, if there are no more.
   subroutine find_more(stiffness, wanted, transposed, state, found, doubtful, error)
      type(scaled_stiffness_type), intent(inout) :: stiffness
      integer, intent(in) :: wanted
      logical, intent(in) :: transposed
      integer(long), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: found(:, :)
      !> Whether some motion may be rigid, but was not found well enough.
      logical, intent(out) :: doubtful
      type(error_type), allocatable, intent(out) :: error
      ! Motions above their multipliers, and the forces K x + Cq^T xi above violations.
      real(wp), allocatable :: x(:, :), rhs(:, :), forces(:, :), of_own(:, :), force(:), rotation(:, :), all(:, :)
      integer, allocatable :: own(:)
      real(wp) :: negligible
      integer :: i, n, before, rigid

      n = size(stiffness%scaling)
      doubtful = .false.
      negligible = rounding*max(4.0_wp, stiffness%matrix%infinity_norm())
      before = size(found, 2)
      allocate (x(size(found, 1), wanted))
      do i = 1, wanted
         call random_vector(state, x(:n, i))
      end do
      do i = 1, iterations
         x(n + 1:, :) = 0
         call stiffness%solve(x, .not. transposed, error)
         if (allocated(error)) return
         x(n + 1:, :) = 0
         call orthonormalize(found, n, x, state)
         call stiffness%solve(x, transposed, error)
         if (allocated(error)) return
         call keep_enlarged(amplified/stiffness%regularization, n, x)
         if (size(x, 2) == 0) return
         call orthonormalize(found, n, x, state)
      end do
      ! What the turn from left to right left of the regularisation.
      rhs = stiffness%regularizer(x, transposed)
      x = rhs
      call stiffness%solve(x, transposed, error)
      if (allocated(error)) return
      ! Refined, as factors may have grown.
      do i = 1, refinements
         forces = rhs
         call stiffness%subtract_product(x, transposed, forces)
         call stiffness%solve(forces, transposed, error)
         if (allocated(error)) return
         x = x + forces
      end do
      call orthonormalize(found, n, x)
      forces = stiffness%forces(x, transposed)
      ! What rounding made of a column without a direction of its own has no length or any
      ! force, which would drown those of the others.
      allocate (own(0))
      do i = 1, size(x, 2)
         if (norm2(x(:n, i)) > 0.5_wp .and. norm2(forces(:, i)) < sqrt(real(n, wp))) own = [own, i]
      end do
      if (size(own) == 0) return
      allocate (of_own(size(forces, 1), size(own) + 1))
      do i = 1, size(own)
         of_own(:, i) = forces(:, own(i))
      end do
      deallocate (forces)
      call least_forces(of_own, force, rotation, error)
      if (allocated(error)) return
      rigid = count(force < negligible)
      doubtful = rigid < size(own)
      allocate (all(size(found, 1), before + rigid))
      all(:, :before) = found
      all(:, before + 1:) = matmul(x(:, own), rotation(:, :rigid))
      ! A free motion needs no reaction.
      where (abs(all(n + 1:, before + 1:)) < negligible) all(n + 1:, before + 1:) = 0
      call move_alloc(all, found)
   end subroutine find_more

   ! Leaves out columns whose first n rows are shorter than this: being orthogonal to the others they say that no motion is
   ! left for them.
   subroutine keep_enlarged(least, n, x)
      real(wp), intent(in) :: least
      integer, intent(in) :: n
      real(wp), allocatable, intent(inout) :: x(:, :)
      real(wp), allocatable :: kept(:, :)
      logical :: short(size(x, 2))
      integer :: j

      short = [(column_length(x(:, j:j), n) < least, j=1, size(x, 2))]
      if (.not. any(short)) return
      allocate (kept(size(x, 1), count(.not. short)), source=x(:, pack([(j, j=1, size(x, 2))], .not. short)))
      call move_alloc(kept, x)
   end subroutine keep_enlarged

   ! Gram-Schmidt, twice; only the first n rows count, the others follow. A column that depends on others to
   ! rounding becomes zero, or, with a state of random numbers, makes a fresh start: one motion may be enlarged so
   ! much more than others that these are lost in it.
   subroutine orthonormalize(found, n, x, state)
      real(wp), contiguous, intent(in) :: found(:, :)
      integer, intent(in) :: n
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer(long), optional, intent(inout) :: state
      integer :: i, pass

      do i = 1, size(x, 2)
         do pass = 1, 2
            x(:, i) = x(:, i)/max(column_length(x(:, i:i), n), tiny(1.0_wp))
            call subtract(found, n, x(:, i:i))
            call subtract(x(:, :i - 1), n, x(:, i:i))
            if (.not. column_length(x(:, i:i), n) < dependent) cycle
            x(:, i) = 0
            if (.not. present(state)) cycle
            call random_vector(state, x(:n, i))
            call subtract(found, n, x(:, i:i))
            call subtract(x(:, :i - 1), n, x(:, i:i))
         end do
         x(:, i) = x(:, i)/max(column_length(x(:, i:i), n), tiny(1.0_wp))
      end do
   end subroutine orthonormalize

   ! What x has along the columns of others, of which the first n rows count.
   subroutine subtract(others, n, x)
      real(wp), contiguous, intent(in) :: others(:, :)
      integer, intent(in) :: n
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp) :: components(size(others, 2), size(x, 2))

      call inner_products(others, x, components, n)
      call subtract_combinations(others, components, x)
   end subroutine subtract

   ! The combinations of columns, of all but the last, that are smaller than others, the smallest first.
   subroutine least_forces(forces, force, rotation, error)
      !> Used up. OpenBLAS reads a few entries of the last column.
      real(wp), contiguous, intent(inout) :: forces(:, :)
      real(wp), allocatable, intent(out) :: force(:), rotation(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: vt(:, :), work(:)
      real(wp) :: none(1, 1)
      integer :: n, k, info

      n = size(forces, 1)
      k = size(forces, 2) - 1
      forces(:, k + 1) = 0
      allocate (force(k), vt(k, k), rotation(k, k), work(10*k + n))
      call dgesvd("N", "S", n, k, forces, n, force, none, 1, vt, k, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgesvd did not converge")
      rotation = transpose(vt(k:1:-1, :))
      force = force(k:1:-1)
   end subroutine least_forces
end module kschur_rigid
