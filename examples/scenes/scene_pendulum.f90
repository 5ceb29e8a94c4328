!> The scene `pendulum`: point masses on massless rigid bars, each hinged to the one before, that gravity holds straight. Without
!> springs their only stiffness is K_c, what the reactions of the hinges do as the bars turn (section 2 of the paper).
!>
!> omega^2 = x g/L, x a zero of the Laguerre polynomial of degree `bars`: 1 for one bar, 2 -+ sqrt(2) for two. One bar with a
!> spring k and a damper d at its hinge: m L^2 lambda^2 + d lambda + k + m g L = 0.
module scene_pendulum
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly, node_unknowns, unknowns_of_nodes
   use scene_joint, only: add_reaction, add_revolute
   use scene_options, only: option_type, options_type
   use scene_rigid_body, only: body_mass
   implicit none
   private
   public :: build_pendulum, pendulum_options

   !> Acceleration of gravity, m/s^2, downwards along z.
   real(wp), parameter :: gravity = 9.81_wp

contains

   !> What the scene can be asked for.
   pure function pendulum_options() result(options)
      type(options_type) :: options

      options%description = "point masses on hinged bars under gravity"
      allocate (options%list(6))
      options%list(1) = option_type("--bars", "1", "bars, each hinged to the one before")
      options%list(2) = option_type("--mass", "15", "mass at the end of each bar, kg")
      options%list(3) = option_type("--length", "4", "length of a bar, m")
      options%list(4) = option_type("--reactions", "on", "stiffness K_c of the joint reactions: on or off")
      options%list(5) = option_type("--stiffness", "0", "of a spring at each hinge, N m/rad")
      options%list(6) = option_type("--damper", "0", "at each hinge, N m s/rad")
   end function pendulum_options

   !> Builds the scene: body k is the mass at the end of bar k; the hinges turn about y.
   subroutine build_pendulum(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: axis(3) = [0.0_wp, 1.0_wp, 0.0_wp], no_arm(3) = 0, point_inertia(3, 3) = 0, &
         between(2, 2) = reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
      integer, parameter :: most_bars = 100000
      character(len=:), allocatable :: reactions
      integer :: bars, k
      real(wp) :: mass, length, stiffness, damper

      call options%read_integer("--bars", 1, most_bars, bars, error)
      call options%read_positive("--mass", mass, error)
      call options%read_positive("--length", length, error)
      call options%read_choice("--reactions", [character(len=3) :: "on", "off"], reactions, error)
      call options%read_not_negative("--stiffness", stiffness, error)
      call options%read_not_negative("--damper", damper, error)
      if (allocated(error)) return

      assembly = new_assembly(6*bars)
      do k = 1, bars
         associate (before => node_unknowns(k - 1), body => node_unknowns(k), to_hinge => [0.0_wp, 0.0_wp, length], &
                    weight_below => [0.0_wp, 0.0_wp, -(bars - k + 1)*mass*gravity])
            call assembly%mass%add_block(body, body, body_mass(mass, point_inertia))
            call add_revolute(assembly, before, no_arm, body, to_hinge, axis)
            if (reactions == "on") call add_reaction(assembly, before, no_arm, body, to_hinge, weight_below)
            ! Between the rotations about y.
            call assembly%stiffness%add_block([before(5), body(5)], [before(5), body(5)], stiffness*between)
            call assembly%damping%add_block([before(5), body(5)], [before(5), body(5)], damper*between)
         end associate
      end do
      call assembly%geometry%add_line(reshape([(0.0_wp, 0.0_wp, -k*length, k=0, bars)], [3, bars + 1]), &
         unknowns_of_nodes([(k, k=0, bars)]))
   end subroutine build_pendulum
end module scene_pendulum
