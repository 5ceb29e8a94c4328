!> A long list of modes nearest to zero: those of a band that holds a few more, which groups of processes find part by part.
module kschur_long_list
   use kschur_band_counted, only: can_be_counted, solve_counted
   use kschur_band_groups, only: band_groups_type
   use kschur_band_parts, only: count_at
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: nearest_first
   use kschur_modes, only: modes_type
   use kschur_options, only: method_krylov_schur
   implicit none
   private
   public :: find_long_list, is_long_list

   ! Shorter lists are found at once; a band holds no more modes than a bit more than the longest.
   integer, parameter :: shortest = 500, longest = 9000

contains

   !> Whether the modes of a problem that is begun are best found in parts.
   pure logical function is_long_list(s)
      type(solve_context_type), intent(in) :: s

      associate (asked => s%options)
         is_long_list = asked%modes >= shortest .and. asked%modes <= longest .and. .not. abs(asked%target) > 0 .and. &
            .not. allocated(asked%shift) .and. asked%method == method_krylov_schur .and. .not. &
            (asked%left .or. asked%certify .or. asked%uncounted)
      end associate
      if (is_long_list) is_long_list = can_be_counted(s) .and. .not. (associated(s%checkpoint) .or. s%is_lossy())
   end function is_long_list

   !> The modes nearest to zero, as many as were asked for.
   subroutine find_long_list(s, groups, modes, done, error)
      !> Prepared.
      type(solve_context_type), target, intent(inout) :: s
      type(band_groups_type), intent(inout) :: groups
      type(modes_type), intent(out) :: modes
      !> False where they are to be found in another way.
      logical, intent(out) :: done
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: order(:)
      real(wp) :: last

      last = 0
      if (groups%are_several()) call find_end(s, last)
      done = last > 0
      if (done) call solve_counted(s, [0.0_wp, last], modes, done, error, groups)
      if (allocated(error) .or. .not. done) return
      order = nearest_first(modes%lambda, (0.0_wp, 0.0_wp))
      call modes%take(order(:min(size(order), s%options%modes)))
   end subroutine find_long_list

   ! An omega (rad/s) below which there are as many modes as were asked for and a few more; zero where there is none.
   subroutine find_end(s, last)
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(out) :: last
      ! Relative: where two ends are one, and where modes are as good as rigid.
      real(wp), parameter :: close = 1.0e-3_wp, lowest = 1.0e-6_wp
      real(wp) :: low, high, middle, top
      integer :: below, enough

      last = 0
      if (s%plan%unknowns_after == 0) return
      enough = s%options%modes + s%options%modes/20
      low = 0
      top = stiffest(s)
      high = top
      do while (high - low > close*high .and. high > lowest*top)
         middle = merge((low + high)/2, high/2, low > 0)
         call count_at(s, middle**2, below)
         if (below < s%options%modes) then
            low = middle
         else
            high = middle
            if (below <= enough) exit
         end if
      end do
      if (.not. (high - low > close*high .and. high > lowest*top)) return
      ! Where damping is above half of critical, modes above may be nearer to zero.
      if (s%problem%alpha/high + s%problem%beta*high <= 1) last = high
   end subroutine find_end

   ! A guess at the highest omega: that of an unknown alone.
   pure real(wp) function stiffest(s)
      type(solve_context_type), intent(in) :: s
      real(wp), allocatable :: mass(:), stiffness(:)

      allocate (mass, source=s%work%mass%diagonal())
      allocate (stiffness, source=s%work%stiffness%diagonal())
      stiffest = sqrt(maxval([0.0_wp, pack(stiffness, mass > 0)/pack(mass, mass > 0)]))
   end function stiffest
end module kschur_long_list
