!> The whole eigenspace of the eigenvalue zero, or of the infinite one, with its Jordan chains: an iteration would see
!> a chain of length k as a ring of radius epsilon^(1/k), and what is near zero or far off as one of it.
module kschur_root_space
   use kschur_echelon, only: reduce_to_echelon
   use kschur_error, only: error_type, error_convergence, error_library, error_singular, new_error
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   use kschur_magnitudes, only: add_magnitudes, magnitudes
   use kschur_scaled_stiffness, only: scaled_stiffness_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: root_space_type, find_root_space

   !> States (x, v) of the chains of lambda = 0 in lambda^2 A2 + lambda A1 + A0, v_j = x_{j-1} and
   !> A0 x_j + Cq^T xi_j = -(A1 x_{j-1} + A2 x_{j-2}), Cq x_j = 0 (Gohberg, Lancaster, Rodman, Matrix Polynomials
   !> (1982), section 1.4).
   type :: root_space_type
      !> n x s; s is the multiplicity of the eigenvalue, and of what is known beside it.
      real(wp), allocatable :: x(:, :), v(:, :)
      !> State j follows the combination links(:, j) of the states before it, s x s, strictly upper triangular.
      real(wp), allocatable :: links(:, :)
      !> Of eigenvalues beside it that are known with it: the last states, each an eigenvector with its eigenvalue (1/s) in
      !> the diagonal of the links. Not allocated: none.
      real(wp), allocatable :: beside(:)
   contains
      procedure :: multiplicity
      procedure :: states => count_states
      procedure :: add_eigenpairs
   end type root_space_type

contains

   !> The root space that begins with null vectors of A0 on the motions that the constraints allow.
   subroutine find_root_space(space, factored, first, second, motions, left, error)
      type(root_space_type), intent(out) :: space
      !> A0, bordered by the constraints.
      type(scaled_stiffness_type), intent(inout) :: factored
      !> A1 and A2.
      type(csr_matrix_type), intent(in) :: first, second
      !> Null vectors from the right and from the left, n x k.
      real(wp), intent(in) :: motions(:, :), left(:, :)
      type(error_type), allocatable, intent(out) :: error
      ! Of the terms that a force, and its product with a left vector, is made of.
      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp), allocatable :: forces(:, :), terms(:, :), level(:, :), coupling(:, :), used(:, :), fresh(:, :), &
         from_left(:, :)
      real(wp) :: size_of_terms
      integer :: n, k, s, j, scaled

      n = size(motions, 1)
      k = size(motions, 2)
      allocate (space%x, source=motions)
      allocate (space%v(n, k), space%links(k, k), source=0.0_wp)
      if (k == 0 .or. size(left, 2) /= k) return
      ! Motions that are mixed hide what is light, or damped little, behind what is not.
      allocate (from_left, source=left)
      call reduce_to_echelon(space%x)
      call reduce_to_echelon(from_left)
      allocate (used(k, 0))
      scaled = 0
      do
         s = size(space%x, 2)
         allocate (forces(n, s), terms(n, s), source=0.0_wp)
         call first%add_product(1.0_wp, space%x, forces)
         call second%add_product(1.0_wp, space%v, forces)
         call add_magnitudes(first, magnitudes(space%x), terms)
         call add_magnitudes(second, magnitudes(space%v), terms)
         where (abs(forces) <= rounding*terms) forces = 0
         ! A long state would hide what is not zero of others.
         do j = scaled + 1, s
            size_of_terms = maxval(matmul(terms(:, j), magnitudes(from_left)))
            if (.not. size_of_terms > 0) cycle
            associate (factor => scale(1.0_wp, -exponent(size_of_terms)))
               space%x(:, j) = factor*space%x(:, j)
               space%v(:, j) = factor*space%v(:, j)
               space%links(:, j) = factor*space%links(:, j)
               forces(:, j) = factor*forces(:, j)
               terms(:, j) = factor*terms(:, j)
            end associate
         end do
         scaled = s
         allocate (level, source=matmul(transpose(magnitudes(from_left)), terms))
         allocate (coupling, source=matmul(transpose(from_left), forces)/spread(max(maxval(level, 2), tiny(1.0_wp)), 2, s))
         call find_fresh(coupling, rounding, used, fresh, error)
         if (allocated(error) .or. size(fresh, 2) == 0) return
         ! No eigenvalue is there more often than all of them together: the links are rounding.
         if (size(space%x, 2) + size(fresh, 2) > 2*size(space%x, 1)) then
            call new_error(error, error_singular, "rounding hides how often zero or infinity is an eigenvalue: "// &
               "the problem is singular for every lambda, or nearly so; look for motions with neither mass nor stiffness")
            return
         end if
         call extend(space, factored, motions, matmul(forces, fresh), fresh, error)
         if (allocated(error)) return
         call append(used, fresh, size(space%x, 2))
         deallocate (forces, terms, level, coupling, fresh)
      end do
   end subroutine find_root_space

   pure integer function multiplicity(self)
      class(root_space_type), intent(in) :: self

      multiplicity = self%states()
      if (allocated(self%beside)) multiplicity = multiplicity - size(self%beside)
   end function multiplicity

   !> s
   pure integer function count_states(self)
      class(root_space_type), intent(in) :: self

      count_states = 0
      if (allocated(self%x)) count_states = size(self%x, 2)
   end function count_states

   !> Adds eigenpairs beside zero.
   subroutine add_eigenpairs(self, lambda, x)
      class(root_space_type), intent(inout) :: self
      !> p numbers (1/s), and n x p.
      real(wp), intent(in) :: lambda(:), x(:, :)
      real(wp), allocatable :: links(:, :)
      integer :: s, j

      s = self%states()
      allocate (links(s + size(lambda), s + size(lambda)), source=0.0_wp)
      links(:s, :s) = self%links
      do j = 1, size(lambda)
         links(s + j, s + j) = lambda(j)
      end do
      call move_alloc(links, self%links)
      call append(self%v, x*spread(lambda, 1, size(x, 1)), size(x, 1))
      call append(self%x, x, size(x, 1))
      self%beside = lambda
   end subroutine add_eigenpairs

   ! Adds the states (-A0^+ f, X a) for combinations a.
   subroutine extend(space, factored, motions, forces, combinations, error)
      type(root_space_type), intent(inout) :: space
      type(scaled_stiffness_type), intent(inout) :: factored
      real(wp), intent(in) :: motions(:, :), forces(:, :), combinations(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), links(:, :)
      integer :: s, t

      s = size(space%x, 2)
      t = size(combinations, 2)
      allocate (x(size(forces, 1), t), source=0.0_wp)
      if (any(abs(forces) > 0)) then
         call factored%pseudo_solve(motions, -forces, x, error)
         if (allocated(error)) return
      end if
      allocate (links(s + t, s + t), source=0.0_wp)
      links(:s, :s) = space%links
      links(:s, s + 1:) = combinations
      call move_alloc(links, space%links)
      call append(space%v, matmul(space%x, combinations), size(x, 1))
      call append(space%x, x, size(x, 1))
   end subroutine extend

   ! Puts columns behind those there are, all with zeros down to a number of rows.
   pure subroutine append(columns, more, rows)
      real(wp), allocatable, intent(inout) :: columns(:, :)
      real(wp), intent(in) :: more(:, :)
      integer, intent(in) :: rows
      real(wp), allocatable :: all(:, :)

      allocate (all(rows, size(columns, 2) + size(more, 2)), source=0.0_wp)
      all(:size(columns, 1), :size(columns, 2)) = columns
      all(:size(more, 1), size(columns, 2) + 1:) = more
      call move_alloc(all, columns)
   end subroutine append

   ! Orthonormal null vectors of a k x s matrix that are orthogonal to those that were used.
   subroutine find_fresh(matrix, negligible, used, fresh, error)
      real(wp), intent(in) :: matrix(:, :), negligible
      !> Null vectors without their last zeros, orthonormal.
      real(wp), intent(in) :: used(:, :)
      real(wp), allocatable, intent(out) :: fresh(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: half = 0.5_wp
      real(wp), allocatable :: a(:, :), singular(:), vt(:, :), null_vectors(:, :)
      integer :: s, rank, u

      s = size(matrix, 2)
      u = size(used, 1)
      call right_singular_vectors(matrix, singular, vt, error)
      if (allocated(error)) return
      rank = count(singular > negligible)
      allocate (null_vectors, source=transpose(vt(rank + 1:, :)))
      ! The null vectors less what was used of them: as many as are left have the length one.
      allocate (a, source=null_vectors)
      a(:u, :) = a(:u, :) - matmul(used, matmul(transpose(used), null_vectors(:u, :)))
      deallocate (singular, vt)
      call right_singular_vectors(transpose(a), singular, vt, error)
      if (allocated(error)) return
      allocate (fresh, source=transpose(vt(:count(singular > half), :)))
   end subroutine find_fresh

   ! All right singular vectors, the largest singular value first; as many values as the smaller side has.
   subroutine right_singular_vectors(matrix, singular, vt, error)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), allocatable, intent(out) :: singular(:), vt(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: a(:, :), work(:)
      real(wp) :: none(1, 1)
      integer :: rows, columns, info

      rows = size(matrix, 1)
      columns = size(matrix, 2)
      allocate (singular(min(rows, columns)), vt(columns, columns))
      if (columns == 0) return
      ! OpenBLAS reads a few entries beyond the end.
      allocate (a(max(rows, 1), columns + 1), source=0.0_wp)
      a(:rows, :columns) = matrix
      allocate (work(10*(rows + columns) + 10))
      ! LAPACK may never end on what is no number.
      if (.not. all(abs(matrix) <= huge(1.0_wp))) call new_error(error, error_convergence, &
         "the chains of the eigenvalue zero are not finite: the entries of the matrices lie too far apart; choose other units")
      if (allocated(error)) return
      call dgesvd("N", "A", rows, columns, a, max(rows, 1), singular, none, 1, vt, columns, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgesvd did not converge")
   end subroutine right_singular_vectors
end module kschur_root_space
