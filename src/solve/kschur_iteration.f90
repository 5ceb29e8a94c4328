!> One run of the iteration on a transform: Ritz pairs become eigenpairs of the problem.
module kschur_iteration
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_method, only: iteration_options
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type
   use kschur_outcome, only: reason_converged
   use kschur_result, only: modal_result_type
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: iterate

contains

   !> Runs the iteration and purifies what it found by one more application,
   !> which removes what is left of infinite eigenvalues.
   subroutine iterate(transform, options, known, asked, pairs, reach, statistics, result, error, monitor)
      class(transform_type), target, intent(inout) :: transform
      type(modal_options_type), intent(in) :: options
      !> Eigenvalues of modes that are not to be found, but count.
      complex(wp), intent(in) :: known(:)
      integer, intent(in) :: asked
      type(eigenpairs_type), intent(out) :: pairs
      !> All eigenvalues nearer to the target than this are among the pairs.
      real(wp), intent(out) :: reach
      type(krylov_statistics_type), intent(out) :: statistics
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(modal_selection_type) :: selection
      type(krylov_options_type) :: krylov
      complex(wp), allocatable :: mu(:), vectors(:, :), phi(:, :), xi(:, :)
      complex(wp) :: roots(2)
      integer, allocatable :: of(:)
      logical, allocatable :: paired(:)
      integer :: j

      selection = modal_selection_type(asked, transform%map, transform%shift, options%target, known)
      krylov = iteration_options(options, result%formulation, asked, &
         count(abs(known - options%target) <= abs(result%shift - options%target)), transform%map%oscillator)
      call transform%iterate(selection, krylov, mu, vectors, statistics, error, monitor)
      if (allocated(error)) return
      result%operator_applications = result%operator_applications + statistics%operator_applications
      if (transform%recover_applies) result%operator_applications = result%operator_applications + size(mu)
      if (abs(aimag(transform%shift)) > 0) then
         allocate (paired(size(mu)), source=.false.)
      else
         call drop_conjugates(mu, vectors, paired)
      end if
      call transform%recover(mu, vectors, phi, xi, error)
      if (allocated(error)) return

      allocate (pairs%lambda(0), of(0))
      reach = huge(1.0_wp)
      if (statistics%reason == reason_converged) reach = 0
      do j = 1, size(mu)
         reach = max(reach, selection%key(mu(j)))
         roots = transform%map%lambdas(transform%theta(mu(j)))
         pairs%lambda = [pairs%lambda, roots(1)]
         of = [of, j]
         ! Of a conjugate pair one is enough.
         if (.not. transform%map%oscillator) cycle
         if (abs(aimag(roots(1))) > 0 .and. .not. abs(roots(2) - conjg(roots(1))) > 0) cycle
         pairs%lambda = [pairs%lambda, roots(2)]
         of = [of, j]
      end do
      if (size(of) == size(mu)) then
         call move_alloc(phi, pairs%phi)
         call move_alloc(xi, pairs%xi)
      else
         allocate (pairs%phi(size(phi, 1), size(of)), source=phi(:, of))
         allocate (pairs%xi(size(xi, 1), size(of)), source=xi(:, of))
      end if
      if (transform%map%oscillator) then
         allocate (pairs%paired(size(of)), source=[(count(of == of(j)) == 1, j=1, size(of))])
      else
         allocate (pairs%paired(size(of)), source=paired(of))
      end if
      do j = 1, size(of)
         pairs%xi(:, j) = transform%map%reaction(pairs%lambda(j))*pairs%xi(:, j)
      end do
      result%restarts = result%restarts + statistics%restarts
      result%seconds%orthogonalize = result%seconds%orthogonalize + statistics%orthogonalize_seconds
   end subroutine iterate

   ! Keeps one of each conjugate pair that a real operator gave.
   subroutine drop_conjugates(mu, vectors, paired)
      complex(wp), allocatable, intent(inout) :: mu(:)
      complex(wp), allocatable, intent(inout) :: vectors(:, :)
      !> Of those that are left, which stand for a pair.
      logical, allocatable, intent(out) :: paired(:)
      logical :: both(size(mu))
      integer :: kept, j

      both = [(abs(aimag(mu(j))) > 0 .and. any(.not. abs(mu - conjg(mu(j))) > 0), j=1, size(mu))]
      kept = 0
      do j = 1, size(mu)
         if (both(j) .and. aimag(mu(j)) > 0) cycle
         kept = kept + 1
         both(kept) = both(j)
         if (kept == j) cycle
         mu(kept) = mu(j)
         vectors(:, kept) = vectors(:, j)
      end do
      allocate (paired, source=both(:kept))
      if (kept == size(mu)) return
      mu = mu(:kept)
      vectors = vectors(:, :kept)
   end subroutine drop_conjugates
end module kschur_iteration
