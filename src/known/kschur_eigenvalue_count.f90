!> The number of finite eigenvalues of a problem: the degree of det P(lambda) on the motions that the constraints allow.
module kschur_eigenvalue_count
   use kschur_deflation, only: deflation_type
   use kschur_problem, only: modal_problem_type
   implicit none
   private
   public :: eigenvalue_count_type, count_eigenvalues

   !> A number of eigenvalues, or an upper bound of it.
   type :: eigenvalue_count_type
      !> Finite eigenvalues, both of a conjugate pair counted, as they are listed: a zero once a rigid motion.
      integer :: number = 0
      !> Whether `number` is exact; otherwise it is an upper bound.
      logical :: exact = .false.
   end type eigenvalue_count_type

contains

   !> Counts the finite eigenvalues that can be listed as modes: twice the n - m + r motions, r the number of redundant
   !> constraints, less the multiplicity of infinity; where that is not known, an upper bound from the number of unknowns with
   !> mass. The root space of zero counts as the rigid motions and their decays only.
   pure function count_eigenvalues(problem, deflation, redundant, listed) result(eigenvalues)
      type(modal_problem_type), intent(in) :: problem
      type(deflation_type), intent(in) :: deflation
      !> Number of constraints that depend linearly on others.
      integer, intent(in) :: redundant
      !> Number of rigid motions and of their decays.
      integer, intent(in) :: listed
      type(eigenvalue_count_type) :: eigenvalues
      integer :: motions, with_mass, per_root

      motions = problem%unknowns() - problem%multipliers() + redundant
      ! Each root theta = lambda^2 is two eigenvalues.
      per_root = merge(2, 1, deflation%oscillator)
      eigenvalues%exact = deflation%infinite_is_known
      if (eigenvalues%exact) then
         eigenvalues%number = 2*motions - per_root*deflation%infinite%multiplicity()
         ! Where damping is proportional, a motion without mass has one root (1 + beta lambda) k = 0.
         if (deflation%oscillator .and. abs(problem%beta) > 0) &
            eigenvalues%number = eigenvalues%number + deflation%infinite%multiplicity()
      else
         with_mass = min(motions, count(problem%mass%row_maxima() > 0))
         eigenvalues%number = with_mass + merge(with_mass, motions, problem%damping%is_zero())
      end if
      eigenvalues%number = max(eigenvalues%number - 2*size(deflation%decay) - per_root*deflation%zero%states(), 0) + listed
   end function count_eigenvalues
end module kschur_eigenvalue_count
