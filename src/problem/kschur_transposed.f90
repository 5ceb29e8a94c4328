!> The problem with M, R, K and H transposed, whose modes are conjugates of the left vectors.
module kschur_transposed
   use kschur_error, only: error_type
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: transpose_csr
   implicit none
   private
   public :: transpose_problem

contains

   !> (M^T, R^T, K^T, Cq): P(lambda)^T chi + Cq^T zeta = 0 makes psi = conj(chi)
   !> and eta = conj(zeta) the left vectors of the problem, psi^* P(lambda) + eta^* Cq = 0.
   subroutine transpose_problem(problem, transposed, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type), intent(out) :: transposed
      type(error_type), allocatable, intent(out) :: error

      transposed%mass = transpose_csr(problem%mass)
      transposed%stiffness = transpose_csr(problem%stiffness)
      transposed%damping = transpose_csr(problem%damping)
      if (allocated(problem%dampers)) allocate (transposed%dampers, source=transpose_csr(problem%dampers))
      if (allocated(problem%loss)) allocate (transposed%loss, source=transpose_csr(problem%loss))
      transposed%constraints = problem%constraints
      call settle_modal_problem(transposed, error, kind_of=problem)
      if (allocated(problem%position)) transposed%position = problem%position
   end subroutine transpose_problem
end module kschur_transposed
