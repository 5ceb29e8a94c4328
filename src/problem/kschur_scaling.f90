!> Scales of a problem: a typical frequency of the matrices, and factors that scale rows of the constraint Jacobian to the level
!> of the stiffness, so that multipliers have the magnitude of displacements.
module kschur_scaling
   use kschur_kinds, only: wp
   use kschur_options, only: scaling_row, scaling_scalar
   use kschur_problem, only: modal_problem_type
   implicit none
   private
   public :: constraint_factors, first_scale, typical_rate

contains

   !> Returns powers of two, so that scaling is exact: constraint i is multiplied by factors(i), and the multiplier of the
   !> scaled constraint times factors(i) is that of the original one.
   pure function constraint_factors(problem, scaling, shift) result(factors)
      type(modal_problem_type), intent(in) :: problem
      !> One of `scaling_*`.
      integer, intent(in) :: scaling
      !> The level is that of |s|^2 |M| + |s| |R| + |K| at this s (1/s), nonzero for a mechanism without stiffness.
      complex(wp), intent(in) :: shift
      real(wp) :: factors(problem%multipliers())
      real(wp) :: level(problem%unknowns()), row_level, row_size
      integer :: i, k

      factors = 1
      if (size(factors) == 0) return
      level = abs(shift)**2*problem%mass%row_maxima() + abs(shift)*problem%damping%row_maxima() &
         + problem%stiffness%row_maxima()
      associate (cq => problem%constraints)
         select case (scaling)
         case (scaling_scalar)
            factors = nearest_power((sum(level)/size(level))/(sum(abs(cq%value))/cq%nonzeros()))
         case (scaling_row)
            do i = 1, cq%rows
               row_level = 0
               row_size = 0
               do k = cq%row_start(i), cq%row_start(i + 1) - 1
                  row_level = max(row_level, level(cq%column(k)))
                  row_size = max(row_size, abs(cq%value(k)))
               end do
               factors(i) = nearest_power(row_level/row_size)
            end do
         end select
      end associate
   end function constraint_factors

   !> Median of sqrt(k/m) over unknowns with diagonal stiffness, of K and H, and mass (1/s), up to a factor of two: independent of
   !> units, and of a few very stiff or heavy unknowns. Without stiffness from damping, or else gyroscopic forces, and mass, without
   !> mass from stiffness and damping, else 1.
   pure real(wp) function typical_rate(problem) result(rate)
      type(modal_problem_type), intent(in) :: problem
      real(wp), dimension(problem%unknowns()) :: mass, other
      integer :: power

      mass = abs(problem%mass%diagonal())
      other = abs(problem%stiffness%diagonal())
      if (allocated(problem%loss)) other = other + abs(problem%loss%diagonal())
      power = 2
      if (problem%mass%is_zero()) then
         mass = abs(problem%damping%diagonal())
         ! Gyroscopic forces have no diagonal.
         if (.not. any(mass > 0 .and. other > 0)) mass = problem%damping%row_maxima()
         power = 1
      else if (.not. any(mass > 0 .and. other > 0)) then
         other = abs(problem%damping%diagonal())
         if (.not. any(mass > 0 .and. other > 0)) other = problem%damping%row_maxima()
         power = 1
      end if
      rate = 1
      if (any(mass > 0 .and. other > 0)) &
         rate = scale(1.0_wp, median(pack(exponent(other) - exponent(mass), mass > 0 .and. other > 0))/power)
   end function typical_rate

   !> Estimate of a low frequency from the matrices (1/s): in their units, though far above the lowest modes of a fine mesh.
   !> Lowered for heavy parts: low modes are resolved from below.
   pure real(wp) function first_scale(problem)
      type(modal_problem_type), intent(in) :: problem
      real(wp), parameter :: below_the_highest = 1.0e-3_wp, heaviest = 1.0e-2_wp
      real(wp) :: typical, of_norms

      typical = typical_rate(problem)
      of_norms = typical
      if (.not. problem%mass%is_zero()) then
         of_norms = problem%stiffness%infinity_norm()
         if (allocated(problem%loss)) of_norms = of_norms + problem%loss%infinity_norm()
         of_norms = sqrt(of_norms/problem%mass%infinity_norm())
         if (.not. of_norms > 0) of_norms = problem%damping%infinity_norm()/problem%mass%infinity_norm()
      end if
      first_scale = below_the_highest*min(typical, max(of_norms, heaviest*typical))
   end function first_scale

   ! Median of a nonempty list of small integers, by counting.
   pure integer function median(numbers)
      integer, intent(in) :: numbers(:)
      integer, allocatable :: times(:)
      integer :: i, passed

      allocate (times(minval(numbers):maxval(numbers)), source=0)
      do i = 1, size(numbers)
         times(numbers(i)) = times(numbers(i)) + 1
      end do
      passed = 0
      do median = lbound(times, 1), ubound(times, 1)
         passed = passed + times(median)
         if (2*passed >= size(numbers)) return
      end do
   end function median

   ! A power of two within a factor of two of x; 1 if x is not positive and finite.
   elemental real(wp) function nearest_power(x)
      real(wp), intent(in) :: x

      nearest_power = 1
      if (x > 0 .and. x <= huge(x)) nearest_power = scale(1.0_wp, exponent(x))
   end function nearest_power
end module kschur_scaling
