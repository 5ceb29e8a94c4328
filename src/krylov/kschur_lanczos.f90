!> Thick-restart Lanczos: wanted eigenpairs of an operator C that is self-adjoint
!> in the inner product x^T B y, B symmetric and positive semidefinite, with one
!> application of C and one of B a step.
!>
!> Sources: Wu and Simon, SIAM J. Matrix Anal. Appl. 22 (2000), the restart;
!> Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48 (1987), semidefinite B.
module kschur_lanczos
   use kschur_archive, only: archive_type
   use kschur_block_decomposition, only: make_room
   use kschur_block_lanczos, only: add_random_directions, expand_block
   use kschur_census, only: census_type
   use kschur_checkpoint, only: checkpoint_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, real_ritz_pairs_type
   use kschur_lanczos_ritz, only: decomposition_type, extract, project, ritz_type, truncate
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_outcome, only: reason_cancelled, reason_converged, reason_fewer_modes, reason_max_restarts
   use kschur_selection, only: selection_type
   implicit none
   private
   public :: lanczos, lanczos_state_type

   ! Convergence is tested after `check_every` steps, or 1/`check_part` of the dimension.
   integer, parameter :: check_every = 8, check_part = 16
   ! With blocks and no verification, the space is extended by this fraction after convergence, so that copies of multiple
   ! eigenvalues appear.
   integer, parameter :: confirming_part = 8

   !> State passed from one call to the next with the same operator.
   type :: lanczos_state_type
      type(decomposition_type) :: decomposition
      !> If associated, ends the search for copies when it proves that none is missing.
      class(census_type), pointer :: census => null()
   end type lanczos_state_type

contains

   !> Computes wanted eigenvalues and eigenvectors of a self-adjoint operator. Returns those that converged, most wanted first,
   !> with B-orthonormal vectors. The basis has max(`options%subspace`, `selection%wanted` + 2) columns. Convergence is also
   !> tested between restarts, to save steps. Failure to converge is reported in `statistics%reason`, not as an error.
   subroutine lanczos(operator, selection, options, state, found, error, monitor)
      class(symmetric_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      !> Empty at the first call; the state of an earlier call continues that iteration.
      type(lanczos_state_type), intent(inout) :: state
      type(real_ritz_pairs_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      class(symmetric_operator_type), pointer :: part
      type(ritz_type) :: ritz
      real(wp) :: residual
      logical :: proceed, over
      ! Dimension at which all wanted values first converged; 0 before. Copies converge a little later.
      integer :: confirmed

      associate (d => state%decomposition, statistics => found%statistics)
         part => operator%by_rows()
         d%by_rows = associated(part)
         if (.not. d%by_rows) part => operator
         call start(part, operator%order(), selection%wanted, options, d, statistics, error)
         if (allocated(error)) return
         call statistics%history%begin()
         proceed = .true.
         confirmed = 0
         do
            do
               if (associated(options%checkpoint)) call carry_state(options%checkpoint, state, statistics, confirmed, error)
               if (allocated(error)) return
               call expand(part, selection%wanted, options, d, statistics, error, monitor)
               if (.not. allocated(error)) call project(d, selection, options, ritz, error)
               if (allocated(error)) return
               residual = maxval([0.0_wp, ritz%residuals(:ritz%wanted)])
               call statistics%history%add_check(ritz%converged, statistics%operator_applications, residual)
               if (present(monitor)) call monitor%report(statistics%restarts, ritz%converged, ritz%needed, residual, proceed)
               if (is_stopped(monitor)) proceed = .false.
               if (ritz%settled .and. confirmed == 0) then
                  confirmed = d%expanded
                  if (options%block > 1 .and. .not. (options%verify .or. options%observes)) &
                     confirmed = confirmed + max(2*options%block, d%expanded/confirming_part)
               end if
               if ((ritz%settled .and. d%expanded >= confirmed) .or. d%exhausted .or. d%expanded >= d%dimension .or. &
                  .not. proceed) exit
            end do
            call conclude(state, ritz, selection, options, proceed, statistics, over)
            if (over) exit
            statistics%restarts = statistics%restarts + 1
            call truncate(d, ritz, options, statistics)
            if (ritz%settled) call add_random_vectors(part, options, d, statistics, error)
            if (allocated(error)) return
         end do
         call extract(d, ritz, selection, options, found)
         call purify(operator, options, d%scale, found, error)
         statistics%locking_error = d%dropped/max(d%scale, tiny(1.0_wp))
      end associate
   end subroutine lanczos

   ! Writes the state of the iteration to the checkpoint, or reads it, when that is due.
   subroutine carry_state(checkpoint, state, statistics, confirmed, error)
      type(checkpoint_type), intent(inout) :: checkpoint
      type(lanczos_state_type), intent(inout) :: state
      type(krylov_statistics_type), intent(inout) :: statistics
      integer, intent(inout) :: confirmed
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: archive

      if (.not. checkpoint%opens(archive, error)) return
      associate (d => state%decomposition)
         call d%carry(archive)
         call archive%carry(d%locked)
         call archive%carry(d%dimension)
         call archive%carry(d%exhausted)
         call archive%carry(d%dropped)
      end associate
      call statistics%carry(archive)
      call archive%carry(confirmed)
      if (associated(state%census)) call state%census%carry(archive)
      call checkpoint%close(archive, error)
   end subroutine carry_state

   ! Allocates the basis and sets the start vectors; enlarges a basis that is continued.
   subroutine start(operator, order, wanted, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      integer, intent(in) :: order, wanted
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer :: m

      m = options%subspace
      ! A restart and a verification need two blocks besides the wanted columns.
      if (options%max_restarts > 1) m = max(m, wanted + 2*options%block)
      m = max(min(m, order), 1)
      d%dimension = max(d%dimension, m)
      d%most = min(d%most, order)
      call make_room(d, order, d%dimension + options%block, options%processes, error)
      if (allocated(error)) return
      if (d%vectors == 0) then
         call add_random_vectors(operator, options, d, statistics, error)
      else if (.not. (d%exhausted .or. d%full())) then
         ! A continued decomposition may have a narrower block.
         call add_random_directions(operator, d, max(options%block - d%vectors + d%expanded, 0), options%filter, options%seed, &
            statistics, error)
      end if
   end subroutine start

   ! Continues with random vectors in the complement of the basis, unless that is empty.
   subroutine add_random_vectors(operator, options, d, statistics, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: attempts = 3
      integer :: attempt

      do attempt = 1, attempts
         if (d%full()) exit
         call add_random_directions(operator, d, min(options%block, d%basis%room() - d%vectors), options%filter, &
            options%seed, statistics, error)
         if (allocated(error) .or. .not. d%closed()) return
      end do
      d%exhausted = .true.
   end subroutine add_random_vectors

   ! Expands up to the next test of convergence, the first at the number of wanted values.
   subroutine expand(operator, wanted, options, d, statistics, error, monitor)
      class(symmetric_operator_type), intent(inout) :: operator
      integer, intent(in) :: wanted
      type(krylov_options_type), intent(in) :: options
      type(decomposition_type), intent(inout) :: d
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), optional, intent(inout) :: monitor
      integer :: last

      last = min(max(d%expanded + max(check_every, d%expanded/check_part), wanted), d%dimension)
      do while (d%expanded < last .and. .not. d%exhausted)
         call expand_block(operator, d, statistics, error)
         if (.not. allocated(error) .and. d%closed()) call add_random_vectors(operator, options, d, statistics, error)
         if (allocated(error)) return
         if (is_stopped(monitor)) return
      end do
   end subroutine expand

   ! Decides whether the iteration ends, and with which reason. A Krylov space contains only one copy of a multiple eigenvalue:
   ! a verification searches the complement of what was found, from a new random vector, until it finds no wanted value.
   subroutine conclude(state, ritz, selection, options, proceed, statistics, over)
      type(lanczos_state_type), intent(in) :: state
      type(ritz_type), intent(in) :: ritz
      class(selection_type), intent(in) :: selection
      type(krylov_options_type), intent(in) :: options
      logical, intent(in) :: proceed
      type(krylov_statistics_type), intent(inout) :: statistics
      logical, intent(out) :: over
      logical :: complete, crowded

      complete = .not. options%verify
      if (ritz%settled .and. options%verify .and. associated(state%census)) &
         call state%census%examine(ritz%all_values, ritz%all_residuals, ritz%needed, complete, &
            state%decomposition%seen_from_start(ritz%values, ritz%vectors))
      crowded = .false.
      if (statistics%stalls()) crowded = is_crowded(ritz, selection)
      over = .true.
      if (ritz%settled .and. (complete .or. state%decomposition%exhausted .or. ritz%wanted == 0)) then
         statistics%reason = reason_converged
      else if (state%decomposition%exhausted) then
         statistics%reason = reason_fewer_modes
      else if (.not. proceed) then
         statistics%reason = reason_cancelled
      else if (statistics%restarts + 1 >= options%max_restarts .or. crowded) then
         statistics%reason = reason_max_restarts
      else
         over = .false.
      end if
   end subroutine conclude

   ! Whether a cluster of Ritz values around the last wanted one prevents convergence.
   logical function is_crowded(ritz, selection)
      type(ritz_type), intent(in) :: ritz
      class(selection_type), intent(in) :: selection

      associate (values => cmplx(ritz%all_values, kind=wp))
         is_crowded = selection%crowds(values, values(max(1, min(ritz%needed, size(values)))))
      end associate
   end function is_crowded

   ! Purifies the vectors of components in the null space of B, where rounding errors accumulate: replaces x by C x / theta
   ! (Nour-Omid et al.). Tries the vector with the smallest |theta| first, where they are largest; stops if that hardly changes.
   subroutine purify(operator, options, scale, pairs, error)
      class(symmetric_operator_type), intent(inout) :: operator
      type(krylov_options_type), intent(in) :: options
      real(wp), intent(in) :: scale
      type(real_ritz_pairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: images(:, :)
      logical :: large(size(pairs%values))
      integer :: j

      associate (values => pairs%values, vectors => pairs%vectors, applications => pairs%statistics%operator_applications)
         large = abs(values) > epsilon(1.0_wp)/options%tolerance*scale
         j = minloc(abs(values), 1, large)
         if (j == 0) return
         allocate (images(size(vectors, 1), 1))
         call operator%apply(vectors(:, j:j), images, error)
         if (allocated(error)) return
         applications = applications + 1
         if (norm2(images(:, 1)/values(j) - vectors(:, j)) <= 10*options%tolerance*norm2(vectors(:, j))) return
         deallocate (images)
         allocate (images(size(vectors, 1), size(values)))
         call operator%apply(vectors, images, error)
         if (allocated(error)) return
         applications = applications + size(values)
         do j = 1, size(values)
            if (large(j)) vectors(:, j) = images(:, j)/values(j)
         end do
      end associate
   end subroutine purify
end module kschur_lanczos
