!> Eigenvalues of the scene `cantilever` in quadruple precision. The module it prints is
!> tests/support/cantilever_reference.f90:
!>
!>     cantilever_real128 > tests/support/cantilever_reference.f90
!>
!> The matrices are those of the scene, in double precision and then converted; the ties
!> are eliminated exactly. Undamped frequencies of the two coarsest meshes come from dense
!> matrices. From there Newton's method on the band of each mesh goes to the damped
!> eigenvalues, and from one mesh to the next.
program cantilever_real128
   use, intrinsic :: iso_fortran_env, only: error_unit, real128
   use kschur, only: error_type, modal_problem_type, text
   use kschur_scenes, only: build_scene
   use quad_reference, only: elimination_type, new_elimination, quad_squared_frequencies
   implicit none

   !> The entries of T^T A T on a band: value(i - j, j) stands in row i, column j.
   type :: band_type
      complex(real128), allocatable :: value(:, :)
   end type band_type

   character(len=*), parameter :: tip_masses(4) = [character(len=3) :: "4e3", "1e5", "1e7", "1e9"]
   integer, parameter :: elements(5) = [10, 30, 100, 300, 1000], modes = 8, half_band = 11
   character(len=*), parameter :: dampings(2) = [character(len=8) :: "none", "rayleigh"]
   complex(real128) :: lambda(modes, size(elements), size(tip_masses), size(dampings))
   real(real128), allocatable :: squared(:)
   type(modal_problem_type) :: problem
   integer :: i, k, l

   do k = 1, size(tip_masses)
      do i = 1, size(elements)
         do l = 1, size(dampings)
            call build(elements(i), tip_masses(k), dampings(l), problem)
            if (l > 1) then
               lambda(:, i, k, l) = lambda(:, i, k, 1)
            else if (i <= 2) then
               call quad_squared_frequencies(problem, squared)
               lambda(:, i, k, l) = cmplx(0, sqrt(squared(:modes)), real128)
            else
               lambda(:, i, k, l) = lambda(:, i - 1, k, l)
            end if
            call newton(problem, lambda(:, i, k, l))
         end do
      end do
   end do
   call print_module()

contains

   subroutine build(count, tip_mass, damping, problem)
      integer, intent(in) :: count
      character(len=*), intent(in) :: tip_mass, damping
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable :: error

      call build_scene("cantilever", [character(len=10) :: "--elements", text(count), "--tip-mass", tip_mass, &
         "--damping", damping], problem, error)
      if (.not. allocated(error)) return
      write (error_unit, "(a)") error%message
      stop 1
   end subroutine build

   !> From estimates to eigenvalues: P(lambda) u = P'(lambda) x,
   !> lambda := lambda - x^T x/x^T u, x := u/|u|, after a few steps at the estimate.
   subroutine newton(problem, values)
      type(modal_problem_type), intent(in) :: problem
      complex(real128), intent(inout) :: values(:)
      integer, parameter :: fixed = 4, most = 30
      real(real128), parameter :: same = 1.0e-22_real128, apart = 1.0e-6_real128, nearby = 1.0e-9_real128
      type(elimination_type) :: elimination
      type(band_type) :: mass, damping, stiffness, slope, factors
      complex(real128), allocatable :: x(:), u(:)
      complex(real128) :: step
      integer :: j, n, iteration

      call new_elimination(problem%constraints, elimination)
      n = elimination%free
      call new_band(elimination, problem, 1, mass)
      call new_band(elimination, problem, 2, damping)
      call new_band(elimination, problem, 3, stiffness)
      ! With the bounds of a band.
      slope = mass
      factors = mass
      allocate (x(n), u(n))
      do j = 1, size(values)
         ! An estimate may be exact, and P singular there.
         values(j) = (1 + nearby)*values(j)
         ! No symmetry that a mode could be orthogonal to.
         x = [(cmplx(1 + mod(7*iteration, 11), mod(5*iteration, 13), real128), iteration=1, n)]
         do iteration = 1, most
            if (iteration == 1 .or. iteration > fixed) &
               factors%value = values(j)**2*mass%value + values(j)*damping%value + stiffness%value
            if (iteration == 1 .or. iteration > fixed) call factorize(factors)
            slope%value = 2*values(j)*mass%value + damping%value
            u = product_with(slope, x)
            call solve(factors, u)
            ! Symmetric matrices: the left vector is the right one, not conjugated.
            step = sum(x*x)/sum(x*u)
            x = u/sqrt(sum(abs(u)**2))
            if (iteration <= fixed) cycle
            values(j) = values(j) - step
            if (abs(step) < same*abs(values(j))) exit
         end do
         if (iteration > most .or. any(abs(values(:j - 1) - values(j)) < apart*abs(values(j)))) then
            write (error_unit, *) "lost mode ", j, iteration, values(:j), step
            stop 1
         end if
      end do
   end subroutine newton

   subroutine new_band(elimination, problem, which, band)
      type(elimination_type), intent(in) :: elimination
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: which
      type(band_type), intent(out) :: band
      integer, allocatable :: row(:), column(:)
      real(real128), allocatable :: value(:)
      integer :: k

      select case (which)
      case (1)
         call elimination%reduce(problem%mass, row, column, value)
      case (2)
         call elimination%reduce(problem%damping, row, column, value)
      case default
         call elimination%reduce(problem%stiffness, row, column, value)
      end select
      allocate (band%value(-half_band:half_band, elimination%free), source=(0.0_real128, 0.0_real128))
      do k = 1, size(value)
         associate (entry => band%value(row(k) - column(k), column(k)))
            entry = entry + value(k)
         end associate
      end do
   end subroutine new_band

   pure function product_with(band, x) result(y)
      type(band_type), intent(in) :: band
      complex(real128), intent(in) :: x(:)
      complex(real128) :: y(size(x))
      integer :: j, first, last

      y = 0
      do j = 1, size(x)
         first = max(1, j - half_band)
         last = min(size(x), j + half_band)
         y(first:last) = y(first:last) + band%value(first - j:last - j, j)*x(j)
      end do
   end function product_with

   !> L U without pivoting: of what quadruple precision loses there is enough.
   subroutine factorize(band)
      type(band_type), intent(inout) :: band
      integer :: n, j, k, last

      n = size(band%value, 2)
      do j = 1, n
         last = min(n, j + half_band)
         band%value(1:last - j, j) = band%value(1:last - j, j)/band%value(0, j)
         do k = j + 1, last
            band%value(j + 1 - k:last - k, k) = band%value(j + 1 - k:last - k, k) &
               - band%value(1:last - j, j)*band%value(j - k, k)
         end do
      end do
   end subroutine factorize

   subroutine solve(band, x)
      type(band_type), intent(in) :: band
      complex(real128), intent(inout) :: x(:)
      integer :: n, j, first, last

      n = size(x)
      do j = 1, n
         last = min(n, j + half_band)
         x(j + 1:last) = x(j + 1:last) - band%value(1:last - j, j)*x(j)
      end do
      do j = n, 1, -1
         x(j) = x(j)/band%value(0, j)
         first = max(1, j - half_band)
         x(first:j - 1) = x(first:j - 1) - band%value(first - j:-1, j)*x(j)
      end do
   end subroutine solve

   subroutine print_module()
      character(len=*), parameter :: counts = "(8, 5, 4)"
      character(len=26), allocatable :: words(:)

      print "(a)", "!> The lowest eigenvalues (1/s) of the scene `cantilever`, in quadruple precision, then"
      print "(a)", "!> rounded. Printed by tests/references/cantilever_real128.f90; not to be edited."
      print "(a)", "module cantilever_reference"
      print "(a)", "   use kschur, only: wp"
      print "(a)", "   implicit none"
      print "(a)", "   private"
      print "(a)", ""
      print "(a)", "   !> Options of the scene."
      print "(3a)", "   character(len=*), parameter, public :: tip_masses(4) = [character(len=3) :: ", quoted(tip_masses), "]"
      print "(a, 4(i0, ', '), i0, a)", "   integer, parameter, public :: elements(5) = [", elements, "]"
      print "(a)", "   !> omega without damping, by mode, elements and tip mass."
      words = formatted(aimag(reshape(lambda(:, :, :, 1), [size(lambda)/2])))
      call print_list("   real(wp), parameter, public :: frequencies"//counts, words, 4)
      print "(a)", "   !> lambda with Rayleigh damping of the beam, likewise."
      words = formatted([reshape(real(lambda(:, :, :, 2)), [size(lambda)/2]), &
         reshape(aimag(lambda(:, :, :, 2)), [size(lambda)/2])])
      associate (half => size(words)/2)
         call print_list("   complex(wp), parameter, public :: eigenvalues"//counts, &
            "("//words(:half)//", "//words(half + 1:)//")", 2)
      end associate
      print "(a)", "end module cantilever_reference"
   end subroutine print_module

   !> An array constructor, some words a line.
   subroutine print_list(name, words, a_line)
      character(len=*), intent(in) :: name, words(:)
      integer, intent(in) :: a_line
      integer :: i, last

      print "(2a)", name, " = reshape([ &"
      do i = 1, size(words), a_line
         last = min(size(words), i + a_line - 1)
         print "(a, *(a, :, ', '))", "      ", words(i:last - 1), &
            words(last)//merge(" &", ",&", last == size(words))
      end do
      print "(a)", "      ], [8, 5, 4])"
   end subroutine print_list

   pure function formatted(values) result(words)
      real(real128), intent(in) :: values(:)
      character(len=26) :: words(size(values))
      integer :: i

      do i = 1, size(values)
         write (words(i), "(es23.16e2, a)") values(i), "_wp"
      end do
   end function formatted

   pure function quoted(words) result(list)
      character(len=*), intent(in) :: words(:)
      character(len=:), allocatable :: list
      integer :: i

      list = ""
      do i = 1, size(words)
         if (i > 1) list = list//", "
         list = list//'"'//trim(words(i))//'"'
      end do
   end function quoted
end program cantilever_real128
