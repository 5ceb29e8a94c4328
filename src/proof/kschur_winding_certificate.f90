!> Proof, for any damping, that no mode is missing: the eigenvalues inside a curve around the target are
!> counted by the turns of the determinant along it.
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
   use kschur_tolerances, only: blurred_value, may_be_anything
   use kschur_winding, only: count_unknown_zeros, reason_length
   implicit none
   private
   public :: certify_by_winding, winding_certificate_type

   ! Entries of the border for redundant constraints, at most.
   integer, parameter :: largest_border = 5000000

   !> What is proved, and what it took.
   type, extends(effort_type) :: winding_certificate_type
      !> One of `certified_*`.
      integer :: verdict = certified_unknown
      !> Where the verdict is no: eigenvalues that are not listed and nearer to the target than `reach`, both of
      !> a conjugate pair counted.
      integer :: missing = 0
      !> The eigenvalues nearer to the target than this were counted (1/s).
      real(wp) :: reach = 0
      !> Why the verdict is unknown; else blank.
      character(len=reason_length) :: reason = ""
   end type winding_certificate_type

contains

   !> Counts inside a curve that goes through the first wide gap between the distances of eigenvalues from the
   !> target, beyond those that are listed. Where that finds more than are known, they may be no nearer than the
   !> furthest that is listed: a second curve goes through a gap inside that, and a third one, if the two disagree,
   !> just inside the furthest. With losses what is above the real axis is counted, as what is below belongs to no mode.
   subroutine certify_by_winding(problem, solver, listed, beyond, zeros, target, resolution, certificate, zeros_at_least, &
      monitor)
      !> Presolved and balanced: where entries are of one size, the phase of the determinant is not lost in rounding.
      type(modal_problem_type), intent(in) :: problem
      !> One that tells determinants; copies of it are used.
      class(complex_linear_solver_type), intent(in) :: solver
      !> The eigenvalues whose being all the nearest is to be proved (1/s), each as often as it is there, one of
      !> each conjugate pair, Im >= 0. A zero is exactly zero.
      complex(wp), intent(in) :: listed(:)
      !> Others that are known roughly. They lie beyond the listed ones.
      complex(wp), intent(in) :: beyond(:)
      !> The multiplicity of the zero in the determinant: 2 for a rigid motion without damping, that is listed once.
      integer, intent(in) :: zeros
      complex(wp), intent(in) :: target
      !> Distances below this are not told apart (1/s).
      real(wp), intent(in) :: resolution
      type(winding_certificate_type), intent(out) :: certificate
      !> Whether the zero may have a larger multiplicity: it cannot be told from missing eigenvalues then.
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

   subroutine compare(determinant, listed, beyond, zeros, target, reach, certificate)
      type(bordered_determinant_type), intent(inout) :: determinant
      complex(wp), intent(in) :: listed(:), beyond(:)
      integer, intent(in) :: zeros
      complex(wp), intent(in) :: target
      !> The distance of the furthest that is listed.
      real(wp), intent(in) :: reach
      type(winding_certificate_type), intent(inout) :: certificate
      complex(wp), allocatable :: known(:)
      real(wp) :: in_a_gap
      integer :: unknown, nearer, nearest

      allocate (known, source=[pack(listed, abs(listed) > 0), pack(beyond, abs(beyond) > 0)])
      call count_within(radius_beyond(reach, distances(beyond, target)), unknown)
      if (unknown == 0) certificate%verdict = certified_yes
      if (unknown <= 0) return
      in_a_gap = radius_within(reach, distances(listed, target))
      call count_within(in_a_gap, nearer)
      nearest = nearer
      if (nearer < unknown) call count_within((1 - blurred_value)*reach, nearest)
      if (nearest < 0 .and. nearer > 0) then
         nearest = nearer
         certificate%reach = in_a_gap
         certificate%reason = ""
      end if
      if (nearest < 0) return
      certificate%verdict = merge(certified_yes, certified_no, nearest == 0)
      certificate%missing = nearest

   contains

      ! Both of each conjugate pair; -1 where it is not known.
      subroutine count_within(radius, number)
         real(wp), intent(in) :: radius
         integer, intent(out) :: number
         type(closed_curve_type) :: curve

         curve = new_closed_curve(target, radius, determinant%is_lossy())
         call count_unknown_zeros(determinant, curve, known, zeros, number, certificate%reason)
         certificate%reach = radius
         if (certificate%reason == "" .and. number < 0) &
            certificate%reason = "more eigenvalues are listed than there are, by "//text(-number)
         if (curve%closed) number = 2*number
         if (certificate%reason /= "") number = -1
      end subroutine count_within
   end subroutine compare

   subroutine prepare(problem, solver, level, determinant, reason)
      type(modal_problem_type), intent(in) :: problem
      class(complex_linear_solver_type), intent(in) :: solver
      !> A size of lambda (1/s).
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

   ! The middle of the first wide gap beyond, or of the widest one; what follows on the last distance is not known, and is
   ! taken to be one.
   pure real(wp) function radius_beyond(reach, further) result(radius)
      real(wp), intent(in) :: reach
      real(wp), intent(in) :: further(:)
      real(wp) :: lower, upper, widest

      radius = reach
      widest = 0
      lower = reach
      do while (any(further > lower) .and. widest < may_be_anything)
         upper = minval(further, further > lower)
         if (upper - lower > widest*upper) then
            widest = (upper - lower)/upper
            radius = (upper + lower)/2
         end if
         lower = upper
      end do
      if (widest < may_be_anything/2) radius = (1 + may_be_anything/2)*lower
   end function radius_beyond

   ! The middle of the first wide gap within, or of the widest one.
   pure real(wp) function radius_within(reach, nearer) result(radius)
      real(wp), intent(in) :: reach
      real(wp), intent(in) :: nearer(:)
      real(wp) :: lower, upper, widest

      radius = (1 - blurred_value)*reach
      widest = 0
      upper = reach
      do while (any(nearer < upper) .and. widest < may_be_anything)
         lower = maxval(nearer, nearer < upper)
         if (upper - lower > widest*upper) then
            widest = (upper - lower)/upper
            radius = (upper + lower)/2
         end if
         upper = lower
      end do
   end function radius_within

   ! Of the nearer of a conjugate pair.
   elemental real(wp) function distances(lambda, target)
      complex(wp), intent(in) :: lambda, target

      distances = min(abs(lambda - target), abs(conjg(lambda) - target))
   end function distances
end module kschur_winding_certificate
