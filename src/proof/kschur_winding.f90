!> How many zeros of an analytic function lie inside a closed curve, by the turns that its value makes
!> along it: the argument principle.
!>
!> The function is divided by the zeros that are known, so that what turns are those that are not known. What
!> is left may still swing, as of zeros outside. That is an analytic function without zeros, exp(p): any
!> polynomial p does not change the count, and one that is fitted to the *size* of the function, which has no
!> ambiguity, predicts how its phase swings. Zeros inside that are not known, and turns that are hidden between
!> two samples, are what no such p makes both small and slow.
!>
!> The path is cut into panels with a sample inside each. A panel counts when the logarithm changes little in
!> both its parts, size and phase, and evenly; else it is halved. When all count, all are halved once more, and have to
!> count again. Steps are uneven, so that a phase that turns
!> evenly does not turn by whole turns in all of them.
module kschur_winding
   use kschur_closed_curve, only: closed_curve_type
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgelsy
   use kschur_tolerances, only: dependent
   implicit none
   private
   public :: analytic_function_type, count_unknown_zeros, reason_length

   !> No reason is longer.
   integer, parameter :: reason_length = 120
   real(wp), parameter :: pi = acos(-1.0_wp), golden = 0.6180339887498949_wp
   ! The most that the logarithm may change in one step, and that it may be off from an even change.
   real(wp), parameter :: largest_step = pi/4, largest_bend = pi/8
   ! A panel may be wider than the next one by this factor.
   real(wp), parameter :: neighbours = 3
   ! What is not known may be as close to the curve as what is known: the chord of a panel, by the distance of that.
   real(wp), parameter :: longest = 4
   ! A phase that is known no better is not known.
   real(wp), parameter :: largest_doubt = pi/12
   ! The total may be off from a whole number of half turns by rounding only.
   real(wp), parameter :: whole = 0.05_wp
   ! Panels at first on half of a curve and on a circle; samples at most; a panel that is not halved any more.
   integer, parameter :: panels_of_half = 4, panels_of_circle = 7, most_samples = 800
   real(wp), parameter :: narrowest = 1.0e-7_wp
   ! Coefficients of p, per sample.
   integer, parameter :: samples_per_coefficient = 3

   !> A function whose zeros are counted, real on the real axis where the curve is half of one symmetric about it.
   type, abstract :: analytic_function_type
   contains
      procedure(evaluate), deferred :: evaluate
   end type analytic_function_type

   abstract interface
      subroutine evaluate(self, lambda, logarithm, doubt, reason)
         import :: analytic_function_type, wp
         class(analytic_function_type), intent(inout) :: self
         complex(wp), intent(in) :: lambda
         !> Of the value; the imaginary part up to whole turns.
         complex(wp), intent(out) :: logarithm
         !> The imaginary part is known up to this (radians).
         real(wp), intent(out) :: doubt
         !> Why there is no value; blank where there is one.
         character(len=*), intent(out) :: reason
      end subroutine evaluate
   end interface

   ! Samples in the order they were taken, and the panels between them: first, inner and last sample.
   type :: samples_type
      integer :: taken = 0
      real(wp) :: part(most_samples) = 0
      complex(wp) :: lambda(most_samples) = 0, logarithm(most_samples) = 0
      ! Distance of each from the nearest known zero.
      real(wp) :: distance(most_samples) = 0
      integer, allocatable :: panels(:, :)
   end type samples_type

contains

   !> Zeros inside the curve that are not among the known ones; of a curve that is symmetric about the real axis
   !> all, of one above it those in it. Negative where there are fewer than are said to be known.
   subroutine count_unknown_zeros(f, curve, known, origin, unknown, reason)
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      !> Inside and outside, not zero, Im >= 0: each with Im > 0 stands for a conjugate pair.
      complex(wp), intent(in) :: known(:)
      !> The multiplicity of the zero at the origin.
      integer, intent(in) :: origin
      integer, intent(out) :: unknown
      !> Why the number is not known; blank where it is.
      character(len=reason_length), intent(out) :: reason
      type(samples_type) :: samples
      complex(wp), allocatable :: logarithms(:)
      logical, allocatable :: passed(:)
      logical :: confirmed
      real(wp) :: turned

      unknown = 0
      call take_first_samples(samples, f, curve, known, origin, reason)
      confirmed = .false.
      do while (reason == "")
         call judge(samples, curve, logarithms, passed)
         if (all(passed)) then
            if (confirmed) exit
            ! By chance a few samples fit a function that turns between them; twice as many do not.
            confirmed = .true.
            passed = .false.
         end if
         call halve(samples, f, curve, known, origin, .not. passed, reason)
      end do
      if (reason /= "") return
      associate (p => samples%panels)
         turned = sum(phase(logarithms(p(2, :)) - logarithms(p(1, :))) + phase(logarithms(p(3, :)) - logarithms(p(2, :))))
      end associate
      if (curve%closed) turned = turned/2
      unknown = nint(turned/pi)
      if (abs(turned/pi - unknown) > whole) reason = "the phase of the determinant is rounding on the real axis"
   end subroutine count_unknown_zeros

   subroutine take_first_samples(samples, f, curve, known, origin, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      complex(wp), intent(in) :: known(:)
      integer, intent(in) :: origin
      character(len=reason_length), intent(out) :: reason
      integer :: panels, j
      real(wp), allocatable :: part(:)

      panels = merge(panels_of_circle, panels_of_half, curve%closed)
      allocate (part(0:2*panels), source=0.0_wp)
      do j = 1, 2*panels
         part(j) = part(j - 1) + uneven(j)
      end do
      reason = ""
      do j = 0, 2*panels
         call sample(samples, f, curve, part(j)/part(2*panels), known, origin, reason)
         if (reason /= "") return
      end do
      allocate (samples%panels(3, panels))
      samples%panels = reshape([([2*j - 1, 2*j, 2*j + 1], j=1, panels)], [3, panels])
   end subroutine take_first_samples

   ! Two panels in the place of each that is to be halved.
   subroutine halve(samples, f, curve, known, origin, which, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      complex(wp), intent(in) :: known(:)
      integer, intent(in) :: origin
      logical, intent(in) :: which(:)
      character(len=reason_length), intent(out) :: reason
      integer, allocatable :: panels(:, :)
      integer :: i, half, ends(2), j
      real(wp) :: weight

      reason = ""
      allocate (panels(3, 0))
      do i = 1, size(which)
         associate (panel => samples%panels(:, i))
            if (.not. which(i)) panels = reshape([panels, panel], [3, size(panels, 2) + 1])
            if (.not. which(i)) cycle
            if (abs(samples%part(panel(3)) - samples%part(panel(1))) < narrowest) &
               reason = "an eigenvalue that is not listed seems to lie next to the curve"
            do half = 1, 2
               ends = panel(half:half + 1)
               j = samples%taken + 1
               weight = uneven(j)/2
               if (reason == "") call sample(samples, f, curve, &
                  (1 - weight)*samples%part(ends(1)) + weight*samples%part(ends(2)), known, origin, reason)
               if (reason /= "") return
               panels = reshape([panels, ends(1), j, ends(2)], [3, size(panels, 2) + 1])
            end do
         end associate
      end do
      call move_alloc(panels, samples%panels)
   end subroutine halve

   subroutine sample(samples, f, curve, part, known, origin, reason)
      type(samples_type), intent(inout) :: samples
      class(analytic_function_type), intent(inout) :: f
      type(closed_curve_type), intent(in) :: curve
      real(wp), intent(in) :: part
      complex(wp), intent(in) :: known(:)
      integer, intent(in) :: origin
      character(len=reason_length), intent(out) :: reason
      complex(wp) :: lambda, logarithm
      real(wp) :: doubt

      reason = ""
      if (samples%taken == most_samples) then
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
         logarithm = logarithm - sum(log(lambda - known)) - sum(log(lambda - conjg(known)), abs(aimag(known)) > 0)
         if (origin > 0) logarithm = logarithm - origin*log(lambda)
      end if
      samples%taken = samples%taken + 1
      samples%part(samples%taken) = part
      samples%lambda(samples%taken) = lambda
      samples%logarithm(samples%taken) = logarithm
      samples%distance(samples%taken) = min(minval(abs(lambda - known)), minval(abs(lambda - conjg(known))))
   end subroutine sample

   ! Takes the polynomial p with which the most panels pass, the simplest of these.
   subroutine judge(samples, curve, logarithms, passed)
      type(samples_type), intent(in) :: samples
      type(closed_curve_type), intent(in) :: curve
      !> Of the samples, less p.
      complex(wp), allocatable, intent(out) :: logarithms(:)
      !> Of each panel.
      logical, allocatable, intent(out) :: passed(:)
      complex(wp), allocatable :: less(:)
      integer :: degree, most

      allocate (passed(size(samples%panels, 2)), source=.false.)
      allocate (logarithms, source=samples%logarithm(:samples%taken))
      degree = 0
      most = samples%taken/samples_per_coefficient - 1
      if (curve%closed) most = most/2
      do
         less = samples%logarithm(:samples%taken) - fitted(samples, curve, degree)
         associate (pass => passes(samples, curve%closed, less))
            if (count(pass) > count(passed)) then
               passed = pass
               logarithms = less
            end if
         end associate
         if (degree >= most .or. all(passed)) return
         degree = min(max(2*degree, 2), most)
      end do
   end subroutine judge

   ! Whether size and phase change little and evenly.
   pure function passes(samples, closed, logarithms) result(pass)
      type(samples_type), intent(in) :: samples
      !> Whether the last panel ends where the first one begins.
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
      ! Where a neighbour had to be so narrow, this one may hide whole turns.
      associate (width => samples%part(samples%panels(3, :)) - samples%part(samples%panels(1, :)))
         pass = pass .and. width <= neighbours*min(eoshift(width, 1, width(merge(1, size(width), closed))), &
            eoshift(width, -1, width(merge(size(width), 1, closed))))
      end associate
   end function passes

   ! Values of the polynomial whose real part is nearest to that of the logarithms; real on the real axis where
   ! the curve is symmetric about it.
   function fitted(samples, curve, degree) result(values)
      type(samples_type), intent(in) :: samples
      type(closed_curve_type), intent(in) :: curve
      integer, intent(in) :: degree
      complex(wp) :: values(samples%taken)
      complex(wp) :: powers(samples%taken, 0:degree)
      real(wp), allocatable :: matrix(:, :), rhs(:, :), work(:)
      integer, allocatable :: pivot(:)
      integer :: n, columns, k, rank, info

      n = samples%taken
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

   ! Between 0.7 and 1.3.
   elemental real(wp) function uneven(j)
      integer, intent(in) :: j

      uneven = 0.7_wp + 0.6_wp*modulo(j*golden, 1.0_wp)
   end function uneven
end module kschur_winding
