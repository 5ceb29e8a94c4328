!> The modes nearest to each of several targets: targets that lie together share a shift, its factors and one Krylov space.
module kschur_targets
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_modal_solver, only: modal_solver_type
   use kschur_mode_selection, only: distances, nearest_first
   use kschur_monitor, only: monitor_type
   use kschur_options, only: modal_options_type, formulation_dense, formulation_low_rank, formulation_proportional, &
      formulation_symmetric
   use kschur_outcome, only: certified_no, reason_converged
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_tolerances, only: same_frequency
   implicit none
   private
   public :: solve_targets

   ! Some targets that are solved together, the first of those that are left.
   type :: group_type
      integer :: targets = 1
      !> Where, and how many modes their discs take.
      complex(wp) :: centre = (0.0_wp, 0.0_wp)
      integer :: modes = 0
   end type group_type

contains

   !> For each target what `solver%solve` gives for it. Where the discs of the modes that several want lie in one disc with no
   !> more modes than all of them want, those of that disc are computed, and each takes its own: where its disc is not covered
   !> after all, or one of the modes is noted for something, it is solved by itself. The effort stands with the first result of
   !> those that share one.
   subroutine solve_targets(solver, targets, options, results, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      !> lambda (1/s).
      complex(wp), intent(in) :: targets(:)
      !> As for one target; the one in it is not used.
      type(modal_options_type), intent(in) :: options
      !> One a target.
      type(modal_result_type), allocatable, intent(out) :: results(:)
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_result_type) :: found
      type(group_type) :: group
      integer, allocatable :: waiting(:)
      logical, allocatable :: covered(:)
      ! Radius of a disc of one mode (1/s), where the last ones were found.
      real(wp) :: each
      complex(wp) :: gathering
      integer :: most, i

      call look_at(solver, real(size(targets), wp)*options%modes, gathering, error)
      if (allocated(error)) return
      allocate (results(size(targets)))
      waiting = nearest_first(targets, (0.0_wp, 0.0_wp))
      each = huge(each)
      most = 1
      do while (size(waiting) > 0)
         group = next_group(targets(waiting), options, each, most, gathering)
         call solve_at(solver, group, options, found, error, monitor)
         if (allocated(error)) return
         if (size(found%eigenvalues) > 0) each = reach_of(found)/size(found%eigenvalues)
         if (most == 1) most = most_modes(found)
         allocate (covered(size(waiting)), source=.false.)
         do i = 1, group%targets
            covered(i) = group%targets == 1
            if (.not. covered(i)) covered(i) = covers(found, group, targets(waiting(i)), options%modes)
            if (.not. covered(i)) cycle
            results(waiting(i)) = share_of(found, targets(waiting(i)), options)
            found%effort_type = effort_type()
         end do
         ! Where a disc is too much at once the others are not tried.
         if (.not. any(covered)) most = 0
         waiting = pack(waiting, .not. covered)
         deallocate (covered)
      end do
   end subroutine solve_targets

   ! Fails where so many modes have no room. Overdamped eigenvalues of a proportional damping gather at -1/beta.
   subroutine look_at(solver, modes, gathering, error)
      type(modal_solver_type), intent(in) :: solver
      real(wp), intent(in) :: modes
      complex(wp), intent(out) :: gathering
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: problem

      problem = solver%current_problem()
      gathering = huge(1.0_wp)
      if (abs(problem%beta) > 0) gathering = -1/problem%beta
      call require_memory(complex_bytes*modes*(real(problem%unknowns(), wp) + problem%multipliers()), "the results", error)
   end subroutine look_at

   ! More at once cost more than they save: where spaces are not Lanczos', in their projected problems.
   pure integer function most_modes(found)
      type(modal_result_type), intent(in) :: found
      integer, parameter :: of_lanczos = 60, of_others = 30

      most_modes = of_lanczos
      if (all(found%formulation /= [formulation_symmetric, formulation_proportional, formulation_low_rank, formulation_dense])) &
         most_modes = of_others
   end function most_modes

   ! As many as have no more modes in their common disc than each for itself, and one at least.
   function next_group(targets, options, each, most, gathering) result(group)
      complex(wp), intent(in) :: targets(:)
      type(modal_options_type), intent(in) :: options
      real(wp), intent(in) :: each
      integer, intent(in) :: most
      complex(wp), intent(in) :: gathering
      type(group_type) :: group
      real(wp), parameter :: margin = 1.2_wp
      complex(wp) :: centre
      real(wp) :: modes
      integer :: i

      group = group_type(1, targets(1), options%modes)
      if (allocated(options%shift) .or. each >= huge(each)) return
      do i = 2, size(targets)
         centre = (upper(targets(1)) + upper(targets(i)))/2
         modes = margin*(options%modes + maxval(abs(upper(targets(:i)) - centre))/each)
         if (modes > min(real(i, wp)*options%modes, real(most, wp)) .or. abs(gathering - centre) < 2*modes*each) exit
         group = group_type(i, centre, ceiling(modes))
      end do
   end function next_group

   ! A disc is that of the conjugate target as well.
   elemental complex(wp) function upper(target)
      complex(wp), intent(in) :: target

      upper = cmplx(real(target, wp), abs(aimag(target)), wp)
   end function upper

   subroutine solve_at(solver, group, options, found, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      type(group_type), intent(in) :: group
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      ! A disc that takes more holds what should be left alone, as where eigenvalues accumulate.
      integer, parameter :: few_restarts = 2
      type(modal_options_type) :: own

      own = options
      if (group%targets > 1) own%max_restarts = min(few_restarts, options%max_restarts)
      own%target = group%centre
      own%modes = group%modes
      call solver%solve(own, found, error, monitor)
   end subroutine solve_at

   ! Radius of the disc about its target in which a result has all modes.
   pure real(wp) function reach_of(found)
      type(modal_result_type), intent(in) :: found

      reach_of = maxval(distances(found%eigenvalues, found%target))
   end function reach_of

   ! Whether the modes nearest to a target are all among those that were found about the centre of the group.
   logical function covers(found, group, target, modes)
      type(modal_result_type), intent(in) :: found
      type(group_type), intent(in) :: group
      complex(wp), intent(in) :: target
      integer, intent(in) :: modes
      integer :: order(size(found%eigenvalues)), i

      covers = found%reason == reason_converged .and. size(found%eigenvalues) == group%modes .and. &
         found%certified /= certified_no .and. found%missing <= 0
      do i = 1, size(found%notes)
         covers = covers .and. index(found%notes(i), "mode") /= 1
      end do
      if (.not. covers) return
      order = nearest_first(found%eigenvalues, target)
      covers = abs(upper(target) - group%centre) + distances(found%eigenvalues(order(modes)), target) <= &
         (1 - same_frequency)*reach_of(found)
   end function covers

   ! The modes nearest to a target.
   function share_of(found, target, options) result(share)
      type(modal_result_type), intent(in) :: found
      complex(wp), intent(in) :: target
      type(modal_options_type), intent(in) :: options
      type(modal_result_type) :: share
      integer :: order(size(found%eigenvalues))

      share = found
      share%target = target
      share%options = options
      share%options%target = target
      share%modes_asked = options%modes
      order = nearest_first(found%eigenvalues, target)
      call share%take(order(:min(options%modes, size(order))))
   end function share_of
end module kschur_targets
