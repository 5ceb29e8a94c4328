!> Solves one problem by several methods, and compares their modes.
module cli_comparison
   use cli_interrupt, only: is_interrupted
   use cli_processes, only: gather_processes
   use cli_progress, only: progress_type
   use kschur, only: arpack_fair, arpack_plain, certified_yes, error_cancelled, error_type, formulation_auto, &
      formulation_damped_constrained, formulation_quadratic, method_arpack, method_krylov_schur, modal_options_type, &
      modal_problem_type, modal_result_type, new_error, reason_cancelled, reason_interrupted, solve_modes, wp
   implicit none
   private
   public :: comparison_type, compare_methods, entry_type, method_count

   integer, parameter :: method_count = 5
   !> Names of the methods.
   character(len=*), parameter, public :: labels(method_count) = [character(len=12) :: &
      "auto", "quadratic", "pencil", "arpack-plain", "arpack-fair"]

   !> Result of one method.
   type :: entry_type
      type(modal_result_type) :: result
      !> Error, if there is no result; else not allocated.
      type(error_type), allocatable :: error
      !> Number of modes of the reference that it lacks; number of its modes, not further from the target than those of the
      !> reference, that the reference lacks.
      integer :: missed = 0, spurious = 0
      real(wp) :: worst = 0, median = 0
   end type entry_type

   !> Results of all methods, and which of them is the reference.
   type :: comparison_type
      type(entry_type) :: entries(method_count)
      !> Reference method; 0 if all failed.
      integer :: reference = 0
      !> Whether its modes are proved to be the wanted ones.
      logical :: certified = .false.
   end type comparison_type

contains

   !> Solves by each method, at the same target and shift if these are given.
   subroutine compare_methods(problem, options, comparison, progress)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(comparison_type), intent(out) :: comparison
      type(progress_type), intent(inout) :: progress
      integer, parameter :: methods(method_count) = [method_krylov_schur, method_krylov_schur, method_krylov_schur, &
         method_arpack, method_arpack]
      integer, parameter :: formulations(method_count) = [formulation_auto, formulation_quadratic, &
         formulation_damped_constrained, formulation_auto, formulation_auto]
      type(modal_options_type) :: own
      integer :: i

      own = options
      do i = 1, method_count
         own%method = methods(i)
         own%formulation = formulations(i)
         own%arpack = merge(arpack_plain, arpack_fair, i == method_count - 1)
         ! The costs of forms are compared, without a count of refined modes.
         own%uncounted = options%uncounted .or. (formulations(i) /= formulation_auto .and. .not. options%certify)
         call progress%name_solve(trim(labels(i)))
         associate (entry => comparison%entries(i))
            call gather_processes(own)
            if (is_interrupted()) then
               call new_error(entry%error, error_cancelled, "the comparison was interrupted before")
            else
               call solve_modes(problem, own, entry%result, entry%error, progress)
               if (entry%result%reason == reason_cancelled) entry%result%reason = reason_interrupted
            end if
         end associate
      end do
      call choose_reference(comparison)
      do i = 1, method_count
         if (.not. allocated(comparison%entries(i)%error)) &
            call judge(comparison%entries(comparison%reference)%result, comparison%entries(i))
      end do
   end subroutine compare_methods

   ! Chooses the reference: the first certified result of Krylov-Schur, else, of those with most modes, the one with the smallest
   ! backward error. Sets the worst and median backward error of each method.
   subroutine choose_reference(comparison)
      type(comparison_type), intent(inout) :: comparison
      integer :: i

      do i = 1, method_count
         associate (entry => comparison%entries(i))
            if (allocated(entry%error)) cycle
            entry%worst = maxval([0.0_wp, entry%result%backward_error])
            entry%median = median(entry%result%backward_error)
            if (comparison%certified) cycle
            comparison%certified = entry%result%certified == certified_yes .and. &
               entry%result%options%method == method_krylov_schur
            if (comparison%certified .or. comparison%reference == 0) then
               comparison%reference = i
            else if (is_better(entry, comparison%entries(comparison%reference))) then
               comparison%reference = i
            end if
         end associate
      end do
   end subroutine choose_reference

   ! Whether a result makes a better reference: it has more modes, or as many with a smaller backward error. One of plain ARPACK is
   ! never better than another, as its spurious values are no modes.
   pure logical function is_better(entry, other)
      type(entry_type), intent(in) :: entry, other

      associate (found => size(entry%result%eigenvalues), before => size(other%result%eigenvalues))
         is_better = found > before .or. (found == before .and. entry%worst < other%worst)
         ! Spurious values of plain ARPACK are not modes.
         if (entry%result%options%is_plain() .neqv. other%result%options%is_plain()) &
            is_better = other%result%options%is_plain()
      end associate
   end function is_better

   ! Counts the modes of the reference that a method missed, and its spurious ones. Matches modes one to one, with multiplicities.
   subroutine judge(reference, entry)
      type(modal_result_type), intent(in) :: reference
      type(entry_type), intent(inout) :: entry
      ! Tolerance of equal eigenvalues, relative to the larger one; for a zero, relative to the largest of all.
      real(wp), parameter :: same = 1.0e-6_wp
      logical :: free(size(entry%result%eigenvalues))
      real(wp) :: largest, reach
      integer :: i, j

      associate (expected => reference%eigenvalues, found => entry%result%eigenvalues)
         free = .true.
         largest = maxval([0.0_wp, abs(expected)])
         do i = 1, size(expected)
            j = minloc(abs(found - expected(i)), 1, free)
            if (j > 0) then
               if (abs(found(j) - expected(i)) > same*merge(max(abs(found(j)), abs(expected(i))), largest, &
                  abs(expected(i)) > 0)) j = 0
            end if
            if (j > 0) then
               free(j) = .false.
            else
               entry%missed = entry%missed + 1
            end if
         end do
         reach = maxval([0.0_wp, distance(expected, reference%target)])
         entry%spurious = count(free .and. distance(found, reference%target) < (1 - same)*reach)
      end associate
   end subroutine judge

   ! Distance of the nearer member of a conjugate pair.
   elemental real(wp) function distance(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distance = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distance

   ! The lower median; 0 if there are no values.
   pure real(wp) function median(values)
      real(wp), intent(in) :: values(:)
      real(wp) :: rest(size(values))
      integer :: i, at

      median = 0
      rest = values
      do i = 1, (size(values) + 1)/2
         at = minloc(rest, 1)
         median = rest(at)
         rest(at) = huge(1.0_wp)
      end do
   end function median
end module cli_comparison
