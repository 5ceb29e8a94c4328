!> The proof that `options%certify` asks for, on the modes of a result.
module kschur_certify
   use kschur_balance, only: balance
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_outcome, only: certified_no, certified_yes, reason_cancelled, reason_converged
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_text, only: text
   use kschur_winding_certificate, only: certify_by_winding, winding_certificate_type
   implicit none
   private
   public :: certify_modes

   ! A zero of the iteration may be off by this, relative to the shift.
   real(wp), parameter :: nearly_zero = 1.0e-4_wp

contains

   !> Counts the eigenvalues about the target, unless it is proved already that no mode is missing. Sets
   !> `certified` and `missing` where the count tells; else a note says why it does not.
   subroutine certify_modes(problem, solver, motions, decay, result)
      !> As given.
      type(modal_problem_type), intent(in) :: problem
      !> One that tells determinants; copies of it are used.
      class(complex_linear_solver_type), intent(in) :: solver
      !> All rigid motions, n x k, orthonormal.
      real(wp), intent(in) :: motions(:, :)
      !> Decay of those with eigenvalues 0 and -decay (1/s); of others nothing is known but that they have a zero.
      real(wp), intent(in) :: decay(:)
      type(modal_result_type), intent(inout) :: result
      type(winding_certificate_type) :: certificate
      type(modal_problem_type) :: work
      type(presolve_type) :: plan
      type(error_type), allocatable :: error
      complex(wp) :: none(0)
      integer :: zeros
      logical :: at_least

      if (result%certified == certified_yes) result%missing = 0
      if (result%certified == certified_yes .or. result%reason == reason_cancelled) return
      call presolve(problem, work, plan, error)
      if (allocated(error)) return
      call balance(work, plan)
      call count_zeros(problem, motions, decay, zeros, at_least)
      call certify_by_winding(work, solver, result%eigenvalues, none, zeros, result%target, nearly_zero*abs(result%shift), &
         certificate, at_least)
      result%factorizations = result%factorizations + certificate%factorizations
      result%seconds%analyze = result%seconds%analyze + certificate%analyze_seconds
      result%seconds%factorize = result%seconds%factorize + certificate%factorize_seconds
      result%seconds%solve = result%seconds%solve + certificate%solve_seconds
      select case (certificate%verdict)
      case (certified_yes)
         result%missing = 0
         ! A set that has not been completed is not complete for having its first ones.
         if (result%reason == reason_converged) result%certified = certified_yes
      case (certified_no)
         result%missing = certificate%missing
         result%certified = certified_no
         call result%add_note("eigenvalues that are nearer to the target than the furthest mode, but not among the modes: "// &
            text(result%missing)//", both of a conjugate pair counted")
      case default
         call result%add_note("the eigenvalues could not be counted: "//trim(certificate%reason))
      end select
   end subroutine certify_modes

   ! The multiplicity of zero in the determinant. With the rigid motions N, and as many from the left, it is that of
   ! det(lambda N_left^T R N + ...): the number of motions where N_left^T R N is regular, and more where it is not.
   subroutine count_zeros(problem, motions, decay, zeros, at_least)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: motions(:, :), decay(:)
      integer, intent(out) :: zeros
      !> Whether there may be more.
      logical, intent(out) :: at_least
      real(wp), parameter :: regular = 1.0e-8_wp
      real(wp) :: forces(size(motions, 1), size(motions, 2)), damping(size(motions, 2), size(motions, 2))
      real(wp) :: singular(size(motions, 2)), work(8*size(motions, 2) + 1), no_left(1, 1), no_right(1, 1)
      integer :: k, info

      k = size(motions, 2)
      zeros = k + count(.not. abs(decay) > 0)
      at_least = size(decay) < k
      if (.not. at_least) return
      if (problem%damping%is_zero()) then
         ! Even in lambda.
         zeros = 2*k
         return
      end if
      zeros = k
      if (.not. problem%stiffness%is_symmetric()) return
      forces = 0
      call problem%damping%add_product(1.0_wp, motions, forces)
      damping = matmul(transpose(motions), forces)
      call dgesvd("N", "N", k, k, damping, k, singular, no_left, 1, no_right, 1, work, size(work), info)
      at_least = info /= 0 .or. .not. singular(k) > regular*maxval(sqrt(sum(forces**2, 1)))
   end subroutine count_zeros
end module kschur_certify
