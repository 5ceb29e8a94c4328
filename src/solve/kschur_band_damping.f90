!> Leaves the damping out of a prepared context, so that the undamped modes of a band are found, and puts it back.
module kschur_band_damping
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type
   use kschur_eigenvalue_count, only: count_eigenvalues, eigenvalue_count_type
   use kschur_kinds, only: wp
   use kschur_options, only: formulation_symmetric, modal_options_type
   use kschur_problem, only: damping_none, modal_problem_type
   use kschur_sparse, only: empty_csr_matrix
   implicit none
   private
   public :: left_damping_type

   !> What the context had with damping.
   type :: left_damping_type
      private
      !> The problem as given, without its damping; the damping alone of the iterated one.
      type(modal_problem_type) :: undamped, iterated
      type(modal_options_type) :: options
      integer :: formulation = formulation_symmetric
      type(eigenpairs_type) :: rigid
      real(wp), allocatable :: decay(:)
      type(eigenvalue_count_type) :: total
   contains
      !> Makes the context that of the undamped problem; its modes will be judged as those of the damped one.
      procedure :: leave_out
      !> Restores what the context had.
      procedure :: put_back
   end type left_damping_type

contains

   subroutine leave_out(self, s)
      !> Must live as long as the context, or until the damping is put back.
      class(left_damping_type), target, intent(inout) :: self
      type(solve_context_type), intent(inout) :: s

      self%options = s%options
      self%formulation = s%formulation
      self%rigid = s%known%rigid
      self%decay = s%known%deflation%decay
      self%total = s%known%total
      self%undamped = s%problem
      call drop_damping(self%undamped)
      call copy_damping(s%work, self%iterated)
      call drop_damping(s%work)
      if (allocated(s%matrices)) deallocate (s%matrices)
      s%damped => s%problem
      s%problem => self%undamped
      s%formulation = formulation_symmetric
      s%known%rigid = chosen_pairs(s%known%rigid, .not. abs(s%known%rigid%lambda) > 0)
      s%known%deflation%decay = 0
      s%known%total = count_eigenvalues(s%work, s%known%deflation, s%known%redundant - s%plan%redundant, &
         size(s%known%rigid%lambda))
   end subroutine leave_out

   subroutine put_back(self, s)
      class(left_damping_type), intent(inout) :: self
      type(solve_context_type), intent(inout) :: s

      if (allocated(s%matrices)) deallocate (s%matrices)
      call copy_damping(self%iterated, s%work)
      s%problem => s%damped
      nullify (s%damped)
      s%options = self%options
      s%formulation = self%formulation
      s%known%rigid = self%rigid
      s%known%deflation%decay = self%decay
      s%known%total = self%total
   end subroutine put_back

   ! Leaves a problem without damping.
   subroutine drop_damping(problem)
      type(modal_problem_type), intent(inout) :: problem

      problem%damping = empty_csr_matrix(problem%unknowns(), problem%unknowns())
      problem%damping_kind = damping_none
      problem%alpha = 0
      problem%beta = 0
   end subroutine drop_damping

   ! Copies the damping matrix with its kind and coefficients.
   subroutine copy_damping(from, to)
      type(modal_problem_type), intent(in) :: from
      type(modal_problem_type), intent(inout) :: to

      to%damping = from%damping
      to%damping_kind = from%damping_kind
      to%alpha = from%alpha
      to%beta = from%beta
   end subroutine copy_damping
end module kschur_band_damping
