!> Selects the modes nearest to a target from Ritz values of a shift-invert operator.
module kschur_modal_selection
   use kschur_kinds, only: wp
   use kschur_selection, only: directions_around, selection_type
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: blurred_value, equal_value, negligible_change, real_tolerance, same_value, seems_zero
   implicit none
   private
   public :: modal_selection_type

   !> The `wanted` modes nearest to the target; a complex-conjugate pair is one mode.
   type, extends(selection_type) :: modal_selection_type
      type(spectral_map_type) :: map
      !> The shift, as a theta.
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      !> The target, as a lambda (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> Modes found earlier, which count as found (1/s).
      complex(wp), allocatable :: known(:)
      !> Whether eigenvalues below the real axis are ignored.
      logical :: upper = .false.
   contains
      procedure :: key
      procedure :: needed
      procedure :: find_border
      procedure :: crowds
      procedure, private :: lambdas_of
      procedure, private :: count_nearer
      procedure, private :: is_upper
   end type modal_selection_type

contains

   ! The two lambdas of a Ritz value mu = 1/(theta - shift).
   pure function lambdas_of(self, mu) result(lambdas)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: mu
      complex(wp) :: lambdas(2)

      lambdas = huge(1.0_wp)
      if (abs(mu) > tiny(1.0_wp)) lambdas = self%map%lambdas(self%shift + 1/mu)
   end function lambdas_of

   !> Distance of the nearer of the two lambdas of a Ritz value from the target; ignored values come last.
   real(wp) function key(self, value)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: value

      key = minval(abs(self%lambdas_of(value) - self%target))
      if (self%upper) key = merge(key, key + huge(1.0_wp)/2, self%is_upper(value))
   end function key

   ! Whether the eigenvalue of a Ritz value is not below the real axis, or errors may have moved it there.
   pure logical function is_upper(self, value)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: value
      complex(wp) :: lambdas(2)

      lambdas = self%lambdas_of(value)
      is_upper = aimag(lambdas(1)) >= -blurred_value*abs(lambdas(1))
   end function is_upper

   !> The border of the disc of lambdas that are nearer to the target than `last`, of which only the part above the real axis counts
   !> where those below are ignored. Unknown if theta has a pole inside it; empty if all that is nearer equals the target.
   subroutine find_border(self, last, values, border)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: last, values(:)
      complex(wp), allocatable, intent(out) :: border(:)
      complex(wp), allocatable :: seen(:), points(:)
      real(wp) :: radius, half_chord
      integer :: i

      radius = self%key(last)
      if (abs(self%map%beta) > 0) then
         if (abs(cmplx(1, self%map%loss, wp)/self%map%beta + self%target) <= radius) return
      end if
      radius = radius - max(negligible_change*radius, equal_value*(radius + abs(self%target)))
      seen = self%target + radius*directions_around()
      do i = 1, size(values)
         if (abs(values(i)) > tiny(1.0_wp)) seen = [seen, self%lambdas_of(values(i))]
      end do
      points = self%target + radius*(seen - self%target)/max(abs(seen - self%target), tiny(1.0_wp))
      ! Half of the real axis within the circle.
      half_chord = sqrt(max(radius**2 - aimag(self%target)**2, 0.0_wp))
      if (self%upper .and. half_chord > 0) then
         associate (middle => real(self%target, wp))
            where (min(aimag(seen), aimag(points)) < 0) &
               points = middle + max(-half_chord, min(half_chord, real(seen, wp) - middle))
            points = [points, cmplx(middle - half_chord, kind=wp), cmplx(middle + half_chord, kind=wp)]
         end associate
      end if
      points = [(self%map%theta(points(i)) - self%shift, i=1, size(points))]
      border = 1/pack(points, abs(points) > 0 .and. radius > 0)
   end subroutine find_border

   !> Whether at least eight values lie within one per cent of the last: stiffness-proportional damping clusters all stiff
   !> motions.
   logical function crowds(self, values, last)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:), last
      integer, parameter :: crowd = 8
      real(wp), parameter :: within = 0.01_wp
      integer :: i

      crowds = count([(abs(self%key(values(i)) - self%key(last)) <= within*self%key(last), i=1, size(values))]) >= crowd
   end function crowds

   ! Number of known modes within a distance.
   pure integer function count_nearer(self, distance)
      class(modal_selection_type), intent(in) :: self
      real(wp), intent(in) :: distance

      count_nearer = 0
      if (allocated(self%known)) count_nearer = count(abs(self%known - self%target) <= distance)
   end function count_nearer

   !> Number of leading values that contain enough modes, together with nearer known ones.
   integer function needed(self, values)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:)

      if (self%map%oscillator) then
         needed = needed_oscillators(self, values)
      else
         needed = needed_eigenvalues(self, values)
      end if
   end function needed

   ! `needed` if theta = lambda: the conjugate of an earlier value completes a pair and adds no mode.
   integer function needed_eigenvalues(self, values) result(needed)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:)
      complex(wp) :: lambda(size(values)), roots(2)
      logical :: single(size(values))
      integer :: modes, i, j

      modes = 0
      do i = 1, size(values)
         roots = self%lambdas_of(values(i))
         lambda(i) = roots(1)
         needed = i
         if (self%upper) then
            if (self%is_upper(values(i))) modes = modes + 1
            if (modes + self%count_nearer(self%key(values(i))) >= self%wanted) return
            cycle
         end if
         single(i) = abs(aimag(lambda(i))) > real_tolerance*abs(lambda(i))
         modes = modes + 1
         if (single(i)) then
            do j = i - 1, 1, -1
               if (.not. single(j)) cycle
               if (abs(lambda(j) - conjg(lambda(i))) > same_value*abs(lambda(i))) cycle
               single([i, j]) = .false.
               modes = modes - 1
               exit
            end do
         end if
         if (modes + self%count_nearer(self%key(values(i))) >= self%wanted) return
      end do
      needed = size(values) + self%wanted - modes
   end function needed_eigenvalues

   ! `needed` for oscillators: one is a single mode, or two if its roots are real; the second counts when the values extend to it.
   integer function needed_oscillators(self, values) result(needed)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:)
      complex(wp) :: roots(2)
      real(wp) :: second(size(values)), reach
      logical :: zero
      integer :: modes, i

      modes = 0
      second = huge(1.0_wp)
      do i = 1, size(values)
         roots = self%lambdas_of(values(i))
         reach = minval(abs(roots - self%target))
         ! An undamped zero has two roots but is one mode.
         zero = maxval(abs(roots))**2 <= seems_zero**2*abs(self%shift) .and. .not. abs(self%map%alpha) > 0
         if (.not. zero .and. all(abs(aimag(roots)) <= real_tolerance*abs(roots))) &
            second(i) = maxval(abs(roots - self%target))
         modes = i + count(second(:i) <= reach)
         needed = i
         if (modes + self%count_nearer(reach) >= self%wanted) return
      end do
      needed = size(values) + self%wanted - modes
   end function needed_oscillators
end module kschur_modal_selection
