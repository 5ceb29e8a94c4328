!> Which modes of a problem are which of a problem that differs a little: each mode there as a sum of the modes here, by
!> left and right vectors in the space of states.
module kschur_following
   use kschur_kinds, only: wp
   use kschur_mac, only: shape_assurance
   use kschur_mode_groups, only: form_between, solve_small
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_tolerances, only: equal_value
   implicit none
   private
   public :: are_equal, is_ambiguous, match_modes, mode_shares, swapping_pair

   ! Below this a mode is another one.
   real(wp), parameter :: least_share = 0.3_wp
   ! A mode that keeps less than the first and shares more than the second with another one may be either.
   real(wp), parameter :: clear = 0.8_wp, mixed = 0.4_wp

contains

   !> The part of each mode before, i, in each mode after, j, of shapes of equal length: |c_ij| of phi_j = sum of c_ij phi_i
   !> as far as the left vectors before see it. Where an unsymmetric problem has none, the shapes take their place.
   function mode_shares(problem, before, after) result(shares)
      !> That of the modes before.
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: before, after
      real(wp) :: shares(size(before%eigenvalues), size(after%eigenvalues))
      complex(wp), allocatable :: left(:, :), here(:, :), there(:, :)
      logical :: singular
      integer :: i

      allocate (left, source=before%eigenvectors)
      if (allocated(before%left_eigenvectors)) then
         left = conjg(before%left_eigenvectors)
      else if (.not. problem%symmetric) then
         left = conjg(before%eigenvectors)
      end if
      ! A mode without a left vector is seen by its shape.
      do i = 1, size(left, 2)
         if (.not. abs(left(1, i)) >= 0) left(:, i) = conjg(before%eigenvectors(:, i))
      end do
      allocate (here(size(left, 2), size(left, 2)), source=states_between(problem, left, before%eigenvalues, before))
      allocate (there(size(shares, 1), size(shares, 2)), source=states_between(problem, left, before%eigenvalues, after))
      call solve_small(here, there, singular)
      shares = abs(there)*spread(lengths(before), 2, size(shares, 2))/spread(lengths(after), 1, size(shares, 1))
      ! Double zeros have no states of their own.
      if (singular .or. .not. all(shares <= huge(1.0_wp))) &
         shares = sqrt(shape_assurance(before%eigenvectors, after%eigenvectors))
      shares = min(shares, 1.0_wp)
   end function mode_shares

   ! left_i^T ((lambda_i + lambda_j) M + R) phi_j.
   function states_between(problem, left, lambda, result) result(form)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: left(:, :), lambda(:)
      type(modal_result_type), intent(in) :: result
      complex(wp) :: form(size(left, 2), size(result%eigenvalues))

      form = form_between(left, problem%mass, result%eigenvectors)
      form = form*(spread(lambda, 2, size(form, 2)) + spread(result%eigenvalues, 1, size(form, 1))) + &
         form_between(left, problem%damping, result%eigenvectors)
   end function states_between

   pure function lengths(result)
      type(modal_result_type), intent(in) :: result
      real(wp) :: lengths(size(result%eigenvalues))
      integer :: j

      lengths = [(norm2(abs(result%eigenvectors(:, j))), j=1, size(lengths))]
   end function lengths

   !> For each mode before the one that it is after, 0 where it is none: the largest share first.
   function match_modes(shares) result(after)
      real(wp), intent(in) :: shares(:, :)
      integer :: after(size(shares, 1))
      logical :: free(size(shares, 1), size(shares, 2))
      integer :: place(2)

      after = 0
      free = .true.
      do while (any(free))
         place = maxloc(shares, free)
         if (shares(place(1), place(2)) < least_share) exit
         after(place(1)) = place(2)
         free(place(1), :) = .false.
         free(:, place(2)) = .false.
      end do
   end function match_modes

   !> Whether a mode may be one or the other of two that are not equal, and that are not those of a mode equal to it.
   logical function is_ambiguous(shares, after, lambda, lambda_after)
      real(wp), intent(in) :: shares(:, :)
      !> As `match_modes` gave them.
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
