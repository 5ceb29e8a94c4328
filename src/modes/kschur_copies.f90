!> Copies of a multiple eigenvalue that an iteration gave the same shape, or nearly so.
module kschur_copies
   use kschur_backward_error, only: backward_errors
   use kschur_effort, only: effort_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_kinds, only: long, wp
   use kschur_lapack, only: dznrm2
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_refine, only: factor_beside, step_from
   use kschur_saddle, only: saddle_blocks
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: any_equal, separate_copies

   ! Of a unit vector no more is left where it depends on others.
   real(wp), parameter :: dependent = 1.0e-2_wp

contains

   !> Whether eigenvalues may be copies of one.
   pure logical function any_equal(lambda)
      complex(wp), intent(in) :: lambda(:)
      integer :: j

      any_equal = any([(any(are_equal(lambda(:j - 1), lambda(j))), j=1, size(lambda))])
   end function any_equal

   !> Puts another shape of the same eigenvalue in the place of each that lies in the span of earlier ones: by inverse iteration
   !> beside them, from a random vector. A defective eigenvalue has none, and there the shape stays.
   subroutine separate_copies(problem, factors, above, solver, pairs, separated, effort, error, monitor)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      !> The backward error that is good enough.
      real(wp), intent(in) :: above
      class(complex_linear_solver_type), intent(inout) :: solver
      type(eigenpairs_type), intent(inout) :: pairs
      !> Which have another shape.
      logical, intent(out) :: separated(:)
      class(effort_type), intent(inout) :: effort
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      type(csr_matrix_type) :: blocks(3)
      type(eigenpairs_type) :: span, pair
      integer(long) :: random_state
      real(wp) :: left
      complex(wp) :: s
      integer :: i, j

      separated = .false.
      random_state = state_of_seed(1)
      do j = 2, size(separated)
         if (.not. any(are_equal(pairs%lambda(:j - 1), pairs%lambda(j)))) cycle
         span = span_before(pairs, j)
         pair = chosen_pairs(pairs, [(i == j, i=1, size(separated))])
         call leave_rest(span, pair, left)
         if (left > dependent) cycle
         if (is_stopped(monitor)) return
         if (blocks(1)%rows == 0) call saddle_blocks(problem, factors, blocks, error)
         if (allocated(error)) return
         call factor_beside(problem, blocks, pairs%lambda(j), solver, s, error)
         if (.not. allocated(error)) then
            call effort%add_factors(solver)
            call iterate_beside(problem, factors, above, solver, s, span, random_state, pair, separated(j), error)
         end if
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_convergence, error_cancelled])) return
            deallocate (error)
         end if
         if (.not. separated(j)) cycle
         pairs%lambda(j) = pair%lambda(1)
         pairs%phi(:, j) = pair%phi(:, 1)
         pairs%xi(:, j) = pair%xi(:, 1)
      end do
   end subroutine separate_copies

   elemental logical function are_equal(first, second)
      complex(wp), intent(in) :: first, second

      are_equal = abs(first - second) <= same_value*abs(second) .and. abs(second) > 0
   end function are_equal

   ! Orthonormal shapes that span those of the pairs before j that have its eigenvalue, with their multipliers.
   function span_before(pairs, j) result(span)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: j
      type(eigenpairs_type) :: span, next
      real(wp) :: left
      integer :: i, k

      span = chosen_pairs(pairs, spread(.false., 1, size(pairs%lambda)))
      do i = 1, j - 1
         if (.not. are_equal(pairs%lambda(i), pairs%lambda(j))) cycle
         next = chosen_pairs(pairs, [(k == i, k=1, size(pairs%lambda))])
         call leave_rest(span, next, left)
         if (left > dependent) call append_pairs(span, next)
      end do
   end function span_before

   ! Of a pair what lies outside a span, of unit norm.
   subroutine leave_rest(span, pair, left)
      type(eigenpairs_type), intent(in) :: span
      type(eigenpairs_type), intent(inout) :: pair
      !> The part of its norm that does.
      real(wp), intent(out) :: left
      complex(wp) :: part
      real(wp) :: length
      integer :: i, pass

      left = 1
      do pass = 1, 3
         length = dznrm2(pair%rows(), pair%phi(:, 1), 1)
         if (pass > 1) left = left*length
         if (.not. length > 0) then
            left = 0
            return
         end if
         pair%phi = pair%phi/length
         pair%xi = pair%xi/length
         if (pass == 3) return
         do i = 1, size(span%lambda)
            part = dot_product(span%phi(:, i), pair%phi(:, 1))
            pair%phi(:, 1) = pair%phi(:, 1) - part*span%phi(:, i)
            pair%xi(:, 1) = pair%xi(:, 1) - part*span%xi(:, i)
         end do
      end do
   end subroutine leave_rest

   ! An eigenvector of the eigenvalue of a pair outside a span.
   subroutine iterate_beside(problem, factors, above, solver, s, span, random_state, pair, found, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: factors(:), above
      !> Factored at s.
      class(complex_linear_solver_type), intent(inout) :: solver
      complex(wp), intent(in) :: s
      type(eigenpairs_type), intent(in) :: span
      integer(long), intent(inout) :: random_state
      type(eigenpairs_type), intent(inout) :: pair
      logical, intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: steps = 5
      ! A shape of its own is worth digits: the eigenvalues of what is taken out of it are not known better.
      real(wp), parameter :: rough = 1.0e-10_wp
      complex(wp), allocatable :: y(:, :)
      complex(wp) :: before, told
      real(wp) :: random(pair%rows()), errors(1), left
      integer :: step

      errors = huge(1.0_wp)
      found = .false.
      before = pair%lambda(1)
      call random_vector(random_state, random)
      pair%phi(:, 1) = random
      call leave_rest(span, pair, left)
      do step = 1, steps
         call step_from(problem, solver, s, pair, 1, y, told, error)
         if (allocated(error)) return
         pair%phi = y(:pair%rows(), :)
         pair%xi(:, 1) = factors*y(pair%rows() + 1:, 1)
         if (are_equal(told, before)) pair%lambda = told
         call leave_rest(span, pair, left)
         if (.not. left > dependent) cycle
         errors = backward_errors(problem, pair)
         if (errors(1) <= above) exit
      end do
      found = left > dependent .and. errors(1) <= max(rough, above)
   end subroutine iterate_beside
end module kschur_copies
