!> How many eigenvalues a problem has: the degree of its determinant on the motions that the constraints allow.
module kschur_eigenvalue_count
   use kschur_deflation, only: deflation_type
   use kschur_problem, only: modal_problem_type
   implicit none
   private
   public :: eigenvalue_count_type, count_eigenvalues

   !> A number, and whether it is exact.
   type :: eigenvalue_count_type
      !> Finite eigenvalues, both of a conjugate pair counted, as they are listed: a zero once a rigid motion.
      integer :: number = 0
      !> Whether there are so many, not just no more.
      logical :: exact = .false.
   end type eigenvalue_count_type

contains

   !> With n - m + r motions, r the number of constraints that follow from others, there are twice as many eigenvalues
   !> less the multiplicity of infinity; what is known of zero beyond the rigid motions is not listed.
   pure function count_eigenvalues(problem, deflation, redundant, listed) result(total)
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), intent(in) :: deflation
      !> Constraints that follow from others.
      integer, intent(in) :: redundant
      !> Rigid motions and their decays.
      integer, intent(in) :: listed
      type(eigenvalue_count_type) :: total
      integer :: motions, with_mass, each

      motions = problem%unknowns() - problem%multipliers() + redundant
      ! A root of a form in lambda^2 is two eigenvalues.
      each = merge(2, 1, deflation%oscillator)
      total%exact = deflation%infinite_is_known
      if (total%exact) then
         total%number = 2*motions - each*deflation%infinite%multiplicity()
         ! Where damping is proportional, a motion without mass has one root (1 + beta lambda) k = 0.
         if (deflation%oscillator .and. abs(problem%beta) > 0) &
            total%number = total%number + deflation%infinite%multiplicity()
      else
         with_mass = min(motions, count(problem%mass%row_maxima() > 0))
         total%number = with_mass + merge(with_mass, motions, problem%damping%is_zero())
      end if
      total%number = max(total%number - 2*size(deflation%decay) - each*deflation%zero%states(), 0) + listed
   end function count_eigenvalues
end module kschur_eigenvalue_count
