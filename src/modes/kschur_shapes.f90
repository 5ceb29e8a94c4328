!> Comparison of mode shapes by linear independence: which eigenpairs are the same.
module kschur_shapes
   use kschur_description, only: quadratic_form
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize
   use kschur_kinds, only: wp
   use kschur_orthonormal, only: orthonormalize
   use kschur_problem, only: modal_problem_type
   use kschur_residual_parts, only: forces_of
   use kschur_sorting, only: ascending_order
   use kschur_tolerances, only: above_all_rounding, nearly_zero, rounding_of_row, rounding_of_sums, same_shape
   implicit none
   private
   public :: independent_part, independent_parts, orthonormalize_zeros, repeats_rigid_motion

contains

   !> Orthonormalizes the shapes of the pairs with eigenvalue zero, and normalizes all pairs.
   subroutine orthonormalize_zeros(pairs)
      !> With real shapes, as rigid motions have.
      type(eigenpairs_type), intent(inout) :: pairs
      ! Shapes above their multipliers.
      real(wp), allocatable :: motions(:, :)
      integer, allocatable :: zeros(:)
      integer :: n, j

      n = pairs%rows()
      allocate (zeros, source=pack([(j, j=1, size(pairs%lambda))], .not. abs(pairs%lambda) > 0))
      allocate (motions(n + size(pairs%xi, 1), size(zeros)))
      motions(:n, :) = pairs%real_phi(:, zeros)
      motions(n + 1:, :) = real(pairs%xi(:, zeros), wp)
      call orthonormalize(motions(:, :0), n, motions)
      zeros = zeros(:size(motions, 2))
      pairs%real_phi(:, zeros) = motions(:n, :)
      pairs%xi(:, zeros) = motions(n + 1:, :)
      do j = 1, size(pairs%lambda)
         call normalize(pairs, j)
      end do
   end subroutine orthonormalize_zeros

   !> Finds which of the first k pairs repeat a rigid motion: zeros that the iteration found again, with rounding errors as
   !> eigenvalues. Such a pair has a small eigenvalue and a shape in the span of the rigid motions, which are the `rigid` pairs
   !> behind the first k. A slow decay has such a shape, too, with lambda = -r/m from lambda^2 m + lambda r = 0: the pair is a zero
   !> unless its eigenvalue is that to a half. Where r is far below lambda m, rounding would else decide which of the two is nearer.
   function repeats_rigid_motion(problem, pairs, k, rigid, reference, zero_noise) result(repeats)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      !> Number of pairs to test, and of the rigid motions and their decays behind them.
      integer, intent(in) :: k, rigid
      !> Size of lambda (1/s), as the shift, relative to which zeros are recognized.
      real(wp), intent(in) :: reference
      !> Below this (1/s) every eigenvalue with such a shape is a zero: rounding of K hides others.
      real(wp), intent(in) :: zero_noise
      logical :: repeats(k)
      integer :: zeros(count(.not. abs(pairs%lambda(k + 1:k + rigid)) > 0))
      complex(wp) :: shape(pairs%rows())
      complex(wp) :: m, r, s
      ! An orthonormal basis of the rigid motions.
      real(wp), allocatable :: motions(:, :)
      real(wp) :: m_terms, r_terms, k_terms, largest, sizes(k)
      ! Whether the rigid motions are left null vectors of the stiffness, too.
      logical :: stiffness_is_symmetric
      integer :: order(k), i, j

      repeats = .false.
      if (min(rigid, k) == 0) return
      ! None is small relative to the others.
      sizes = abs(pairs%lambda(:k))
      if (minval(sizes) > nearly_zero*max(reference, maxval(sizes))) return
      zeros = pack([(i, i=k + 1, k + rigid)], .not. abs(pairs%lambda(k + 1:k + rigid)) > 0)
      allocate (motions(pairs%rows(), size(zeros)))
      do i = 1, size(zeros)
         motions(:, i) = real(pairs%column(zeros(i)), wp)
      end do
      call orthonormalize(motions(:, :0), size(motions, 1), motions)
      ! Tests shapes in the order of increasing eigenvalues, and stops behind the first that is no motion, unless that may be a
      ! zero itself, as shapes cost more.
      order = ascending_order(sizes)
      largest = huge(1.0_wp)
      do i = 1, k
         j = order(i)
         if (sizes(j) > nearly_zero*largest) exit
         shape = pairs%column(j)
         repeats(j) = hypot(norm2(off_motions(real(shape, wp))), norm2(off_motions(aimag(shape)))) <= same_shape*norm2(abs(shape))
         if (.not. repeats(j)) largest = min(largest, max(reference, sizes(j)))
      end do
      if (.not. largest < huge(1.0_wp)) largest = reference
      stiffness_is_symmetric = problem%stiffness%is_symmetric()
      if (allocated(problem%loss)) stiffness_is_symmetric = stiffness_is_symmetric .and. problem%loss%is_symmetric()
      do j = 1, k
         if (.not. repeats(j) .or. sizes(j) < zero_noise) cycle
         shape = pairs%column(j)
         call quadratic_form(problem%mass, shape, m, m_terms)
         call quadratic_form(problem%damping, shape, r, r_terms)
         call quadratic_form(problem%stiffness, shape, s, k_terms)
         repeats(j) = sizes(j) <= nearly_zero*largest .and. (abs(r) <= rounding_of_row*r_terms .or. &
            abs(pairs%lambda(j)**2)*m_terms <= rounding_of_sums*k_terms .or. &
            abs(pairs%lambda(j)*m) < 2*abs(pairs%lambda(j)*m + r))
         if (repeats(j)) repeats(j) = .not. is_eigenpair(j)
      end do

   contains

      ! The part of a vector that is orthogonal to the rigid motions.
      pure function off_motions(x)
         real(wp), intent(in) :: x(:)
         real(wp) :: off_motions(size(x))

         off_motions = x - matmul(motions, matmul(x, motions))
      end function off_motions

      ! Whether pair j is an eigenpair with a nonzero eigenvalue: its residual is small relative to its inertia or damping forces.
      ! The eigenvalue of a repeated zero is an error, and its residual is of the size of these forces.
      logical function is_eigenpair(j)
         integer, intent(in) :: j
         complex(wp) :: forces(pairs%rows(), 3)
         integer :: i

         forces = forces_of(problem, pairs, j)
         is_eigenpair = norm2(abs(sum(forces, 2))) < same_shape*maxval(norm2(abs(forces(:, :2)), 1))
         if (.not. (is_eigenpair .and. stiffness_is_symmetric)) return
         ! Along the motions only inertia and damping act. All else may be that of a chain of zero, which gyroscopic forces begin.
         do i = 1, size(zeros)
            associate (motion => pairs%column(zeros(i)))
               is_eigenpair = is_eigenpair .and. abs(dot_product(motion, forces(:, 1) + forces(:, 2))) <= same_shape* &
                  max(sum(abs(motion*forces(:, 1))), sum(abs(motion*forces(:, 2))))
            end associate
         end do
      end function is_eigenpair
   end function repeats_rigid_motion

   !> Norm of the part of the state of pair j of `others` that is orthogonal to the states of those of `pairs` with eigenvalues near
   !> its own, relative to the norm of the state: small if `pairs` has this pair already.
   real(wp) function independent_part(pairs, others, j, distance) result(part)
      !> The list with the span, and the list of the pair.
      class(eigenpairs_type), intent(in) :: pairs, others
      !> Position in `others`.
      integer, intent(in) :: j
      !> Relative distance of eigenvalues that are near.
      real(wp), intent(in) :: distance
      type(eigenpairs_type) :: near
      real(wp), allocatable :: parts(:)
      integer :: i

      near = chosen_pairs(pairs, abs(pairs%lambda - others%lambda(j)) <= distance*abs(others%lambda(j)))
      call append_pairs(near, chosen_pairs(others, [(i == j, i=1, size(others%lambda))]))
      allocate (parts, source=independent_parts(near, [(i, i=1, size(near%lambda))]))
      part = parts(size(parts))
   end function independent_part

   !> For each chosen pair the norm of the part of its state [phi; lambda phi/|lambda|] that is orthogonal to the states of the
   !> chosen ones before it, relative to the norm of the state: small for a pair that is listed twice.
   pure function independent_parts(pairs, chosen) result(parts)
      class(eigenpairs_type), intent(in) :: pairs
      !> Their positions.
      integer, intent(in) :: chosen(:)
      real(wp) :: parts(size(chosen))
      complex(wp) :: gram(size(chosen), size(chosen)), direction(size(chosen))
      integer :: i, j

      direction = pairs%lambda(chosen)/max(abs(pairs%lambda(chosen)), tiny(1.0_wp))
      do j = 1, size(chosen)
         do i = 1, j
            gram(i, j) = product_of_shapes(pairs, chosen(i), chosen(j))*(1 + conjg(direction(i))*direction(j))
         end do
      end do
      parts = distances_from_span(gram)
   end function independent_parts

   ! The inner product phi_i^* phi_j.
   pure complex(wp) function product_of_shapes(pairs, i, j) result(product)
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: i, j

      if (pairs%is_real()) then
         product = dot_product(pairs%real_phi(:, i), pairs%real_phi(:, j))
      else
         product = dot_product(pairs%phi(:, i), pairs%phi(:, j))
      end if
   end function product_of_shapes

   ! Distances of vectors from the span of those before them, relative to their norms: the square roots of the pivots of the
   ! Cholesky factorization of their Gram matrix, accurate to the root of epsilon. A vector whose pivot is rounding is skipped.
   pure function distances_from_span(gram) result(distances)
      !> Gram matrix, upper triangle.
      complex(wp), intent(in) :: gram(:, :)
      real(wp) :: distances(size(gram, 1)), pivot
      complex(wp) :: schur(size(gram, 1), size(gram, 1))
      integer :: i, j, k

      schur = gram
      do k = 1, size(gram, 1)
         pivot = real(schur(k, k), wp)
         distances(k) = sqrt(max(pivot, 0.0_wp)/max(real(gram(k, k), wp), tiny(1.0_wp)))
         if (.not. distances(k)**2 > above_all_rounding) cycle
         do j = k + 1, size(gram, 1)
            do i = k + 1, j
               schur(i, j) = schur(i, j) - conjg(schur(k, i))*schur(k, j)/pivot
            end do
         end do
      end do
   end function distances_from_span
end module kschur_shapes
