!> Options and statistics of the Krylov-Schur and Lanczos iterations.
module kschur_krylov_options
   use kschur_archive, only: archive_type
   use kschur_checkpoint, only: checkpoint_type
   use kschur_kinds, only: wp
   use kschur_outcome, only: history_type, reason_converged
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: krylov_options_type, krylov_statistics_type, real_ritz_pairs_type, ritz_pairs_type, subspace_dimension

   !> Options of an iteration.
   type :: krylov_options_type
      !> Largest dimension of the Krylov space. Convergence is tested earlier, and memory is used only as the space grows.
      integer :: subspace = 20
      !> A Ritz pair has converged when its residual is below this, relative to its Ritz value.
      real(wp) :: tolerance = 1.0e-12_wp
      !> The iteration ends instead of making this restart: with 1 the Krylov space is filled once.
      integer :: max_restarts = 200
      !> Number of applications of the operator to a random start vector, which filter out components of infinite eigenvalues.
      integer :: filter = 3
      integer :: seed = 1
      !> Block size: vectors that the operator is applied to at a time.
      integer :: block = 1
      !> Whether to search for further copies of multiple eigenvalues with new random vectors, unless a block of random start
      !> vectors proves that there are none: from one start vector an iteration finds one copy, others only through rounding.
      logical :: verify = .true.
      !> Whether this is a short run near the shift, which another iteration will continue.
      logical :: observes = .false.
      !> Whether Krylov-Schur computes eigenvectors.
      logical :: vectors = .true.
      !> Start vectors, one column for each of a block; not allocated: random. Ignored by Lanczos.
      real(wp), allocatable :: start(:, :)
      !> Expected dimension at convergence: Krylov-Schur tests convergence from there on.
      integer :: expected = 0
      !> Whether a later call with the same operator will continue: structured quadratic forms then keep their Krylov space.
      !> Lanczos always does.
      logical :: keep = .false.
      !> Checkpoint to write and to continue from; not associated: none. Ignored by ARPACK.
      type(checkpoint_type), pointer :: checkpoint => null()
      !> Processes that may share the rows of the basis; not associated: one. Ignored by ARPACK.
      type(processes_type), pointer :: processes => null()
   end type krylov_options_type

   !> Statistics of an iteration.
   type :: krylov_statistics_type
      !> One of `reason_*`.
      integer :: reason = reason_converged
      integer :: operator_applications = 0
      !> Number of restarts and verifications.
      integer :: restarts = 0
      !> Norm of the couplings neglected by locking, relative to the projected operator.
      real(wp) :: locking_error = 0
      real(wp) :: orthogonalize_seconds = 0
      type(history_type) :: history
   contains
      !> Writes to a checkpoint, or reads.
      procedure :: carry
      !> Whether convergence stagnates over many restarts.
      procedure :: stalls
   end type krylov_statistics_type

   !> Result of an iteration: Ritz values and unit vectors, most wanted first.
   type :: ritz_pairs_type
      complex(wp), allocatable :: mu(:), vectors(:, :)
      !> The vectors of a self-adjoint operator; `vectors` is not allocated then.
      real(wp), allocatable :: real_vectors(:, :)
      !> Marks pairs that stand for a conjugate pair; not allocated if all pairs are present.
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

   !> Whether neither the number of converged values nor the residual has improved in the second half of at least forty restarts:
   !> for example, more eigenvalues lie near the last wanted one than the space has dimensions, and each is purged before it
   !> converges.
   pure logical function stalls(self)
      class(krylov_statistics_type), intent(in) :: self
      ! Least number of restarts, and the factor by which the residual must fall in the second half of the history.
      integer, parameter :: least_restarts = 40
      real(wp), parameter :: progress = 0.1_wp
      integer :: checks, middle

      checks = size(self%history%converged)
      middle = checks/2
      stalls = .false.
      if (self%restarts < least_restarts .or. middle == 0) return
      stalls = maxval(self%history%converged(middle + 1:)) <= maxval(self%history%converged(:middle)) .and. &
         minval(self%history%residual(middle + 1:)) > progress*minval(self%history%residual(:middle))
   end function stalls

   !> Dimension of a Krylov space for a number of wanted eigenvalues.
   pure integer function subspace_dimension(asked, values, block)
      !> Option of the caller; 0: chosen from `values`.
      integer, intent(in) :: asked
      integer, intent(in) :: values
      !> Block size.
      integer, intent(in) :: block
      ! The filter polynomial of a restart has a degree equal to the number of steps, not of vectors.
      integer, parameter :: steps = 20, least_steps = 2

      subspace_dimension = asked
      if (asked == 0) subspace_dimension = max(2*values, values + steps*block)
      subspace_dimension = max(subspace_dimension, values + least_steps*block)
   end function subspace_dimension
end module kschur_krylov_options
