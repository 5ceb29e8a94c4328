!> What the Krylov-Schur iteration is told and what it tells of itself, for
!> real and complex operators alike.
module kschur_krylov_options
   use kschur_archive, only: archive_type
   use kschur_checkpoint, only: checkpoint_type
   use kschur_kinds, only: wp
   use kschur_outcome, only: history_type, reason_converged
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: krylov_options_type, krylov_statistics_type, real_ritz_pairs_type, ritz_pairs_type, subspace_dimension

   !> What an iteration is told.
   type :: krylov_options_type
      !> Largest dimension of the Krylov space. Convergence is looked at before it
      !> is reached, and memory is touched as far as it is used.
      integer :: subspace = 20
      !> A Ritz pair has converged when its residual is below this, relative to its Ritz value.
      real(wp) :: tolerance = 1.0e-12_wp
      !> The iteration gives up instead of making this restart: 1 lets it fill
      !> the Krylov space once.
      integer :: max_restarts = 200
      !> Applications of the operator that filter a random vector into a start
      !> vector: they remove what belongs to infinite eigenvalues.
      integer :: filter = 3
      integer :: seed = 1
      !> Vectors that the operator is applied to at a time: the Krylov space grows by so many.
      integer :: block = 1
      !> Whether to look for copies of multiple eigenvalues with fresh random
      !> vectors: one vector finds one copy, and others through rounding only.
      logical :: verify = .true.
      !> Whether it only looks what there is about the shift, for another iteration to go on from.
      logical :: observes = .false.
      !> Whether eigenvectors are wanted too; Krylov-Schur makes none where they are not.
      logical :: vectors = .true.
      !> What the Krylov space begins with, as many columns as a block has; not allocated: random vectors. Lanczos does not
      !> look at it.
      real(wp), allocatable :: start(:, :)
      !> Convergence is not looked at before the space has this dimension: it is expected near it. Lanczos looks when it wants.
      integer :: expected = 0
      !> Whether a later call with the same operator is to go on from where this one ends: structured
      !> quadratic forms keep their Krylov space then. Lanczos always does.
      logical :: keep = .false.
      !> Where its state is kept, and from where it goes on; not associated: nowhere. ARPACK does not look at it.
      type(checkpoint_type), pointer :: checkpoint => null()
      !> Who may share the rows of the basis; not associated: nobody. ARPACK does not look at it.
      type(processes_type), pointer :: processes => null()
   end type krylov_options_type

   !> What it tells of itself.
   type :: krylov_statistics_type
      !> One of `reason_*`.
      integer :: reason = reason_converged
      integer :: operator_applications = 0
      !> How often the Krylov space was made smaller, to go on or to verify.
      integer :: restarts = 0
      !> Norm of the couplings that locking dropped, relative to the projected operator.
      real(wp) :: locking_error = 0
      real(wp) :: orthogonalize_seconds = 0
      type(history_type) :: history
   contains
      !> To or from a checkpoint.
      procedure :: carry
      !> Whether many restarts have changed nothing.
      procedure :: stalls
   end type krylov_statistics_type

   !> What an iteration gives: Ritz values and unit vectors, most wanted first.
   type :: ritz_pairs_type
      complex(wp), allocatable :: mu(:), vectors(:, :)
      !> The vectors of a self-adjoint operator; `vectors` is not allocated then.
      real(wp), allocatable :: real_vectors(:, :)
      !> Which stand for themselves and their conjugates; not allocated where all are there.
      logical, allocatable :: paired(:)
      type(krylov_statistics_type) :: statistics
   end type ritz_pairs_type

   !> The same of a self-adjoint operator.
   type :: real_ritz_pairs_type
      real(wp), allocatable :: values(:), vectors(:, :)
      type(krylov_statistics_type) :: statistics
   end type real_ritz_pairs_type

contains

   subroutine carry(self, archive)
      class(krylov_statistics_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive

      call archive%carry(self%reason)
      call archive%carry(self%operator_applications)
      call archive%carry(self%restarts)
      call archive%carry(self%locking_error)
      call archive%carry(self%orthogonalize_seconds)
      call archive%carry(self%history%converged)
      call archive%carry(self%history%operator_applications)
      call archive%carry(self%history%residual)
   end subroutine carry

   !> As where more eigenvalues crowd around the last wanted one than the space has dimensions: none of them converges
   !> before it is purged.
   pure logical function stalls(self)
      class(krylov_statistics_type), intent(in) :: self
      ! Looks since the middle of the history, at least, and what the least residual is to be less by.
      integer, parameter :: least_restarts = 40
      real(wp), parameter :: progress = 0.1_wp
      integer :: looks, middle

      looks = size(self%history%converged)
      middle = looks/2
      stalls = .false.
      if (self%restarts < least_restarts .or. middle == 0) return
      stalls = maxval(self%history%converged(middle + 1:)) <= maxval(self%history%converged(:middle)) .and. &
         minval(self%history%residual(middle + 1:)) > progress*minval(self%history%residual(:middle))
   end function stalls

   !> Dimension of a Krylov space in which a number of eigenvalues can be found.
   pure integer function subspace_dimension(asked, values, block)
      !> What was asked for; 0: chosen from `values`.
      integer, intent(in) :: asked
      integer, intent(in) :: values
      !> Vectors that it grows by in a step.
      integer, intent(in) :: block
      ! A restart filters by a polynomial whose degree is the number of steps, not of vectors.
      integer, parameter :: steps = 20, least_steps = 2

      subspace_dimension = asked
      if (asked == 0) subspace_dimension = max(2*values, values + steps*block)
      subspace_dimension = max(subspace_dimension, values + least_steps*block)
   end function subspace_dimension
end module kschur_krylov_options
