!> Proof by Sylvester's law of inertia that no mode of an undamped or
!> proportionally damped symmetric problem is missing.
!>
!> Between s and t > s the number of negative eigenvalues of [K - s M, Cq^T; Cq, 0] grows by the number of finite eigenvalues
!> theta = omega^2 in [s, t): M is semidefinite, so K - s M decreases with s, and the contribution of infinite eigenvalues and
!> redundant constraints does not depend on s. (Parlett, The Symmetric Eigenvalue Problem, 3.3; for saddle matrices Gould, Math.
!> Prog. 32, 1985.)
module kschur_certificate
   use kschur_archive, only: archive_type
   use kschur_census, only: census_type
   use kschur_effort, only: effort_type, for_count
   use kschur_error, only: error_type
   use kschur_inertia, only: counting_matrix, negative_directions
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: linear_solver_type, matrix_structure_type, real_linear_solver_type
   use kschur_mass_bound, only: is_definite
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes
   use kschur_problem, only: modal_problem_type
   use kschur_random_start, only: random_start_type
   use kschur_row_problem, only: all_three, mass_alone, row_problem_type, undamped
   use kschur_sparse, only: csr_matrix_type
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: improbable, known_well, no_correct_digits, nearly_zero, same_frequency, same_value, &
      usual_least_of_mass
   implicit none
   private
   public :: certificate_type, indistinct, inertia_census_type, new_inertia_census

   real(wp), parameter :: infinity = huge(1.0_wp)

   !> Verdict, and effort.
   type, extends(effort_type) :: certificate_type
      !> One of `certified_*`.
      integer :: verdict = certified_unknown
      !> No eigenvalue at a smaller distance from the target is missing (1/s).
      real(wp) :: reach = 0
      !> If all eigenvalues were computed: their distances from the target, of each the nearer of a conjugate pair, without
      !> rigid motions (1/s).
      real(wp), allocatable :: distances(:)
   end type certificate_type

   !> Census that compares Ritz values with an inertia count about the target.
   type, extends(census_type) :: inertia_census_type
      !> The modes nearest to this lambda are wanted (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> All within this distance of it are wanted too (1/s).
      real(wp) :: within = 0
      type(certificate_type) :: certificate
      type(modal_problem_type), pointer, private :: problem => null()
      type(row_problem_type), pointer, private :: matrices => null()
      class(real_linear_solver_type), allocatable, private :: solver
      type(spectral_map_type), private :: map
      real(wp), private :: shift = 0
      integer, private :: zeros = 0
      ! Lower bound of the eigenvalues of M scaled to unit diagonal, or zero; and the least entry of its diagonal.
      real(wp), private :: mass_bound = 0, least_inertia = 0
      ! Negative eigenvalues at the shift; -1 if unknown.
      integer, private :: negative_at_shift = -1
      ! Interval of theta that was counted last, and its number of eigenvalues.
      logical, private :: counted = .false., given_up = .false.
      real(wp), private :: from = 0, to = 0
      integer, private :: expected = 0
      ! Distance of the furthest wanted value at that time.
      real(wp), private :: wanted_reach = 0
   contains
      procedure :: examine
      procedure :: carry
      !> Takes over the count of an interval.
      procedure :: take_count
      procedure, private :: count_about
      procedure, private :: count_found
      procedure, private :: distance_of
      procedure, private :: distance_beyond
      procedure, private :: theta_at
      procedure, private :: end_of_interval
      procedure, private :: converged_below
      procedure, private :: is_complete_below
      procedure, private :: negative_at
   end type inertia_census_type

contains

   !> Differences of distances from the target below this (1/s) do not count: far from the target all distances are nearly equal,
   !> though the eigenvalues are not.
   elemental real(wp) function indistinct(distance, size)
      !> Distance from the target, and magnitude of the eigenvalue (1/s).
      real(wp), intent(in) :: distance, size

      indistinct = same_frequency*min(distance, size)
   end function indistinct

   !> Creates a census of Ritz values 1/(theta - shift).
   subroutine new_inertia_census(census, problem, map, shift, factored, solver, zeros, mass_bound, matrices)
      type(inertia_census_type), intent(out) :: census
      type(modal_problem_type), target, intent(in) :: problem
      type(spectral_map_type), intent(in) :: map
      real(wp), intent(in) :: shift
      !> The solver that has factored the problem at the shift.
      class(linear_solver_type), intent(in) :: factored
      !> Prototype of a solver that computes the inertia of indefinite matrices.
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      !> Number of deflated zero eigenvalues.
      integer, intent(in) :: zeros
      !> Lower bound of the eigenvalues of M, scaled to unit diagonal; zero: none was proved.
      real(wp), intent(in) :: mass_bound
      !> Distributed matrices, whose whole copies may have been freed; absent or not associated: none.
      type(row_problem_type), pointer, optional, intent(in) :: matrices

      census%zeros = zeros
      census%mass_bound = mass_bound
      census%least_inertia = minval(problem%mass%diagonal())
      if (present(matrices)) census%matrices => matrices
      census%problem => problem
      census%map = map
      census%shift = shift
      ! Each multiplier has a negative pivot, except redundant ones, whose signs are rounding errors. Counting too few of these
      ! makes the census expect too many eigenvalues, never too few.
      if (factored%null_pivots == 0) census%negative_at_shift = factored%negative_pivots - problem%multipliers()
      ! At zero the pivots of rigid motions are rounding errors; these eigenvalues are not below the shift.
      if (.not. abs(shift) > 0) census%negative_at_shift = max(census%negative_at_shift - zeros, 0)
      call move_alloc(solver, census%solver)
   end subroutine new_inertia_census

   !> Writes the counts to a checkpoint, or reads them, with the effort.
   subroutine carry(self, archive)
      class(inertia_census_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive

      call archive%carry(self%negative_at_shift)
      call archive%carry(self%counted)
      call archive%carry(self%given_up)
      call archive%carry(self%from)
      call archive%carry(self%to)
      call archive%carry(self%expected)
      call archive%carry(self%wanted_reach)
      call archive%carry(self%certificate%verdict)
      call archive%carry(self%certificate%reach)
      call archive%carry(self%certificate%factorizations)
      self%certificate%factorizations_for(for_count) = self%certificate%factorizations
   end subroutine carry

   !> Compares the number of wanted and converged values with a count of eigenvalues: the last count if that reaches as far, and a
   !> new one if that does not, or disagrees. An incomplete set may still contain the nearest ones, if the missing ones lie between
   !> its furthest value and the end of the interval: if the same set is examined again, the interval ends at its furthest value.
   subroutine examine(self, values, residuals, wanted, complete, seen)
      class(inertia_census_type), intent(inout) :: self
      real(wp), intent(in) :: values(:), residuals(:)
      integer, intent(in) :: wanted
      logical, intent(out) :: complete
      type(random_start_type), optional, intent(in) :: seen
      real(wp) :: reach, slack

      complete = .false.
      if (self%given_up .or. wanted == 0 .or. wanted > size(values)) return
      ! The reach is at least the accuracy of computed zeros.
      reach = max(self%within, maxval(self%distance_of(values(:wanted))), nearly_zero*sqrt(abs(self%shift)))
      slack = indistinct(reach, sqrt(abs(self%shift) + 1/minval(abs(values(:wanted)), abs(values(:wanted)) > tiny(1.0_wp))))
      if (self%counted .and. reach <= self%certificate%reach + slack) &
         complete = self%count_found(values, residuals, wanted) == self%expected
      if (.not. complete) then
         call self%count_about(values, residuals, reach, &
            tight=self%counted .and. abs(reach - self%wanted_reach) <= slack, seen=seen)
         if (self%counted) complete = self%count_found(values, residuals, wanted) == self%expected
      end if
      self%certificate%verdict = certified_unknown
      self%given_up = .not. self%counted
      if (self%counted) self%certificate%verdict = merge(certified_yes, certified_no, complete)
   end subroutine examine

   ! Counts the eigenvalues in an interval that contains all nearer to the target than `reach`.
   subroutine count_about(self, values, residuals, reach, tight, seen)
      class(inertia_census_type), intent(inout) :: self
      real(wp), intent(in) :: values(:), residuals(:), reach
      logical, intent(in) :: tight
      type(random_start_type), optional, intent(in) :: seen
      integer :: above, below

      self%counted = .false.
      self%wanted_reach = reach
      if (self%negative_at_shift < 0) self%negative_at_shift = self%negative_at(self%shift, 0)
      if (self%negative_at_shift < 0) return
      call self%end_of_interval(1, values, residuals, reach, tight, self%to, above, seen)
      if (self%negative_at_shift == 0) then
         ! No eigenvalue is below the shift.
         self%from = self%shift
         below = 0
      else
         call self%end_of_interval(-1, values, residuals, reach, tight, self%from, below, seen)
      end if
      call self%take_count(self%from, self%to, below, above)
   end subroutine count_about

   !> Takes over the count of an interval of theta: the number of eigenvalues below either end, zeros included, -1 if unknown. The
   !> target must be set.
   subroutine take_count(self, from, to, below, above)
      class(inertia_census_type), intent(inout) :: self
      real(wp), intent(in) :: from, to
      integer, intent(in) :: below, above

      self%from = from
      self%to = to
      self%certificate%reach = self%distance_beyond(1, to)
      if (below /= 0) self%certificate%reach = min(self%certificate%reach, self%distance_beyond(-1, from))
      self%expected = above - below
      self%counted = min(above, below, self%expected) >= 0
   end subroutine take_count

   ! Number of wanted or converged values in the interval.
   integer function count_found(self, values, residuals, wanted)
      class(inertia_census_type), intent(in) :: self
      real(wp), intent(in) :: values(:), residuals(:)
      integer, intent(in) :: wanted
      real(wp) :: theta
      integer :: i

      count_found = 0
      if (self%from <= 0 .and. self%to > 0) count_found = self%zeros
      do i = 1, size(values)
         if ((i > wanted .and. residuals(i) > known_well) .or. .not. abs(values(i)) > tiny(1.0_wp)) cycle
         theta = self%shift + 1/values(i)
         if (theta > self%from .and. theta < self%to) count_found = count_found + 1
      end do
   end function count_found

   ! Distance from the target of the nearer lambda of a Ritz value; infinite for a Ritz value of zero.
   elemental real(wp) function distance_of(self, value) result(reach)
      class(inertia_census_type), intent(in) :: self
      real(wp), intent(in) :: value

      reach = infinity
      if (abs(value) > tiny(1.0_wp)) &
         reach = minval(abs(self%map%lambdas(cmplx(self%shift + 1/value, 0, wp)) - self%target))
   end function distance_of

   ! Smallest distance from the target of any theta above (side 1) or below (-1) a given one.
   real(wp) function distance_beyond(self, side, theta)
      class(inertia_census_type), intent(in) :: self
      integer, intent(in) :: side
      real(wp), intent(in) :: theta

      if (side > 0) then
         distance_beyond = self%map%distance_to(theta, infinity, self%target)
      else
         distance_beyond = self%map%distance_to(-infinity, theta, self%target)
      end if
   end function distance_beyond

   ! The theta on one side of the shift beyond which the distance from the target is at least `reach`, by bisection; infinite if
   ! none.
   real(wp) function theta_at(self, side, reach)
      class(inertia_census_type), intent(in) :: self
      integer, intent(in) :: side
      real(wp), intent(in) :: reach
      integer, parameter :: doublings = 200, halvings = 60
      real(wp) :: inside, outside, middle
      integer :: i

      inside = 0
      outside = max(abs(self%shift), reach**2, tiny(1.0_wp))
      do i = 1, doublings
         if (self%distance_beyond(side, self%shift + side*outside) >= reach) exit
         inside = outside
         outside = 2*outside
      end do
      theta_at = side*infinity
      if (i > doublings) return
      do i = 1, halvings
         middle = (inside + outside)/2
         if (self%distance_beyond(side, self%shift + side*middle) >= reach) then
            outside = middle
         else
            inside = middle
         end if
      end do
      theta_at = self%shift + side*outside
   end function theta_at

   ! Chooses an end of the interval in the first wide gap of values beyond `reach`, and counts the negative eigenvalues there;
   ! -1 if that fails.
   subroutine end_of_interval(self, side, values, residuals, reach, tight, theta, negative, seen)
      class(inertia_census_type), intent(inout) :: self
      integer, intent(in) :: side
      real(wp), intent(in) :: values(:), residuals(:), reach
      !> Whether to end at `reach`, up to rounding.
      logical, intent(in) :: tight
      real(wp), intent(out) :: theta
      integer, intent(out) :: negative
      type(random_start_type), optional, intent(in) :: seen
      real(wp) :: last, end_value

      theta = self%shift
      negative = self%negative_at_shift
      if (self%distance_beyond(side, theta) >= reach) return
      negative = -1
      theta = self%theta_at(side, reach)
      if (abs(theta) >= infinity) return
      last = 1/(side*(theta - self%shift))
      ! If the distance is not monotonic in theta, the interval may contain values that were not sought.
      if (any(side*values > last .and. self%distance_of(values) > (1 + same_frequency)*reach)) return

      end_value = 0
      if (.not. tight) end_value = clear_gap(side*values, residuals, last)
      if (.not. end_value > 0) end_value = near_gap(side*values, residuals, last)
      if (.not. end_value > 0) end_value = (1 + same_frequency)*last
      theta = self%shift + side/end_value
      if (side < 0) then
         negative = self%negative_at(theta, 0)
      else
         negative = self%converged_below(theta, values, residuals)
         if (.not. self%is_complete_below(theta, seen)) negative = self%negative_at(theta, negative)
      end if
   end subroutine end_of_interval

   ! Whether the random start of the iteration proves, up to a probability of `improbable`, that no eigenvalue between the shift and
   ! theta is missing, nor one as far below the shift. Rigid motions are deflated: that says nothing of these.
   logical function is_complete_below(self, theta, seen)
      class(inertia_census_type), intent(in) :: self
      real(wp), intent(in) :: theta
      type(random_start_type), optional, intent(in) :: seen
      type(error_type), allocatable :: error

      is_complete_below = .false.
      if (.not. present(seen) .or. self%negative_at_shift > 0) return
      if (.not. allocated(seen%values)) return
      ! Redundant constraints may hide that some are below the shift.
      if (self%problem%multipliers() > 0 .and. max(abs(self%shift), abs(self%target)) > 0) return
      ! With one start vector no found eigenvalue is known to be simple.
      if (size(seen%first, 1) < 2) return
      if (.not. seen%chance_of_missing(1/(theta - self%shift), same_value, usual_least_of_mass*self%least_inertia) <= improbable) &
         return
      is_complete_below = self%mass_bound >= usual_least_of_mass
      if (self%mass_bound > 0) return
      if (associated(self%matrices)) call self%matrices%bring_back(mass_alone, error)
      if (.not. allocated(error)) is_complete_below = is_definite(self%problem%mass, usual_least_of_mass)
   end function is_complete_below

   ! Lower bound of the number of eigenvalues below a theta above the shift: converged Ritz values are eigenvalues.
   integer function converged_below(self, theta, values, residuals) result(number)
      class(inertia_census_type), intent(in) :: self
      real(wp), intent(in) :: theta, values(:), residuals(:)

      number = self%negative_at_shift + count(values*(theta - self%shift) > 1 .and. residuals <= known_well)
      if (self%shift <= 0 .and. theta > 0) number = number + self%zeros
   end function converged_below

   ! Middle of the first wide gap below `last` between converged values, or of the widest one; zero if none.
   real(wp) function clear_gap(values, residuals, last) result(middle)
      real(wp), intent(in) :: values(:), residuals(:), last
      real(wp) :: upper, lower, widest
      logical :: converged
      integer :: i

      middle = 0
      widest = same_value
      upper = last
      converged = .true.
      do while (converged .and. widest < no_correct_digits)
         lower = 0
         converged = .false.
         i = maxloc(values, 1, values < upper .and. values > 0)
         if (i > 0) then
            converged = residuals(i) <= known_well
            lower = values(i)
            ! An unconverged value may be higher by its residual.
            if (.not. converged) lower = lower*(1 + residuals(i))
         end if
         if ((upper - lower)/upper > widest) then
            widest = (upper - lower)/upper
            middle = (upper + lower)/2
         end if
         upper = lower
      end do
   end function clear_gap

   ! Middle of the widest gap between converged values from `last` to (1 + same_frequency) last, which users regard as equal: the
   ! interval ends within this cluster, and the gap decides which of it count as the nearest. Zero if no converged one lies on the
   ! near side of the gap.
   pure real(wp) function near_gap(values, residuals, last) result(middle)
      real(wp), intent(in) :: values(:), residuals(:), last
      real(wp) :: upper, lower, widest

      middle = 0
      upper = (1 + same_frequency)*last
      widest = 0
      do while (upper > last)
         lower = max(last, maxval(values, values < upper .and. residuals <= known_well))
         if (upper - lower > widest) then
            widest = upper - lower
            middle = (upper + lower)/2
         end if
         upper = lower
      end do
      ! Without converged values beyond, the interval ends before all of them.
      if (.not. any(values > middle .and. values < (1 + same_frequency)*last .and. residuals <= known_well)) middle = 0
   end function near_gap

   ! Number of negative eigenvalues of K - theta M on the null space of the constraints, by one factorisation; -1 if unknown.
   integer function negative_at(self, theta, least) result(negative)
      class(inertia_census_type), intent(inout) :: self
      real(wp), intent(in) :: theta
      !> A lower bound of it.
      integer, intent(in) :: least
      class(real_linear_solver_type), allocatable :: solver
      type(csr_matrix_type) :: matrix
      type(matrix_structure_type) :: structure
      type(error_type), allocatable :: error

      negative = -1
      if (associated(self%matrices)) then
         ! R takes part in the scaling of constraints only.
         call self%matrices%bring_back(merge(all_three, undamped, self%problem%multipliers() > 0), error)
      end if
      if (.not. allocated(error)) call counting_matrix(self%problem, theta, least, matrix, structure, error)
      if (associated(self%matrices)) call self%matrices%put_away(all_three)
      if (allocated(error)) return
      allocate (solver, source=self%solver)
      negative = negative_directions(matrix, structure, solver)
      call self%certificate%add_factors(solver, for_count)
   end function negative_at
end module kschur_certificate
