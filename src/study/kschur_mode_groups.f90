!> Modes of a result that share an eigenvalue, with their left vectors: quantities of the group do not depend on the choice of
!> its basis, those of a single member do.
module kschur_mode_groups
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesv
   use kschur_memory, only: complex_bytes
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: equal_value
   implicit none
   private
   public :: mode_group_type, bytes_of_groups, check_modes_of, form_between, group_of, solve_small

   !> k modes of one eigenvalue.
   type :: mode_group_type
      !> Their positions in the result.
      integer, allocatable :: member(:)
      !> Their eigenvalue (1/s).
      complex(wp) :: lambda
      !> Shapes and multipliers, n x k and m x k.
      complex(wp), allocatable :: phi(:, :), xi(:, :)
      !> Shapes and multipliers of the transposed problem, conjugates of left vectors; phi and xi for a symmetric problem.
      complex(wp), allocatable :: chi(:, :), eta(:, :)
   contains
      !> chi^T (2 lambda M + R) phi, k x k: the derivative of the problem by lambda, the modal a of a single mode.
      procedure :: derivative
   end type mode_group_type

contains

   !> Fails if a result does not belong to the problem, or left vectors of an unsymmetric problem are missing.
   subroutine check_modes_of(problem, result, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(out) :: error

      if (.not. (allocated(result%eigenvectors) .and. allocated(result%multipliers))) then
         call new_error(error, error_usage, "the result holds no modes: solve first")
      else if (any([size(result%eigenvectors, 1), size(result%multipliers, 1)] /= &
         [problem%unknowns(), problem%multipliers()])) then
         call new_error(error, error_usage, "the result is not one of this problem: its shapes have other lengths")
      else if (.not. (problem%symmetric .or. allocated(result%left_eigenvectors))) then
         call new_error(error, error_usage, &
            "the problem is unsymmetric, and the result has no left vectors: ask the solve for them (left)")
      end if
   end subroutine check_modes_of

   !> Memory in bytes of the largest group and its work arrays.
   pure real(wp) function bytes_of_groups(problem, result) result(bytes)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      integer, parameter :: vectors = 6
      integer :: j, most

      most = 1
      do j = 1, size(result%eigenvalues)
         most = max(most, count(are_equal(result%eigenvalues, result%eigenvalues(j))))
      end do
      bytes = vectors*most*complex_bytes*(real(problem%unknowns(), wp) + problem%multipliers())
   end function bytes_of_groups

   ! Whether two eigenvalues are equal to rounding.
   pure elemental logical function are_equal(lambda, other)
      complex(wp), intent(in) :: lambda, other

      are_equal = abs(lambda - other) <= equal_value*abs(other)
   end function are_equal

   !> Returns the group of mode j.
   function group_of(problem, result, j) result(group)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: j
      type(mode_group_type) :: group
      integer :: i, k

      group%lambda = result%eigenvalues(j)
      allocate (group%member, source=pack([(i, i=1, size(result%eigenvalues))], are_equal(result%eigenvalues, group%lambda)))
      k = size(group%member)
      allocate (group%phi(problem%unknowns(), k), group%chi(problem%unknowns(), k))
      allocate (group%xi(problem%multipliers(), k), group%eta(problem%multipliers(), k))
      do i = 1, k
         group%phi(:, i) = result%eigenvectors(:, group%member(i))
         group%xi(:, i) = result%multipliers(:, group%member(i))
         if (problem%symmetric) cycle
         group%chi(:, i) = conjg(result%left_eigenvectors(:, group%member(i)))
         group%eta(:, i) = conjg(result%left_multipliers(:, group%member(i)))
      end do
      if (.not. problem%symmetric) return
      group%chi = group%phi
      group%eta = group%xi
   end function group_of

   function derivative(self, problem)
      class(mode_group_type), intent(in) :: self
      type(modal_problem_type), intent(in) :: problem
      complex(wp) :: derivative(size(self%member), size(self%member))

      derivative = 2*self%lambda*form_between(self%chi, problem%mass, self%phi) + &
         form_between(self%chi, problem%damping, self%phi)
   end function derivative

   !> x^T A y.
   function form_between(x, matrix, y) result(form)
      complex(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp) :: form(size(x, 2), size(y, 2))
      complex(wp) :: product(size(x, 1), size(y, 2))

      product = 0
      call matrix%add_product((1.0_wp, 0.0_wp), y, product)
      form = matmul(transpose(x), product)
   end function form_between

   !> b := A^{-1} b for a small dense matrix; `singular` if it has a zero pivot.
   subroutine solve_small(a, b, singular)
      complex(wp), intent(in) :: a(:, :)
      complex(wp), intent(inout) :: b(:, :)
      logical, intent(out) :: singular
      complex(wp) :: factors(size(a, 1), size(a, 1))
      integer :: pivots(size(a, 1)), info

      factors = a
      call zgesv(size(a, 1), size(b, 2), factors, max(1, size(a, 1)), pivots, b, max(1, size(b, 1)), info)
      singular = info /= 0
   end subroutine solve_small
end module kschur_mode_groups
