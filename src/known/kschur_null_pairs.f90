!> Left and right null vectors of an unsymmetric matrix, told entry by entry from vectors that have a small force.
module kschur_null_pairs
   use kschur_error, only: error_type
   use kschur_extended_residual, only: extended_product
   use kschur_kinds, only: wp, xp
   use kschur_lapack, only: dgesv
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_magnitudes, only: terms_of
   use kschur_sparse, only: csr_matrix_type, transpose_csr
   use kschur_tolerances, only: contraction, rounding_of_energy, rounding_of_row
   implicit none
   private
   public :: keep_null_pairs, radius_of_zeros, solve

contains

   !> Keeps the combinations of Y and X, null vectors of A^T and A to the rounding of its norm, that are null vectors to the
   !> rounding of its entries: some A + E with |E| <= u |A| is singular, to first order, only if |y^T A x| <= u |y|^T |A| |x|. Where
   !> rows and columns have units of their own, the norm says little. Vectors in double precision say little as well, as only their
   !> largest entries are accurate: they are refined by residuals in extended precision first (Higham, Accuracy and Stability of
   !> Numerical Algorithms (2002), chapters 7 and 12).
   subroutine keep_null_pairs(matrix, solver, y, x, forms, doubtful, error)
      !> A, N x N, and factors of a matrix near it.
      type(csr_matrix_type), intent(in) :: matrix
      class(real_linear_solver_type), intent(inout) :: solver
      !> Y and X, N x k each; on return refined, and fewer if some were not null.
      real(wp), allocatable, intent(inout) :: y(:, :), x(:, :)
      !> |Y^T A X| of those kept, with its rounding.
      real(wp), allocatable, intent(out) :: forms(:, :)
      !> Whether some kept pair may not be null.
      logical, intent(out) :: doubtful
      type(error_type), allocatable, intent(out) :: error
      ! Each step reduces errors by the distance of the factored matrix relative to the least singular value that is not null.
      integer, parameter :: most_steps = 20
      type(csr_matrix_type) :: transposed
      real(xp), allocatable :: left(:, :), right(:, :), forces(:, :)
      real(wp), allocatable :: terms(:, :), forms_before(:, :), terms_before(:, :)
      ! The largest correction of an entry of these vectors of unit length.
      real(wp) :: change
      logical :: settled
      integer :: step, place(2), i, j

      transposed = transpose_csr(matrix)
      allocate (left(size(y, 1), size(y, 2)), right(size(x, 1), size(x, 2)))
      left = y
      right = x
      allocate (forms_before(size(y, 2), size(x, 2)), terms_before(size(y, 2), size(x, 2)), source=huge(1.0_wp))
      change = 1
      do step = 0, most_steps
         forces = extended_product(matrix, right)
         call measure(forces)
         settled = all(abs(forms) <= rounding_of_energy*terms .or. abs(forms - forms_before) <= contraction*abs(forms))
         if (settled .and. (change <= epsilon(1.0_xp) .or. all(terms >= (1 - contraction)*terms_before))) exit
         forms_before = forms
         terms_before = terms
         change = 0
         call correct(.false., forces, right)
         if (.not. allocated(error)) call correct(.true., extended_product(transposed, left), left)
         if (allocated(error)) return
      end do
      ! Takes the pair with the largest form away, and makes the others conjugate to it.
      do while (settled .and. size(right, 2) > 0)
         place = maxloc(abs(forms)/max(terms, tiny(1.0_wp)))
         if (abs(forms(place(1), place(2))) <= rounding_of_row*terms(place(1), place(2))) exit
         associate (others => [(j, j=1, place(2) - 1), (j, j=place(2) + 1, size(right, 2))], &
            other_left => [(i, i=1, place(1) - 1), (i, i=place(1) + 1, size(left, 2))])
            right = right(:, others) - spread(right(:, place(2)), 2, size(others))* &
               spread(real(forms(place(1), others)/forms(place(1), place(2)), xp), 1, size(right, 1))
            left = left(:, other_left) - spread(left(:, place(1)), 2, size(other_left))* &
               spread(real(forms(other_left, place(2))/forms(place(1), place(2)), xp), 1, size(left, 1))
         end associate
         call measure(extended_product(matrix, right))
      end do
      doubtful = .not. settled .or. any(abs(forms) > rounding_of_energy*terms)
      forms = abs(forms) + epsilon(1.0_xp)*terms
      y = real(left, wp)
      x = real(right, wp)

   contains

      ! Computes the forms Y^T A X and the terms |Y|^T |A| |X| that they are sums of.
      subroutine measure(forces)
         !> A X.
         real(xp), intent(in) :: forces(:, :)

         forms = real(matmul(transpose(left), forces), wp)
         terms = matmul(transpose(real(abs(left), wp)), terms_of(matrix, real(abs(right), wp)))
      end subroutine measure

      ! Subtracts from vectors what solves for their forces.
      subroutine correct(adjoint, residual, vectors)
         logical, intent(in) :: adjoint
         real(xp), intent(in) :: residual(:, :)
         real(xp), intent(inout) :: vectors(:, :)
         real(wp) :: correction(size(vectors, 1), size(vectors, 2))

         correction = real(residual, wp)
         call solve(solver, adjoint, correction, error)
         if (allocated(error)) return
         vectors = vectors - correction
         change = max(change, maxval(abs(correction)))
      end subroutine correct
   end subroutine keep_null_pairs

   !> Solves with factors, or with their transpose, in place.
   subroutine solve(solver, transposed, x, error)
      class(real_linear_solver_type), intent(inout) :: solver
      logical, intent(in) :: transposed
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (transposed) then
         call solver%solve_adjoint(x, error)
      else
         call solver%solve(x, error)
      end if
   end subroutine solve

   !> Bounds |lambda| (1/s) of the eigenvalues of pairs that are taken as null vectors of K, to first order, for each
   !> |G| <= |Y^T K X|: that of lambda^2 Y^T M X + G or, where it is less, twice that of lambda Y^T R X + G, which is the smaller
   !> root of all three at most. Huge if both may be singular.
   real(wp) function radius_of_zeros(mass, damping, y, x, forms) result(radius)
      !> M and R.
      type(csr_matrix_type), intent(in) :: mass, damping
      !> Y and X, n x k, and |Y^T K X|.
      real(wp), intent(in) :: y(:, :), x(:, :), forms(:, :)

      radius = 0
      if (size(x, 2) > 0) radius = min(sqrt(largest_change(mass)), 2*min(largest_change(damping), huge(radius)/4))

   contains

      ! The spectral radius of |(Y^T A X)^-1| |G|, bounded by a power iteration (Collatz, Math. Z. 48 (1942)).
      real(wp) function largest_change(a)
         type(csr_matrix_type), intent(in) :: a
         integer, parameter :: most_turns = 20
         real(wp), dimension(size(x, 2), size(x, 2)) :: form, inverse
         real(wp) :: change(size(x, 2)), image(size(x, 2))
         integer :: pivots(size(x, 2)), info, turn, j

         form = matmul(transpose(y), a%product(x))
         inverse = 0
         do j = 1, size(inverse, 1)
            inverse(j, j) = 1
         end do
         call dgesv(size(form, 1), size(form, 1), form, size(form, 1), pivots, inverse, size(form, 1), info)
         largest_change = huge(1.0_wp)
         if (info /= 0) return
         change = 1
         do turn = 1, most_turns
            image = matmul(abs(inverse), matmul(forms, change))
            largest_change = min(largest_change, maxval(image/change))
            change = max(image/max(maxval(image), tiny(1.0_wp)), epsilon(1.0_wp))
         end do
      end function largest_change
   end function radius_of_zeros
end module kschur_null_pairs
