!> Whether LDL^T factors of a stiffness exist whose bodies only constraints hold, and are accurate.
module kschur_held_bodies
   use kschur_anchors, only: has_anchors, join, separate
   use kschur_error, only: error_type
   use kschur_kinds, only: long, wp
   use kschur_linear_solver, only: real_linear_solver_type
   use kschur_magnitudes, only: terms_of
   use kschur_orthonormal, only: subtract
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector, state_of_seed
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: are_held, try_factors

contains

   !> Whether the elimination order has anchors for each body of a symmetric stiffness: no mass or damper couples bodies, as the
   !> order follows from all matrices. Without constraints: none has.
   pure logical function are_held(problem)
      type(modal_problem_type), intent(in) :: problem
      integer :: body(problem%unknowns()), bodies, i
      logical :: is_free(problem%unknowns())

      are_held = .false.
      if (.not. problem%symmetric .or. problem%multipliers() == 0) return
      associate (k => problem%stiffness)
         body = separate(size(body))
         call join(k%row_start, k%column, body)
         bodies = count(body == [(i, i=1, size(body))])
         call join(problem%mass%row_start, problem%mass%column, body)
         call join(problem%damping%row_start, problem%damping%column, body)
         if (allocated(problem%loss)) call join(problem%loss%row_start, problem%loss%column, body)
         if (count(body == [(i, i=1, size(body))]) /= bodies) return
         is_free = .true.
         is_free(problem%constraints%column) = .false.
         are_held = has_anchors(k%row_start, k%column, body, is_free)
      end associate
   end function are_held

   !> Whether factors solve A x = f accurately, f without components along null vectors: the first solution of a random f is the
   !> second one, so that x is large, as motions of low frequencies are.
   subroutine try_factors(solver, matrix, null_vectors, n, accurate, error)
      !> Has factored A, n unknowns above multipliers.
      class(real_linear_solver_type), intent(inout) :: solver
      type(csr_matrix_type), intent(in) :: matrix
      !> Orthonormal in their first n rows.
      real(wp), intent(in) :: null_vectors(:, :)
      integer, intent(in) :: n
      logical, intent(out) :: accurate
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: solves = 2
      real(wp), dimension(matrix%rows, 1) :: x, forces
      integer(long) :: state
      integer :: i

      accurate = .false.
      state = state_of_seed(7)
      call random_vector(state, x(:n, 1))
      do i = 1, solves
         x(n + 1:, :) = 0
         call subtract(null_vectors, null_vectors, x, n)
         forces(:n, :) = x(:n, :)/max(norm2(x(:n, :)), tiny(1.0_wp))
         forces(n + 1:, :) = 0
         x = forces
         call solver%solve(x, error)
         if (allocated(error)) return
         call subtract(null_vectors, null_vectors, x, n)
      end do
      accurate = maxval(abs(forces - matrix%product(x))) <= rounding_of_sums*maxval(abs(forces) + terms_of(matrix, abs(x)))
   end subroutine try_factors
end module kschur_held_bodies
