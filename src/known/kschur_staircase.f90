!> The whole eigenspace of the eigenvalue zero, or of the infinite one, with its Jordan chains: an iteration would see
!> a chain of length k as a ring of radius epsilon^(1/k), and what is near zero or far off as one of it.
module kschur_staircase
   use kschur_error, only: error_type, error_singular, new_error
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_magnitudes, only: add_magnitudes, magnitudes
   use kschur_monitor, only: ask_monitor, monitor_type
   use kschur_null_space, only: null_space_type
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, rounding_of_sums
   implicit none
   private
   public :: find_root_space, most_null_vectors, root_space_type, undamped_zeros, zero_and_infinite

   !> Chains that begin with more null vectors than this are not followed: the steps below are dense.
   integer, parameter :: most_null_vectors = 1000
   ! Beside twice the null vectors, as of free bodies, there are no more states: chains are short, and those of rounding go on
   ! until they have all states.
   integer, parameter :: states_beside = 128

   !> States (x, v) of the chains of lambda = 0 in lambda^2 A2 + lambda A1 + A0, v_j = x_{j-1} and
   !> A0 x_j + Cq^T xi_j = -(A1 x_{j-1} + A2 x_{j-2}), Cq x_j = 0 (Gohberg, Lancaster, Rodman, Matrix Polynomials
   !> (1982), section 1.4).
   type :: root_space_type
      !> n x s; s is the multiplicity of the eigenvalue, and of what is known beside it.
      real(wp), allocatable :: x(:, :), v(:, :)
      !> State j follows the combination links(:, j) of the states before it, s x s, strictly upper triangular but for those of eigenvalues beside.
      real(wp), allocatable :: links(:, :)
      !> Eigenvalues beside it that are known with it (1/s), both of a conjugate pair: those of the last states, a pair of them
      !> a block of the links. Not allocated: none.
      complex(wp), allocatable :: beside(:)
   contains
      procedure :: multiplicity
      procedure :: states => count_states
      procedure :: add_eigenpairs
   end type root_space_type

contains

   !> The root space that begins with null vectors of A0 on the motions that the constraints allow, `most_null_vectors` at most.
   subroutine find_root_space(space, null_space, first, second, error, monitor)
      type(root_space_type), intent(out) :: space
      !> Of A0.
      type(null_space_type), intent(inout) :: null_space
      !> A1 and A2.
      type(csr_matrix_type), intent(in) :: first, second
      type(error_type), allocatable, intent(out) :: error
      !> Asked before each step.
      class(monitor_type), optional, intent(inout) :: monitor
      real(wp), allocatable :: left(:, :), forces(:, :), terms(:, :), level(:, :), factor(:), used(:, :), fresh(:, :), &
         both(:, :), singular(:), vectors(:, :), y(:, :), weights(:)
      integer :: n, k, s

      n = size(null_space%motions, 1)
      k = size(null_space%motions, 2)
      allocate (space%x, source=null_space%motions)
      allocate (space%v(n, k), space%links(k, k), used(k, 0), source=0.0_wp)
      if (k == 0) return
      call null_space%find_left(left, error)
      if (allocated(error) .or. size(left, 2) /= k) return
      ! Motions that are mixed hide what is light, or damped little, behind what is not.
      weights = row_weights(first, second)
      call reduce_to_echelon(space%x, weights)
      call reduce_to_echelon(left, weights)
      do
         call ask_monitor(monitor, error)
         if (allocated(error)) return
         s = space%states()
         allocate (forces(n, s), terms(n, s), source=0.0_wp)
         call first%add_product(1.0_wp, space%x, forces)
         call second%add_product(1.0_wp, space%v, forces)
         call add_magnitudes(first, magnitudes(space%x), terms)
         call add_magnitudes(second, magnitudes(space%v), terms)
         where (abs(forces) <= cancelled*terms) forces = 0
         ! A long state would hide what is not zero of others.
         level = matmul(transpose(magnitudes(left)), terms)
         factor = scale(1.0_wp, -exponent(maxval(level, 1)))
         space%x = space%x*spread(factor, 1, n)
         space%v = space%v*spread(factor, 1, n)
         space%links = space%links*spread(factor, 1, s)
         forces = forces*spread(factor, 1, n)
         level = level*spread(factor, 1, k)
         ! Combinations that no left vector sees, without those that were used: null vectors of both together.
         allocate (both(k + size(used, 2), s), source=0.0_wp)
         both(:k, :) = matmul(transpose(left), forces)/spread(max(maxval(level, 2), tiny(1.0_wp)), 2, s)
         both(k + 1:, :size(used, 1)) = transpose(used)
         call right_singular_vectors(both, singular, vectors, error)
         if (allocated(error)) return
         fresh = vectors(:, count(singular > cancelled) + 1:)
         if (size(fresh, 2) == 0) return
         ! No eigenvalue is there more often than all of them together: the links are rounding.
         if (s + size(fresh, 2) > min(2*n, 2*k + states_beside)) then
            call new_error(error, error_singular, "rounding hides how often zero or infinity is an eigenvalue: "// &
               "the problem is singular for every lambda, or nearly so; look for motions with neither mass nor stiffness, "// &
               "and for entries far above all others")
            return
         end if
         ! The next states are (-A0^+ f, X a) for combinations a.
         forces = matmul(forces, fresh)
         allocate (y(n + size(null_space%multipliers, 1), size(fresh, 2)), source=0.0_wp)
         if (any(abs(forces) > 0)) call null_space%pseudo_solve(-forces, y, error)
         if (allocated(error)) return
         call append(space%v, matmul(space%x, fresh), n)
         call append(space%x, y(:n, :), n)
         call append(space%links, fresh, space%states())
         call append(used, fresh, space%states())
         deallocate (forces, terms, both, y)
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

   !> Adds eigenpairs beside zero, those that are not real with their conjugates.
   subroutine add_eigenpairs(self, lambda, x)
      class(root_space_type), intent(inout) :: self
      !> p numbers (1/s), and n x p.
      complex(wp), intent(in) :: lambda(:), x(:, :)
      complex(wp) :: state(size(x, 1), 2)
      integer :: s, j

      if (.not. allocated(self%x)) allocate (self%x(size(x, 1), 0), self%v(size(x, 1), 0), self%links(0, 0))
      if (.not. allocated(self%beside)) allocate (self%beside(0))
      do j = 1, size(lambda)
         s = self%states()
         self%beside = [self%beside, lambda(j)]
         state(:, 1) = x(:, j)
         state(:, 2) = lambda(j)*x(:, j)
         ! A [Re z, Im z] = B [Re z, Im z] [Re lambda, Im lambda; -Im lambda, Re lambda].
         call append(self%x, real(state(:, :1), wp), size(x, 1))
         call append(self%v, real(state(:, 2:), wp), size(x, 1))
         if (abs(aimag(lambda(j))) > 0) then
            call append(self%x, aimag(state(:, :1)), size(x, 1))
            call append(self%v, aimag(state(:, 2:)), size(x, 1))
         end if
         call append(self%links, reshape([real(wp) ::], [0, self%states() - s]), self%states())
         self%links(s + 1, s + 1) = real(lambda(j), wp)
         if (self%states() == s + 1) cycle
         self%beside = [self%beside, conjg(lambda(j))]
         self%links(s + 1:, s + 2) = [aimag(lambda(j)), real(lambda(j), wp)]
         self%links(s + 2, s + 1) = -aimag(lambda(j))
      end do
   end subroutine add_eigenpairs

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

   ! Size of each row of A1, and far below all of these that of A2 where A1 has none.
   pure function row_weights(first, second) result(weights)
      type(csr_matrix_type), intent(in) :: first, second
      real(wp) :: weights(first%rows)
      real(wp), parameter :: far_below = sqrt(tiny(1.0_wp))

      weights = relative(first)
      where (.not. weights > 0) weights = far_below*(relative(second) + epsilon(1.0_wp))

   contains

      pure function relative(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp) :: relative(matrix%rows)

         relative = matrix%row_maxima()
         if (any(relative > 0)) relative = relative/maxval(relative)
      end function relative
   end function row_weights

   ! Replaces a basis of rank k by the reduced echelon one of the same space, by elimination (Golub, Van Loan, Matrix Computations
   ! (2013), section 3.4): each vector has its pivot where those after it have zero. The pivot is the largest entry times
   ! the weight of its row: then a row that is far above all others, as of a damper of 1e20, acts on one vector, and is exactly
   ! zero in those after it. Within a row no weight differs, so that they grow by no more than a factor of two a step.
   pure subroutine reduce_to_echelon(basis, weights)
      real(wp), intent(inout) :: basis(:, :)
      real(wp), intent(in) :: weights(:)
      real(wp), parameter :: one_digit = 10
      real(wp) :: column(size(basis, 1)), factor
      integer :: j, l, largest, place(2)

      do j = 1, size(basis, 2)
         basis(:, j) = basis(:, j)/maxval(abs(basis(:, j)))
      end do
      do j = 1, size(basis, 2)
         ! Rows of pivots before have zeros here.
         place = maxloc(abs(basis(:, j:))*spread(weights, 2, size(basis, 2) - j + 1))
         largest = place(2) + j - 1
         if (.not. abs(basis(place(1), largest)) > 0) return
         column = basis(:, largest)/maxval(abs(basis(:, largest)))
         basis(:, largest) = basis(:, j)
         basis(:, j) = column
         do l = 1, size(basis, 2)
            if (l == j .or. .not. abs(basis(place(1), l)) > 0) cycle
            factor = basis(place(1), l)/column(place(1))
            ! A pivot that is small in its vector would swell those before it.
            if (l < j .and. abs(factor) > one_digit) cycle
            basis(:, l) = basis(:, l) - factor*column
            basis(place(1), l) = 0
         end do
         where (abs(basis) <= rounding_of_sums) basis = 0
      end do
   end subroutine reduce_to_echelon

   !> The states (phi, lambda/unit phi, ...) of the root spaces of zero and of infinity as an invariant subspace of
   !> shift-invert at sigma. With A Z = B Z J it is T = (J - sigma)^{-1}, with B Z = A Z J it is (1 - sigma J)^{-1} J.
   function zero_and_infinite(zero, infinite, order, shift, unit, oscillator) result(invariant)
      !> That of infinity is the one of the reversed polynomial, whose states are (lambda phi, phi).
      type(root_space_type), intent(in) :: zero, infinite
      !> Length of the states.
      integer, intent(in) :: order
      !> sigma, a theta.
      complex(wp), intent(in) :: shift
      !> Unit of lambda in the second part of a state (1/s).
      real(wp), intent(in) :: unit
      !> Whether states are phi alone.
      logical, intent(in) :: oscillator
      type(invariant_type) :: invariant
      complex(wp), parameter :: none = 0, one = 1
      integer :: n, k, s

      k = zero%states()
      s = k + infinite%states()
      allocate (invariant%vectors(order, s))
      allocate (invariant%projected(s, s))
      invariant%vectors = 0
      invariant%projected = 0
      if (k > 0) then
         n = size(zero%x, 1)
         invariant%vectors(:n, :k) = zero%x
         if (.not. oscillator) invariant%vectors(n + 1:2*n, :k) = zero%v/unit
         invariant%projected(:k, :k) = quotient(zero%links, none, one, one, -shift)
      end if
      if (s == k) return
      n = size(infinite%x, 1)
      if (oscillator) then
         invariant%vectors(:n, k + 1:) = infinite%x
      else
         invariant%vectors(:n, k + 1:) = infinite%v
         invariant%vectors(n + 1:2*n, k + 1:) = infinite%x/unit
      end if
      invariant%projected(k + 1:, k + 1:) = quotient(infinite%links, one, none, -shift, one)
   end function zero_and_infinite

   !> The root space of lambda = 0 that rigid motions without damping have at least: (phi, 0), and (0, phi) next in
   !> its chain.
   pure function undamped_zeros(motions) result(space)
      !> n x k.
      real(wp), intent(in) :: motions(:, :)
      type(root_space_type) :: space
      integer :: n, k, j

      n = size(motions, 1)
      k = size(motions, 2)
      allocate (space%x(n, 2*k), space%v(n, 2*k), space%links(2*k, 2*k), source=0.0_wp)
      space%x(:, :k) = motions
      space%v(:, k + 1:) = motions
      do j = 1, k
         space%links(j, k + j) = 1
      end do
   end function undamped_zeros

   ! (c J + d)^{-1} (a J + b).
   function quotient(j, a, b, c, d) result(q)
      real(wp), intent(in) :: j(:, :)
      complex(wp), intent(in) :: a, b, c, d
      complex(wp), dimension(size(j, 1), size(j, 1)) :: q, divisor
      integer :: i, info, pivots(size(j, 1))

      q = a*j
      divisor = c*j
      do i = 1, size(j, 1)
         q(i, i) = q(i, i) + b
         divisor(i, i) = divisor(i, i) + d
      end do
      if (size(j, 1) > 0) call zgesv(size(j, 1), size(j, 1), divisor, size(j, 1), pivots, q, size(j, 1), info)
   end function quotient
end module kschur_staircase
