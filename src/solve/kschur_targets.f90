!> Computes the modes nearest to each of several targets; neighbouring targets share a shift, its factors and one Krylov space.
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

   ! The first of the remaining targets, which are solved together.
   type :: group_type
      integer :: targets = 1
      ! Centre of a disc that contains the discs of the modes of each target (1/s), and number of modes in it.
      complex(wp) :: centre = (0.0_wp, 0.0_wp)
      integer :: modes = 0
   end type group_type

contains

   !> Returns for each target what `solver%solve` gives for it. If the discs that hold the modes of several targets lie in one disc
   !> with no more modes than these targets want together, the modes of that disc are computed, and each target takes the nearest.
   !> Targets whose disc turns out not to be covered, or all if a note is about one of the modes, are tried again, finally one by
   !> one. The effort is reported with the first of the results that share it (docs/theory.md, section 15).
   subroutine solve_targets(solver, targets, options, results, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      !> lambda (1/s).
      complex(wp), intent(in) :: targets(:)
      !> As for one target; its target is ignored.
      type(modal_options_type), intent(in) :: options
      !> One for each target.
      type(modal_result_type), allocatable, intent(out) :: results(:)
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      type(modal_result_type) :: found
      type(group_type) :: group
      integer, allocatable :: waiting(:)
      logical, allocatable :: covered(:)
      ! Radius of the last disc divided by the number of its modes (1/s).
      real(wp) :: radius_per_mode
      complex(wp) :: accumulation
      integer :: largest_number, i

      call find_accumulation(solver, real(size(targets), wp)*options%modes, accumulation, error)
      if (allocated(error)) return
      allocate (results(size(targets)))
      waiting = nearest_first(targets, (0.0_wp, 0.0_wp))
      radius_per_mode = huge(radius_per_mode)
      largest_number = 1
      do while (size(waiting) > 0)
         group = next_group(targets(waiting), options, radius_per_mode, largest_number, accumulation)
         call solve_at(solver, group, options, found, error, monitor)
         if (allocated(error)) return
         if (size(found%eigenvalues) > 0) radius_per_mode = radius_of(found)/size(found%eigenvalues)
         if (largest_number == 1) largest_number = most_modes(found)
         allocate (covered(size(waiting)), source=.false.)
         do i = 1, group%targets
            covered(i) = group%targets == 1
            if (.not. covered(i)) covered(i) = covers(found, group, targets(waiting(i)), options%modes)
            if (.not. covered(i)) cycle
            results(waiting(i)) = nearest_of(found, targets(waiting(i)), options)
            found%effort_type = effort_type()
         end do
         ! If a common disc failed for all its targets, no other is tried.
         if (.not. any(covered)) largest_number = 0
         waiting = pack(waiting, .not. covered)
         deallocate (covered)
      end do
   end subroutine solve_targets

   ! Fails if memory for so many modes is short. Finds the point where overdamped eigenvalues accumulate with proportional damping,
   ! -1/beta.
   subroutine find_accumulation(solver, modes, accumulation, error)
      type(modal_solver_type), intent(in) :: solver
      real(wp), intent(in) :: modes
      complex(wp), intent(out) :: accumulation
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: problem

      problem = solver%current_problem()
      accumulation = huge(1.0_wp)
      if (abs(problem%beta) > 0) accumulation = -1/problem%beta
      call require_memory(complex_bytes*modes*(real(problem%unknowns(), wp) + problem%multipliers()), "the results", error)
   end subroutine find_accumulation

   ! Largest number of modes that are computed together, as more cost more than they save; smaller for Krylov-Schur, whose projected
   ! problems cost more than those of Lanczos.
   pure integer function most_modes(found)
      type(modal_result_type), intent(in) :: found
      integer, parameter :: of_lanczos = 60, of_others = 30

      most_modes = of_lanczos
      if (all(found%formulation /= [formulation_symmetric, formulation_proportional, formulation_low_rank, formulation_dense])) &
         most_modes = of_others
   end function most_modes

   ! The longest group of leading targets whose common disc holds no more modes than they want together, by an estimate, and which
   ! is not near the accumulation point; one target at least.
   function next_group(targets, options, radius_per_mode, largest_number, accumulation) result(group)
      complex(wp), intent(in) :: targets(:)
      type(modal_options_type), intent(in) :: options
      real(wp), intent(in) :: radius_per_mode
      integer, intent(in) :: largest_number
      complex(wp), intent(in) :: accumulation
      type(group_type) :: group
      real(wp), parameter :: margin = 1.2_wp
      complex(wp) :: centre
      real(wp) :: modes
      integer :: i

      group = group_type(1, targets(1), options%modes)
      if (allocated(options%shift) .or. radius_per_mode >= huge(radius_per_mode)) return
      do i = 2, size(targets)
         centre = (upper_half(targets(1)) + upper_half(targets(i)))/2
         modes = margin*(options%modes + maxval(abs(upper_half(targets(:i)) - centre))/radius_per_mode)
         if (modes > min(real(i, wp)*options%modes, real(largest_number, wp)) .or. &
            abs(accumulation - centre) < 2*modes*radius_per_mode) exit
         group = group_type(i, centre, ceiling(modes))
      end do
   end function next_group

   ! The target or its conjugate in the upper half plane: both have the same disc, as distances are those of the nearer of a pair.
   elemental complex(wp) function upper_half(target)
      complex(wp), intent(in) :: target

      upper_half = cmplx(real(target, wp), abs(aimag(target)), wp)
   end function upper_half

   ! Computes the modes of the disc of a group.
   subroutine solve_at(solver, group, options, found, error, monitor)
      type(modal_solver_type), target, intent(inout) :: solver
      type(group_type), intent(in) :: group
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), target, intent(inout), optional :: monitor
      ! Largest number of restarts for a common disc: one that needs more may hold a point where eigenvalues accumulate.
      integer, parameter :: few_restarts = 2
      type(modal_options_type) :: settings

      settings = options
      if (group%targets > 1) settings%max_restarts = min(few_restarts, options%max_restarts)
      settings%target = group%centre
      settings%modes = group%modes
      call solver%solve(settings, found, error, monitor)
   end subroutine solve_at

   ! Radius of the disc around its target in which a result has all modes (1/s).
   pure real(wp) function radius_of(found)
      type(modal_result_type), intent(in) :: found

      radius_of = maxval(distances(found%eigenvalues, found%target))
   end function radius_of

   ! Whether the modes nearest to a target are all among those found in the disc of its group, and no note is about one of these.
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
      covers = abs(upper_half(target) - group%centre) + distances(found%eigenvalues(order(modes)), target) <= &
         (1 - same_frequency)*radius_of(found)
   end function covers

   ! The result for one target, with the nearest of the modes found.
   function nearest_of(found, target, options) result(share)
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
   end function nearest_of
end module kschur_targets
