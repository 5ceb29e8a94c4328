!> A Lanczos decomposition of a self-adjoint operator, grown step by step in the
!> inner product x^T B y, B symmetric and positive semidefinite.
!>
!> Sources: Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48 (1987), semidefinite B;
!> Daniel, Gragg, Kaufman, Stewart, Math. Comp. 30 (1976), orthogonalisation twice
!> where needed; Hernandez, Roman, Tomas, Parallel Computing 33 (2007), its norm
!> from Pythagoras.
module kschur_lanczos_decomposition
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_library, error_memory
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_tall_products_real, only: inner_products, subtract_combinations
   use kschur_text, only: text
   implicit none
   private
   public :: decomposition_type, start, expand, fresh_direction, breakdown

   !> What is left of a vector in the span of the basis, or in the null space of B.
   real(wp), parameter :: breakdown = 100*epsilon(1.0_wp)
   ! A second orthogonalisation when the first left less than this of the norm.
   real(wp), parameter :: enough_left = 0.7_wp
   ! Convergence is tested after so many steps, or after this part of the dimension.
   integer, parameter :: check_every = 8, check_part = 16

   !> A Lanczos decomposition C V = V T + beta v e^T, V^T B V = I: V are the columns
   !> 1..dimension of `basis`, v is the next one, e the last unit vector. B V is not
   !> kept: V^T (B y) needs one product with B a step, as (B V)^T y would, and half
   !> the memory. The first `locked` columns are converged Ritz vectors.
   type :: decomposition_type
      real(wp), allocatable :: basis(:, :)
      !> The upper triangle of T.
      real(wp), allocatable :: projected(:, :)
      !> B v, but for the last orthogonalisation of v.
      real(wp), allocatable :: image(:, :)
      integer :: dimension = 0
      integer :: locked = 0
      real(wp) :: beta = 0
      !> Whether the basis spans all there is: beta = 0 and v does not exist.
      logical :: exhausted = .false.
      integer(long) :: random_state = 1
      !> Lower bounds of the norms of C and of B.
      real(wp) :: scale = 0, metric_scale = 0
      real(wp) :: dropped = 0
   end type decomposition_type

contains

   !> Allocates the decomposition and fills its first column; enlarges one that is kept.
   !> Fails where memory does.
   subroutine start(operator, wanted, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      integer, intent(in) :: wanted
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: basis(:, :), projected(:, :)
      integer :: n, m, k, status

      n = operator%order()
      m = options%subspace
      ! A restart, and the verification, need two columns beside the wanted ones.
      if (options%max_restarts > 1) m = max(m, wanted + 2)
      m = max(min(m, n), 1)
      k = d%dimension
      if (allocated(d%basis)) then
         if (size(d%projected, 2) >= m) return
      end if
      allocate (basis(n, m + 1), stat=status)
      if (status == 0 .and. .not. allocated(d%image)) allocate (d%image(n, 1), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "there is no memory for a Lanczos basis of "// &
            text(m + 1)//" vectors of length "//text(n))
         return
      end if
      allocate (projected(m, m), source=0.0_wp)
      if (k > 0) then
         basis(:, :k + 1) = d%basis(:, :k + 1)
         projected(:k, :k) = d%projected(:k, :k)
      end if
      call move_alloc(basis, d%basis)
      call move_alloc(projected, d%projected)
      if (k > 0) return
      d%random_state = state_of_seed(options%seed)
      call fresh_direction(operator, options, d, 0, statistics, error)
   end subroutine start

   !> Makes column k+1 a filtered random vector B-orthonormal to columns 1..k; or
   !> finds the basis exhausted.
   subroutine fresh_direction(operator, options, d, k, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      real(wp) :: coefficients(k), length
      real(wp), allocatable :: x(:, :)
      integer :: attempt, i

      allocate (x(size(d%basis, 1), 1))
      coefficients = 0
      do attempt = 1, attempts
         call random_vector(d%random_state, d%basis(:, k + 1))
         call orthogonalize(operator, d, k, 0.0_wp, .true., coefficients, length, error)
         do i = 1, options%filter
            if (allocated(error) .or. .not. length > 0) exit
            x(:, 1) = d%basis(:, k + 1)
            call operator%apply(x, d%basis(:, k + 1:k + 1), error)
            if (allocated(error)) return
            statistics%operator_applications = statistics%operator_applications + 1
            call orthogonalize(operator, d, k, breakdown*d%scale, .true., coefficients, length, error)
         end do
         if (allocated(error) .or. length > 0) return
      end do
      d%exhausted = .true.
   end subroutine fresh_direction

   ! Orthonormalises column k+1 against columns 1..k by classical Gram-Schmidt;
   ! `length` is the B-norm that was left, zero where nothing but rounding is.
   subroutine orthogonalize(operator, d, k, negligible, fresh, coefficients, length, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      ! A B-norm that is rounding of what the column was made of.
      real(wp), intent(in) :: negligible
      ! Whether the column may lie in the null space of B, as a random one may. A Lanczos vector
      ! gathers a part there too, which grows from step to step and does no harm until the end.
      logical, intent(in) :: fresh
      ! What was subtracted is added to the first k.
      real(wp), intent(inout) :: coefficients(:)
      real(wp), intent(out) :: length
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: passes = 3
      real(wp) :: correction(k, 1), before, smallest, y_squared
      integer :: pass

      smallest = negligible
      associate (y => d%basis(:, k + 1:k + 1))
         do pass = 1, passes
            call operator%apply_metric(y, d%image, error)
            if (allocated(error)) return
            before = sqrt(max(dot(y, d%image), 0.0_wp))
            y_squared = max(dot(y, y), tiny(1.0_wp))
            d%metric_scale = max(d%metric_scale, before**2/y_squared)
            if (pass == 1) smallest = max(smallest, breakdown*before)
            if (fresh) smallest = max(smallest, sqrt(breakdown*d%metric_scale*y_squared))
            length = 0
            if (.not. before > smallest) exit
            call inner_products(d%basis, d%image, correction)
            call subtract_combinations(d%basis(:, :k), correction, y)
            coefficients(:k) = coefficients(:k) + correction(:, 1)
            length = sqrt(max(before**2 - sum(correction**2), 0.0_wp))
            if (length > enough_left*before) exit
            if (pass == passes) length = 0
         end do
         if (length > 0) then
            y = y/length
            d%image = d%image/length
         end if
      end associate
   end subroutine orthogonalize

   !> Lanczos steps up to the next test of convergence, the first when there are as
   !> many as are wanted. Fails on an operator that is not finite.
   subroutine expand(operator, wanted, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      integer, intent(in) :: wanted
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: coefficients(size(d%projected, 2))
      integer :: k, last
      integer(long) :: started

      last = max(d%dimension + max(check_every, d%dimension/check_part), wanted)
      do k = d%dimension + 1, min(last, size(d%projected, 2))
         if (d%exhausted) return
         call operator%apply(d%basis(:, k:k), d%basis(:, k + 1:k + 1), error)
         if (allocated(error)) return
         statistics%operator_applications = statistics%operator_applications + 1
         started = clock()
         call subtract_neighbours(d, k, coefficients)
         if (.not. abs(coefficients(k)) <= huge(1.0_wp)) call new_error(error, error_library, &
            "the operator made a vector that is not finite")
         if (allocated(error)) return
         d%scale = max(d%scale, maxval(abs(coefficients(:k))))
         call orthogonalize(operator, d, k, breakdown*d%scale, .false., coefficients, d%beta, error)
         if (allocated(error)) return
         statistics%orthogonalize_seconds = statistics%orthogonalize_seconds + seconds_since(started)
         d%projected(:k, k) = coefficients(:k)
         d%scale = max(d%scale, maxval(abs(coefficients(:k))))
         d%dimension = k
         if (.not. d%beta > 0) call fresh_direction(operator, options, d, k, statistics, error)
         if (allocated(error)) return
      end do
   end subroutine expand

   ! The three-term recurrence. Without it, what the basis lacks of orthogonality
   ! would pass through the Gram-Schmidt step times the subtracted coefficients,
   ! and grow from step to step; with it, little is left to be subtracted there.
   subroutine subtract_neighbours(d, k, coefficients)
      type(decomposition_type), intent(inout) :: d
      integer, intent(in) :: k
      real(wp), intent(out) :: coefficients(:)

      coefficients = 0
      coefficients(k) = dot(d%image, d%basis(:, k + 1:k + 1))
      d%basis(:, k + 1) = d%basis(:, k + 1) - coefficients(k)*d%basis(:, k)
      if (.not. d%beta > 0) return
      coefficients(k - 1) = d%beta
      d%basis(:, k + 1) = d%basis(:, k + 1) - d%beta*d%basis(:, k - 1)
   end subroutine subtract_neighbours

   ! x^T y of single columns.
   real(wp) function dot(x, y)
      real(wp), contiguous, intent(in) :: x(:, :), y(:, :)
      real(wp) :: c(1, 1)

      call inner_products(x, y, c)
      dot = c(1, 1)
   end function dot
end module kschur_lanczos_decomposition
