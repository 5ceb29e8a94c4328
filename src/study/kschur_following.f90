!> Which modes of a problem are which of a problem that differs a little: each mode there as a sum of the modes here, by
!> left and right vectors in the space of states. Modes of one eigenvalue are one space, whose basis is any.
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

   !> A problem and its modes, at a value of the parameter.
   type :: place_type
      real(wp) :: value = 0
      type(modal_problem_type) :: problem
      !> After `settle_spaces` shapes are of unit length, and orthonormal in each space.
      type(modal_result_type) :: result
      !> For each mode the first of those whose eigenvalue is the same: the space to which it belongs.
      integer, allocatable :: space(:)
   end type place_type

   ! Below this a mode is another one.
   real(wp), parameter :: least_share = 0.3_wp
   ! A mode that keeps less than the first and shares more than the second with another one may be either.
   real(wp), parameter :: clear = 0.8_wp, mixed = 0.4_wp

contains

   !> Finds the spaces of a place that was solved, and gives each an orthonormal basis. A shape that depends on those before it,
   !> as of a defective eigenvalue, stays alone.
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
               call subtract_space(phi(:, :j - 1), place%space(:j - 1) == i, rest)
            end do
            if (norm2(abs(rest)) < dependent_state) cycle
            phi(:, j) = rest/norm2(abs(rest))
            place%space(j) = i
         end do
      end associate
   end subroutine settle_spaces

   subroutine subtract_space(phi, is_in, x)
      complex(wp), intent(in) :: phi(:, :)
      logical, intent(in) :: is_in(:)
      complex(wp), intent(inout) :: x(:)
      integer :: i

      do i = 1, size(is_in)
         if (is_in(i)) x = x - dot_product(phi(:, i), x)*phi(:, i)
      end do
   end subroutine subtract_space

   !> Tells for each mode before which one it is after, and turns the shapes of equal eigenvalues after to those that they were
   !> before. Zeros are compared with zeros, by their shapes, as a double zero has no state of its own, and other modes with others;
   !> what is left, where a motion is held or let go, by shapes.
   subroutine follow_modes(before, after, match, shares)
      !> Settled.
      type(place_type), intent(in) :: before
      type(place_type), intent(inout) :: after
      !> 0: it is none.
      integer, allocatable, intent(out) :: match(:)
      !> The part of each mode before, i, in each mode after, j: |c_ij| of phi_j = sum of c_ij phi_i as far as the left vectors
      !> before see it.
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

   ! For each entry the place of the first one that is equal.
   pure function first_of(numbers) result(first)
      integer, intent(in) :: numbers(:)
      integer :: first(size(numbers))
      integer :: i

      do i = 1, size(numbers)
         first(i) = findloc(numbers, numbers(i), 1)
      end do
   end function first_of

   ! c of the modes whose numbers are given, which are no zeros. Where they are defective they are seen by their shapes.
   subroutine expand_states(before, after, rows, columns, products, c)
      type(place_type), intent(in) :: before, after
      integer, intent(in) :: rows(:), columns(:)
      !> Of all shapes, phi_i^* phi_j.
      complex(wp), intent(in) :: products(:, :)
      complex(wp), intent(inout) :: c(:, :)
      complex(wp) :: left(before%problem%unknowns(), size(rows)), here(size(rows), size(rows)), there(size(rows), size(columns))
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
         ! A mode without a left vector is seen by its shape.
         do i = 1, size(left, 2)
            if (.not. abs(left(1, i)) >= 0) left(:, i) = conjg(result%eigenvectors(:, rows(i)))
         end do
         here = states_between(problem, left, result%eigenvalues(rows), result, rows)
         there = states_between(problem, left, result%eigenvalues(rows), after%result, columns)
      end associate
      call solve_small(here, there, singular)
      c(rows, columns) = products(rows, columns)
      if (.not. singular .and. all(abs(there) <= huge(1.0_wp))) c(rows, columns) = there
   end subroutine expand_states

   elemental logical function is_zero(lambda)
      complex(wp), intent(in) :: lambda

      is_zero = .not. abs(lambda) > 0
   end function is_zero

   ! left_i^T ((lambda_i + lambda_j) M + R) phi_j of some modes j.
   function states_between(problem, left, lambda, result, modes) result(form)
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
   end function states_between

   !> Whether a mode may be one or the other of two that are not equal, and that are not those of a mode equal to it.
   logical function is_ambiguous(shares, after, lambda, lambda_after)
      real(wp), intent(in) :: shares(:, :)
      !> As `follow_modes` gave them.
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

   !> Whether two eigenvalues are one, as far as rounding lets one see.
   elemental logical function are_equal(a, b)
      complex(wp), intent(in) :: a, b

      are_equal = abs(a - b) <= equal_value*max(abs(a), abs(b))
   end function are_equal

   !> Two modes whose damped frequencies change their order, and the part of the way where they are equal; no modes where
   !> there are none.
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
