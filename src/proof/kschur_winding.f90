!> Counts the zeros of an analytic function inside a closed curve by its winding number (argument principle).
!>
!> The function is divided by its known zeros, so that only unknown ones contribute. The quotient may still vary, for example by
!> zeros outside: as exp(p) with p analytic. Subtracting any polynomial p does not change the count, and one fitted to the
!> modulus, which has no ambiguity, predicts the variation of the phase. Unknown zeros inside, or turns missed between samples,
!> cannot be made both small and slow by any p.
!>
!> The path is divided into panels with one interior sample. A panel is accepted if the logarithm changes little and evenly in
!> modulus and phase; otherwise it is halved. When all are accepted, all are halved once more and must be accepted again. Steps
!> are uneven, so that an evenly turning phase cannot make whole turns in all of them.
module kschur_winding
   use kschur_closed_curve, only: closed_curve_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgelsy
   use kschur_tolerances, only: dependent, narrowest_panel
   implicit none
   private
   public :: analytic_function_type, count_unknown_zeros, reason_length

   !> Length of reasons.
   integer, parameter :: reason_length = 120
   real(wp), parameter :: pi = acos(-1.0_wp), golden = 0.6180339887498949_wp
   ! Largest change of the logarithm in one step, and largest deviation from an even change.
   real(wp), parameter :: largest_step = pi/4, largest_bend = pi/8
   ! Largest ratio of the widths of adjacent panels.
   real(wp), parameter :: largest_ratio = 3
   ! Largest chord of a panel, relative to its distance from known zeros: unknown ones may be as close.
   real(wp), parameter :: longest = 4
   ! Largest acceptable error of a phase.
   real(wp), parameter :: largest_doubt = pi/12
   ! Largest deviation of the total from a whole number of half turns.
   real(wp), parameter :: integer_tolerance = 0.05_wp
   ! Initial panels on half of a curve and on a circle; most samples.
   integer, parameter :: panels_of_half = 4, panels_of_circle = 7, most_samples = 800
   ! Coefficients of p, per sample.
   integer, parameter :: samples_per_coefficient = 3

   !> A function whose zeros are counted, real on the real axis where the curve is half of one symmetric about it.
   type, abstract :: analytic_function_type
   contains
      procedure(evaluate), deferred :: evaluate
   end type analytic_function_type

   abstract interface
      !> Evaluates the logarithm of the function, and bounds the error of its phase.
      subroutine evaluate(self, lambda, logarithm, doubt, reason)
         import :: analytic_function_type, wp
         class(analytic_function_type), intent(inout) :: self
         complex(wp), intent(in) :: lambda
         !> log of the value; imaginary part up to multiples of 2 pi.
         complex(wp), intent(out) :: logarithm
         !> Error bound of the imaginary part (radians).
         real(wp), intent(out) :: doubt
         !> Why the evaluation failed; else blank.
         character(len=*), intent(out) :: reason
      end subroutine evaluate
   end interface

   ! Samples in the order taken, and panels: indices of first, inner and last sample.
   type :: samples_type
      integer :: count = 0
      real(wp) :: part(most_samples) = 0
      complex(wp) :: lambda(most_samples) = 0, logarithm(most_samples) = 0
      ! Distance of each from the nearest known zero.
      real(wp) :: distance(most_samples) = 0
      integer, allocatable :: panels(:, :)
   end type samples_type

contains

   !> Counts the zeros inside the curve that are not among the given ones; for a curve symmetric about the real axis all, for a
   !> circle above it those inside it. Negative if fewer zeros exist than are given.
   subroutine count_unknown_zeros(f, curve, zeros, origin, unknown, reason)
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      !> Known zeros inside and outside, nonzero, Im >= 0: each with Im > 0 stands for a conjugate pair.
      complex(wp), intent(in) :: zeros(:)
      !> Multiplicity of the zero at the origin.
      integer, intent(in) :: origin
      integer, intent(out) :: unknown
      !> Why the count failed; else blank.
      character(len=reason_length), intent(out) :: reason
      type(samples_type) :: samples
      complex(wp), allocatable :: logarithms(:)
      logical, allocatable :: passed(:)
      logical :: confirmed
      real(wp) :: turning

      unknown = 0
      call take_first_samples(samples, f, curve, zeros, origin, reason)
      confirmed = .false.
      do while (reason == "")
         call fit_and_test(samples, curve, logarithms, passed)
         if (all(passed)) then
            if (confirmed) exit
            ! A few samples may by chance fit a function that turns between them; twice as many do not.
            confirmed = .true.
            passed = .false.
         end if
         call halve(samples, f, curve, zeros, origin, .not. passed, reason)
      end do
      if (reason /= "") return
      associate (p => samples%panels)
         turning = sum(phase(logarithms(p(2, :)) - logarithms(p(1, :))) + phase(logarithms(p(3, :)) - logarithms(p(2, :))))
      end associate
      if (curve%closed) turning = turning/2
      unknown = nint(turning/pi)
      if (abs(turning/pi - unknown) > integer_tolerance) reason = "the phase of the determinant is rounding on the real axis"
   end subroutine count_unknown_zeros

   ! Samples the ends and interiors of the initial panels.
   subroutine take_first_samples(samples, f, curve, zeros, origin, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      complex(wp), intent(in) :: zeros(:)
      integer, intent(in) :: origin
      character(len=reason_length), intent(out) :: reason
      integer :: panels, j
      real(wp), allocatable :: part(:)

      panels = merge(panels_of_circle, panels_of_half, curve%closed)
      allocate (part(0:2*panels), source=0.0_wp)
      do j = 1, 2*panels
         part(j) = part(j - 1) + uneven_weight(j)
      end do
      reason = ""
      do j = 0, 2*panels
         call sample(samples, f, curve, part(j)/part(2*panels), zeros, origin, reason)
         if (reason /= "") return
      end do
      allocate (samples%panels(3, panels))
      samples%panels = reshape([([2*j - 1, 2*j, 2*j + 1], j=1, panels)], [3, panels])
   end subroutine take_first_samples

   ! Halves the selected panels, with a new interior sample in each half. Fails if one is too narrow.
   subroutine halve(samples, f, curve, zeros, origin, which, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      complex(wp), intent(in) :: zeros(:)
      integer, intent(in) :: origin
      logical, intent(in) :: which(:)
      character(len=reason_length), intent(out) :: reason
      integer, allocatable :: panels(:, :)
      integer :: i, half, neighbours(2), j
      real(wp) :: weight

      reason = ""
      allocate (panels(3, 0))
      do i = 1, size(which)
         associate (panel => samples%panels(:, i))
            if (.not. which(i)) panels = reshape([panels, panel], [3, size(panels, 2) + 1])
            if (.not. which(i)) cycle
            if (abs(samples%part(panel(3)) - samples%part(panel(1))) < narrowest_panel) &
               reason = "an eigenvalue that is not listed seems to lie next to the curve"
            do half = 1, 2
               neighbours = panel(half:half + 1)
               j = samples%count + 1
               weight = uneven_weight(j)/2
               if (reason == "") call sample(samples, f, curve, &
                  (1 - weight)*samples%part(neighbours(1)) + weight*samples%part(neighbours(2)), zeros, origin, reason)
               if (reason /= "") return
               panels = reshape([panels, neighbours(1), j, neighbours(2)], [3, size(panels, 2) + 1])
            end do
         end associate
      end do
      call move_alloc(panels, samples%panels)
   end subroutine halve

   ! Evaluates the function, divided by its known zeros, at a point of the curve, and appends the sample. Fails if the phase is too
   ! uncertain, or there are too many samples.
   subroutine sample(samples, f, curve, part, zeros, origin, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      real(wp), intent(in) :: part
      complex(wp), intent(in) :: zeros(:)
      integer, intent(in) :: origin
      character(len=reason_length), intent(out) :: reason
      complex(wp) :: lambda, logarithm
      real(wp) :: doubt

      reason = ""
      if (samples%count == most_samples) then
         reason = "the determinant turns too fast along the curve"
         return
      end if
      lambda = curve%point(part)
      ! A closed curve ends where it began.
      if (curve%closed .and. part >= 1) then
         logarithm = samples%logarithm(1)
         lambda = samples%lambda(1)
      else
         call f%evaluate(lambda, logarithm, doubt, reason)
         if (reason == "" .and. .not. doubt <= largest_doubt) reason = "the phase of the determinant is lost in rounding"
         if (reason /= "") return
         logarithm = logarithm - sum(log(lambda - zeros)) - sum(log(lambda - conjg(zeros)), abs(aimag(zeros)) > 0)
         if (origin > 0) logarithm = logarithm - origin*log(lambda)
      end if
      samples%count = samples%count + 1
      samples%part(samples%count) = part
      samples%lambda(samples%count) = lambda
      samples%logarithm(samples%count) = logarithm
      samples%distance(samples%count) = min(minval(abs(lambda - zeros)), minval(abs(lambda - conjg(zeros))))
   end subroutine sample

   ! Chooses the polynomial p of least degree for which most panels are accepted.
   subroutine fit_and_test(samples, curve, logarithms, passed)
      type(samples_type), intent(in) :: samples
      type(closed_curve_type), intent(in) :: curve
      !> Logarithms of the samples minus p.
      complex(wp), allocatable, intent(out) :: logarithms(:)
      !> Whether each panel is accepted.
      logical, allocatable, intent(out) :: passed(:)
      complex(wp), allocatable :: remainder(:)
      integer :: degree, most

      allocate (passed(size(samples%panels, 2)), source=.false.)
      allocate (logarithms, source=samples%logarithm(:samples%count))
      degree = 0
      most = samples%count/samples_per_coefficient - 1
      if (curve%closed) most = most/2
      do
         remainder = samples%logarithm(:samples%count) - fitted(samples, curve, degree)
         associate (pass => test_panels(samples, curve%closed, remainder))
            if (count(pass) > count(passed)) then
               passed = pass
               logarithms = remainder
            end if
         end associate
         if (degree >= most .or. all(passed)) return
         degree = min(max(2*degree, 2), most)
      end do
   end subroutine fit_and_test

   ! Accepts panels in which modulus and phase change little and evenly, and which are not too long or wide.
   pure function test_panels(samples, closed, logarithms) result(pass)
      type(samples_type), intent(in) :: samples
      !> Whether the curve is closed.
      logical, intent(in) :: closed
      complex(wp), intent(in) :: logarithms(:)
      logical :: pass(size(samples%panels, 2))
      complex(wp) :: step(2)
      real(wp) :: weight
      integer :: i

      do i = 1, size(pass)
         associate (p => samples%panels(:, i))
            step = logarithms(p(2:3)) - logarithms(p(1:2))
            step = cmplx(real(step, wp), phase(step), wp)
            weight = (samples%part(p(2)) - samples%part(p(1)))/(samples%part(p(3)) - samples%part(p(1)))
            pass(i) = all(abs(step) < largest_step) .and. abs((1 - weight)*step(1) - weight*step(2)) < largest_bend &
               .and. abs(samples%lambda(p(3)) - samples%lambda(p(1))) <= longest*minval(samples%distance(p))
         end associate
      end do
      ! Next to a very narrow panel, this one may hide whole turns.
      associate (width => samples%part(samples%panels(3, :)) - samples%part(samples%panels(1, :)))
         pass = pass .and. width <= largest_ratio*min(eoshift(width, 1, width(merge(1, size(width), closed))), &
            eoshift(width, -1, width(merge(size(width), 1, closed))))
      end associate
   end function test_panels

   ! Values at the samples of the polynomial whose real part fits the log moduli best, by least squares. Its coefficients are real
   ! if the curve is symmetric about the real axis.
   function fitted(samples, curve, degree) result(values)
      type(samples_type), intent(in) :: samples
      type(closed_curve_type), intent(in) :: curve
      integer, intent(in) :: degree
      complex(wp) :: values(samples%count)
      complex(wp) :: powers(samples%count, 0:degree)
      real(wp), allocatable :: matrix(:, :), rhs(:, :), work(:)
      integer, allocatable :: pivot(:)
      integer :: n, columns, k, rank, info

      n = samples%count
      powers(:, 0) = 1
      do k = 1, degree
         powers(:, k) = powers(:, k - 1)*curve%variable(samples%lambda(:n))
      end do
      columns = degree + 1
      if (curve%closed) columns = 2*degree + 1
      allocate (matrix(n, columns), rhs(n, 1), work(64*(n + columns)))
      allocate (pivot(columns), source=0)
      matrix(:, :degree + 1) = real(powers, wp)
      if (curve%closed) matrix(:, degree + 2:) = -aimag(powers(:, 1:))
      rhs(:, 1) = real(samples%logarithm(:n), wp)
      call dgelsy(n, columns, 1, matrix, n, rhs, n, pivot, dependent, rank, work, size(work), info)
      values = matmul(powers, rhs(:degree + 1, 1))
      if (curve%closed) values = values + (0.0_wp, 1.0_wp)*matmul(powers(:, 1:), rhs(degree + 2:columns, 1))
   end function fitted

   ! The imaginary part in [-pi, pi).
   elemental real(wp) function phase(logarithm)
      complex(wp), intent(in) :: logarithm

      phase = modulo(aimag(logarithm) + pi, 2*pi) - pi
   end function phase

   ! Quasi-random weight between 0.7 and 1.3.
   elemental real(wp) function uneven_weight(j)
      integer, intent(in) :: j

      uneven_weight = 0.7_wp + 0.6_wp*modulo(j*golden, 1.0_wp)
   end function uneven_weight
end module kschur_winding
