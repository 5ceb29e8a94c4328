!> The proof that `options%certify` asks for, on the modes of a result.
module kschur_certify
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_outcome, only: certified_no, certified_yes, reason_cancelled, reason_converged
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
   subroutine certify_modes(problem, solver, zeros, result)
      !> Reduced and balanced: where entries are of one size, the phase of the determinant is not lost in rounding.
      type(modal_problem_type), intent(in) :: problem
      !> One that tells determinants; copies of it are used.
      class(complex_linear_solver_type), intent(in) :: solver
      !> Multiplicity of the eigenvalue zero.
      integer, intent(in) :: zeros
      type(modal_result_type), intent(inout) :: result
      type(winding_certificate_type) :: certificate
      complex(wp) :: none(0)

      if (result%certified == certified_yes) result%missing = 0
      if (result%certified == certified_yes .or. result%reason == reason_cancelled) return
      call certify_by_winding(problem, solver, result%eigenvalues, none, zeros, result%target, &
         nearly_zero*abs(result%shift), certificate)
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
end module kschur_certify
