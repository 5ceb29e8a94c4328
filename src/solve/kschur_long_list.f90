!> Computes a long list of modes nearest to zero with groups of processes: as the modes of a band from zero that holds a few more
!> (docs/theory.md, section 14).
module kschur_long_list
   use kschur_band_counted, only: can_be_counted, solve_counted
   use kschur_band_groups, only: band_groups_type
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: nearest_first
   use kschur_modes, only: modes_type
   use kschur_options, only: method_krylov_schur
   use kschur_tolerances, only: narrowest_interval, seems_rigid
   implicit none
   private
   public :: find_long_list, is_long_list

   ! Shorter lists are computed at once; a band for longer ones may exceed its largest number of modes.
   integer, parameter :: shortest = 500, longest = 9000

contains

   !> Whether the requested modes are better computed as parts of a band: many modes nearest to zero that can be counted, without
   !> options that a band does not have.
   pure logical function is_long_list(s)
      type(solve_context_type), intent(in) :: s

      associate (asked => s%options)
         is_long_list = asked%modes >= shortest .and. asked%modes <= longest .and. .not. abs(asked%target) > 0 .and. &
            .not. allocated(asked%shift) .and. asked%method == method_krylov_schur .and. .not. &
            (asked%left .or. asked%certify .or. asked%uncounted)
      end associate
      if (is_long_list) is_long_list = can_be_counted(s) .and. .not. (associated(s%checkpoint) .or. s%is_lossy())
   end function is_long_list

   !> Computes the requested number of modes nearest to zero.
   subroutine find_long_list(s, groups, modes, done, error)
      !> Prepared for a solve.
      type(solve_context_type), target, intent(inout) :: s
      type(band_groups_type), intent(inout) :: groups
      type(modes_type), intent(out) :: modes
      !> False if they are to be computed in another way: there is one group only, or no suitable band.
      logical, intent(out) :: done
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: order(:)
      real(wp) :: last

      last = 0
      if (groups%number_of_groups() > 1) call find_band_end(s, groups, last)
      done = last > 0
      if (done) call solve_counted(s, [0.0_wp, last], modes, done, error, groups)
      if (allocated(error) .or. .not. done) return
      order = nearest_first(modes%lambda, (0.0_wp, 0.0_wp))
      call modes%take(order(:min(size(order), s%options%modes)))
   end subroutine find_long_list

   ! Finds an omega (rad/s) below which there are as many modes as requested, and at most 5 % more, by sections of an interval, each
   ! counted by a group; zero if there is none.
   subroutine find_band_end(s, groups, last)
      type(solve_context_type), intent(inout) :: s
      type(band_groups_type), intent(inout) :: groups
      real(wp), intent(out) :: last
      real(wp) :: low, high, top, omega(groups%number_of_groups())
      integer, allocatable :: below(:)
      integer :: most_modes, i

      last = 0
      if (s%plan%unknowns_after == 0) return
      most_modes = s%options%modes + s%options%modes/20
      low = 0
      top = highest_estimate(s)
      high = top
      do while (high - low > narrowest_interval*high .and. high > seems_rigid*top)
         do i = 1, size(omega)
            omega(i) = low + i*(high - low)/(size(omega) + 1)
            ! From zero by halves, as the end may lie far below the highest.
            if (.not. low > 0) omega(i) = max(scale(high, i - 1 - size(omega)), seems_rigid*top)
         end do
         call groups%count(s, omega**2, below)
         do i = 1, size(omega)
            if (below(i) >= s%options%modes) exit
            low = omega(i)
         end do
         if (i > size(omega)) cycle
         high = omega(i)
         if (below(i) <= most_modes) exit
      end do
      if (.not. (high - low > narrowest_interval*high .and. high > seems_rigid*top)) return
      ! If damping exceeds half of critical, overdamped modes above the band may be nearer to zero.
      if (s%problem%alpha/high + s%problem%beta*high <= 1) last = high
   end subroutine find_band_end

   ! Estimate of the highest omega (rad/s): the largest sqrt(k/m) of the diagonals.
   pure real(wp) function highest_estimate(s)
      type(solve_context_type), intent(in) :: s
      real(wp), allocatable :: mass(:), stiffness(:)

      allocate (mass, source=s%work%mass%diagonal())
      allocate (stiffness, source=s%work%stiffness%diagonal())
      highest_estimate = sqrt(maxval([0.0_wp, pack(stiffness, mass > 0)/pack(mass, mass > 0)]))
   end function highest_estimate
end module kschur_long_list
