!> Proof that no mode is missing, for any damping: counts the eigenvalues inside a curve around the target by the winding number
!> of the determinant.
!>
!> The argument principle is textbook; Bindel and Hood (SIAM J. Matrix Anal. Appl. 34 (2013)) use it to localise
!> eigenvalues of nonlinear problems. A count by quadrature with random vectors (Maeda, Futamura, Sakurai, JSIAM
!> Letters 3 (2011)) estimates the same number, and proves nothing.
module kschur_winding_certificate
   use kschur_bordered_determinant, only: bordered_determinant_type, new_bordered_determinant
   use kschur_closed_curve, only: closed_curve_type, new_closed_curve
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_monitor, only: monitor_type
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_options, only: scaling_row
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes
   use kschur_problem, only: modal_problem_type
   use kschur_redundancy, only: count_redundant
   use kschur_scaling, only: constraint_factors
   use kschur_text, only: text
   use kschur_tolerances, only: blurred_value, no_correct_digits
   use kschur_winding, only: count_unknown_zeros, reason_length
   implicit none
   private
   public :: certify_by_winding, winding_certificate_type

   ! Largest number of entries of the border for redundant constraints.
   integer, parameter :: largest_border = 5000000

   !> Verdict, and effort.
   type, extends(effort_type) :: winding_certificate_type
      !> One of `certified_*`.
      integer :: verdict = certified_unknown
      !> If the verdict is no: number of missing eigenvalues nearer to the target than `reach`, both members of conjugate pairs.
      integer :: missing = 0
      !> If it is unknown: by how many more eigenvalues are listed than there are.
      integer :: surplus = 0
      !> Radius of the count (1/s).
      real(wp) :: reach = 0
      !> Why the verdict is unknown; else blank.
      character(len=reason_length) :: reason = ""
   end type winding_certificate_type

contains

   !> Proves that no eigenvalue is missing among the listed ones, or counts the missing ones. Counts inside a curve through the
   !> first wide gap of distances from the target beyond the listed eigenvalues. If that finds more than are known, the missing ones
   !> may be beyond the furthest listed one: a second curve passes through a gap inside that, and a third, if the two disagree, just
   !> inside it.
   subroutine certify_by_winding(problem, solver, listed, beyond, zeros, target, resolution, certificate, zeros_at_least, &
      monitor)
      !> Presolved and balanced: with entries of equal size, rounding does not destroy the phase of the determinant.
      type(modal_problem_type), intent(in) :: problem
      !> Prototype of a solver that computes determinants.
      class(complex_linear_solver_type), intent(in) :: solver
      !> Eigenvalues to be proved the nearest ones (1/s), with multiplicity, one of each conjugate pair, Im >= 0. Zeros are
      !> exactly zero.
      complex(wp), intent(in) :: listed(:)
      !> Further approximate eigenvalues, beyond the listed ones.
      complex(wp), intent(in) :: beyond(:)
      !> Multiplicity of the zero of the determinant: 2 for an undamped rigid motion, which is listed once.
      integer, intent(in) :: zeros
      complex(wp), intent(in) :: target
      !> Resolution of distances (1/s).
      real(wp), intent(in) :: resolution
      type(winding_certificate_type), intent(out) :: certificate
      !> Whether the zero may have a larger multiplicity, which could not be distinguished from missing eigenvalues.
      logical, optional, intent(in) :: zeros_at_least
      class(monitor_type), optional, target, intent(inout) :: monitor
      type(bordered_determinant_type) :: determinant
      real(wp) :: furthest, reach

      if (size(listed) == 0) then
         certificate%reason = "no mode is listed"
         return
      end if
      furthest = maxval(distances(listed, target))
      reach = max(furthest, resolution)
      if (.not. reach > 0) then
         certificate%reason = "the modes that are listed are the target itself"
         return
      end if
      call prepare(problem, solver, reach + abs(target), determinant, certificate%reason)
      if (present(monitor)) determinant%monitor => monitor
      if (certificate%reason == "") call compare(determinant, listed, beyond, zeros, target, reach, certificate)
      if (certificate%verdict == certified_no .and. furthest < resolution) &
         certificate = winding_certificate_type(reason="what else is at the target cannot be told apart")
      if (present(zeros_at_least) .and. certificate%verdict == certified_no) then
         if (zeros_at_least) certificate = winding_certificate_type(reason="the multiplicity of the zero is not known")
      end if
      call certificate%add_effort(determinant%effort)
   end subroutine certify_by_winding

   ! Counts the zeros inside up to three curves, and sets verdict, missing number and radius by those that are not known.
   subroutine compare(determinant, listed, beyond, zeros, target, reach, certificate)
      type(bordered_determinant_type), intent(inout) :: determinant
      complex(wp), intent(in) :: listed(:), beyond(:)
      integer, intent(in) :: zeros
      complex(wp), intent(in) :: target
      !> Distance of the furthest listed one.
      real(wp), intent(in) :: reach
      type(winding_certificate_type), intent(inout) :: certificate
      complex(wp), allocatable :: known_zeros(:)
      real(wp) :: gap_radius
      integer :: unknown, unknown_nearer, missing

      allocate (known_zeros, source=[pack(listed, abs(listed) > 0), pack(beyond, abs(beyond) > 0)])
      call count_within(radius_beyond(reach, distances(beyond, target)), unknown)
      if (unknown == 0) certificate%verdict = certified_yes
      if (unknown <= 0) return
      gap_radius = radius_within(reach, distances(listed, target))
      call count_within(gap_radius, unknown_nearer)
      missing = unknown_nearer
      if (unknown_nearer < unknown) call count_within((1 - blurred_value)*reach, missing)
      if (missing < 0 .and. unknown_nearer > 0) then
         missing = unknown_nearer
         certificate%reach = gap_radius
         certificate%reason = ""
         certificate%surplus = 0
      end if
      if (missing < 0) return
      certificate%verdict = merge(certified_yes, certified_no, missing == 0)
      certificate%missing = missing

   contains

      ! Number of unknown eigenvalues inside a radius, both members of each conjugate pair; -1 if the count fails.
      subroutine count_within(radius, number)
         real(wp), intent(in) :: radius
         integer, intent(out) :: number
         type(closed_curve_type) :: curve

         curve = new_closed_curve(target, radius, determinant%is_lossy())
         call count_unknown_zeros(determinant, curve, known_zeros, zeros, number, certificate%reason)
         certificate%reach = radius
         if (certificate%reason == "" .and. number < 0) then
            certificate%surplus = -number
            certificate%reason = "more eigenvalues are listed than there are, by "//text(-number)
         end if
         if (curve%closed) number = 2*number
         if (certificate%reason /= "") number = -1
      end subroutine count_within
   end subroutine compare

   ! Prepares the determinant, bordered for redundant constraints.
   subroutine prepare(problem, solver, level, determinant, reason)
      type(modal_problem_type), intent(in) :: problem
      class(complex_linear_solver_type), intent(in) :: solver
      !> Magnitude of lambda (1/s).
      real(wp), intent(in) :: level
      type(bordered_determinant_type), intent(out) :: determinant
      character(len=reason_length), intent(out) :: reason
      type(error_type), allocatable :: error
      integer :: redundant

      reason = ""
      call count_redundant(problem%constraints, redundant, error)
      if (.not. allocated(error) .and. redundant > largest_border/max(problem%multipliers(), 1)) then
         reason = "there are too many redundant constraints"
         return
      end if
      if (.not. allocated(error)) call new_bordered_determinant(determinant, problem, &
         constraint_factors(problem, scaling_row, cmplx(level, 0, wp)), redundant, solver, error)
      if (allocated(error)) reason = error%message
   end subroutine prepare

   ! Radius of the first curve: the middle of the first wide gap of distances beyond `reach`, or of the widest one. What follows the
   ! last known distance is unknown, and taken as a wide gap.
   pure real(wp) function radius_beyond(reach, further) result(radius)
      real(wp), intent(in) :: reach
      real(wp), intent(in) :: further(:)
      real(wp) :: lower, upper, widest

      radius = reach
      widest = 0
      lower = reach
      do while (any(further > lower) .and. widest < no_correct_digits)
         upper = minval(further, further > lower)
         if (upper - lower > widest*upper) then
            widest = (upper - lower)/upper
            radius = (upper + lower)/2
         end if
         lower = upper
      end do
      if (widest < no_correct_digits/2) radius = (1 + no_correct_digits/2)*lower
   end function radius_beyond

   ! Radius of the second curve: the middle of the first wide gap of distances below `reach`, or of the widest one.
   pure real(wp) function radius_within(reach, nearer) result(radius)
      real(wp), intent(in) :: reach
      real(wp), intent(in) :: nearer(:)
      real(wp) :: lower, upper, widest

      radius = (1 - blurred_value)*reach
      widest = 0
      upper = reach
      do while (any(nearer < upper) .and. widest < no_correct_digits)
         lower = maxval(nearer, nearer < upper)
         if (upper - lower > widest*upper) then
            widest = (upper - lower)/upper
            radius = (upper + lower)/2
         end if
         upper = lower
      end do
   end function radius_within

   ! Distance of the nearer member of a conjugate pair.
   elemental real(wp) function distances(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distances = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distances
end module kschur_winding_certificate
