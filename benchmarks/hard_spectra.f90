!> Hard cases: targets and shifts at the worst places, multiple eigenvalues, unsymmetric
!> matrices at the edge of stability.
module hard_spectra
   use, intrinsic :: iso_fortran_env, only: real128
   use cantilever_reference, only: eigenvalues, elements, tip_masses
   use hard_judge, only: case_type, judge_type, said
   use hard_models, only: add_mass, add_spring, append, copies, damped, finished, half_sine_squares, scene
   use kschur, only: modal_problem_type, text, wp
   use quad_reference, only: quad_squared_frequencies
   use rotor_reference, only: critical_speed, rotor_eigenvalues
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns
   use scene_beam, only: add_beam, beam_type, table_2_beam, table_2_rayleigh
   use scene_joint, only: add_tie
   use scene_vectors, only: rpm, turned
   implicit none
   private
   public :: examine_brakes, examine_multiple, examine_rotors, examine_targets

   complex(wp), parameter :: i = (0.0_wp, 1.0_wp)

contains

   !> A free chain; target, then target and shift, at the worst places.
   subroutine examine_targets(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: masses = 60, modes = 7
      real(wp), parameter :: rayleigh(2, 2) = reshape([0.0_wp, 0.0_wp, 0.01_wp, 0.02_wp], [2, 2])
      character(len=*), parameter :: names(4) = [character(len=18) :: "an eigenvalue", "a rigid motion", "1e-14", &
         "1e6 x the largest"]
      type(case_type) :: case
      type(modal_problem_type) :: problem
      complex(wp) :: places(size(names))
      integer :: d, k, s

      allocate (case%expected(0))
      case%options%modes = modes
      do d = 1, 2
         problem = copies(chain(masses, "line"), 1, rayleigh(:, d))
         case%expected = damped(half_sine_squares(0, masses - 1, 2*masses), rayleigh(:, d))
         places = [case%expected(8), (0.0_wp, 0.0_wp), (1.0e-14_wp, 0.0_wp), 1.0e6_wp*maxval(abs(case%expected))*i]
         do s = 1, 2
            ! A shift of the user is kept: so far out the eigenvalues cannot be told apart, and the result says so.
            do k = 1, merge(4, 3, s == 1)
               case%options%target = places(k)
               if (allocated(case%options%shift)) deallocate (case%options%shift)
               if (s == 2) allocate (case%options%shift, source=places(k))
               case%name = trim(merge("target", "shift ", s == 1))//" on "//trim(names(k))//&
                  said(", damped", d == 2)
               call judge%examine(case, problem)
            end do
         end do
      end do
   end subroutine examine_targets

   ! Unit masses and springs: omega^2 = 4 sin^2(j pi/2n), of a ring 4 sin^2(j pi/n).
   function chain(masses, shape) result(problem)
      integer, intent(in) :: masses
      character(len=*), intent(in) :: shape
      type(modal_problem_type) :: problem

      problem = scene("spring-chain", [character(len=9) :: "--masses", text(masses), "--shape", shape, "--damping", "none"])
   end function chain

   !> Eigenvalues that are there twice or twenty times.
   subroutine examine_multiple(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: around = 101, side = 30, many = 20
      type(case_type) :: case
      type(modal_problem_type) :: problem
      type(assembly_type) :: assembly
      real(real128), allocatable :: squared(:), across(:)
      integer :: k

      problem = scene("cantilever", [character(len=10) :: "--elements", text(elements(1)), "--tip-mass", tip_masses(1)])
      case%name = "two identical cantilevers"
      case%options%modes = 16
      case%accuracy = 1.0e-9_wp
      case%expected = [eigenvalues(:, 1, 1), eigenvalues(:, 1, 1)]
      call judge%examine(case, copies(problem, 2))

      case%accuracy = 1.0e-10_wp
      case%name = "a ring of springs"
      case%options%modes = 25
      case%expected = damped(half_sine_squares(0, around - 1, around))
      call judge%examine(case, chain(around, "ring"))
      case%name = "a ring of springs, damped"
      case%expected = damped(half_sine_squares(0, around - 1, around), [0.01_wp, 0.02_wp])
      call judge%examine(case, copies(chain(around, "ring"), 1, [0.01_wp, 0.02_wp]))

      ! The plate of finite differences, hinged at its edges: K = L^2, omega is an eigenvalue of L.
      across = half_sine_squares(1, side, 2*(side + 1))
      case%name = "a square plate of differences"
      case%options%modes = 40
      case%expected = damped([((across(k) + across)**2, k=1, side)])
      call judge%examine(case, plate(side))

      problem = square_of_beams(4)
      call quad_squared_frequencies(problem, squared)
      squared(:6) = 0
      case%name = "a square of crossed beams"
      case%options%modes = 30
      case%expected = damped(squared)
      call judge%examine(case, problem)
      case%name = "a square of crossed beams, damped"
      case%expected = damped(squared, table_2_rayleigh)
      call judge%examine(case, copies(problem, 1, table_2_rayleigh))

      assembly = new_assembly(many + 10)
      squared = [(merge(4.0_real128, 4 + real(k - many, real128)/2, k <= many), k=1, many + 10)]
      do k = 1, many + 10
         call add_mass(assembly, k, 1.0_wp)
         call add_spring(assembly, k, 0, real(squared(k), wp))
      end do
      problem = finished(assembly)
      case%name = "20 identical springs"
      case%options%modes = 24
      case%expected = damped(squared)
      call judge%examine(case, problem)
      case%name = "20 identical springs, damped"
      case%expected = damped(squared, [0.01_wp, 0.02_wp])
      call judge%examine(case, copies(problem, 1, [0.01_wp, 0.02_wp]))
   end subroutine examine_multiple

   ! K = L^2, L the five-point Laplacian; M = I.
   function plate(side) result(problem)
      integer, intent(in) :: side
      type(modal_problem_type) :: problem
      type(assembly_type) :: assembly
      integer :: at(5), x, y, a, b
      real(wp), parameter :: stencil(5) = [4.0_wp, -1.0_wp, -1.0_wp, -1.0_wp, -1.0_wp]

      assembly = new_assembly(side**2)
      do y = 1, side
         do x = 1, side
            call add_mass(assembly, place(x, y), 1.0_wp)
            ! A row of L, times its transpose.
            at = [place(x, y), place(x - 1, y), place(x + 1, y), place(x, y - 1), place(x, y + 1)]
            call assembly%stiffness%add_block(at, at, reshape([((stencil(a)*stencil(b), a=1, 5), b=1, 5)], [5, 5]))
         end do
      end do
      problem = finished(assembly)

   contains

      pure integer function place(x, y)
         integer, intent(in) :: x, y

         place = 0
         if (min(x, y) > 0 .and. max(x, y) <= side) place = x + (y - 1)*side
      end function place
   end function plate

   ! Crossed beams of square section, an element a cell, tied where they cross; free.
   function square_of_beams(cells) result(problem)
      integer, intent(in) :: cells
      type(modal_problem_type) :: problem
      real(wp), parameter :: across(3, 3) = &
         reshape([0.0_wp, 1.0_wp, 0.0_wp, -1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      type(assembly_type) :: assembly
      type(beam_type) :: beam
      integer :: a, b, nodes

      nodes = (cells + 1)**2
      assembly = new_assembly(12*nodes)
      beam = table_2_beam()
      do a = 0, cells
         call add_beam(assembly, [(1 + a*(cells + 1) + b, b=0, cells)], beam%mass(1.0_wp, .false.), &
            beam%stiffness(1.0_wp), [0.0_wp, 0.0_wp])
         call add_beam(assembly, [(nodes + 1 + a + b*(cells + 1), b=0, cells)], &
            turned(beam%mass(1.0_wp, .false.), across, across), turned(beam%stiffness(1.0_wp), across, across), &
            [0.0_wp, 0.0_wp])
      end do
      do a = 1, nodes
         call add_tie(assembly, node_unknowns(a), node_unknowns(nodes + a))
      end do
      problem = finished(assembly)
   end function square_of_beams

   !> The scene `brake` below and above its critical friction; other oscillators stand around.
   subroutine examine_brakes(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: others = 20
      real(wp), parameter :: k1 = 1.0_wp, k2 = 1.5625_wp, part(4) = [0.5_wp, 0.99_wp, 1.01_wp, 1.5_wp]
      real(wp), parameter :: alphas(2) = [0.0_wp, 0.05_wp]
      type(case_type) :: case
      type(assembly_type) :: assembly
      complex(real128) :: root, pair(4)
      real(wp) :: friction
      integer :: d, k, o

      case%options%modes = 8
      do d = 1, size(alphas)
         do k = 1, size(part)
            friction = part(k)*abs(k1 - k2)/(2*sqrt(k1*k2))
            assembly = new_assembly(others + 4)
            call append(assembly, scene("brake", [character(len=24) :: "--friction", digits_of(friction), "--stiffness-1", &
               digits_of(k1), "--stiffness-2", digits_of(k2), "--damping", "none"]), 0)
            do o = 1, others
               call add_mass(assembly, 4 + o, 1.0_wp)
               call add_spring(assembly, 4 + o, 0, 0.25_wp*o)
            end do
            root = sqrt(cmplx((real(k1, real128) - k2)**2 - 4*real(friction*k1, real128)*(friction*k2), kind=real128))
            pair(1:2) = (real(k1, real128) + k2 + [root, -root])/2
            ! lambda^2 + alpha lambda + s = 0.
            pair(1:2) = sqrt((alphas(d)/2.0_real128)**2 - pair(1:2))
            pair(3:4) = -pair(1:2)
            case%expected = [upper(cmplx(pair - alphas(d)/2.0_real128, kind=wp)), &
               damped([(0.25_real128*o, o=1, others)], [alphas(d), 0.0_wp])]
            case%name = "brake, "//said("damped, ", d == 2)//"friction "//parts(part(k))//" of critical"
            call judge%examine(case, mass_damped(finished(assembly), alphas(d)))
         end do
      end do
   end subroutine examine_brakes

   ! All digits of a number.
   pure function digits_of(number) result(word)
      real(wp), intent(in) :: number
      character(len=24) :: word

      write (word, "(es24.16)") number
      word = adjustl(word)
   end function digits_of

   pure function upper(values) result(chosen)
      complex(wp), intent(in) :: values(:)
      complex(wp), allocatable :: chosen(:)

      allocate (chosen, source=pack(values, aimag(values) > 0))
   end function upper

   function mass_damped(problem, alpha) result(changed)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: alpha
      type(modal_problem_type) :: changed

      changed = problem
      if (alpha > 0) changed = copies(problem, 1, [alpha, 0.0_wp])
   end function mass_damped

   pure function parts(part) result(word)
      real(wp), intent(in) :: part
      character(len=5) :: word

      write (word, "(f5.3)") part
   end function parts

   !> The scene `rotor` in rigid bearings, below, at and above the speed where it loses its stability; damped
   !> oscillators stand around.
   subroutine examine_rotors(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: others = 16
      real(wp), parameter :: rotating = 1.0e-4_wp, resting = 100.0_wp, alpha = 3.0_wp, spring = 2.0e4_wp
      real(wp), parameter :: part(6) = [0.0_wp, 0.9_wp, 0.999_wp, 1.0_wp, 1.001_wp, 1.5_wp]
      type(case_type) :: case
      type(modal_problem_type) :: rotor
      type(assembly_type) :: assembly
      real(wp) :: speed
      integer :: k, o, n

      case%options%modes = 8
      do k = 1, size(part)
         speed = part(k)*critical_speed(rotating, resting)
         rotor = scene("rotor", [character(len=24) :: "--speed", digits_of(speed/rpm), "--bearings", "rigid", "--density", "0", &
            "--rotating", digits_of(rotating), "--resting", digits_of(resting), "--elements", "2"])
         n = rotor%unknowns()
         assembly = new_assembly(n + others)
         call append(assembly, rotor, 0)
         do o = n + 1, n + others
            call add_mass(assembly, o, 1.0_wp)
            call add_spring(assembly, o, 0, spring*(o - n))
            call assembly%damping%add_entry(o, o, alpha)
         end do
         case%expected = [rotor_eigenvalues(speed, rotating, resting), &
            damped([(real(spring*o, real128), o=1, others)], [alpha, 0.0_wp])]
         case%name = "rotor, speed "//parts(part(k))//" of critical"
         call judge%examine(case, finished(assembly))
      end do
   end subroutine examine_rotors
end module hard_spectra
