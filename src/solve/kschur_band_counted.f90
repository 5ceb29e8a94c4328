!> Computes all modes of a band of an undamped or proportionally damped symmetric problem: the eigenvalues are counted by inertia,
!> and the parts of the band are solved one by one (docs/theory.md, section 14).
module kschur_band_counted
   use kschur_band_damping, only: left_damping_type
   use kschur_band_cuts, only: count_parts
   use kschur_band_groups, only: band_groups_type
   use kschur_band_part, only: finished_parts_type, part_modes_type
   use kschur_band_parts, only: part_type
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: chosen_pairs, eigenpairs_type, move_pairs, replace_pair
   use kschur_error, only: error_type, take_cancelled
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: accept_pairs, mode_request_type, nearest_first
   use kschur_modes, only: modes_type, no_modes
   use kschur_monitor, only: ask_monitor
   use kschur_options, only: formulation_proportional, formulation_symmetric
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes, reason_cancelled, reason_converged
   use kschur_text, only: text
   implicit none
   private
   public :: can_be_counted, solve_counted

contains

   !> Whether the modes of a band may be counted by inertia: with a symmetric formulation, alpha and beta not negative, no losses,
   !> and a solver that computes inertias. The counts may still show that omega^2 is negative somewhere.
   pure logical function can_be_counted(s)
      type(solve_context_type), intent(in) :: s

      can_be_counted = any(s%formulation == [formulation_symmetric, formulation_proportional]) .and. &
         min(s%problem%alpha, s%problem%beta) >= 0 .and. allocated(s%inner%counting) .and. .not. s%is_lossy()
   end function can_be_counted

   !> Computes all modes with band(1) <= omega <= band(2) (rad/s), omega being the undamped frequency: part by part, from the
   !> undamped modes, which have the same shapes (docs/theory.md, eq. (4)).
   subroutine solve_counted(s, band, modes, counted, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      real(wp), intent(in) :: band(2)
      !> `found` is the number of modes in the band, listed or not.
      type(modes_type), intent(out) :: modes
      !> False if the modes turned out not to be countable: nothing is computed then.
      logical, intent(out) :: counted
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout) :: groups
      ! From this number on the monitor is told how many modes there are, as they take long.
      integer, parameter :: many = 1000
      type(part_type), allocatable :: parts(:)
      type(finished_parts_type), target :: finished
      type(eigenpairs_type) :: rigid
      integer :: total, missing

      counted = .true.
      allocate (parts(0))
      if (s%plan%unknowns_after > 0) &
         call count_parts(s, band, count(.not. abs(s%known%rigid%lambda) > 0), parts, counted, error, groups)
      if (.not. allocated(error)) call ask_monitor(s%monitor, error)
      if (allocated(error) .or. .not. counted) return
      total = sum(parts%below_to - parts%below_from)
      if (associated(s%monitor) .and. total >= many) &
         call s%monitor%announce("the band holds "//text(total)//" oscillating modes")
      modes = no_modes(s%problem%unknowns(), s%problem%multipliers())
      modes%certified = certified_yes
      rigid = chosen_pairs(s%known%rigid, abs(s%known%rigid%lambda) >= band(1) .and. abs(s%known%rigid%lambda) <= band(2))
      call accept_pairs(s%problem, mode_request_type(rigid=size(rigid%lambda)), rigid, modes)
      allocate (finished%found(size(parts)))
      if (size(parts) > 0) call solve_parts(s, parts, finished, modes, counted, error, groups)
      if (allocated(error) .or. .not. counted) return
      associate (solved => finished%found(:finished%parts))
         missing = total - sum(solved%oscillators)
         call append_parts(solved, modes)
      end associate
      call modes%take(nearest_first(modes%lambda, s%options%target))
      modes%found = size(modes%lambda) + missing
      if (missing > 0 .and. modes%certified == certified_yes) modes%certified = certified_no
   end subroutine solve_counted

   ! Solves the parts one by one, with the undamped problem in the place of the damped one.
   subroutine solve_parts(s, parts, finished, modes, counted, error, groups)
      type(solve_context_type), target, intent(inout) :: s
      type(part_type), intent(in) :: parts(:)
      !> The modes of the parts.
      type(finished_parts_type), target, intent(inout) :: finished
      !> Reason, verdict, locking error and history of the band.
      type(modes_type), intent(inout) :: modes
      !> False if a part has a negative eigenvalue omega^2, so that the count does not apply.
      logical, intent(out) :: counted
      type(error_type), allocatable, intent(out) :: error
      type(band_groups_type), intent(inout) :: groups
      type(left_damping_type), target :: damping
      integer :: applications, i
      logical :: cancelled

      counted = .true.
      call damping%leave_out(s)
      applications = s%effort%operator_applications
      if (associated(s%checkpoint)) call s%checkpoint%begin_parts(finished, error)
      call groups%announce(parts)
      do i = 1, size(parts)
         if (allocated(error)) exit
         if (associated(s%monitor)) call s%monitor%counts(sum(finished%found(:i - 1)%oscillators), &
            parts(i)%below_to - parts(i)%below_from, sum(parts%below_to - parts%below_from))
         if (i <= finished%parts) then
            call s%effort%add_effort(finished%found(i)%effort)
         else
            call groups%obtain(i, s, parts, finished%found(i), error)
         end if
         call take_cancelled(error, cancelled)
         ! The parts before this one are complete.
         if (cancelled) modes%reason = reason_cancelled
         if (cancelled) modes%certified = certified_unknown
         if (allocated(error) .or. cancelled) exit
         counted = finished%found(i)%counted
         if (.not. counted) exit
         call modes%history%append(finished%found(i)%history, applications)
         applications = applications + finished%found(i)%effort%operator_applications
         call merge_verdict(finished%found(i), modes)
         if (associated(s%checkpoint) .and. i > finished%parts) call s%checkpoint%next_part()
         finished%parts = max(i, finished%parts)
         if (modes%reason == reason_cancelled) exit
      end do
      ! Later steps are not saved: a resumed solve repeats them.
      nullify (s%checkpoint)
      call damping%put_back(s)
   end subroutine solve_parts

   ! Merges reason, verdict and locking error of a part into those of the band.
   subroutine merge_verdict(found, modes)
      type(part_modes_type), intent(in) :: found
      type(modes_type), intent(inout) :: modes

      modes%locking_error = max(modes%locking_error, found%locking_error)
      if (found%reason /= reason_converged) then
         modes%reason = found%reason
         modes%certified = certified_unknown
      else if (found%certified == certified_no .and. modes%certified == certified_yes) then
         modes%certified = certified_no
      end if
   end subroutine merge_verdict

   ! Appends the modes of parts, and frees each part when it is copied: memory may not suffice for two copies of all.
   subroutine append_parts(parts, modes)
      type(part_modes_type), intent(inout) :: parts(:)
      type(modes_type), intent(inout) :: modes
      type(eigenpairs_type) :: joined
      integer :: total, last, i

      total = size(modes%lambda) + sum([(size(parts(i)%lambda), i=1, size(parts))])
      allocate (joined%lambda(total), joined%xi(size(modes%xi, 1), total))
      if (is_real(modes) .and. all([(is_real(parts(i)), i=1, size(parts))])) then
         allocate (joined%real_phi(modes%rows(), total))
      else
         allocate (joined%phi(modes%rows(), total))
      end if
      last = 0
      call move(modes)
      do i = 1, size(parts)
         call move(parts(i))
         modes%backward_error = [modes%backward_error, parts(i)%backward_error]
         modes%error_bound = [modes%error_bound, parts(i)%error_bound]
      end do
      call move_pairs(joined, modes%eigenpairs_type)
      modes%uncertainty = modes%error_bound
      modes%motion = [modes%motion, spread(0, 1, total - size(modes%motion))]

   contains

      ! Moves the pairs of a list behind those before.
      subroutine move(list)
         class(modes_type), intent(inout) :: list
         type(eigenpairs_type) :: pairs
         integer :: j

         call move_pairs(list%eigenpairs_type, pairs)
         do j = 1, size(pairs%lambda)
            joined%lambda(last + j) = pairs%lambda(j)
            call replace_pair(joined, last + j, pairs, j)
         end do
         last = last + size(pairs%lambda)
      end subroutine move

      ! Whether a list can be stored with real shapes.
      pure logical function is_real(list)
         class(modes_type), intent(in) :: list

         is_real = list%is_real() .or. size(list%lambda) == 0
      end function is_real
   end subroutine append_parts
end module kschur_band_counted
