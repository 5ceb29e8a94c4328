!> The scene `spring-chain`: equal masses in a row, each on springs to its neighbours, nothing held.
!>
!> omega^2 = 4 (k/m) sin^2(j pi/2n), j = 0 ... n - 1; of a ring 4 (k/m) sin^2(j pi/n). With stiffness-proportional
!> damping alone zero is a 2 x 2 Jordan block.
module scene_spring_chain
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly
   use scene_options, only: option_type, options_type
   implicit none
   private
   public :: build_spring_chain, spring_chain_options

contains

   !> What the scene can be asked for.
   pure function spring_chain_options() result(options)
      type(options_type) :: options

      options%description = "free chain of masses and springs"
      allocate (options%list(7))
      options%list(1) = option_type("--masses", "60", "masses")
      options%list(2) = option_type("--shape", "line", "line; ring; or halves, two lines joined by a constraint")
      options%list(3) = option_type("--mass", "1", "each mass, kg")
      options%list(4) = option_type("--stiffness", "1", "stiffness of each spring, N/m")
      options%list(5) = option_type("--damping", "rayleigh", "damping: rayleigh or none")
      options%list(6) = option_type("--alpha", "0", "damping by mass, 1/s")
      options%list(7) = option_type("--beta", "0.01", "damping by stiffness, s")
   end function spring_chain_options

   !> Builds the scene. Of two halves the mass in the middle is cut: the masses 1 ... n/2 + 1 and n/2 + 1 ... n, each
   !> with half of it, are n + 1 unknowns.
   subroutine build_spring_chain(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: spring(2, 2) = reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
      real(wp), parameter :: no_spring(1, 1) = 0, no_mass(2, 2) = 0
      integer, parameter :: fewest_masses = 3, most_masses = 10000000
      character(len=:), allocatable :: shape, damping
      real(wp) :: mass, stiffness, rayleigh(2)
      integer :: masses, cut, k

      call options%read_integer("--masses", fewest_masses, most_masses, masses, error)
      call options%read_choice("--shape", [character(len=6) :: "line", "ring", "halves"], shape, error)
      call options%read_positive("--mass", mass, error)
      call options%read_positive("--stiffness", stiffness, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      call options%read_not_negative("--alpha", rayleigh(1), error)
      call options%read_not_negative("--beta", rayleigh(2), error)
      call options%require("--damping", "rayleigh", [character(len=7) :: "--alpha", "--beta"], error)
      if (allocated(error)) return

      if (damping == "none") rayleigh = 0
      cut = 0
      if (shape == "halves") cut = masses/2 + 1
      assembly = new_assembly(masses + merge(1, 0, cut > 0))
      do k = 1, assembly%unknowns
         call assembly%add_element([k], merge(0.5_wp, 1.0_wp, cut > 0 .and. (k == cut .or. k == cut + 1))*&
            reshape([mass], [1, 1]), no_spring, rayleigh)
         if (k > 1 .and. .not. (cut > 0 .and. k == cut + 1)) &
            call assembly%add_element([k - 1, k], no_mass, stiffness*spring, rayleigh)
      end do
      if (shape == "ring") call assembly%add_element([masses, 1], no_mass, stiffness*spring, rayleigh)
      if (cut > 0) call assembly%add_constraints([cut, cut + 1], reshape([1.0_wp, -1.0_wp], [1, 2]))
      call assembly%geometry%add_line(reshape([(real(k, wp), 0.0_wp, 0.0_wp, k=1, assembly%unknowns)], &
         [3, assembly%unknowns]), reshape([(k, 0, 0, k=1, assembly%unknowns)], [3, assembly%unknowns]))
   end subroutine build_spring_chain
end module scene_spring_chain
