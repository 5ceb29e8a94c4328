!> Runs the iteration on the current transform once, and makes eigenpairs of the iterated problem from its Ritz pairs.
module kschur_iteration
   use kschur_block_choice, only: chosen_block
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_effort, only: phase_iterate, phase_place, phase_recover
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, ritz_pairs_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_modes, only: take_columns
   use kschur_options, only: modal_options_type, formulation_proportional, formulation_quadratic, formulation_symmetric
   use kschur_outcome, only: reason_converged
   use kschur_settings, only: set_iteration_options
   use kschur_split, only: match_conjugates
   use kschur_tolerances, only: accepted_backward_error, same_frequency, same_value
   implicit none
   private
   public :: iterate

contains

   !> Computes the wanted eigenpairs nearest to the target by iteration on the current transform. Where needed, one more application
   !> of the operator purifies the vectors of components of infinite eigenvalues (docs/theory.md, section 7). If the iteration
   !> was not verified and a block may have missed copies, it is repeated with verification.
   subroutine iterate(s, wanted, pairs, complete_radius, statistics, error)
      type(solve_context_type), target, intent(inout) :: s
      !> Number of wanted modes.
      integer, intent(in) :: wanted
      !> Of the iterated problem, without rigid motions that are deflated.
      type(eigenpairs_type), intent(out) :: pairs
      !> All eigenvalues nearer to the target than this (1/s) are among the pairs; huge if the iteration did not converge.
      real(wp), intent(out) :: complete_radius
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      type(modal_selection_type) :: selection
      type(modal_options_type) :: settings
      class(krylov_options_type), allocatable :: options
      type(ritz_pairs_type) :: ritz
      ! Eigenvalues of deflated modes, which count as wanted ones.
      complex(wp), allocatable :: deflated(:)
      logical, allocatable :: paired(:)
      logical :: is_uncounted
      integer :: j

      call s%end_step(phase_place)
      allocate (deflated, source=s%known%deflation%eigenvalues())
      selection = modal_selection_type(wanted, s%transform%map, s%transform%shift, s%options%target, deflated, s%is_lossy())
      settings = s%options
      settings%block = chosen_block(s, merge(1, 2, s%transform%map%oscillator)*wanted)
      s%block = settings%block
      call set_iteration_options(settings, s%formulation, s%work%unknowns()*merge(1, 2, s%transform%map%oscillator), wanted, &
         count(abs(deflated - s%options%target) <= abs(s%shift - s%options%target)), s%transform%map%oscillator, &
         s%is_lossy(), options)
      ! Few modes become more accurate than the iteration here, and a few steps cost less than factors for polishing.
      if (.not. s%options%is_plain() .and. (s%formulation == formulation_quadratic .or. .not. s%work%symmetric)) &
         options%tolerance = min(options%tolerance, max(s%options%good_enough(), accepted_backward_error))
      if (allocated(s%last)) call s%transform%begin_with(s%last, options%block, options%start)
      ! Lanczos verifies by a count; without one, it finds as many copies as a block has vectors.
      is_uncounted = s%options%uncounted .and. any(s%formulation == [formulation_symmetric, formulation_proportional])
      options%verify = .not. is_uncounted .or. options%block == 1
      ! Two sums of known modes find two of each eigenspace.
      if (allocated(options%start)) options%verify = options%block == 1 .or. most_copies(s%last%lambda) > 1
      if (allocated(options%start)) options%expected = s%dimension
      if (associated(s%checkpoint)) call s%checkpoint%next_iteration()
      options%checkpoint => s%checkpoint
      options%processes => s%processes
      ! The count of the certificate frees the whole matrices, as further factors need their memory.
      call s%announce_phase("iteration", whole_iterated, error)
      if (allocated(error)) return
      do
         call s%transform%iterate(selection, options, ritz, error, s%monitor)
         if (allocated(error)) exit
         associate (effort => s%effort, more => ritz%statistics)
            effort%operator_applications = effort%operator_applications + more%operator_applications
            effort%restarts = effort%restarts + more%restarts
            effort%seconds%orthogonalize = effort%seconds%orthogonalize + more%orthogonalize_seconds
         end associate
         if (options%verify .or. most_copies(ritz%mu) < options%block) exit
         ! A block of b vectors finds b copies of an eigenvalue at most: if it found so many, there may be more.
         options%verify = .true.
      end do
      call s%hold(whole_iterated, error)
      if (allocated(error)) return
      if (associated(s%checkpoint)) then
         if (allocated(s%checkpoint%complaint)) then
            call s%add_note("a checkpoint could not be written: "//s%checkpoint%complaint)
            deallocate (s%checkpoint%complaint)
         end if
      end if
      call require_memory(s%bytes_of_shapes(3*size(ritz%mu)), "mode shapes", error)
      if (allocated(error)) return
      statistics = ritz%statistics
      s%dimension = expected_dimension(statistics, options)
      complete_radius = huge(1.0_wp)
      if (statistics%reason == reason_converged) complete_radius = maxval([0.0_wp, (selection%key(ritz%mu(j)), j=1, size(ritz%mu))])
      if (allocated(ritz%paired)) then
         call move_alloc(ritz%paired, paired)
      else
         allocate (paired(size(ritz%mu)), source=.false.)
         if (allocated(ritz%vectors) .and. .not. s%is_lossy()) call drop_mirrored(ritz%mu, ritz%vectors)
      end if
      call s%end_step(phase_iterate)
      ritz%statistics%operator_applications = 0
      call s%transform%recover(ritz, pairs, error)
      if (allocated(error)) return
      s%effort%operator_applications = s%effort%operator_applications + ritz%statistics%operator_applications
      call set_eigenvalues(ritz%mu)
      call s%end_step(phase_recover)

   contains

      ! Sets the eigenvalues lambda of Ritz values mu. Both roots of an oscillator share its shape: of a conjugate pair one is
      ! listed, with losses only the root above the real axis. Multipliers are scaled from the undamped problem to lambda.
      subroutine set_eigenvalues(mu)
         complex(wp), intent(in) :: mu(:)
         complex(wp) :: lambda(2*size(mu)), roots(2)
         integer :: ritz_index(2*size(mu)), j, k

         k = 0
         do j = 1, size(mu)
            roots = s%transform%map%lambdas(s%transform%theta(mu(j)))
            k = k + 1
            lambda(k) = roots(1)
            ritz_index(k) = j
            if (.not. s%transform%map%oscillator) cycle
            if (abs(aimag(roots(1))) > 0 .and. .not. abs(roots(2) - conjg(roots(1))) > 0) cycle
            if (s%transform%map%upper .and. .not. abs(roots(2) - roots(1)) > 0) cycle
            k = k + 1
            lambda(k) = roots(2)
            ritz_index(k) = j
         end do
         allocate (pairs%lambda(k), source=lambda(:k))
         if (k > size(mu)) then
            if (pairs%is_real()) then
               pairs%real_phi = pairs%real_phi(:, ritz_index(:k))
            else
               pairs%phi = pairs%phi(:, ritz_index(:k))
            end if
            pairs%xi = pairs%xi(:, ritz_index(:k))
         end if
         ! With a complex pair of theta, each of its roots stands for a conjugate pair, too; so does one listed alone.
         allocate (pairs%paired(k), source=paired(ritz_index(:k)))
         if (s%transform%map%oscillator) pairs%paired = pairs%paired .or. [(count(ritz_index(:k) == ritz_index(j)) == 1, j=1, k)]
         do j = 1, k
            pairs%xi(:, j) = s%transform%map%reaction(lambda(j))*pairs%xi(:, j)
         end do
      end subroutine set_eigenvalues

      ! Removes Ritz pairs whose eigenvalues are conjugates of others above the real axis, and marks the latter as `paired`. Judging
      ! would do so, too, but after twice the work.
      subroutine drop_mirrored(mu, vectors)
         complex(wp), allocatable, intent(inout) :: mu(:), vectors(:, :)
         complex(wp) :: theta(size(mu))
         logical :: mirrored(size(mu))
         integer :: j

         theta = [(s%transform%theta(mu(j)), j=1, size(mu))]
         call match_conjugates(theta, same_value*abs(theta), paired, mirrored)
         if (.not. any(mirrored)) return
         call take_columns(vectors, pack([(j, j=1, size(mu))], .not. mirrored))
         mu = pack(mu, .not. mirrored)
         paired = pack(paired, .not. mirrored)
      end subroutine drop_mirrored
   end subroutine iterate

   ! Dimension of the space at which another iteration that starts with known modes should converge; 0: not known. It is one step
   ! before the last test, and one more if the residuals were far below the tolerance there.
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

   ! Largest number of values that are equal within `same_frequency`.
   pure integer function most_copies(values)
      complex(wp), intent(in) :: values(:)
      integer :: j

      most_copies = maxval([0, (count(abs(values - values(j)) <= same_frequency*abs(values(j))), j=1, size(values))])
   end function most_copies
end module kschur_iteration
