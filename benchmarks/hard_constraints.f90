!> Hard cases: constraints that repeat, close loops or are badly scaled, ties by the
!> thousand, massless nodes, mechanisms, units.
module hard_constraints
   use, intrinsic :: iso_fortran_env, only: real128
   use cantilever_reference, only: eigenvalues, elements, tip_masses
   use dense_reference, only: dense_squared_frequencies
   use hard_judge, only: case_type, judge_type, said
   use hard_models, only: add_mass, add_spring, append, damped, finished, half_sine_squares, in_millimetres, &
      in_units_of_their_own, scene, with_uneven_constraints
   use kschur, only: modal_problem_type, text, wp
   use quad_reference, only: quad_squared_frequencies
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns
   use scene_beam, only: add_beam, beam_type, table_2_beam
   use scene_joint, only: add_fix, add_revolute
   use scene_rigid_body, only: body_mass, box_inertia
   implicit none
   private
   public :: examine_constraints, examine_massless, examine_mechanisms, examine_ties, examine_units

contains

   !> Rows that are there twice, rows of very different size, loops.
   subroutine examine_constraints(judge)
      type(judge_type), intent(inout) :: judge
      type(case_type) :: case
      type(modal_problem_type) :: problem, ring
      type(assembly_type) :: assembly
      real(wp), allocatable :: squared(:)
      integer :: k, loop

      problem = scene("cantilever", [character(len=10) :: "--elements", text(elements(1)), "--tip-mass", tip_masses(1)])
      case%options%modes = 8
      case%expected = eigenvalues(:, 1, 1)
      case%accuracy = 1.0e-9_wp

      assembly = new_assembly(problem%unknowns())
      call append(assembly, problem, 0)
      call append_constraints(problem)
      do k = 0, 1
         case%options%presolve = k == 0
         case%name = "each constraint twice"//said(", no presolve", k == 1)
         call judge%examine(case, finished(assembly))
      end do

      do k = 0, 1
         case%options%presolve = k == 0
         case%name = "constraints scaled by 1e-8, 1e8"//said(", no presolve", k == 1)
         call judge%examine(case, with_uneven_constraints(problem))
      end do

      case%options%modes = 6
      case%accuracy = 1.0e-10_wp
      do loop = 0, 1
         ring = bodies_in_a_ring(loop == 0)
         call dense_squared_frequencies(ring, squared)
         case%expected = damped(real(squared, real128))
         do k = 0, 1
            case%options%presolve = k == 0
            case%name = "a loop of bodies"//said(", arms of decimals", loop == 1)// &
               said(", no presolve", k == 1)
            call judge%examine(case, ring)
         end do
      end do

   contains

      subroutine append_constraints(problem)
         type(modal_problem_type), intent(in) :: problem
         integer :: r, k

         associate (cq => problem%constraints)
            do r = 1, cq%rows
               do k = cq%row_start(r), cq%row_start(r + 1) - 1
                  call assembly%constraints%add_entry(cq%rows + r, cq%column(k), 3*cq%value(k))
               end do
            end do
            assembly%multipliers = 2*cq%rows
         end associate
      end subroutine append_constraints
   end subroutine examine_constraints

   ! Four bodies, each fixed to the next and the last to the first: 24 rows of rank 18. One
   ! rests on springs.
   function bodies_in_a_ring(exact) result(problem)
      !> Whether the lever arms are binary fractions; others close the loop up to rounding.
      logical, intent(in) :: exact
      type(modal_problem_type) :: problem
      integer, parameter :: bodies = 4
      real(wp), parameter :: corner(3, bodies) = &
         reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.5_wp, 1.0_wp, 2.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.25_wp], [3, bodies])
      type(assembly_type) :: assembly
      real(wp) :: centre(3, bodies), joint(3)
      integer :: b, next, k

      assembly = new_assembly(6*bodies)
      centre = corner
      if (.not. exact) centre = 0.7_wp*corner + 0.1_wp
      do b = 1, bodies
         next = mod(b, bodies) + 1
         associate (this => node_unknowns(b))
            call assembly%mass%add_block(this, this, body_mass(1.0_wp*b, box_inertia(1.0_wp*b, [1.0_wp, 2.0_wp, 0.5_wp])))
            joint = (centre(:, b) + 2*centre(:, next))/3
            if (exact) joint = (centre(:, b) + centre(:, next))/2
            call add_fix(assembly, this, joint - centre(:, b), node_unknowns(next), joint - centre(:, next))
         end associate
      end do
      do k = 1, 6
         call add_spring(assembly, k, 0, 100.0_wp*k)
      end do
      problem = finished(assembly)
   end function bodies_in_a_ring

   !> Ten thousand ties: in a row, and all of one group.
   subroutine examine_ties(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: links = 10001
      type(case_type) :: case
      type(assembly_type) :: assembly
      real(real128) :: a, b
      integer :: k

      ! Links of two half masses and a spring, the end of each tied to the next: omega^2 = 4 sin^2(j pi/2n).
      assembly = new_assembly(2*links)
      do k = 1, links
         call add_mass(assembly, 2*k - 1, 0.5_wp)
         call add_mass(assembly, 2*k, 0.5_wp)
         call add_spring(assembly, 2*k - 1, 2*k, 1.0_wp)
         if (k < links) call assembly%add_constraints([2*k, 2*k + 1], reshape([1.0_wp, -1.0_wp], [1, 2]))
      end do
      case%name = "10000 ties in a row"
      case%options%modes = 6
      case%accuracy = 1.0e-8_wp
      case%expected = damped(half_sine_squares(0, 10, 2*links))
      call judge%examine(case, finished(assembly))

      ! One mass of 10001 parts on a spring, a second one on it.
      assembly = new_assembly(links + 1)
      do k = 1, links
         call add_mass(assembly, k, 1.0_wp)
         if (k > 1) call assembly%add_constraints([1, k], reshape([1.0_wp, -1.0_wp], [1, 2]))
      end do
      call add_mass(assembly, links + 1, 7.0_wp)
      call add_spring(assembly, 1, 0, 4000.0_wp)
      call add_spring(assembly, 17, links + 1, 3.0_wp)
      case%name = "10000 ties to one unknown"
      case%options%modes = 2
      case%accuracy = 1.0e-10_wp
      a = (4003.0_real128/links + 3.0_real128/7)/2
      b = 4000.0_real128*3/(7.0_real128*links)
      case%expected = damped([b/(a + sqrt(a**2 - b)), a + sqrt(a**2 - b)])
      call judge%examine(case, finished(assembly))
   end subroutine examine_ties

   !> A chain with a massless node in the middle of each spring.
   subroutine examine_massless(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: masses = 40
      real(wp), parameter :: by_mass(2) = [0.02_wp, 0.0_wp], by_both(2) = [0.02_wp, 0.01_wp]
      type(case_type) :: case
      type(modal_problem_type) :: problem
      type(assembly_type) :: assembly
      integer :: k

      assembly = new_assembly(2*masses - 1)
      do k = 1, masses
         call add_mass(assembly, 2*k - 1, 1.0_wp)
         if (k == masses) exit
         call add_spring(assembly, 2*k - 1, 2*k, 2.0_wp)
         call add_spring(assembly, 2*k, 2*k + 1, 2.0_wp)
      end do
      problem = finished(assembly)
      case%options%modes = 12
      case%name = "massless nodes"
      case%expected = damped(half_sine_squares(0, masses - 1, 2*masses))
      call judge%examine(case, problem)
      case%name = "massless nodes, damped by mass"
      case%expected = damped(half_sine_squares(0, masses - 1, 2*masses), by_mass)
      call judge%examine(case, damped_by(by_mass))
      ! The damping of massless nodes makes modes at -1/beta.
      case%name = "massless nodes, damped by mass and stiffness"
      case%expected = damped(half_sine_squares(0, masses - 1, 2*masses), by_both)
      call judge%examine(case, damped_by(by_both))

   contains

      function damped_by(rayleigh) result(changed)
         real(wp), intent(in) :: rayleigh(2)
         type(modal_problem_type) :: changed
         type(assembly_type) :: again

         again = new_assembly(problem%unknowns())
         call append(again, problem, 0, rayleigh=rayleigh)
         changed = finished(again)
      end function damped_by
   end subroutine examine_massless

   !> Motions without stiffness.
   subroutine examine_mechanisms(judge)
      type(judge_type), intent(inout) :: judge
      real(wp), parameter :: to_hinge(3) = [-0.5_wp, 0.0_wp, 0.0_wp], to_next(3) = [0.5_wp, 0.0_wp, 0.0_wp]
      real(wp), parameter :: about_z(3) = [0.0_wp, 0.0_wp, 1.0_wp], no_arm(3) = 0
      integer, parameter :: bars = 5
      type(case_type) :: case
      type(modal_problem_type) :: problem
      type(assembly_type) :: assembly
      type(beam_type) :: beam
      real(real128), allocatable :: squared(:)
      integer :: k

      ! Bars, the first hinged to the ground, each to the one before: only rotations about z are free.
      assembly = new_assembly(6*bars)
      do k = 1, bars
         associate (bar => node_unknowns(k))
            call assembly%mass%add_block(bar, bar, body_mass(2.0_wp, box_inertia(2.0_wp, [1.0_wp, 0.25_wp, 0.5_wp])))
            call add_revolute(assembly, node_unknowns(k - 1), merge(to_next, 0.0_wp, k > 1), bar, to_hinge, about_z)
         end associate
      end do
      case%name = "a chain of bars without stiffness"
      case%options%modes = bars
      case%expected = [((0.0_wp, 0.0_wp), k=1, bars)]
      call judge%examine(case, finished(assembly))
      case%name = "a chain of bars, one spring"
      call add_spring(assembly, 6, 12, 50.0_wp)
      problem = finished(assembly)
      call quad_squared_frequencies(problem, squared)
      case%expected = damped(squared)
      call judge%examine(case, problem)

      beam = table_2_beam()
      assembly = new_assembly(66)
      call add_beam(assembly, [(k, k=1, 11)], beam%mass(0.5_wp, .false.), beam%stiffness(0.5_wp), [0.0_wp, 0.0_wp])
      call add_revolute(assembly, node_unknowns(0), no_arm, node_unknowns(1), no_arm, about_z)
      case%name = "a beam on a hinge"
      case%options%modes = 8
      problem = finished(assembly)
      call quad_squared_frequencies(problem, squared)
      squared(1) = 0
      case%expected = damped(squared)
      call judge%examine(case, problem)
   end subroutine examine_mechanisms

   !> Millimetres, tonnes and seconds; a unit for each unknown.
   subroutine examine_units(judge)
      type(judge_type), intent(inout) :: judge
      type(case_type) :: case
      type(modal_problem_type) :: problem
      integer :: k

      case%accuracy = 1.0e-9_wp
      case%options%modes = 8
      do k = 1, size(tip_masses)
         problem = scene("cantilever", [character(len=10) :: "--elements", text(elements(1)), "--tip-mass", tip_masses(k)])
         case%expected = eigenvalues(:, 1, k)
         case%name = "cantilever, "//tip_masses(k)//" kg, in mm, t, s"
         call judge%examine(case, in_millimetres(problem))
         case%name = "cantilever, "//tip_masses(k)//" kg, any units"
         call judge%examine(case, in_units_of_their_own(problem))
      end do
   end subroutine examine_units
end module hard_constraints
