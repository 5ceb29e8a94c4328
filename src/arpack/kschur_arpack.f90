!> ARPACK as an alternative to Krylov-Schur, with the same operators and arguments: implicitly restarted Arnoldi and Lanczos
!> (Lehoucq, Sorensen, Yang 1998), used as in its drivers dndrv4, zndrv4 and dsdrv4.
!>
!> ARPACK keeps its state in saved variables and is not thread-safe. A lock (kschur_lock) admits one iteration of the process at
!> a time; others wait. An operator or monitor that calls ARPACK itself gets an error.
module kschur_arpack
   use kschur_arpack_complex, only: complex_process_type
   use kschur_arpack_messages, only: arpack_error, info_exhausted, info_no_shifts, info_restarts, info_zero_start
   use kschur_arpack_options, only: arpack_options_type
   use kschur_arpack_process, only: arpack_process_type, ido_done
   use kschur_arpack_real, only: real_process_type
   use kschur_arpack_symmetric, only: symmetric_process_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_lock, only: acquire_lock, release_lock, lock_arpack
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_operator, only: complex_operator_type, real_operator_type, symmetric_operator_type
   use kschur_outcome, only: reason_cancelled, reason_converged, reason_fewer_modes, reason_max_restarts
   use kschur_random, only: random_vector, state_of_seed
   use kschur_selection, only: selection_type, order_by_preference
   implicit none
   private
   public :: arpack, arpack_symmetric

   !> Computes wanted eigenvalues and unit eigenvectors of a real or complex operator, most wanted first; arguments as in
   !> `krylov_schur`. ARPACK finds eigenvalues of largest magnitude; if wanted ones may not be among them it is run again for
   !> more, unless `options%raw`.
   interface arpack
      module procedure arpack_of_real, arpack_of_complex
   end interface arpack

   ! Maximal number of runs.
   integer, parameter :: most_runs = 6

   ! Results of one run.
   type :: run_type
      complex(wp), allocatable :: mu(:), vectors(:, :)
      ! INFO of the iteration.
      integer :: info = 0
      ! Upper bound of the magnitudes of eigenvalues not found.
      real(wp) :: edge = 0
      ! Whether all nonzero eigenvalues were found.
      logical :: complete = .false.
      logical :: proceed = .true.
      ! Ritz values and error bounds at the last restart.
      real(wp), allocatable :: magnitudes(:), bounds(:)
   end type run_type

contains

   ! Recursive, as an operator may call it: the lock then returns an error.
   recursive subroutine arpack_of_real(operator, selection, options, values, vectors, statistics, error, monitor)
      class(real_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(real_process_type) :: process

      process%routine = "dnaupd"
      process%operator => operator
      call iterate(process, selection, options, values, vectors, statistics, error, monitor)
      if (.not. (allocated(error) .or. options%raw)) call trim_to_wanted(selection, values, vectors)
   end subroutine arpack_of_real

   recursive subroutine arpack_of_complex(operator, selection, options, values, vectors, statistics, error, monitor)
      class(complex_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(complex_process_type) :: process

      process%routine = "znaupd"
      process%operator => operator
      call iterate(process, selection, options, values, vectors, statistics, error, monitor)
      if (.not. (allocated(error) .or. options%raw)) call trim_to_wanted(selection, values, vectors)
   end subroutine arpack_of_complex

   ! Drops values behind the leading ones that contain all wanted ones.
   subroutine trim_to_wanted(selection, values, vectors)
      class(selection_type), intent(in) :: selection
      complex(wp), allocatable, intent(inout) :: values(:), vectors(:, :)
      integer :: wanted

      wanted = min(selection%needed(values), size(values))
      values = values(:wanted)
      vectors = vectors(:, :wanted)
   end subroutine trim_to_wanted

   !> As `arpack` for a self-adjoint operator; returns all that converged, possibly more than is wanted. dsaupd finds fewer
   !> eigenvalues than the rank of the operator: if that is not enough, dnaupd is used.
   recursive subroutine arpack_symmetric(operator, selection, options, values, vectors, statistics, error, monitor)
      class(symmetric_operator_type), target, intent(inout) :: operator
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      real(wp), allocatable, intent(out) :: values(:)
      real(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(symmetric_process_type) :: process
      complex(wp), allocatable :: complex_values(:), complex_vectors(:, :)
      integer :: applications, j

      process%routine = "dsaupd"
      process%operator => operator
      process%self_adjoint => operator
      call iterate(process, selection, options, complex_values, complex_vectors, statistics, error, monitor)
      if (process%info == info_exhausted) then
         applications = statistics%operator_applications
         call arpack(operator, selection, options, complex_values, complex_vectors, statistics, error, monitor)
         statistics%operator_applications = statistics%operator_applications + applications
      end if
      if (allocated(error)) return
      allocate (values, source=real(complex_values, wp))
      allocate (vectors, source=real(complex_vectors, wp))
      ! Rounding may turn two equal values into a conjugate pair: real and imaginary part are its two vectors.
      do j = 1, size(values)
         if (aimag(complex_values(j)) < 0) vectors(:, j) = aimag(complex_vectors(:, j))
      end do
   end subroutine arpack_symmetric

   ! Runs ARPACK until the wanted eigenvalues are among those found.
   recursive subroutine iterate(process, selection, options, values, vectors, statistics, error, monitor)
      class(arpack_process_type), intent(inout) :: process
      class(selection_type), intent(in) :: selection
      type(arpack_options_type), intent(in) :: options
      complex(wp), allocatable, intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(krylov_statistics_type), intent(out) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(run_type) :: run
      integer, allocatable :: order(:)
      integer :: n, wanted, most_columns, needed, covered, i

      call statistics%history%begin()
      n = process%order()
      wanted = min(max(options%values, 1), n)
      most_columns = n + 2
      needed = 0
      covered = 0
      do i = 1, most_runs
         call set_limits(process, wanted, most_columns, options)
         call run_once(process, options, run, statistics, error, monitor)
         if (process%info == info_exhausted .and. process%converged() > wanted + 1 .and. most_columns > n .and. i < most_runs) then
            ! The Krylov space is invariant and holds all eigenvalues.
            most_columns = process%converged()
            deallocate (error)
            cycle
         end if
         if (allocated(error)) return
         allocate (order, source=order_by_preference(selection, run%mu))
         covered = count_covered(selection, run%mu(order), run%edge)
         if (options%raw) covered = size(order)
         needed = selection%needed(run%mu(order(:covered)))
         if (needed <= covered .or. options%raw .or. .not. run%proceed .or. run%info /= 0 .or. &
            run%complete .or. i == most_runs) exit
         wanted = min(wanted + max(needed - covered, 2), n)
         deallocate (order)
      end do
      if (.not. run%proceed) then
         statistics%reason = reason_cancelled
      else if (needed <= covered) then
         statistics%reason = reason_converged
      else if (run%info /= 0) then
         statistics%reason = reason_max_restarts
      else if (run%complete) then
         statistics%reason = reason_fewer_modes
      end if
      allocate (values(covered), source=run%mu(order(:covered)))
      allocate (vectors(n, covered), source=run%vectors(:, order(:covered)))
   end subroutine iterate

   ! Sets NEV and NCV. ARPACK requires NEV + 2 <= NCV <= N: if nearly all eigenvalues are wanted, the operator is padded with
   ! zero rows.
   subroutine set_limits(process, wanted, most_columns, options)
      class(arpack_process_type), intent(inout) :: process
      integer, intent(in) :: wanted, most_columns
      type(arpack_options_type), intent(in) :: options
      integer, parameter :: beyond = 2

      process%wanted = wanted
      process%length = max(process%order(), wanted + beyond)
      process%columns = min(max(options%subspace + wanted - options%values, wanted + beyond), process%length, most_columns)
      process%tolerance = options%tolerance
   end subroutine set_limits

   ! One run, from start vector to eigenvectors. Fails if ARPACK does; reaching the restart limit only sets process%info.
   recursive subroutine run_once(process, options, run, statistics, error, monitor)
      class(arpack_process_type), intent(inout) :: process
      type(arpack_options_type), intent(in) :: options
      type(run_type), intent(out) :: run
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      real(wp), allocatable :: start(:)
      integer(long) :: state
      integer :: before
      logical :: held

      allocate (start(process%order()))
      state = state_of_seed(options%seed)
      call random_vector(state, start)
      before = statistics%operator_applications
      call acquire_lock(lock_arpack, held)
      if (held) then
         call new_error(error, error_usage, "ARPACK is iterating in this thread already: an operator or a monitor "// &
            "must not call it")
         return
      end if
      call process%begin(start, merge(0, options%filter, options%raw), options%max_restarts, error)
      allocate (run%magnitudes(process%columns), run%bounds(process%columns), source=0.0_wp)
      do while (.not. allocated(error) .and. run%proceed .and. process%ido /= ido_done)
         if (is_stopped(monitor)) run%proceed = .false.
         if (.not. run%proceed) exit
         call process%step(error)
         statistics%operator_applications = before + process%applications
         if (.not. allocated(error) .and. process%ido /= ido_done) call record_step(process, run, statistics, monitor)
      end do
      if (.not. allocated(error) .and. run%proceed) call finish(process, run, statistics, error)
      call release_lock(lock_arpack)
      if (.not. allocated(run%mu)) allocate (run%mu(0), run%vectors(process%order(), 0))
   end subroutine run_once

   ! Records history after each restart and polls the monitor: the wanted Ritz values are last.
   subroutine record_step(process, run, statistics, monitor)
      class(arpack_process_type), intent(in) :: process
      type(run_type), intent(inout) :: run
      type(krylov_statistics_type), intent(inout) :: statistics
      class(monitor_type), intent(inout), optional :: monitor
      real(wp) :: bounds(process%columns), residuals(process%wanted)
      integer :: first, converged

      call process%ritz(run%magnitudes, bounds)
      if (.not. any(abs(bounds - run%bounds) > 0)) return
      run%bounds = bounds
      statistics%restarts = statistics%restarts + 1
      first = process%columns - process%wanted + 1
      residuals = relative(bounds(first:), run%magnitudes(first:))
      converged = count(residuals <= process%tolerance)
      call statistics%history%add_check(converged, statistics%operator_applications, maxval(residuals))
      if (present(monitor)) call monitor%report(statistics%restarts, converged, process%wanted, maxval(residuals), &
         run%proceed)
   end subroutine record_step

   ! Extracts the pairs; ARPACK has sorted converged ones to the front.
   subroutine finish(process, run, statistics, error)
      class(arpack_process_type), intent(inout) :: process
      type(run_type), intent(inout) :: run
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer :: converged, first

      ! If all motions are deflated, the start vector is zero.
      run%complete = process%info == info_zero_start
      if (run%complete) return
      run%info = process%info
      if (all(process%info /= [0, info_restarts, info_no_shifts])) then
         call arpack_error(process%routine, process%info, error)
         return
      end if
      converged = min(process%converged(), process%columns)
      first = max(converged, process%wanted)
      call process%ritz(run%magnitudes, run%bounds)
      call statistics%history%add_check(min(converged, process%wanted), statistics%operator_applications, &
         maxval([0.0_wp, relative(run%bounds(:first), run%magnitudes(:first))]))
      if (run%info == 0) then
         run%complete = process%wanted == process%order()
         if (.not. run%complete) run%edge = minval(run%magnitudes(:converged))
      else
         run%edge = maxval([0.0_wp, run%magnitudes(converged + 1:)])
      end if
      if (converged > 0) call process%extract(run%mu, run%vectors, error)
   end subroutine finish

   ! Relative error bound, as in ARPACK's convergence test.
   elemental real(wp) function relative(bound, magnitude)
      real(wp), intent(in) :: bound, magnitude

      relative = bound/max(epsilon(1.0_wp)**(2.0_wp/3), magnitude)
   end function relative

   ! Number of leading values that are certainly more wanted than any not found, whose magnitudes are at most `edge`.
   integer function count_covered(selection, values, edge) result(covered)
      class(selection_type), intent(in) :: selection
      complex(wp), intent(in) :: values(:)
      real(wp), intent(in) :: edge
      ! Directions sampled for a missing value, and the error of that sampling.
      integer, parameter :: directions = 360
      real(wp), parameter :: slack = 1.0e-4_wp, turn = 8*atan(1.0_wp)
      real(wp) :: nearest
      integer :: i

      nearest = huge(1.0_wp)
      do i = 1, merge(directions, 0, edge > 0)
         nearest = min(nearest, selection%key(edge*exp(cmplx(0, turn*i/directions, wp))))
      end do
      covered = 0
      do i = 1, size(values)
         if (selection%key(values(i)) > nearest + slack*abs(nearest)) exit
         covered = i
      end do
   end function count_covered
end module kschur_arpack
