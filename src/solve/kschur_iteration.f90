!> One run of the iteration on a transform: Ritz pairs become eigenpairs of what is iterated.
module kschur_iteration
   use kschur_block_choice, only: chosen_block
   use kschur_context, only: solve_context_type, whole_iterated, whole_none
   use kschur_effort, only: phase_iterate, phase_place, phase_recover
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, ritz_pairs_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_options, only: modal_options_type, formulation_low_rank, formulation_proportional, formulation_symmetric
   use kschur_outcome, only: reason_converged
   use kschur_settings, only: set_iteration_options
   use kschur_split, only: match_conjugates
   use kschur_tolerances, only: same_frequency, same_value
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: iterate

contains

   !> Runs the iteration and purifies what it found by one more application,
   !> which removes what is left of infinite eigenvalues.
   subroutine iterate(s, asked, pairs, reach, statistics, error)
      type(solve_context_type), target, intent(inout) :: s
      !> How many modes are wanted.
      integer, intent(in) :: asked
      type(eigenpairs_type), intent(out) :: pairs
      !> All eigenvalues nearer to the target than this are among the pairs.
      real(wp), intent(out) :: reach
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      type(modal_selection_type) :: selection
      type(modal_options_type) :: settings
      class(krylov_options_type), allocatable :: options
      type(ritz_pairs_type) :: ritz
      ! Eigenvalues of modes that are not to be found, but count.
      complex(wp), allocatable :: known(:)
      logical, allocatable :: paired(:)
      logical :: counts
      integer :: j

      call s%end_step(phase_place)
      allocate (known, source=s%known%deflation%eigenvalues())
      selection = modal_selection_type(asked, s%transform%map, s%transform%shift, s%options%target, known, s%is_lossy())
      settings = s%options
      settings%block = chosen_block(s, merge(1, 2, s%transform%map%oscillator)*asked)
      s%block = settings%block
      call set_iteration_options(settings, s%formulation, s%work%unknowns()*merge(1, 2, s%transform%map%oscillator), asked, &
         count(abs(known - s%options%target) <= abs(s%shift - s%options%target)), s%transform%map%oscillator, options)
      if (allocated(s%last)) call s%transform%begin_with(s%last, options%block, options%start)
      ! A symmetric form counts instead.
      counts = s%formulation == formulation_low_rank .or. (.not. s%options%uncounted .and. &
         any(s%formulation == [formulation_symmetric, formulation_proportional]))
      options%verify = counts .or. options%block == 1
      if (allocated(options%start)) options%verify = options%verify .or. most_copies(s%last%lambda) > 1
      if (allocated(options%start)) options%expected = s%dimension
      if (associated(s%checkpoint)) call s%checkpoint%next_iteration()
      options%checkpoint => s%checkpoint
      options%processes => s%processes
      ! The certificate makes other factors beside those that there are.
      call s%announce_phase("iteration", whole_none, error)
      do
         call s%transform%iterate(selection, options, ritz, error, s%monitor)
         if (allocated(error)) exit
         call account(s, ritz%statistics)
         if (options%verify .or. most_copies(ritz%mu) < options%block) exit
         ! A block finds as many copies as it has vectors, and there may be more.
         options%verify = .true.
      end do
      call s%hold(whole_iterated, error)
      if (allocated(error)) return
      if (associated(s%checkpoint)) call tell_complaint(s)
      call require_memory(s%bytes_of_shapes(3*size(ritz%mu)), "mode shapes", error)
      if (allocated(error)) return
      statistics = ritz%statistics
      s%dimension = expected_dimension(statistics, options)
      reach = huge(1.0_wp)
      if (statistics%reason == reason_converged) reach = maxval([0.0_wp, (selection%key(ritz%mu(j)), j=1, size(ritz%mu))])
      if (allocated(ritz%paired)) then
         call move_alloc(ritz%paired, paired)
      else
         allocate (paired(size(ritz%mu)), source=.false.)
         if (allocated(ritz%vectors) .and. .not. s%is_lossy()) call drop_mirrored(s%transform, ritz%mu, ritz%vectors, paired)
      end if
      if (s%transform%recover_applies) s%effort%operator_applications = s%effort%operator_applications + size(ritz%mu)
      call s%end_step(phase_iterate)
      call s%transform%recover(ritz, pairs, error)
      if (allocated(error)) return
      call set_eigenvalues(s%transform, ritz%mu, paired, pairs)
      call s%end_step(phase_recover)
   end subroutine iterate

   ! Where another iteration that begins with modes is expected to converge; 0: not known. A step less would have done where
   ! the residuals are far below what is asked.
   pure integer function expected_dimension(statistics, options) result(dimension)
      type(krylov_statistics_type), intent(in) :: statistics
      class(krylov_options_type), intent(in) :: options
      real(wp), parameter :: far_below = 0.1_wp
      integer :: looks

      dimension = 0
      if (.not. allocated(options%start) .or. statistics%restarts > 0 .or. statistics%reason /= reason_converged) return
      looks = size(statistics%history%residual)
      if (looks == 0) return
      dimension = statistics%history%operator_applications(looks) - options%block
      if (statistics%history%residual(looks) < far_below*options%tolerance) dimension = dimension - options%block
   end function expected_dimension

   subroutine account(s, statistics)
      type(solve_context_type), intent(inout) :: s
      type(krylov_statistics_type), intent(in) :: statistics

      associate (effort => s%effort)
         effort%operator_applications = effort%operator_applications + statistics%operator_applications
         effort%restarts = effort%restarts + statistics%restarts
         effort%seconds%orthogonalize = effort%seconds%orthogonalize + statistics%orthogonalize_seconds
      end associate
   end subroutine account

   ! Of how many values some one may be.
   pure integer function most_copies(values)
      complex(wp), intent(in) :: values(:)
      integer :: j

      most_copies = maxval([0, (count(abs(values - values(j)) <= same_frequency*abs(values(j))), j=1, size(values))])
   end function most_copies

   subroutine tell_complaint(s)
      type(solve_context_type), intent(inout) :: s

      if (.not. allocated(s%checkpoint%complaint)) return
      call s%add_note("a checkpoint could not be written: "//s%checkpoint%complaint)
      deallocate (s%checkpoint%complaint)
   end subroutine tell_complaint

   ! An oscillator has two eigenvalues with one shape; of a conjugate pair one is enough.
   subroutine set_eigenvalues(transform, mu, paired, pairs)
      class(transform_type), intent(in) :: transform
      complex(wp), intent(in) :: mu(:)
      logical, intent(in) :: paired(:)
      !> Its shapes and multipliers are those of mu.
      type(eigenpairs_type), intent(inout) :: pairs
      complex(wp) :: lambda(2*size(mu)), roots(2)
      integer :: of(2*size(mu)), j, k

      k = 0
      do j = 1, size(mu)
         roots = transform%map%lambdas(transform%theta(mu(j)))
         k = k + 1
         lambda(k) = roots(1)
         of(k) = j
         if (.not. transform%map%oscillator) cycle
         if (abs(aimag(roots(1))) > 0 .and. .not. abs(roots(2) - conjg(roots(1))) > 0) cycle
         if (abs(transform%map%loss) > 0) cycle
         k = k + 1
         lambda(k) = roots(2)
         of(k) = j
      end do
      allocate (pairs%lambda(k), source=lambda(:k))
      if (k > size(mu)) then
         if (pairs%is_real()) then
            pairs%real_phi = pairs%real_phi(:, of(:k))
         else
            pairs%phi = pairs%phi(:, of(:k))
         end if
         pairs%xi = pairs%xi(:, of(:k))
      end if
      ! Each of the four of an oscillator whose theta is one of a pair, too.
      allocate (pairs%paired(k), source=paired(of(:k)))
      if (transform%map%oscillator) pairs%paired = pairs%paired .or. [(count(of(:k) == of(j)) == 1, j=1, k)]
      do j = 1, k
         pairs%xi(:, j) = transform%map%reaction(lambda(j))*pairs%xi(:, j)
      end do
   end subroutine set_eigenvalues

   ! Leaves out eigenvalues below the real axis that mirror others above it.
   subroutine drop_mirrored(transform, mu, vectors, paired)
      class(transform_type), intent(in) :: transform
      complex(wp), allocatable, intent(inout) :: mu(:)
      complex(wp), allocatable, intent(inout) :: vectors(:, :)
      logical, allocatable, intent(inout) :: paired(:)
      complex(wp) :: theta(size(mu))
      complex(wp), allocatable :: kept(:, :)
      logical :: again(size(mu))
      integer :: j

      theta = [(transform%theta(mu(j)), j=1, size(mu))]
      call match_conjugates(theta, same_value*abs(theta), paired, again)
      if (.not. any(again)) return
      allocate (kept(size(vectors, 1), count(.not. again)), source=vectors(:, pack([(j, j=1, size(mu))], .not. again)))
      call move_alloc(kept, vectors)
      mu = pack(mu, .not. again)
      paired = pack(paired, .not. again)
   end subroutine drop_mirrored
end module kschur_iteration
