!> Matches the modes of two similar problems: each mode of one is expanded in modes of the other, by left and right vectors in
!> state space. Modes of equal eigenvalues are treated as one space, since their basis is arbitrary.
module kschur_following
   use kschur_kinds, only: wp
   use kschur_mode_groups, only: form_between, solve_small
   use kschur_principal_pairs, only: pair_spaces
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_sorting, only: positions
   use kschur_tolerances, only: dependent_state, equal_value
   implicit none
   private
   public :: are_equal, follow_modes, is_ambiguous, place_type, settle_spaces, swapping_pair

   !> A problem and its modes at a value of the parameter.
   type :: place_type
      real(wp) :: value = 0
      type(modal_problem_type) :: problem
      !> After `settle_spaces` shapes have unit norm, and are orthonormal within each space.
      type(modal_result_type) :: result
      !> For each mode, the first mode with the same eigenvalue: the space it belongs to.
      integer, allocatable :: space(:)
   end type place_type

   ! Smallest share of a mode for a match.
   real(wp), parameter :: least_share = 0.3_wp
   ! A match is ambiguous if a mode keeps less than `clear` of itself and another mode has more than `mixed` of it.
   real(wp), parameter :: clear = 0.8_wp, mixed = 0.4_wp

contains

   !> Groups the modes of a solved point by equal eigenvalues to spaces, and orthonormalises the shapes of each. A shape that
   !> depends on earlier ones, as for a defective eigenvalue, forms its own space.
   subroutine settle_spaces(place)
      type(place_type), intent(inout) :: place
      complex(wp) :: rest(place%problem%unknowns())
      integer :: i, j, pass

      associate (phi => place%result%eigenvectors, lambda => place%result%eigenvalues)
         if (allocated(place%space)) deallocate (place%space)
         allocate (place%space, source=[(j, j=1, size(lambda))])
         do j = 1, size(lambda)
            phi(:, j) = phi(:, j)/norm2(abs(phi(:, j)))
            i = place%space(findloc(are_equal(lambda(:j), lambda(j)), .true., 1))
            if (i == j) cycle
            rest = phi(:, j)
            do pass = 1, 2
               call orthogonalize_against(phi(:, :j - 1), place%space(:j - 1) == i, rest)
            end do
            if (norm2(abs(rest)) < dependent_state) cycle
            phi(:, j) = rest/norm2(abs(rest))
            place%space(j) = i
         end do
      end associate
   end subroutine settle_spaces

   ! Subtracts the components of x along the marked orthonormal columns.
   subroutine orthogonalize_against(phi, is_in, x)
      complex(wp), intent(in) :: phi(:, :)
      logical, intent(in) :: is_in(:)
      complex(wp), intent(inout) :: x(:)
      integer :: i

      do i = 1, size(is_in)
         if (is_in(i)) x = x - dot_product(phi(:, i), x)*phi(:, i)
      end do
   end subroutine orthogonalize_against

   !> Finds for each mode before its match after, and rotates the shapes of equal eigenvalues after to those before. Zeros are
   !> matched with zeros, by shapes, since a double zero has no complete states; other modes with others; the rest, as when a
   !> motion becomes constrained or free, by shapes.
   subroutine follow_modes(before, after, match, shares)
      !> After `settle_spaces`.
      type(place_type), intent(in) :: before
      type(place_type), intent(inout) :: after
      !> 0: no match.
      integer, allocatable, intent(out) :: match(:)
      !> Share of each mode before, i, in each mode after, j: |c_ij| of phi_j = sum of c_ij phi_i, projected by the left vectors
      !> before.
      real(wp), allocatable, intent(out) :: shares(:, :)
      complex(wp), dimension(size(before%space), size(after%space)) :: c, products
      logical, dimension(size(before%space), size(after%space)) :: zeros, zeros_after
      integer :: n, m, j

      n = size(before%space)
      m = size(after%space)
      allocate (match(n), source=0)
      zeros = spread(is_zero(before%result%eigenvalues), 2, m)
      zeros_after = spread(is_zero(after%result%eigenvalues), 1, n)
      products = matmul(conjg(transpose(before%result%eigenvectors)), after%result%eigenvectors)
      c = merge(products, (0.0_wp, 0.0_wp), zeros .and. zeros_after)
      call expand_states(before, after, positions(.not. is_zero(before%result%eigenvalues)), &
         positions(.not. is_zero(after%result%eigenvalues)), products, c)
      call pair([(j, j=1, n)], [(j, j=1, m)])
      associate (rows => positions(match == 0), columns => positions([(all(match /= j), j=1, m)]))
         c(rows, columns) = merge(products(rows, columns), c(rows, columns), zeros(rows, columns) .neqv. zeros_after(rows, columns))
         call pair(rows, columns)
      end associate
      allocate (shares, source=min(abs(c), 1.0_wp))

   contains

      ! Matches some modes before with some after, and rotates the shapes in c, products and the result.
      subroutine pair(rows, columns)
         integer, intent(in) :: rows(:), columns(:)
         complex(wp), allocatable :: turn_before(:, :), turn_after(:, :)
         integer, allocatable :: partner(:)

         if (min(size(rows), size(columns)) == 0) return
         call pair_spaces(c(rows, columns), first_of(before%space(rows)), first_of(after%space(columns)), least_share, partner, &
            turn_before, turn_after)
         match(rows) = merge(columns(max(partner, 1)), 0, partner > 0)
         associate (phi => after%result%eigenvectors)
            phi(:, columns) = matmul(phi(:, columns), turn_after)
         end associate
         c(:, columns) = matmul(c(:, columns), turn_after)
         c(rows, :) = matmul(conjg(transpose(turn_before)), c(rows, :))
         products(:, columns) = matmul(products(:, columns), turn_after)
         products(rows, :) = matmul(conjg(transpose(turn_before)), products(rows, :))
      end subroutine pair
   end subroutine follow_modes

   ! For each entry, the position of the first equal one.
   pure function first_of(numbers) result(first)
      integer, intent(in) :: numbers(:)
      integer :: first(size(numbers))
      integer :: i

      do i = 1, size(numbers)
         first(i) = findloc(numbers, numbers(i), 1)
      end do
   end function first_of

   ! Computes c for modes with nonzero eigenvalues: expands states after in states before by left vectors. Defective ones are
   ! compared by shapes.
   subroutine expand_states(before, after, rows, columns, products, c)
      type(place_type), intent(in) :: before, after
      integer, intent(in) :: rows(:), columns(:)
      !> Products of all shapes, phi_i^* phi_j.
      complex(wp), intent(in) :: products(:, :)
      complex(wp), intent(inout) :: c(:, :)
      complex(wp) :: left(before%problem%unknowns(), size(rows)), own(size(rows), size(rows)), cross(size(rows), size(columns))
      logical :: singular
      integer :: i

      if (min(size(rows), size(columns)) == 0) return
      associate (result => before%result, problem => before%problem)
         left = result%eigenvectors(:, rows)
         if (allocated(result%left_eigenvectors)) then
            left = conjg(result%left_eigenvectors(:, rows))
         else if (.not. problem%symmetric) then
            left = conjg(left)
         end if
         ! A mode without left vector is compared by its shape.
         do i = 1, size(left, 2)
            if (.not. abs(left(1, i)) >= 0) left(:, i) = conjg(result%eigenvectors(:, rows(i)))
         end do
         own = state_products(problem, left, result%eigenvalues(rows), result, rows)
         cross = state_products(problem, left, result%eigenvalues(rows), after%result, columns)
      end associate
      call solve_small(own, cross, singular)
      c(rows, columns) = products(rows, columns)
      if (.not. singular .and. all(abs(cross) <= huge(1.0_wp))) c(rows, columns) = cross
   end subroutine expand_states

   ! Whether an eigenvalue is exactly zero, as that of a rigid motion is.
   elemental logical function is_zero(lambda)
      complex(wp), intent(in) :: lambda

      is_zero = .not. abs(lambda) > 0
   end function is_zero

   ! Products left_i^T ((lambda_i + lambda_j) M + R) phi_j for some modes j, by which states are biorthogonal.
   function state_products(problem, left, lambda, result, modes) result(form)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: left(:, :), lambda(:)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: modes(:)
      complex(wp) :: form(size(left, 2), size(modes))
      complex(wp) :: phi(size(left, 1), size(modes))

      phi = result%eigenvectors(:, modes)
      form = form_between(left, problem%mass, phi)
      form = form*(spread(lambda, 2, size(form, 2)) + spread(result%eigenvalues(modes), 1, size(form, 1))) + &
         form_between(left, problem%damping, phi)
   end function state_products

   !> Whether a mode may match either of two modes with different eigenvalues.
   logical function is_ambiguous(shares, after, lambda, lambda_after)
      real(wp), intent(in) :: shares(:, :)
      !> As returned by `follow_modes`.
      integer, intent(in) :: after(:)
      !> Eigenvalues before and after (1/s).
      complex(wp), intent(in) :: lambda(:), lambda_after(:)
      integer :: i, j

      is_ambiguous = .true.
      do i = 1, size(after)
         if (after(i) == 0) cycle
         if (shares(i, after(i)) >= clear) cycle
         do j = 1, size(lambda_after)
            if (j == after(i) .or. are_equal(lambda_after(j), lambda_after(after(i)))) cycle
            if (any(after == j .and. are_equal(lambda, lambda(i)))) cycle
            if (shares(i, j) > mixed) return
         end do
      end do
      is_ambiguous = .false.
   end function is_ambiguous

   !> Whether two eigenvalues are equal to rounding.
   elemental logical function are_equal(a, b)
      complex(wp), intent(in) :: a, b

      are_equal = abs(a - b) <= equal_value*max(abs(a), abs(b))
   end function are_equal

   !> Finds two modes whose damped frequencies change order, and the fraction of the step at which they are equal; zeros if
   !> none.
   subroutine swapping_pair(before, after, match, pair, part)
      !> Eigenvalues (1/s).
      complex(wp), intent(in) :: before(:), after(:)
      integer, intent(in) :: match(:)
      integer, intent(out) :: pair(2)
      real(wp), intent(out) :: part
      real(wp) :: first, last
      integer :: i, j

      pair = 0
      part = 0
      do i = 1, size(match)
         do j = i + 1, size(match)
            if (min(match(i), match(j)) == 0) cycle
            first = aimag(before(i) - before(j))
            last = aimag(after(match(i)) - after(match(j)))
            if (.not. first*last < 0) cycle
            if (are_equal(before(i), before(j)) .or. are_equal(after(match(i)), after(match(j)))) cycle
            pair = [i, j]
            part = first/(first - last)
            return
         end do
      end do
   end subroutine swapping_pair
end module kschur_following
