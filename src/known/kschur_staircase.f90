!> The root space, eigenvectors and Jordan chains, of the eigenvalue zero or infinity. An iteration cannot resolve it: rounding
!> splits the eigenvalue of a chain of length k into a circle of radius epsilon^(1/k), which mixes with its neighbours.
module kschur_staircase
   use kschur_error, only: error_type, error_singular, new_error
   use kschur_invariant, only: invariant_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_magnitudes, only: magnitudes, terms_of
   use kschur_monitor, only: ask_monitor, monitor_type
   use kschur_null_space, only: null_space_type
   use kschur_singular_vectors, only: right_singular_vectors
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, rounding_of_sums
   implicit none
   private
   public :: find_root_space, most_null_vectors, root_space_type, separate_motions, undamped_zeros, zero_and_infinite

   !> Chains are not computed if there are more null vectors than this: the steps below are dense.
   integer, parameter :: most_null_vectors = 1000
   ! Most states beyond twice the null vectors, the multiplicity of free bodies: true chains are short, those that rounding makes
   ! do not end.
   integer, parameter :: most_extra_states = 128

   !> The root space of lambda = 0 of lambda^2 A2 + lambda A1 + A0 as states (x, v): Jordan chains v_j = x_{j-1},
   !> A0 x_j + Cq^T xi_j = -(A1 x_{j-1} + A2 x_{j-2}), Cq x_j = 0 (Gohberg, Lancaster, Rodman, Matrix Polynomials (1982), section
   !> 1.4), and eigenpairs known with it.
   type :: root_space_type
      !> n x s; s is the multiplicity of the eigenvalue plus the number of other eigenvalues known with it.
      real(wp), allocatable :: x(:, :), v(:, :)
      !> The restriction of the operator to the space, s x s: state j is mapped to the combination links(:, j) of states. Strictly
      !> upper triangular for the chains, with 1x1 and 2x2 blocks of the nonzero eigenvalues behind them.
      real(wp), allocatable :: links(:, :)
      !> Nonzero eigenvalues known with it (1/s), both of a conjugate pair: those of the last states. Not allocated: none.
      complex(wp), allocatable :: nonzero(:)
   contains
      !> Multiplicity of the eigenvalue zero.
      procedure :: multiplicity
      !> Number of states, s.
      procedure :: states => count_states
      !> Adds nonzero eigenpairs.
      procedure :: add_eigenpairs
   end type root_space_type

contains

   !> Computes the root space of lambda = 0 from the null vectors of A0 on the motions that the constraints allow, by extending
   !> Jordan chains: a combination of states whose force A1 x + A2 v is orthogonal to the left null vectors has a successor
   !> -A0^+ (A1 x + A2 v). Ends when no new combination is left.
   subroutine find_root_space(space, null_space, a1, a2, error, monitor)
      type(root_space_type), intent(out) :: space
      !> The null space of A0, with `most_null_vectors` at most.
      type(null_space_type), intent(inout) :: null_space
      !> A1 and A2, the coefficients of lambda and lambda^2.
      type(csr_matrix_type), intent(in) :: a1, a2
      !> Where rounding hides the multiplicity, or a step fails.
      type(error_type), allocatable, intent(out) :: error
      !> Asked before each step whether to go on.
      class(monitor_type), optional, intent(inout) :: monitor
      real(wp), allocatable :: left(:, :), forces(:, :), terms(:, :), term_sizes(:, :), scaling(:), extended(:, :), &
         combinations(:, :), conditions(:, :), singular(:), vectors(:, :), y(:, :)
      integer :: n, k, s

      n = size(null_space%motions, 1)
      k = size(null_space%motions, 2)
      allocate (space%x, source=null_space%motions)
      allocate (space%v(n, k), space%links(k, k), extended(k, 0), source=0.0_wp)
      if (k == 0) return
      left = null_space%motions
      if (allocated(null_space%left_motions)) left = null_space%left_motions
      if (size(left, 2) /= k) return
      call separate_motions(space%x, a1, a2)
      call separate_motions(left, a1, a2)
      do
         call ask_monitor(monitor, error)
         if (allocated(error)) return
         s = space%states()
         forces = a1%product(space%x) + a2%product(space%v)
         terms = terms_of(a1, magnitudes(space%x)) + terms_of(a2, magnitudes(space%v))
         where (abs(forces) <= cancelled*terms) forces = 0
         ! Scales states to one size by powers of two: a large one would hide the forces of others.
         term_sizes = matmul(transpose(magnitudes(left)), terms)
         scaling = scale(1.0_wp, -exponent(maxval(term_sizes, 1)))
         space%x = space%x*spread(scaling, 1, n)
         space%v = space%v*spread(scaling, 1, n)
         space%links = space%links*spread(scaling, 1, s)
         forces = forces*spread(scaling, 1, n)
         term_sizes = term_sizes*spread(scaling, 1, k)
         ! Combinations whose forces are orthogonal to the left null vectors, and which are orthogonal to those extended before: the
         ! null vectors of both conditions together.
         allocate (conditions(k + size(extended, 2), s), source=0.0_wp)
         conditions(:k, :) = matmul(transpose(left), forces)/spread(max(maxval(term_sizes, 2), tiny(1.0_wp)), 2, s)
         conditions(k + 1:, :size(extended, 1)) = transpose(extended)
         call right_singular_vectors(conditions, singular, vectors, error)
         if (allocated(error)) return
         combinations = vectors(:, count(singular > cancelled) + 1:)
         if (size(combinations, 2) == 0) return
         ! The multiplicity cannot exceed the number of eigenvalues: chains are rounding then.
         if (s + size(combinations, 2) > min(2*n, 2*k + most_extra_states)) then
            call new_error(error, error_singular, "rounding hides how often zero or infinity is an eigenvalue: "// &
               "the problem is singular for every lambda, or nearly so; look for motions with neither mass nor stiffness, "// &
               "and for entries far above all others")
            return
         end if
         ! The successors are (-A0^+ f, X a) for combinations a with forces f.
         forces = matmul(forces, combinations)
         allocate (y(n + size(null_space%multipliers, 1), size(combinations, 2)), source=0.0_wp)
         if (any(abs(forces) > 0)) call null_space%pseudo_solve(-forces, y, error)
         if (allocated(error)) return
         call append_columns(space%v, matmul(space%x, combinations), n)
         call append_columns(space%x, y(:n, :), n)
         call append_columns(space%links, combinations, space%states())
         call append_columns(extended, combinations, space%states())
         deallocate (conditions, y)
      end do
   end subroutine find_root_space

   !> The multiplicity of the eigenvalue zero.
   pure integer function multiplicity(self)
      class(root_space_type), intent(in) :: self

      multiplicity = self%states()
      if (allocated(self%nonzero)) multiplicity = multiplicity - size(self%nonzero)
   end function multiplicity

   !> The number of states, s.
   pure integer function count_states(self)
      class(root_space_type), intent(in) :: self

      count_states = 0
      if (allocated(self%x)) count_states = size(self%x, 2)
   end function count_states

   !> Adds nonzero eigenpairs, the complex ones with their conjugates as a real basis of two states.
   subroutine add_eigenpairs(self, lambda, x)
      class(root_space_type), intent(inout) :: self
      !> Eigenvalues, p numbers (1/s), and shapes, n x p.
      complex(wp), intent(in) :: lambda(:), x(:, :)
      real(wp) :: motion(size(x, 1), 2), velocity(size(x, 1), 2), block(2, 2)
      complex(wp) :: both(2)
      integer :: s, p, n, j

      if (.not. allocated(self%x)) allocate (self%x(size(x, 1), 0), self%v(size(x, 1), 0), self%links(0, 0))
      if (.not. allocated(self%nonzero)) allocate (self%nonzero(0))
      n = size(x, 1)
      do j = 1, size(lambda)
         s = self%states()
         p = merge(2, 1, abs(aimag(lambda(j))) > 0)
         both = [lambda(j), conjg(lambda(j))]
         motion = reshape([real(x(:, j), wp), aimag(x(:, j))], [n, 2])
         velocity = reshape([real(lambda(j)*x(:, j), wp), aimag(lambda(j)*x(:, j))], [n, 2])
         ! A [Re z, Im z] = B [Re z, Im z] [Re lambda, Im lambda; -Im lambda, Re lambda].
         block = reshape([real(both(1), wp), -aimag(both(1)), aimag(both(1)), real(both(1), wp)], [2, 2])
         self%nonzero = [self%nonzero, both(:p)]
         call append_columns(self%x, motion(:, :p), n)
         call append_columns(self%v, velocity(:, :p), n)
         call append_columns(self%links, reshape([real(wp) ::], [0, p]), s + p)
         self%links(s + 1:, s + 1:) = block(:p, :p)
      end do
   end subroutine add_eigenpairs

   ! Appends columns to a block, and pads all with zeros to a number of rows.
   pure subroutine append_columns(columns, more, rows)
      real(wp), allocatable, intent(inout) :: columns(:, :)
      real(wp), intent(in) :: more(:, :)
      integer, intent(in) :: rows
      real(wp), allocatable :: all(:, :)

      allocate (all(rows, size(columns, 2) + size(more, 2)), source=0.0_wp)
      all(:size(columns, 1), :size(columns, 2)) = columns
      all(:size(more, 1), size(columns, 2) + 1:) = more
      call move_alloc(all, columns)
   end subroutine append_columns

   !> Replaces a basis of motions by one of separate motions: in a mixed one, terms of heavy or damped motions would hide those of
   !> light or undamped ones. It is a column echelon form of the same space, by Gauss-Jordan elimination (Golub, Van Loan, Matrix
   !> Computations (2013), section 3.4): each vector is zero in the pivot rows of those before it. The pivot is the largest entry
   !> times the weight of its row, so that a row far above all others, as of a damper of 1e20, acts on one vector and is exactly
   !> zero in those after it. Among the vectors left, the pivot is the largest entry of its row: a step at most doubles their
   !> entries. Entries that are rounding become zero.
   pure subroutine separate_motions(basis, a1, a2)
      !> n rows of motions; rows below them are combined alike.
      real(wp), intent(inout) :: basis(:, :)
      !> Coefficients of lambda and lambda^2.
      type(csr_matrix_type), intent(in) :: a1, a2
      ! A pivot that is smaller in its vector than this would spoil the vectors before it.
      real(wp), parameter :: largest_factor = 10
      real(wp), parameter :: far_below = sqrt(tiny(1.0_wp))
      real(wp) :: weights(a1%rows), column(size(basis, 1)), factor
      integer :: n, j, l, largest, place(2)

      ! The weight of a row is its largest entry in A1, relative to the matrix, or for a row of zeros that in A2, scaled below all
      ! others.
      weights = relative_maxima(a1)
      where (.not. weights > 0) weights = far_below*(relative_maxima(a2) + epsilon(1.0_wp))
      n = size(weights)
      do j = 1, size(basis, 2)
         basis(:, j) = basis(:, j)/maxval(abs(basis(:n, j)))
      end do
      do j = 1, size(basis, 2)
         ! The pivot rows before have zeros in these columns.
         place = maxloc(abs(basis(:n, j:))*spread(weights, 2, size(basis, 2) - j + 1))
         largest = place(2) + j - 1
         if (.not. abs(basis(place(1), largest)) > 0) return
         column = basis(:, largest)/maxval(abs(basis(:n, largest)))
         basis(:, largest) = basis(:, j)
         basis(:, j) = column
         do l = 1, size(basis, 2)
            if (l == j .or. .not. abs(basis(place(1), l)) > 0) cycle
            factor = basis(place(1), l)/column(place(1))
            if (l < j .and. abs(factor) > largest_factor) cycle
            basis(:, l) = basis(:, l) - factor*column
            basis(place(1), l) = 0
         end do
         where (abs(basis(:n, :)) <= rounding_of_sums) basis(:n, :) = 0
      end do

   contains

      ! The largest entry of each row, relative to the largest of the matrix.
      pure function relative_maxima(matrix) result(maxima)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp) :: maxima(matrix%rows)

         maxima = matrix%row_maxima()
         if (any(maxima > 0)) maxima = maxima/maxval(maxima)
      end function relative_maxima
   end subroutine separate_motions

   !> Assembles the root spaces of zero and infinity, as states (phi, lambda/unit phi, ...), to an invariant subspace Z of the
   !> shift-invert operator (A - sigma B)^{-1} B, to lock it: its projection is (J - sigma)^{-1} for A Z = B Z J (zero) and
   !> (1 - sigma J)^{-1} J for B Z = A Z J (infinity).
   function zero_and_infinite(zero, infinite, order, shift, unit, oscillator) result(invariant)
      !> The root space of infinity is that of zero of the reversed polynomial, with states (lambda phi, phi).
      type(root_space_type), intent(in) :: zero, infinite
      !> Length of the states.
      integer, intent(in) :: order
      !> sigma, the shift, a theta.
      complex(wp), intent(in) :: shift
      !> Unit of lambda in the second part of a state (1/s).
      real(wp), intent(in) :: unit
      !> Whether theta is plus or minus lambda^2: states are phi alone.
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

   !> The root space of lambda = 0 of undamped rigid motions without computing chains: the states (phi, 0) and their successors
   !> (0, phi).
   pure function undamped_zeros(motions) result(space)
      !> The rigid motions, n x k.
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

   ! The rational function (c J + d)^{-1} (a J + b) of a matrix J.
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
